"""What a sensor remembers, taken out again: creep by its lags, hysteresis by play operators.

A static curve gives an apparent force u. Creep first: what lags behind, two lags a decade of time, all of one strength,
is solved for sample by sample. Then hysteresis: newtons are a weighted sum of play operators of the rest (the inverse
of a Prandtl-Ishlinskii operator is one again, Krejci and Kuhnen 2001). A play of width q keeps its value while the
force moves less than q; q is a share of the force itself where the loop is (`relative`), else newtons. Nothing is
solved backwards in time and nothing can run away: the result is bounded by the weights.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from underfoot.errors import require
from underfoot.kernels import kernel

Values = NDArray[np.float64]
LAGS_S = 0.03 * 10.0 ** (np.arange(12) / 2.0)
"""The lags of creep, 30 ms to 9500 s."""
_KEPT_S = 1.0
"""A load kept for this long is taken as it reads; creep is what comes before and after."""
MOST_PLAYS = 12
SHARES = (0.006, 0.015, 0.03, 0.05, 0.08, 0.12, 0.17, 0.25)
"""Widths of plays: shares of the force, or of full scale."""
KINDS = ("creep", "relative", "absolute")
_SOFT = 1e-4
_STATE = MOST_PLAYS + LAGS_S.size + 1


@dataclass(frozen=True)
class Learned:
    """Creep per decade, and the weights of the force itself (first) and of its plays; how much of it is relative."""

    creep: float
    relative: bool
    widths: Values
    weights: Values


def state_size() -> int:
    """Numbers of one sensor's memory; all zero is a sensor that has rested."""
    return _STATE


def recall(
    u: Values, time_s: Values, creep: float, relative: bool, widths: Values, weights: Values, state: Values
) -> Values:
    """Newtons (n,) from apparent forces `u` (n,) at `time_s` (n,); `state` goes on where it was. NaN stays NaN.

    >>> recall(np.array([0.0, 5.0]), np.array([0.0, 0.1]), 0.0, False, np.empty(0), np.ones(1), np.zeros(state_size()))
    array([0., 5.])
    """
    terms, newtons = np.empty((u.size, widths.size + 1)), np.empty(u.size)
    remember(u, time_s, creep, relative, widths, state, np.empty(LAGS_S.size), terms)
    weigh(terms, weights, newtons)
    return newtons


@kernel
def weigh(terms, weights, newtons):
    """Newtons (n,) of what is remembered, (n, 1 + plays). Below 0 nothing is: noise about rest stays as it is."""
    for i in range(newtons.size):
        total = min(terms[i, 0], 0.0)
        for k in range(weights.size):
            total += max(terms[i, k], 0.0) * weights[k]
        newtons[i] = total if math.isfinite(terms[i, 0]) else math.nan


@kernel
def remember(u, time_s, creep, relative, widths, state, share, terms):
    """The force without creep and each of its plays, shape (n, 1 + plays): what the weights stand for.

    `state` is plays, lags, and the time of the last sample with 1 added (0: none yet); `share` a place to work in, a
    number for each of `LAGS_S`.
    """
    each = creep / 2.0
    lags = LAGS_S.size
    at_once = 1.0
    for k in range(lags):
        at_once -= each * (1.0 - math.exp(-_KEPT_S / LAGS_S[k]))
    last_step = -1.0
    total = 0.0
    for i in range(u.size):
        now = u[i]
        if not math.isfinite(now):
            for k in range(widths.size + 1):
                terms[i, k] = math.nan
            continue
        step = 0.0 if state[_STATE - 1] == 0.0 else max(time_s[i] + 1.0 - state[_STATE - 1], 0.0)
        if math.isfinite(time_s[i]):
            state[_STATE - 1] = max(time_s[i] + 1.0, state[_STATE - 1])
        else:
            step = 0.0
        if step != last_step:
            total = 0.0
            for k in range(lags):
                share[k] = 1.0 - math.exp(-step / LAGS_S[k])
                total += share[k]
            last_step = step
        kept = 0.0
        for k in range(lags):
            kept += (1.0 - share[k]) * state[MOST_PLAYS + k]
        clean = (now - each * kept) / (at_once + each * total)
        for k in range(lags):
            state[MOST_PLAYS + k] += share[k] * (clean - state[MOST_PLAYS + k])
        terms[i, 0] = clean
        pressed = max(clean, 0.0)
        for k in range(widths.size):
            width = widths[k] * pressed if relative else widths[k]
            state[k] = min(max(state[k], pressed - width), pressed)
            terms[i, k + 1] = state[k]


def learn(
    u: Values, time_s: Values, force_n: Values, weight: Values, full_scale_n: float, kind: str, creep: float
) -> tuple[Learned, float]:
    """The weights that explain `force_n` (n,) best at this `creep`, and the weighted squares that they leave.

    `kind` is "creep" alone, or with "relative" or "absolute" plays. `weight` (n,) is what each sample counts; 0 is a
    sample that the fit does not see, though its past counts. `BadValue` for another kind.
    """
    require(kind in KINDS, "kind", kind, ", ".join(KINDS))
    relative = kind == "relative"
    widths = np.array([] if kind == "creep" else SHARES) * (1.0 if relative else full_scale_n)
    terms = np.empty((u.size, widths.size + 1))
    remember(u, time_s, creep, relative, widths, np.zeros(_STATE), np.empty(LAGS_S.size), terms)
    seen = weight > 0.0
    root = np.sqrt(weight[seen])
    left, right = terms[seen] * root[:, None], force_n[seen] * root
    # Plays that hardly differ share their weight instead of fighting over it.
    square = left.T @ left
    soft = np.diag([1e-12] + [_SOFT] * widths.size) * max(square[0, 0], 1e-300)
    weights = np.linalg.solve(square + soft, left.T @ right)
    return Learned(creep, relative, widths, weights), float(((left @ weights - right) ** 2).sum())
