"""Event lists: onsets with strengths and durations, read and written by kernels.

Times are session frames, float64, fractions included; the meaning of strengths is up to the source; durations are
seconds, 0 if unknown. A list is in order of time, with at most one event per frame.
"""

import math
from collections.abc import Sequence

from underfoot.kernels import kernel
from underfoot.layouts import Layout, Memory

EVENTS = Layout("events", "count", "capacity", time=("room",), strength=("room",), duration=("room",))
"""List of up to `room` events. `len(events)` is their number; `capacity` is `room`, stored in the list itself."""

STARTS = ("at once", "at events")
"""What a rhythm or an envelope waits for before it plays: nothing, or an event."""
AT_ONCE = 0
"""Index of "at once" in `STARTS`."""

events_at = EVENTS.at
"""For compiled code: `events_at(values, (room,))` views a list in an array or at a pointer."""


def event_list(*events: Sequence[float], room: int = 0) -> Memory:
    """Return a list of (time, strength) or (time, strength, duration), with room for `room` events or just these.

    >>> struck = event_list((0.5, 1.0), (480.0, 2.0, 0.1))
    >>> len(struck), struck.time.tolist()
    (2, [0.5, 480.0])
    """
    made = EVENTS.zeros(room=max(room, len(events)))
    made.capacity = made.room
    for k, (time, strength, *duration) in enumerate(events):
        made.time[k], made.strength[k], made.duration[k] = time, strength, duration[0] if duration else 0.0
    made.count = len(events)
    return made


@kernel
def append(events: Memory, time: float, strength: float, duration: float = 0.0) -> None:
    """Append an event whose frame is after that of the last one."""
    k = len(events)
    events.time[k], events.strength[k], events.duration[k] = time, strength, duration
    events.count = k + 1.0


@kernel
def emit(events: Memory, time: float, strength: float, duration: float = 0.0) -> None:
    """Append an event, or merge it with the last one if in the same frame, at their time weighted by size.

    By signed strengths that nearly cancel, the time would lie frames away.
    """
    last = len(events) - 1
    if last < 0 or math.floor(events.time[last]) != math.floor(time):
        append(events, time, strength, duration)
        return
    total = events.strength[last] + strength
    if total != 0.0:
        size = abs(events.strength[last]) + abs(strength)
        events.time[last] += (time - events.time[last]) * (abs(strength) / size)
    events.strength[last] = total
    events.duration[last] = max(events.duration[last], duration)
