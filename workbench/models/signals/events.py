"""Events: lists of onsets with their strengths and durations, which kernels read, write and hand on.

Times are session frames, float64, with parts of a frame; strengths are what their maker says they are; durations are
seconds, 0 where nobody knows. A list is in order of time, at most one event a frame.
"""

import math
from collections.abc import Sequence

from underfoot.kernels import kernel
from underfoot.layouts import Layout, Memory

EVENTS = Layout("events", "count", "capacity", time=("room",), strength=("room",), duration=("room",))
"""A list of up to `room` events. `len(events)` is how many there are; `capacity` is `room`, kept in the list itself."""

events_at = EVENTS.at
"""For compiled code: `events_at(values, (room,))` is the list in an array or at a pointer."""


def event_list(*events: Sequence[float], room: int = 0) -> Memory:
    """A list of (time, strength) or (time, strength, duration), with room for `room` of them or for just these.

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
    """Add an event at the end, whose frame is after the last one's."""
    k = len(events)
    events.time[k], events.strength[k], events.duration[k] = time, strength, duration
    events.count = k + 1.0


@kernel
def emit(events: Memory, time: float, strength: float, duration: float = 0.0) -> None:
    """Add an event at the end; one in the last one's frame is added to that, at their weighted time."""
    last = len(events) - 1
    if last < 0 or math.floor(events.time[last]) != math.floor(time):
        append(events, time, strength, duration)
        return
    total = events.strength[last] + strength
    if total != 0.0:
        events.time[last] += (time - events.time[last]) * (strength / total)
    events.strength[last] = total
    events.duration[last] = max(events.duration[last], duration)
