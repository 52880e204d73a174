"""Marks that a person adds to the open recording at the cursor, or removes there."""

from collections.abc import Callable

from PySide6.QtWidgets import QWidget

from underfoot.widgets.controls.question import ask_text
from underfoot.widgets.recordings.reader import RecordingReader
from underfoot.widgets.recordings.timeline import Axis
from underfoot.widgets.recordings.tracks import time_text

_NEAR_PX = 8.0
"""Distance from the cursor up to which a mark is removed."""


class MarkEditing:
    """Adds and removes marks at the cursor of `axis`, in the file of `reader`; dialogs are those of `owner`, and
    `notify` shows a line.
    """

    def __init__(self, axis: Axis, reader: RecordingReader, owner: QWidget, notify: Callable[[str], object]) -> None:
        self._axis, self._reader, self._owner, self._notify = axis, reader, owner, notify

    def add(self, text: str = "") -> None:
        """Mark the cursor's time."""
        if self._axis.content is not None:
            opened = self._axis.content.opened
            frame = opened.first + round(self._axis.cursor_s * opened.rate)
            self._reader.change(lambda recording: recording.add_mark(frame, text))

    def ask(self) -> None:
        """Ask for a text, and mark the cursor's time with it."""
        if self._axis.content is not None:
            ask_text(self._owner, "A mark", f"What is at {time_text(self._axis.cursor_s)}?", self.add)

    def remove(self) -> None:
        """Remove the mark nearest to the cursor, within a few pixels."""
        if self._axis.content is None:
            return
        opened = self._axis.content.opened
        cursor = opened.first + self._axis.cursor_s * opened.rate
        nearest = min(opened.marks, key=lambda mark: abs(mark.frame - cursor), default=None)
        if nearest is not None and abs(nearest.frame - cursor) <= _NEAR_PX * self._axis.seconds_per_px * opened.rate:
            self._reader.change(lambda recording: recording.remove_mark(nearest.id))
        else:
            self._notify("No mark is near the cursor.")
