"""Stick-slip friction of a block on a moving belt."""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from underfoot.array_cache import ArrayCache
from underfoot.layouts import Layout
from underfoot.models.signals.glide import multiply
from underfoot.models.stick_slip import quantile_table, texture
from underfoot.parameters import Choice, Count, Number
from underfoot.patch.node import Input, Output, RequestedError, node, prepared

_TABLES = ArrayCache("slip-quantiles-3")
"""A table takes half a second in a process that has not yet loaded the solver's kernels."""


@node("stick-slip", "Materials", "Stick-slip")
class StickSlip:
    """Stick-slip friction of a spring-held block on a moving belt (8.2, 8.4): a squeak, or a rubber sole.

    Duration and distance of each slip are drawn from their joint distribution (Fokker-Planck, to the requested error).
    The output is 0 while force or velocity is 0 or below.
    """

    also_called = "bow, rub"
    accuracy = "requested: the error below, of the distributions (largest CDF difference)"
    requested_error = RequestedError(
        "largest CDF difference", "making its table; playing costs the same", "underfoot.models.stick_slip.table_error"
    )
    force = Input("N", doc="normal force on the belt: loudness is proportional to it")
    velocity = Number(
        0.1, 0.0, 10.0, unit="m/s", scale="amplitude", wire="audio", doc="belt velocity v_b; distances in proportion"
    )
    frequency = Number(
        120.0, 1.0, 5000.0, unit="Hz", scale="log", wire="span", doc="natural frequency, w0 / 2 pi: the pitch"
    )
    damping = Count(40, 5, 300, unit="%", doc="damping zeta, relative to w0")
    noise = Count(30, 2, 200, unit="%", doc="noise D, relative to w0 v_b^2: irregularity of the slips")
    start = Count(150, 0, 500, unit="%", doc="x0, relative to v_b / w0: extension of the spring when a slip begins")
    error = Choice(
        "0.001", options=("0.03", "0.01", "0.003", "0.001", "0.0003"), doc="largest CDF error of the distributions"
    )
    reference = Number(700.0, 1.0, 1e5, unit="N", scale="log", doc="force at which levels are as stated")
    loudness = Number(
        1.0, 0.0, 1000.0, scale="gain", wire="span", doc="strength of a mean slip at reference force and 0.1 m/s"
    )
    level = Number(
        0.1, 0.0, 100.0, scale="gain", wire="audio", added=0.01, doc="factor on the acceleration of the block"
    )
    acceleration = Output("m/s^2", doc="acceleration of the block: one cycle of a sine per slip")
    events = Output(kind="event", doc="starts of slips; strength is proportional to the distance")
    state = Layout("stick_slip_node", "per_newton", slips=texture.STATE)
    coefficients = texture.COEFFICIENTS
    muted_by = ("force", "velocity")

    @prepared
    def table(values, rate):
        return slip_table(values)

    def distributions(values):
        from underfoot.models.stick_slip.slip_drawings import slip_drawings

        return slip_drawings(values)

    def design(frequency, rate, coefficients):
        texture.design(2.0 * math.pi * frequency, rate, coefficients)

    def run(force, velocity, reference, loudness, level, table, key, frame, coefficients, state, acceleration, events):
        drive, first, per_newton = acceleration, len(events), 1.0 / reference
        if state.per_newton == 0.0:
            state.per_newton = per_newton
        state.per_newton = multiply(force, state.per_newton, per_newton, frame, drive)
        for i in range(drive.size):
            drive[i] = drive[i] * velocity[i] if force[i] > 0.0 else 0.0
        texture.run(drive, table, key, frame, coefficients, state.slips, acceleration, events)
        for k in range(first, len(events)):
            events.strength[k] *= 10.0 * loudness
        for i in range(acceleration.size):
            acceleration[i] *= level[i]


def slip_table(values: Mapping[str, Any]) -> NDArray[np.float64]:
    """Return the quantile table for a node with these `values`; cached in memory and with the kernels.

    >>> slip_table({"damping": 40, "noise": 50, "start": 200, "error": "0.01"}).size > 100
    True
    """
    damping, noise, start, error = (values[name] for name in ("damping", "noise", "start", "error"))

    def make() -> NDArray[np.float64]:
        return quantile_table.slip_table(0.01 * damping, 0.01 * noise, 0.01 * start, error=float(error))

    return _TABLES.get(f"{damping}-{noise}-{start}-{error}", make)
