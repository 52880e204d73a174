"""What comes and goes, as the silence of boards that sleep, and would fill a log."""

from collections import deque

OFTEN, WITHIN_S = 5, 3600.0
"""As often something is said within this time."""
LAST = "so often that it is said no more for an hour"
"""What is added where it is said for the last time."""


class Recurrence:
    """Says whether what is there at a time may be said: `OFTEN` times `WITHIN_S`.

    >>> silence = Recurrence()
    >>> [silence.says(10.0 * k) for k in range(6)], silence.is_last
    ([True, True, True, True, True, False], True)
    >>> silence.says(3600.0), silence.is_last, silence.says(3605.0)
    (True, True, False)
    """

    def __init__(self) -> None:
        self._said_s = deque[float](maxlen=OFTEN)

    def says(self, now_s: float) -> bool:
        """Return whether it is said at `now_s`, and count it if so."""
        if len(self._said_s) == OFTEN and now_s - self._said_s[0] < WITHIN_S:
            return False
        self._said_s.append(now_s)
        return True

    @property
    def is_last(self) -> bool:
        """Whether what was said last was the last for some time."""
        return len(self._said_s) == OFTEN and self._said_s[-1] - self._said_s[0] < WITHIN_S
