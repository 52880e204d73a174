"""A recording of somebody of a known weight who stands, swaying a little, and then walks along eight tiles."""

import numpy as np
from made_recordings import ABOUT

from underfoot.floor.layout import default_floor
from underfoot.records.recording_writer import Writer

FIRST_STEP_S, STEP_S, CONTACT_S, STEPS = 8.0, 0.55, 0.65, 8
PEAK = 1.1
"""The first peak of a step, as a share of the weight."""


def stood_and_walked(path, weight_n, stands_s=6.0, stops_s=0.0):
    """Write it: a foot on each of the first two tiles from 0.5 s on, for longer than a step lasts, steps from
    `FIRST_STEP_S` on, and after them for `stops_s` a foot on each of the last two."""
    stops_at_s = FIRST_STEP_S + STEP_S * STEPS + 0.5
    time_s = np.arange(0.0, stops_at_s + stops_s + 0.5, 1e-3)
    shares = np.zeros((len(time_s), STEPS))
    sway = 1.0 + 0.004 * np.sin(2.0 * np.pi * time_s)
    for feet, at_s, for_s in ((slice(2), 0.5, stands_s), (slice(-2, None), stops_at_s, stops_s)):
        stood = np.interp(time_s - at_s, [0.0, 0.2, for_s, 0.2 + for_s], [0.0, 1.0, 1.0, 0.0]) * sway * (for_s > 0.0)
        shares[:, feet] += np.outer(stood, [0.45, 0.55])
    for number in range(STEPS):
        at = (time_s - FIRST_STEP_S - STEP_S * number) / CONTACT_S
        shares[:, number] += np.interp(at, [0.0, 0.2, 0.5, 0.8, 1.0], [0.0, PEAK, 0.7, 1.05, 0.0])
    stamps = np.round(48_000 * time_s)
    writer = Writer(path, ABOUT | {"floor": default_floor(1, STEPS).dumps().decode()})
    writer.put("force", 0, np.column_stack([stamps, stamps, np.repeat(0.25 * weight_n * shares, 4, axis=1)]))
    writer.close()
    return path
