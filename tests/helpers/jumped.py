"""A recording of somebody who stands and jumps, with forces whose take-off velocity is known in closed form."""

import numpy as np
from made_recordings import ABOUT

from underfoot.floor.layout import default_floor
from underfoot.records.recording_writer import Writer

WEIGHT_N, GRAVITY_M_S2 = 700.0, 9.80665
STANDS_S, DIPS_S, PUSHES_S = 1.0, 3.0, 0.75
DIP_G = np.array([[0.0, 0.0], [0.25, -0.7], [0.45, 0.9], [0.7, 1.4], [PUSHES_S, -1.0]])
"""Seconds since the dip began, and the acceleration of the body's centre, in g: up to the take-off."""
VELOCITY_M_S = GRAVITY_M_S2 * np.trapezoid(DIP_G[:, 1], DIP_G[:, 0])
FLIGHT_S = 2.0 * VELOCITY_M_S / GRAVITY_M_S2
HEIGHT_MM = 1e3 * VELOCITY_M_S**2 / (2.0 * GRAVITY_M_S2)
TAKE_OFF_S = DIPS_S + PUSHES_S
AIRBORNE_S = TAKE_OFF_S + 0.5 * FLIGHT_S
LANDING_N = 3.0 * WEIGHT_N


def load_n(time_s):
    """Return the load at these seconds: on the floor from `STANDS_S` on, in the air from `TAKE_OFF_S` for `FLIGHT_S`,
    and then on the floor until 7 s."""
    landed = [(0.0, -1.0), (0.02, 2.0), (0.2, 0.5), (0.6, 0.0)]
    knots = [
        *[(0.0, -1.0), (STANDS_S, -1.0), (STANDS_S + 0.3, 0.0)],
        *((DIPS_S + at, g) for at, g in DIP_G.tolist()),
        *[(TAKE_OFF_S + FLIGHT_S + at, g) for at, g in landed],
        *[(6.8, 0.0), (7.0, -1.0), (8.0, -1.0)],
    ]
    return WEIGHT_N * (1.0 + np.interp(time_s, *np.transpose(knots)))


def jumped(path, rate_hz=1000.0, noise_n=0.3, tare_n=3.0, lost=lambda time_s: time_s < 0.0, load_n=load_n, further=0):
    """Write it, a foot on each of two tiles, whose sensors have a tare and noise; samples that are `lost` are not
    there. Who jumps `further` lands on the tiles so many further on."""
    time_s = np.arange(0.0, 8.0, 1.0 / rate_hz)
    time_s = time_s[~lost(time_s)]
    force_n = np.random.default_rng(1).normal(tare_n, noise_n, (len(time_s), 4 * (2 + further)))
    for begin_s, end_s, at in ((0.0, AIRBORNE_S, 0), (AIRBORNE_S, np.inf, 4 * further)):
        there = (time_s >= begin_s) & (time_s < end_s)
        force_n[there, at : at + 8] += load_n(time_s[there])[:, None] / 8.0
    stamps = np.round(48_000 * time_s)
    writer = Writer(path, ABOUT | {"floor": default_floor(1, 2 + further).dumps().decode(), "force_rate": str(rate_hz)})
    writer.put("force", 0, np.column_stack([stamps, stamps, force_n]))
    writer.close()
    return path
