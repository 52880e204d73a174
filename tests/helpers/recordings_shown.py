"""The Recordings workspace on the screen, for tests."""

from on_screen import show
from PySide6.QtCore import QPointF

from underfoot.widgets.recordings.workspace import RecordingsWorkspace
from underfoot.widgets.session.settings import Settings


def recordings_shown(qtbot, width=1280, height=748):
    """The workspace of this size, with nothing open."""
    made = RecordingsWorkspace(Settings())
    qtbot.addWidget(made, before_close_func=lambda one: one.close_down())
    made.resize(width, height)
    show(qtbot, made)
    return made


def place_on(axis, time_s, track):
    """Return where a time is in a track of the time axis, in pixels."""
    tracks = axis.painter()
    return QPointF(tracks.x(time_s), 0.5 * (tracks.tracks[track].top + tracks.tracks[track].bottom))
