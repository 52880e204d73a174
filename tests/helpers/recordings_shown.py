"""The Recordings workspace on the screen, for tests."""

from on_screen import show

from underfoot.widgets.recordings.workspace import RecordingsWorkspace
from underfoot.widgets.session.settings import Settings


def recordings_shown(qtbot, width=1280, height=748):
    """The workspace of this size, with nothing open."""
    made = RecordingsWorkspace(Settings())
    qtbot.addWidget(made, before_close_func=lambda one: one.close_down())
    made.resize(width, height)
    show(qtbot, made)
    return made
