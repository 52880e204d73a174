"""The damage of one bundle: the law of its thresholds, what fails when the strain passes them, what stiffness is left.

Thresholds are handled in the hazard y = -ln(1 - P(x)), in which the least of n thresholds lies Exp/n above the
last (errata 7.15). When the strain has passed it within a frame, all that fail with it are drawn at once, `1 +
Binomial(n - 1, 1 - exp(y - y_x))`: exact, at a cost that does not grow with their number. With mean damage the
failures are a Poisson process of intensity N p(x) dx instead (errata 7.10).
"""

import math

from underfoot.kernels import kernel
from underfoot.models.driven_oscillator import frame_step, resolved
from underfoot.models.fibre_bundle.counts import binomial, poisson
from underfoot.models.signals.random import exponential

#: Models of damage: the position of each is its code.
MODELS = ("exact", "mean", "inverse", "inverse_mean")
EXACT, MEAN, INVERSE, INVERSE_MEAN = range(4)

#: Laws of the thresholds: the position of each is its code.
THRESHOLDS = ("weibull", "uniform")
WEIBULL, UNIFORM = range(2)

# The tuning. KAPPA, GAMMA, CREEP and GAIN are k_F, b_F, b_R and 1 over the mass, with time in frames.
MODEL, LAW, FIBRES, POOL, SHAPE, PER_SHAPE, SCALE, STIFFNESS, KAPPA, GAMMA, CREEP, GAIN = range(12)
MAXIMUM, STIFFENING, COMPOUND, PRESSURE, LIMIT, RENEWAL, STRENGTH, EXPONENT, HELD = range(12, 21)
TUNING_SIZE = 21

#: No bundle gets stiffer than this times its first stiffness.
_STIFFEST = 1e6

#: Draws that one frame may use: the counter of a draw is its frame times this, plus its number.
DRAWS = 64
_FIRST, _FOLLOWING, _BATCH = range(3)


@kernel
def tune(t, rate_hz, model, law, fibres, shape, scale, stiffness, mass, damping, creep):
    """Fill the tuning `t` [21] of a bundle; `tune_inverse` and `tune_contact` follow.

    `model` and `law` are codes, `fibres` a count, `shape` k and `scale` lambda the thresholds' law (7.13), the
    rest k_F, m, b_F and b_R of (7.1), per fibre. A mass or damping so small that no frame could show it is raised
    to what settles within a frame. May be called at any time: a change acts from the next call of the bundle's
    `run` on.
    """
    frame_s = 1.0 / rate_hz
    mass, damping = resolved(frame_s, stiffness, damping, creep, mass)
    t[MODEL] = model
    t[LAW] = law
    t[FIBRES] = fibres
    t[POOL] = fibres
    t[SHAPE] = shape
    t[PER_SHAPE] = 1.0 / shape
    t[SCALE] = scale
    t[STIFFNESS] = stiffness
    t[KAPPA] = stiffness * frame_s * frame_s / mass
    t[GAMMA] = damping * frame_s / mass
    t[CREEP] = creep * frame_s / mass
    t[GAIN] = frame_s * frame_s / mass


@kernel
def tune_inverse(t, restructurings, stiffening, compound):
    """After `tune`: how often a chain restructures, by what share it stiffens, and whether that compounds (7.18)."""
    t[MAXIMUM] = restructurings
    t[STIFFENING] = stiffening
    t[COMPOUND] = compound
    if t[MODEL] >= INVERSE:
        t[POOL] = t[FIBRES] * restructurings


@kernel
def tune_contact(t, rate_hz, pressure, renewal_s, strength, exponent, held):
    """After `tune`: how the bundle meets its load and its listeners.

    `pressure` is the stress of (7.1) for one unit of load; `renewal_s` the time without load to fresh ground. An
    event's strength is `strength` (E / E1)^`exponent`, with E1 = k_F lambda^2 / 2; the exponent 1/2 gives an
    impact's velocity, 1 its energy. With `held` the strain of a wholly broken bundle is kept; without, (7.1) lets
    it fall.
    """
    t[PRESSURE] = pressure / t[FIBRES]
    t[LIMIT] = 1e9 * t[STIFFNESS] * t[SCALE]
    t[RENEWAL] = renewal_s * rate_hz
    t[STRENGTH] = strength * (0.5 * t[STIFFNESS] * t[SCALE] ** 2) ** -exponent
    t[EXPONENT] = exponent
    t[HELD] = held


@kernel
def hazard(t, x):
    """-ln(1 - P(x)) of the strain `x`: infinite from the largest uniform threshold on."""
    ratio = x / t[SCALE]
    if ratio <= 0.0:
        return 0.0
    if t[LAW] == WEIBULL:
        return _power(ratio, t[SHAPE])
    return -math.log1p(-ratio) if ratio < 1.0 else math.inf


@kernel
def threshold_strain(t, y):
    """The strain whose hazard is `y`; infinite where no threshold is left."""
    if y == math.inf:
        return math.inf
    if t[LAW] == WEIBULL:
        return t[SCALE] * y ** t[PER_SHAPE]
    return -t[SCALE] * math.expm1(-y)


@kernel
def first_hazard(t, key, counter, x):
    """The hazard of a fresh bundle's least threshold; none lies below the strain `x` in which the ground formed."""
    return hazard(t, x) + exponential(key, counter + _FIRST) / t[POOL]


@kernel
def fail(t, key, counter, y, x, failed):
    """How many fail when the strain `x` has passed the threshold of hazard `y`, and the hazard of the one after."""
    passed = hazard(t, x)
    wait = exponential(key, counter + _FOLLOWING)
    if t[MODEL] == EXACT or t[MODEL] == INVERSE:
        others = t[POOL] - failed - 1.0
        count = binomial(key, counter + _BATCH, others, -math.expm1(y - passed))
        others -= count
        return 1.0 + count, (passed + wait / others if others > 0.0 else math.inf)
    left = math.exp(-passed)
    count = poisson(key, counter + _BATCH, t[POOL] * (math.exp(-y) - left))
    left -= wait / t[POOL]
    return 1.0 + count, (-math.log(left) if left > 0.0 else math.inf)


@kernel
def stiffness_left(t, failed, peak):
    """A / N after `failed` failures or, with mean damage, after the strain `peak`; 0 once the bundle is broken."""
    model = t[MODEL]
    if model == EXACT:
        return 1.0 - failed / t[FIBRES]
    if model == MEAN:
        left = math.exp(-hazard(t, peak))
        return 0.0 if t[HELD] != 0.0 and left * t[FIBRES] < 0.5 else left
    share = failed / t[POOL] if model == INVERSE else -math.expm1(-hazard(t, peak))
    if t[COMPOUND] != 0.0:
        return min((1.0 + t[STIFFENING] * share) ** t[MAXIMUM], _STIFFEST)
    return 1.0 + t[STIFFENING] * t[MAXIMUM] * share


@kernel
def bundle_step(t, left):
    """The coefficients of one frame's motion (`frame_step`) for the stiffness `left`."""
    if left <= 0.0 and t[HELD] != 0.0:
        return 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    return frame_step(left * t[KAPPA], left * t[GAMMA] + t[CREEP], t[GAIN])


@kernel
def energy_released(t, failed, x):
    """k_F x^2 / 2 for each failure at the strain `x` (errata, chapter 7)."""
    return failed * 0.5 * t[STIFFNESS] * x * x


@kernel
def event_strength(t, energy):
    """The strength that an event of `energy` has, as `tune_contact` says."""
    if t[EXPONENT] == 0.5:
        return t[STRENGTH] * math.sqrt(energy)
    return t[STRENGTH] * energy ** t[EXPONENT]


@kernel
def crossing(start, end, level):
    """Where, as a share of a frame below 1, a strain that goes from `start` to `end` passes `level`."""
    return min(max((level - start) / (end - start), 0.0), 0.999)


@kernel
def _power(base, exponent):
    """`base ** exponent`; for small whole exponents by products, which take a tenth of the time."""
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
