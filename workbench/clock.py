"""The one clock: session frames, and the spans in which everything but samples happens."""

RATE_HZ = 48_000
"""Session frames a second, unless the patch's target says otherwise."""

SPAN = 32
"""Frames in a span. Sleep, control wires, swaps and commands act where a span begins, whatever the device's block."""

RAMP = 240
"""Frames that a moved control takes to reach its new value."""

FADE = 480
"""Frames in which a new program is faded in over the old one."""


def next_span(frame: int) -> int:
    """The first span edge at or after `frame`.

    >>> next_span(0), next_span(1), next_span(32)
    (0, 32, 32)
    """
    return -(-frame // SPAN) * SPAN
