"""A recording of somebody of a known weight who stands, swaying a little, and then walks along eight tiles."""

import numpy as np
from made_recordings import ABOUT

from underfoot.floor.layout import default_floor
from underfoot.records.recording_writer import Writer

FIRST_STEP_S, STEP_S, CONTACT_S, STEPS = 8.0, 0.55, 0.65, 8
PEAK = 1.1
"""The first peak of a step, as a share of the weight."""


def stood_and_walked(path, weight_n, stands_s=6.0):
    """Write it: a foot on each of the first two tiles from 0.5 s on, for longer than a step lasts, and steps from
    `FIRST_STEP_S` on."""
    time_s = np.arange(0.0, FIRST_STEP_S + STEP_S * STEPS + 1.0, 1e-3)
    shares = np.zeros((len(time_s), STEPS))
    sway = 1.0 + 0.004 * np.sin(2.0 * np.pi * time_s)
    stood = np.interp(time_s, [0.5, 0.7, 0.5 + stands_s, 0.7 + stands_s], [0.0, 1.0, 1.0, 0.0]) * sway
    shares[:, :2] += np.outer(stood, [0.45, 0.55])
    for number in range(STEPS):
        at = (time_s - FIRST_STEP_S - STEP_S * number) / CONTACT_S
        shares[:, number] += np.interp(at, [0.0, 0.2, 0.5, 0.8, 1.0], [0.0, PEAK, 0.7, 1.05, 0.0])
    stamps = np.round(48_000 * time_s)
    writer = Writer(path, ABOUT | {"floor": default_floor(1, STEPS).dumps().decode()})
    writer.put("force", 0, np.column_stack([stamps, stamps, np.repeat(0.25 * weight_n * shares, 4, axis=1)]))
    writer.close()
    return path
