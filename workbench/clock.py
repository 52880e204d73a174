"""Session clock: frames, and the spans at which everything but samples happens; and intervals of a computer's."""

import time
from collections.abc import Callable

RATE_HZ = 48_000
"""Session frames per second, unless the session's target has another rate."""

SPAN = 32
"""Frames in a span. Sleep, control wires, swaps and commands take effect at span edges, whatever the block size."""

RAMP = 240
"""Frames in which a changed control reaches its new value."""

FADE = 480
"""Frames of a fade: from one program or equaliser to the next, and of outputs that open or close."""

LONG_AGO = -(1 << 60)
"""A frame before all others, for what has not happened yet."""


def next_span(frame: int) -> int:
    """Return the first span edge at or after `frame`.

    >>> next_span(0), next_span(1), next_span(32)
    (0, 32, 32)
    """
    return -(-frame // SPAN) * SPAN


def once_in(seconds: float) -> Callable[[], bool]:
    """Return a function that says whether it is this long ago that it said so, or was made: for reports of progress.

    >>> is_due = once_in(3600.0)
    >>> is_due()
    False
    """
    due_s = time.perf_counter() + seconds

    def is_due() -> bool:
        nonlocal due_s
        now_s = time.perf_counter()
        if now_s < due_s:
            return False
        due_s = now_s + seconds
        return True

    return is_due
