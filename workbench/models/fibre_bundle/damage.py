"""Damage of one bundle: distribution of the thresholds, failures at a strain, remaining stiffness.

Thresholds are handled in the hazard y = -ln(1 - P(x)), in which the least of n thresholds lies Exp/n above the
last (7.15 corrected). When the strain has passed it within a frame, all failures in that frame are drawn at once, `1 +
Binomial(n - 1, 1 - exp(y - y_x))`: exact, at a cost that does not grow with their number. With mean damage the
failures are a Poisson process of intensity N p(x) dx instead (7.10, see docs/models.md#fibre-bundles).
"""

import math

import numpy as np

from underfoot.clock import SPAN
from underfoot.kernels import inlined, kernel
from underfoot.layouts import Layout, Memory
from underfoot.models.driven_oscillator import frame_step, resolved
from underfoot.models.fibre_bundle.counts import binomial, poisson
from underfoot.models.signals.random import exponential

MODELS = ("exact", "mean", "inverse", "inverse_mean")
"""Damage models; the index of each is its code."""
EXACT, MEAN, INVERSE, INVERSE_MEAN = range(4)

THRESHOLDS = ("weibull", "uniform")
"""Distributions of the thresholds; the index of each is its code."""
WEIBULL, UNIFORM = range(2)

PARAMETERS = Layout(
    "bundle_parameters",
    *("thresholds", "fibres", "shape", "scale", "stiffness", "mass", "damping", "creep"),
    *("restructurings", "stiffening", "renewal", "loudness", "softness"),
)
"""Input of `design`: code of the thresholds' distribution, N, k, lambda, then k_F, m, b_F and b_R of (7.1), per fibre;
n_max and alpha of an inverse bundle; the renewal time in seconds; and the strength of a failure, `loudness`
(E / E1)^`softness` with E1 = k_F lambda^2 / 2: exponent 1/2 gives the velocity of an impact, 1 its energy. Those of a
frame are added: of many failures the level would else depend on the rate."""

COEFFICIENTS = Layout(
    "bundle_coefficients",
    *("model", "thresholds", "fibres", "pool", "shape", "per_shape", "scale", "stiffness"),
    *("kappa", "gamma", "creep", "gain", "restructurings", "stiffening", "compound"),
    *("pressure", "limit", "renewal", "loudness", "softness", "holds", "designs"),
)
"""kappa, gamma, creep and gain are k_F, b_F, b_R and 1 over the mass, with time in frames. `pool` is the number of
thresholds. If `holds`, a fully broken bundle keeps its strain. `designs` counts the calls of `design`."""

NO_THRESHOLD = np.finfo(np.float64).max
"""Strain, in a state, of the next failure where there is none: what is infinite in a call."""

AT_REST = 1e-200
"""Strains and speeds below this are set to 0 where nothing loads them: as they go on falling to the last bits that a
number has, many processors take far longer for each sum."""
REST_INTERVAL = 8 * SPAN
"""Session frames after which it is looked for what has come to rest: shorter than from `AT_REST` to those bits."""

_STIFFEST = 1e6
"""Largest stiffness of a bundle, relative to its initial stiffness."""

DRAWS = 64
"""Random draws reserved for each frame: the counter of a draw is frame times this, plus its index."""
_FIRST, _FOLLOWING, _BATCH = range(3)


@kernel
def design(parameters: Memory, model: float, pressure: float, rate: float, coefficients: Memory) -> None:
    """Compute the coefficients of a bundle with `parameters` (named as in `PARAMETERS`) and the `model` of this code.

    `pressure` is the stress of (7.1) per unit of load. A mass or damping too small for frames to resolve is raised so
    that the motion settles within a frame. `compound` and `holds` are off. A change takes effect with the next `run`.
    """
    frame_s = 1.0 / rate
    stiffness, scale, fibres = parameters.stiffness, parameters.scale, parameters.fibres
    mass, damping = resolved(frame_s, stiffness, parameters.damping, parameters.creep, parameters.mass)
    c = coefficients
    c.model, c.thresholds = model, parameters.thresholds
    c.fibres = c.pool = fibres
    c.shape, c.per_shape = parameters.shape, 1.0 / parameters.shape
    c.scale, c.stiffness = scale, stiffness
    c.kappa = stiffness * frame_s * frame_s / mass
    c.gamma = damping * frame_s / mass
    c.creep = parameters.creep * frame_s / mass
    c.gain = frame_s * frame_s / mass
    c.restructurings, c.stiffening, c.compound = parameters.restructurings, parameters.stiffening, 0.0
    if model >= INVERSE:
        c.pool = fibres * parameters.restructurings
    c.pressure = pressure / fibres
    c.limit = 1e9 * stiffness * scale
    c.renewal = parameters.renewal * rate
    c.loudness = parameters.loudness * (0.5 * stiffness * scale**2) ** -parameters.softness
    c.softness = parameters.softness
    c.holds = 0.0
    c.designs += 1.0


@kernel
def critical_load(thresholds: float, fibres: float, shape: float, scale: float, stiffness: float) -> float:
    """Return the quasi-static critical load: N k_F lambda k^(-1/k) exp(-1/k); uniform, N k_F lambda / 4."""
    if thresholds == UNIFORM:
        return 0.25 * fibres * stiffness * scale
    return fibres * stiffness * scale * shape ** (-1.0 / shape) * math.exp(-1.0 / shape)


@kernel
def hazard(c: Memory, strain: float) -> float:
    """Return the hazard -ln(1 - P(x)) of a strain: infinite from the largest uniform threshold on."""
    ratio = strain / c.scale
    if ratio <= 0.0:
        return 0.0
    if c.thresholds == WEIBULL:
        return _power(ratio, c.shape)
    return -math.log1p(-ratio) if ratio < 1.0 else math.inf


@kernel
def threshold_strain(c: Memory, y: float) -> float:
    """Return the strain with hazard `y`; infinite if no threshold is left."""
    if y == math.inf:
        return math.inf
    if c.thresholds == WEIBULL:
        return c.scale * y**c.per_shape
    return -c.scale * math.expm1(-y)


@kernel
def first_hazard(c: Memory, key: np.uint64, counter: int, strain: float) -> float:
    """Draw the hazard of an intact bundle's least threshold, at least that of the strain at its renewal."""
    return hazard(c, strain) + exponential(key, counter + _FIRST) / c.pool


@kernel
def fail(c: Memory, key: np.uint64, counter: int, y: float, strain: float, failed: float) -> tuple[float, float]:
    """Draw the number of failures once the strain has passed hazard `y`, and return it with the next hazard."""
    passed = hazard(c, strain)
    wait = exponential(key, counter + _FOLLOWING)
    if not has_mean_damage(c):
        others = c.pool - failed - 1.0
        count = binomial(key, counter + _BATCH, others, -math.expm1(y - passed))
        others -= count
        return 1.0 + count, (passed + wait / others if others > 0.0 else math.inf)
    left = math.exp(-passed)
    count = poisson(key, counter + _BATCH, c.pool * (math.exp(-y) - left))
    left -= wait / c.pool
    return 1.0 + count, (-math.log(left) if left > 0.0 else math.inf)


@inlined
def has_mean_damage(c: Memory) -> bool:
    """Return whether the damage follows from the largest strain, and not from the failures that were drawn."""
    return c.model == MEAN or c.model == INVERSE_MEAN


@kernel
def stiffness_left(c: Memory, failed: float, peak: float) -> float:
    """Return A / N after `failed` failures or, with mean damage, after the strain `peak`; 0 if the bundle is broken."""
    model = c.model
    if model == EXACT:
        return 1.0 - failed / c.fibres
    if model == MEAN:
        left = math.exp(-hazard(c, peak))
        return 0.0 if c.holds != 0.0 and left * c.fibres < 0.5 else left
    share = failed / c.pool if model == INVERSE else -math.expm1(-hazard(c, peak))
    if c.compound != 0.0:
        return min((1.0 + c.stiffening * share) ** c.restructurings, _STIFFEST)
    return 1.0 + c.stiffening * c.restructurings * share


@kernel
def bundle_step(c: Memory, left: float) -> tuple[float, ...]:
    """Return the coefficients of the motion over a frame (`frame_step`) for the stiffness `left`."""
    if left <= 0.0 and c.holds != 0.0:
        return 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    return frame_step(left * c.kappa, left * c.gamma + c.creep, c.gain)


@kernel
def energy_released(c: Memory, failed: float, strain: float) -> float:
    """Return the energy of failures at a strain: k_F x^2 / 2 each."""
    return failed * 0.5 * c.stiffness * strain * strain


@kernel
def strength_of(c: Memory, failed: float, strain: float) -> float:
    """Return the strengths of failures at a strain, added."""
    energy = energy_released(c, 1.0, strain)
    return failed * c.loudness * (math.sqrt(energy) if c.softness == 0.5 else energy**c.softness)


@kernel
def _power(base: float, exponent: float) -> float:
    """Return `base ** exponent`; small whole exponents by products, in a tenth of the time."""
    whole = int(exponent)
    if whole != exponent or whole > 16:
        return base**exponent
    power = 1.0
    while whole > 0:
        if whole & 1:
            power *= base
        base *= base
        whole >>= 1
    return power
