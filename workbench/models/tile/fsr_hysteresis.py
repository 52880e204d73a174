"""Hysteresis and creep of force sensing resistors, compensated: creep by lags, hysteresis by play operators.

A static curve gives an apparent force u. Creep first: it is modelled by lags of equal strength, two a decade of time,
and solved for sample by sample. Then hysteresis: the force is a weighted sum of the force without creep and of play
operators of it (the inverse of a Prandtl-Ishlinskii operator is one again, Krejci and Kuhnen 2001). A play operator of
width q keeps its value while the force moves by less than q; q is a share of the force itself where the hysteresis loop
is (`relative`), else newtons. Nothing is solved backwards in time, and the result is bounded by the weights.
"""

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from underfoot.errors import require
from underfoot.kernels import kernel

Values = NDArray[np.float64]
LAGS_S = 0.03 * 10.0 ** (np.arange(12) / 2.0)
"""Time constants of creep, 30 ms to 9500 s."""
_REFERENCE_S = 1.0
"""A load held for this long is taken as it reads; creep is what comes before and after."""
MOST_PLAYS = 12
"""Play operators for which a `STATE` has room."""
WIDTHS = (0.006, 0.015, 0.03, 0.05, 0.08, 0.12, 0.17, 0.25)
"""Widths of the play operators that are fitted: shares of the force, or of full scale."""
KINDS = ("creep", "relative", "absolute")
_RIDGE = 1e-4

STATE = np.dtype(
    [("plays", np.float64, (MOST_PLAYS,)), ("lags", np.float64, (LAGS_S.size,)), ("clock_s", np.float64)], align=True
)
"""What one sensor has kept of the forces before: outputs of its play operators and of its lags, newtons, and the time
of its last sample plus 1 s. All zero is a sensor that has rested without a load, before its first sample."""


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
"""A `HysteresisModel` as kernels read it: `plays` is how many play operators there are."""


@dataclass(frozen=True)
class HysteresisModel:
    """Hysteresis and creep of one sensor.

    `creep` is a share of the force a decade of time. `widths` (plays,) are those of the play operators, shares of the
    force where `relative`, else newtons; `weights` (1 + plays,) are of the force itself, then of each play operator.
    """

    creep: float
    relative: bool
    widths: Values
    weights: Values

    def record(self) -> np.void:
        """The model as kernels read it."""
        plays, found = self.widths.size, np.zeros(1, MODEL)[0]
        found["creep"], found["relative"], found["plays"] = self.creep, self.relative, plays
        found["widths"][:plays], found["weights"][: 1 + plays] = self.widths, self.weights
        return found


def compensate(apparent_n: Values, time_s: Values, model: HysteresisModel, state: np.void) -> Values:
    """Newtons (n,) from apparent forces (n,) at `time_s` (n,); `state`, of `STATE`, is carried on. NaN stays NaN.

    >>> nothing = HysteresisModel(0.0, False, np.empty(0), np.ones(1))
    >>> compensate(np.array([0.0, 5.0]), np.array([0.0, 0.1]), nothing, np.zeros(1, STATE)[0])
    array([0., 5.])
    """
    terms, newtons = np.empty((apparent_n.size, 1 + model.widths.size)), np.empty(apparent_n.size)
    record = model.record()
    play_operators(apparent_n, time_s, record, state, np.empty(LAGS_S.size), terms)
    weighted_sum(terms, record, newtons)
    return newtons


@kernel
def weighted_sum(terms: Values, model: np.record, newtons: Values) -> None:
    """Newtons (n,) of the terms (n, 1 + plays). Below 0 only the force itself counts: noise of an empty tile stays."""
    for i in range(newtons.size):
        total = min(terms[i, 0], 0.0)
        for k in range(1 + model.plays):
            total += max(terms[i, k], 0.0) * model.weights[k]
        newtons[i] = total if math.isfinite(terms[i, 0]) else math.nan


@kernel
def play_operators(
    apparent_n: Values, time_s: Values, model: np.record, state: np.record, steps: Values, terms: Values
) -> None:
    """Write the force without creep and each play operator of it, (n, 1 + plays): what the weights are of.

    `model` is of `MODEL`; `state`, of `STATE`, is carried on; `steps` is a place to work in, a number for each of
    `LAGS_S`.
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
    """Make a state that of a sensor that has rested, before its first sample."""
    for k in range(MOST_PLAYS):
        state.plays[k] = 0.0
    for k in range(LAGS_S.size):
        state.lags[k] = 0.0
    state.clock_s = 0.0


def fit(
    apparent_n: Values, time_s: Values, force_n: Values, weight: Values, full_scale_n: float, kind: str, creep: float
) -> tuple[HysteresisModel, float]:
    """The model of this `creep` that explains `force_n` (n,) best, and the weighted squares that it leaves.

    `kind` is "creep" alone, or with "relative" or "absolute" play operators. `weight` (n,) is what each sample counts;
    0 is a sample that the fit does not see, though its past counts. `BadValue` for another kind.
    """
    require(kind in KINDS, "kind", kind, ", ".join(KINDS))
    relative = kind == "relative"
    widths = np.array([] if kind == "creep" else WIDTHS) * (1.0 if relative else full_scale_n)
    model = HysteresisModel(creep, relative, widths, np.ones(widths.size + 1))
    terms = np.empty((apparent_n.size, widths.size + 1))
    play_operators(apparent_n, time_s, model.record(), np.zeros(1, STATE)[0], np.empty(LAGS_S.size), terms)
    seen = weight > 0.0
    root = np.sqrt(weight[seen])
    left, right = terms[seen] * root[:, None], force_n[seen] * root
    # Play operators that hardly differ share their weight instead of cancelling one another (ridge regression).
    square = left.T @ left
    ridge = np.diag([1e-12] + [_RIDGE] * widths.size) * max(square[0, 0], 1e-300)
    weights = np.linalg.solve(square + ridge, left.T @ right)
    return replace(model, weights=weights), float(((left @ weights - right) ** 2).sum())
