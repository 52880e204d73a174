"""Lists of events as arrays, one row each: time, strength, duration."""

import numpy as np


def rows_of(events):
    """Return the events of a list, [event, 3]."""
    count = len(events)
    return np.column_stack([events.time[:count], events.strength[:count], events.duration[:count]])


def within(rows, first, last):
    """Return those of rows [event, 3] whose frames are in [first, last)."""
    onsets = np.floor(rows[:, 0])
    return rows[(onsets >= first) & (onsets < last)]
