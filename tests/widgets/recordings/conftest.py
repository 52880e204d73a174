"""The Recordings workspace on the screen."""

import pytest
from on_screen import show

from underfoot.widgets.recordings.workspace import RecordingsWorkspace
from underfoot.widgets.session.settings import Settings


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """Where the program records."""
    made = tmp_path / "recorded"
    made.mkdir()
    monkeypatch.setattr("underfoot.widgets.recordings.workspace.recordings_folder", lambda: made)
    return made


@pytest.fixture
def workspace(qtbot, folder):
    """The workspace on the screen, with nothing open."""
    made = RecordingsWorkspace(Settings())
    qtbot.addWidget(made, before_close_func=lambda one: one.close_down())
    made.resize(1280, 748)
    show(qtbot, made)
    made.set_active(True)
    return made
