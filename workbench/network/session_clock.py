"""The time of a session on another clock, as that of LSL, for stamps that are as even as the session's own."""

from collections import deque

from underfoot.devices.device_clock import JUMP_S, WINDOW_US, WINDOWS


class SessionClock:
    """Maps the session's time to a clock that is read whenever the session is looked at.

    Blocks are played, and looked at, in time or late, never early. So the earliest of the last ten seconds count, as
    for the clocks of devices; where all have become later by more than `JUMP_S`, those before no longer do.

    >>> clock = SessionClock()
    >>> [clock.at(time_s, 0.5, 100.5 + time_s + late_s) for time_s, late_s in ((1.0, 0.0), (1.25, 0.012), (1.5, 0.003))]
    [101.0, 101.25, 101.5]
    >>> clock.at(601.0, 0.5, 702.03)  # ten minutes later, by which the clocks have drifted apart
    701.53
    """

    def __init__(self) -> None:
        self._windows = deque[tuple[float, float]]()  # its beginning, and the least offset in it

    def at(self, time_s: float, ago_s: float, now_s: float) -> float:
        """Return when the session's `time_s` was, by the clock whose time is `now_s`: `ago_s` before the last block."""
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
