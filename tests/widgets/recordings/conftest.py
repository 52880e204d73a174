"""The Recordings workspace on the screen."""

import pytest
from recordings_shown import recordings_shown


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """Where the program records."""
    made = tmp_path / "recorded"
    made.mkdir()
    monkeypatch.setattr("underfoot.widgets.recordings.workspace.documents_folder", lambda: made)
    return made


@pytest.fixture
def workspace(qtbot, folder):
    """The workspace on the screen, with nothing open."""
    made = recordings_shown(qtbot)
    made.set_active(True)
    return made
