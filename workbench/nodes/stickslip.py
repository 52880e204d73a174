"""Stick-slip: a block that a belt carries along until it slips back, again and again."""

import math
from collections.abc import Mapping
from contextlib import suppress
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from underfoot.errors import BadFile
from underfoot.files import replaced
from underfoot.kernel_cache import cache_folder
from underfoot.models.stick_slip import quantile_table, texture
from underfoot.parameters import Choice, Count, Number
from underfoot.patch.node import Input, Output, frames, grow, moved, node, rest_kernel, room, run_kernel

_MOST_KEPT = 100
"""Tables on disk."""
_STATE, _TUNING = texture.state_size(), texture.tuning_size()


@node("stick-slip", "Materials", "Stick-slip")
class StickSlip:
    """A block on a spring that a belt carries along until it slips back (8.2, 8.4): a squeak, or a rubber sole.

    How long each slip lasts and how far it goes is drawn from their joint law (Fokker-Planck, to the asked error), one
    look-up a slip. Nothing happens while force or velocity is 0 or below.
    """

    force = Input("N", doc="presses the block onto the belt: loudness goes with it")
    velocity = Number(0.1, 0.0, 10.0, unit="m/s", wire="audio", doc="v_b of the belt: distances go with it")
    frequency = Number(120.0, 1.0, 5000.0, unit="Hz", scale="log", doc="w0 / 2 pi of block and spring: the pitch")
    damping = Count(40, 5, 300, unit="%", doc="zeta, of w0")
    noise = Count(30, 2, 200, unit="%", doc="D, of w0 v_b^2: how uneven the slips are")
    start = Count(150, 0, 500, unit="%", doc="x0, of v_b / w0: how far the spring is drawn when a slip begins")
    error = Choice(
        "0.001", options=("0.03", "0.01", "0.003", "0.001", "0.0003"), doc="asked of the laws: largest CDF difference"
    )
    reference = Number(700.0, 1.0, 1e5, unit="N", scale="log", doc="force at which all comes out as strong as it is")
    loudness = Number(1.0, 0.0, 1000.0, doc="strength of a mean slip at the reference force and 0.1 m/s")
    level = Number(0.1, 0.0, 100.0, wire="audio", doc="share of the block's acceleration that is put out")
    acceleration = Output("m/s^2", doc="of the block: one cycle of a sine a slip")
    events = Output(kind="event", doc="slips as they begin, stronger the farther they go")
    state = _STATE
    tuning = 1 + _TUNING
    muted_by = ("force", "velocity")

    def prepare(values, rate):
        return slip_table(values)

    @run_kernel
    def run(x, y, c, s, t, d, e, o, key, rate, frame, n):
        tuning = frames(t, 1 + _TUNING)[1:]
        if moved(c, t, 1):
            texture.tune(tuning, rate, 2.0 * math.pi * c[0])
        table = frames(d, 1 + int(d[0]))[1:]
        drive, out = frames(y[0], n), frames(y[0], n)
        for i in range(n):
            drive[i] = x[0][i] / c[5] * x[1][i] if x[0][i] > 0.0 else 0.0
        events = room(o[0], n)
        count = texture.run(frames(s, _STATE), tuning, table, key, frame, drive, out, events)
        for k in range(count):
            events[3 * k + 1] *= 10.0 * c[6]
        grow(o[0], count)
        for i in range(n):
            out[i] *= x[2][i]

    @rest_kernel
    def rest(c, s, t, d):
        return texture.rest(frames(s, _STATE), frames(t, 1 + _TUNING)[1:])


def slip_table(values: Mapping[str, Any]) -> NDArray[np.float64]:
    """The size of the table for a node of these `values`, and the table; kept in memory and beside the kernels.

    >>> made = slip_table({"damping": 40, "noise": 50, "start": 200, "error": "0.01"})
    >>> bool(made[0] == made.size - 1)
    True
    """
    return _table(values["damping"], values["noise"], values["start"], values["error"])


@lru_cache(maxsize=64)
def _table(damping: int, noise: int, start: int, error: str) -> NDArray[np.float64]:
    # Making one costs half a second in a process that has not loaded the solver's kernels yet.
    path = cache_folder() / "slips" / f"{damping}-{noise}-{start}-{error}.npy"
    try:
        return np.load(path)
    except (OSError, ValueError, EOFError):
        pass  # not there yet, or cut short
    table = quantile_table.slip_table(0.01 * damping, 0.01 * noise, 0.01 * start, error=float(error))
    sized = np.append(float(table.size), table)
    with suppress(OSError, BadFile):  # an install without a writable place does without
        _keep(path, sized)
    return sized


def _keep(path: Path, table: NDArray[np.float64]) -> None:
    """Write a table for the next process, under its name only once it is whole; of many, the oldest go."""
    path.parent.mkdir(parents=True, exist_ok=True)
    for old in sorted(path.parent.glob("*.npy"), key=lambda file: file.stat().st_mtime)[:-_MOST_KEPT]:
        old.unlink(missing_ok=True)
    with replaced(path) as part, part.open("wb") as file:
        np.save(file, table)
