"""The time of a session on another clock, as that of LSL, for stamps that are as even as the session's own."""

from collections import deque
from collections.abc import Callable

from underfoot.devices.device_clock import JUMP_S, WINDOW_US, WINDOWS


class SessionClock:
    """Maps the session's time to another clock, of which `now` is read whenever the session is looked at.

    Blocks are played, and looked at, in time or late, never early. So the earliest of the last ten seconds count, as
    for the clocks of devices; where all have become later by more than `JUMP_S`, those before no longer do.

    >>> looked_at_s = iter((101.5, 101.762, 102.003, 702.03))  # in time, 12 and 3 ms late; ten minutes later, drifted
    >>> clock = SessionClock(lambda: next(looked_at_s))
    >>> [clock.at(time_s, 0.5) for time_s in (1.0, 1.25, 1.5, 601.0)]
    [101.0, 101.25, 101.5, 701.53]
    """

    def __init__(self, now: Callable[[], float]) -> None:
        self._now = now
        self._windows = deque[tuple[float, float]]()  # its beginning, and the least offset in it

    def at(self, time_s: float, ago_s: float) -> float:
        """Return when the session's `time_s` was, by the other clock: `ago_s` before the last block."""
        now_s = self._now()
        offset_s = now_s - (time_s + ago_s)
        if self._windows and now_s - self._windows[-1][0] < WINDOW_US * 1e-6:
            began_s, least_s = self._windows.pop()
            self._windows.append((began_s, min(least_s, offset_s)))
        else:
            if self._windows and self._windows[-1][1] - self._offset_s > JUMP_S:
                self._windows = deque([self._windows[-1]])
            self._windows.append((now_s, offset_s))
        while now_s - self._windows[0][0] > WINDOWS * WINDOW_US * 1e-6:
            self._windows.popleft()
        return time_s + self._offset_s

    @property
    def _offset_s(self) -> float:
        return min(least_s for _, least_s in self._windows)
