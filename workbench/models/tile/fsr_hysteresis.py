"""Compensation of hysteresis and creep of force sensing resistors: play operators for hysteresis, lags for creep.

A static curve gives an apparent force u. Creep is compensated first: it is modelled by lags of equal strength, two per
decade of time, and solved sample by sample. Then hysteresis: the force is a weighted sum of the creep-free force and of
play operators on it (the inverse of a Prandtl-Ishlinskii operator is again one, Krejci and Kuhnen 2001). A play
operator of width q keeps its value while the force moves by less than q; q is a share of the force itself where the
hysteresis loop is (`relative`), else newtons. Nothing is solved backwards in time, and the weights bound the result.
"""

import math

import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from underfoot.arguments import choice, require_alike
from underfoot.kernels import Floats, kernel

LAGS_S = 0.03 * 10.0 ** (np.arange(12) / 2.0)
"""Time constants of creep, 30 ms to 9500 s."""
_REFERENCE_S = 1.0
"""Time after which a constant load reads as its static value; creep is the deviation before and after."""
MOST_CREEP = 0.4
"""Largest creep, a share of the force per decade: from 0.494 on the lags leave nothing of a force that acts at once."""
MOST_PLAYS = 12
"""Largest number of play operators in a `STATE`."""
WIDTHS = (0.006, 0.015, 0.03, 0.05, 0.08, 0.12, 0.17, 0.25)
"""Widths of the fitted play operators: shares of the force, or of full scale."""
KINDS = ("creep", "relative", "absolute")
_RIDGE = 1e-4

STATE = np.dtype(
    [("plays", np.float64, (MOST_PLAYS,)), ("lags", np.float64, (LAGS_S.size,)), ("clock_s", np.float64)], align=True
)
"""Memory of one sensor: outputs of its play operators and of its lags, newtons, and the time of its last sample plus
1 s. All zeros are a sensor at rest without load, before its first sample."""


MODEL = np.dtype(
    [
        ("creep", np.float64),
        ("relative", np.bool_),
        ("plays", np.int64),
        ("widths", np.float64, (MOST_PLAYS,)),
        ("weights", np.float64, (1 + MOST_PLAYS,)),
    ],
    align=True,
)
"""A `HysteresisModel` for kernels: `plays` is the number of play operators."""


class HysteresisModel(Struct, frozen=True):
    """Hysteresis and creep of one sensor.

    `creep` is a share of the force per decade of time. `widths` (plays,) are those of the play operators, shares of the
    force where `relative`, else newtons; `weights` (1 + plays,) apply to the force itself, then to each play operator.
    """

    creep: float
    relative: bool
    widths: Floats
    weights: Floats

    def record(self) -> np.void:
        """Return the model as a record for kernels."""
        plays, found = self.widths.size, np.zeros(1, MODEL)[0]
        found["creep"], found["relative"], found["plays"] = self.creep, self.relative, plays
        found["widths"][:plays], found["weights"][: 1 + plays] = self.widths, self.weights
        return found


def compensate(apparent_n: Floats, time_s: Floats, model: HysteresisModel, state: np.void) -> Floats:
    """Return newtons (n,) from apparent forces (n,) at `time_s` (n,); updates `state` (a `STATE`). NaN stays NaN.

    >>> nothing = HysteresisModel(0.0, False, np.empty(0), np.ones(1))
    >>> compensate(np.array([0.0, 5.0]), np.array([0.0, 0.1]), nothing, np.zeros(1, STATE)[0])
    array([0., 5.])
    """
    require_alike(apparent_n=apparent_n, time_s=time_s)
    terms, newtons = np.empty((apparent_n.size, 1 + model.widths.size)), np.empty(apparent_n.size)
    record = model.record()
    play_operators(apparent_n, time_s, record, state, np.empty(LAGS_S.size), terms)
    weighted_sum(terms, record, newtons)
    return newtons


@kernel
def weighted_sum(terms: Floats, model: np.record, newtons: Floats) -> None:
    """Sum the terms (n, 1 + plays) into newtons (n,). Below 0 only the force itself counts: an empty tile's noise."""
    for i in range(newtons.size):
        total = min(terms[i, 0], 0.0)
        for k in range(1 + model.plays):
            total += max(terms[i, k], 0.0) * model.weights[k]
        newtons[i] = total if math.isfinite(terms[i, 0]) else math.nan


@kernel
def play_operators(
    apparent_n: Floats, time_s: Floats, model: np.record, state: np.record, steps: Floats, terms: Floats
) -> None:
    """Write the creep-free force and each play operator of it, (n, 1 + plays): the terms to be weighted.

    `model` is a `MODEL`; `state`, a `STATE`, is updated; `steps` is working memory, one number for each of `LAGS_S`.
    """
    each = model.creep / 2.0
    lags = LAGS_S.size
    at_once = 1.0
    for k in range(lags):
        at_once -= each * (1.0 - math.exp(-_REFERENCE_S / LAGS_S[k]))
    last_elapsed = -1.0
    total = 0.0
    for i in range(apparent_n.size):
        now = apparent_n[i]
        if not math.isfinite(now):
            for k in range(1 + model.plays):
                terms[i, k] = math.nan
            continue
        elapsed = 0.0 if state.clock_s == 0.0 else max(time_s[i] + 1.0 - state.clock_s, 0.0)
        if math.isfinite(time_s[i]):
            state.clock_s = max(time_s[i] + 1.0, state.clock_s)
        else:
            elapsed = 0.0
        if elapsed != last_elapsed:
            total = 0.0
            for k in range(lags):
                steps[k] = 1.0 - math.exp(-elapsed / LAGS_S[k])
                total += steps[k]
            last_elapsed = elapsed
        kept = 0.0
        for k in range(lags):
            kept += (1.0 - steps[k]) * state.lags[k]
        force = (now - each * kept) / (at_once + each * total)
        for k in range(lags):
            state.lags[k] += steps[k] * (force - state.lags[k])
        terms[i, 0] = force
        pressed = max(force, 0.0)
        for k in range(model.plays):
            width = model.widths[k] * pressed if model.relative else model.widths[k]
            state.plays[k] = min(max(state.plays[k], pressed - width), pressed)
            terms[i, k + 1] = state.plays[k]


@kernel
def reset(state: np.record) -> None:
    """Reset a state to that of a sensor at rest, before its first sample."""
    for k in range(MOST_PLAYS):
        state.plays[k] = 0.0
    for k in range(LAGS_S.size):
        state.lags[k] = 0.0
    state.clock_s = 0.0


def fit(
    apparent_n: Floats, time_s: Floats, force_n: Floats, weight: Floats, full_scale_n: float, kind: str, creep: float
) -> tuple[HysteresisModel, Floats, float]:
    """Return the best model of `force_n` (n,) with this `creep`, its newtons (n,), and its weighted squared residuals.

    `kind` is "creep" alone, or "relative" or "absolute" for play operators too. `weight` (n,) weights the samples; the
    fit ignores samples of weight 0, except as history. `BadValue` for another kind.

    >>> time_s = np.arange(500) / 100.0
    >>> force_n = 50.0 * (1.0 - np.cos(time_s))
    >>> model, newtons, residual = fit(2.0 * force_n, time_s, force_n, np.ones(500), 200.0, "creep", creep=0.0)
    >>> round(float(model.weights[0]), 6), residual < 1e-9  # an apparent force twice too large
    (0.5, True)
    """
    choice("kind", kind, KINDS)
    relative = kind == "relative"
    widths = np.array([] if kind == "creep" else WIDTHS) * (1.0 if relative else full_scale_n)
    model = HysteresisModel(creep, relative, widths, np.ones(widths.size + 1))
    terms = np.empty((apparent_n.size, widths.size + 1))
    play_operators(apparent_n, time_s, model.record(), np.zeros(1, STATE)[0], np.empty(LAGS_S.size), terms)
    seen = weight > 0.0
    root = np.sqrt(weight[seen])
    left, right = terms[seen] * root[:, None], force_n[seen] * root
    # Ridge regression: play operators that hardly differ share their weight instead of cancelling one another.
    square = left.T @ left
    ridge = np.diag([1e-12] + [_RIDGE] * widths.size) * max(square[0, 0], 1e-300)
    model = replace(model, weights=np.linalg.solve(square + ridge, left.T @ right))
    newtons = np.empty(apparent_n.size)
    weighted_sum(terms, model.record(), newtons)
    return model, newtons, float(((left @ model.weights - right) ** 2).sum())
