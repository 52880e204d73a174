"""Stick-slip: a block that a belt carries along until it slips back, again and again."""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from underfoot.array_cache import ArrayCache
from underfoot.layouts import Layout
from underfoot.models.signals.glide import glided
from underfoot.models.stick_slip import quantile_table, texture
from underfoot.parameters import Choice, Count, Number
from underfoot.patch.node import AskedError, Input, Output, node, prepared

_TABLES = ArrayCache("slip-quantiles-2")
"""Making one costs half a second in a process that has not loaded the solver's kernels yet."""


@node("stick-slip", "Materials", "Stick-slip")
class StickSlip:
    """A block on a spring that a belt carries along until it slips back (8.2, 8.4): a squeak, or a rubber sole.

    How long each slip lasts and how far it goes is drawn from their joint law (Fokker-Planck, to the asked error), one
    look-up a slip. Nothing happens while force or velocity is 0 or below.
    """

    accuracy = "asked: the error below, of the laws (largest CDF difference)"
    asked = AskedError(
        "largest CDF difference", "making its table; playing costs the same", "underfoot.models.stick_slip.table_error"
    )
    force = Input("N", doc="presses the block onto the belt: loudness goes with it")
    velocity = Number(
        0.1, 0.0, 10.0, unit="m/s", scale="amplitude", wire="audio", doc="v_b of the belt: distances go with it"
    )
    frequency = Number(
        120.0, 1.0, 5000.0, unit="Hz", scale="log", wire="span", doc="w0 / 2 pi of block and spring: the pitch"
    )
    damping = Count(40, 5, 300, unit="%", doc="zeta, of w0")
    noise = Count(30, 2, 200, unit="%", doc="D, of w0 v_b^2: how uneven the slips are")
    start = Count(150, 0, 500, unit="%", doc="x0, of v_b / w0: how far the spring is drawn when a slip begins")
    error = Choice(
        "0.001", options=("0.03", "0.01", "0.003", "0.001", "0.0003"), doc="asked of the laws: largest CDF difference"
    )
    reference = Number(700.0, 1.0, 1e5, unit="N", scale="log", doc="force at which all comes out as strong as it is")
    loudness = Number(
        1.0, 0.0, 1000.0, scale="gain", wire="span", doc="strength of a mean slip at the reference force and 0.1 m/s"
    )
    level = Number(0.1, 0.0, 100.0, scale="gain", wire="audio", doc="share of the block's acceleration that is put out")
    acceleration = Output("m/s^2", doc="of the block: one cycle of a sine a slip")
    events = Output(kind="event", doc="slips as they begin, stronger the farther they go")
    state = Layout("stick_slip_node", "per_newton", slips=texture.STATE)
    coefficients = texture.COEFFICIENTS
    muted_by = ("force", "velocity")

    @prepared
    def table(values, rate):
        return slip_table(values)

    def laws(values):
        from underfoot.models.stick_slip.slip_laws import slip_laws

        return slip_laws(values)

    def design(frequency, rate, coefficients):
        texture.design(2.0 * math.pi * frequency, rate, coefficients)

    def run(force, velocity, reference, loudness, level, table, key, frame, coefficients, state, acceleration, events):
        drive, first, per_newton = acceleration, len(events), 1.0 / reference
        if state.per_newton == 0.0:
            state.per_newton = per_newton
        for i in range(drive.size):
            state.per_newton = glided(state.per_newton, per_newton, frame + i)
            drive[i] = force[i] * state.per_newton * velocity[i] if force[i] > 0.0 else 0.0
        texture.run(drive, table, key, frame, coefficients, state.slips, acceleration, events)
        for k in range(first, len(events)):
            events.strength[k] *= 10.0 * loudness
        for i in range(acceleration.size):
            acceleration[i] *= level[i]


def slip_table(values: Mapping[str, Any]) -> NDArray[np.float64]:
    """The table for a node of these `values`; kept in memory and beside the kernels.

    >>> slip_table({"damping": 40, "noise": 50, "start": 200, "error": "0.01"}).size > 100
    True
    """
    damping, noise, start, error = (values[name] for name in ("damping", "noise", "start", "error"))

    def make() -> NDArray[np.float64]:
        return quantile_table.slip_table(0.01 * damping, 0.01 * noise, 0.01 * start, error=float(error))

    return _TABLES.get(f"{damping}-{noise}-{start}-{error}", make)
