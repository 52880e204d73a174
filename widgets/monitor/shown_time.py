"""The time that the plots of the Monitor workspace show: now, paused, or some of the last ten minutes."""

import math

from PySide6.QtCore import QSignalBlocker, Qt
from PySide6.QtWidgets import QScrollBar

from underfoot.widgets.monitor.force_history import HISTORY_S

_LIVE_S = 0.05
"""Who scrolls to within this time of now sees live data again."""


class ShownTime:
    """The seconds before a time, which is now unless the display is paused or scrolled back.

    >>> time = ShownTime(5.0)
    >>> time.kept_from_s, time.now_s = 0.0, 60.0
    >>> time.scroll_to(20.0)
    >>> time.end_s, time.ago_s
    (20.0, 40.0)
    >>> time.scroll_to(60.0)
    >>> time.end_s, time.ago_s
    (60.0, nan)
    """

    def __init__(self, duration_s: float) -> None:
        self.duration_s = duration_s
        self.start_again()

    def start_again(self) -> None:
        """Forget everything but the duration: another session begins."""
        self.now_s = 0.0
        self.kept_from_s = math.nan
        """Beginning of what is kept; NaN if nothing is."""
        self.resume()

    def advance_to(self, time_s: float) -> None:
        """Note that there is data up to this time."""
        self.now_s = max(self.now_s, time_s)

    @property
    def first_s(self) -> float:
        """The earliest time that can be shown; NaN if there is none."""
        return max(self.kept_from_s, self.now_s - HISTORY_S)

    @property
    def end_s(self) -> float:
        """The time at the right edge of the plots."""
        for held_s in (self._back_to_s, self._paused_s):
            if math.isfinite(held_s):
                return held_s
        return self.now_s

    @property
    def ago_s(self) -> float:
        """Seconds scrolled back; NaN if not scrolled back."""
        return self.now_s - self._back_to_s

    @property
    def is_paused(self) -> bool:
        """Whether the display is paused; data is still kept."""
        return not math.isnan(self._paused_s)

    def pause(self) -> None:
        """Hold the present time."""
        self._paused_s = self.now_s

    def resume(self) -> None:
        """Show live data again."""
        self._paused_s = self._back_to_s = math.nan

    def scroll_to(self, end_s: float) -> None:
        """Show the seconds before a time that is kept. The present time: live again."""
        if not self.first_s < self.now_s or end_s >= self.now_s - _LIVE_S:
            self._back_to_s = math.nan
        else:
            self._back_to_s = max(end_s, min(self.first_s + self.duration_s, self.now_s))


class TimeBar(QScrollBar):
    """Scrolls through the times that are kept, in tenths of a second."""

    def __init__(self) -> None:
        super().__init__(Qt.Orientation.Horizontal)
        self.setAccessibleName("Back through the last ten minutes")
        self.setFocusPolicy(Qt.FocusPolicy.NoFocus)

    def show_time(self, time: ShownTime) -> None:
        """Set the range to the kept times, and the value to the shown one."""
        first_s = time.first_s + time.duration_s if math.isfinite(time.first_s) else time.now_s
        with QSignalBlocker(self):
            self.setRange(min(round(10.0 * first_s), round(10.0 * time.now_s)), round(10.0 * time.now_s))
            self.setPageStep(round(10.0 * time.duration_s))
            self.setValue(round(10.0 * time.end_s))
