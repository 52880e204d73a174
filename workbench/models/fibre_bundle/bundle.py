"""Fibre bundle: fibres that break, or force chains that restructure, at random thresholds.

The bundle moves by (7.1), `sigma = A (b_F x' + k_F x) + N (b_R x' + m x'')`; A is the number of intact fibres, or
the stiffness of the restructured chains. A fibre fails when the strain x exceeds its threshold; `damage` draws the
failures.

Between failures the motion is exact for a load that is linear between frames. Failures take effect at the end of their
frame, half a frame late on average. The mean models take the damage at the predicted midpoint of four frames: second
order where frames resolve the motion, first order otherwise.

When the load has not been above 0 for the renewal time, the bundle is renewed: the next load acts on intact fibres with
new draws. Until then the damage stays, and no fibre fails below the largest strain so far (the Kaiser effect). A fully
broken bundle carries nothing, and (7.1) lets it fall without end; in real time its strain is held instead until the
renewal.

In scripts: `FibreBundle(2000).response(stress, rate_hz)`. In real time: `run` for one tile, `tail`, and
`damage.design`.
"""

import math
from typing import NamedTuple

import numpy as np
from msgspec import Struct
from numpy.typing import ArrayLike, NDArray

from underfoot.arguments import HUGE, TINY, choice, integer, number, numbers, seed_of
from underfoot.drawing import Drawing, series
from underfoot.drawing.picture import Picture
from underfoot.errors import require
from underfoot.kernels import Floats, inlined, kernel
from underfoot.layouts import Layout, Memory
from underfoot.models.driven_oscillator import crossing
from underfoot.models.fibre_bundle.damage import (
    AT_REST,
    COEFFICIENTS,
    DRAWS,
    MODELS,
    NO_THRESHOLD,
    PARAMETERS,
    REST_INTERVAL,
    THRESHOLDS,
    bundle_step,
    critical_load,
    design,
    energy_released,
    fail,
    first_hazard,
    has_mean_damage,
    stiffness_left,
    strength_of,
    threshold_strain,
)
from underfoot.models.signals.events import append, event_list
from underfoot.models.signals.random import stream_key

STATE = Layout(
    "bundle",
    *("strain", "speed", "load", "failed", "next_hazard", "worn", "peak", "wearing", "former", "designed", "breaking"),
    step=8,
)
"""Zeros are an intact bundle at rest. `worn` is 0 for an intact bundle, else 1 plus the frames since the last load;
`former` is the strain a frame ago. The strain of the next failure, `breaking`, and the coefficients of the motion,
`step`, are those of the design with number `designed`."""


class Fracture(Struct, frozen=True):
    """Response of a bundle: one value per frame, shape [frames], and the times of its events."""

    strain: NDArray[np.float64]
    """Strain x at each frame."""
    failures: NDArray[np.int64]
    """Failed fibres in each frame; restructured chains, for an inverse bundle."""
    energy: NDArray[np.float64]
    """Energy released in each frame: k_F x^2 / 2 per failure (docs/models.md#fibre-bundles)."""
    threshold: NDArray[np.float64]
    """Strain at which the next fibre fails, xi(t) of Fig. 7.5; infinite if none is left or drawn."""
    event_s: NDArray[np.float64]
    """Times in seconds of the first failure in each frame with failures, resolved within the frame."""

    def __repr__(self) -> str:
        return f"<Fracture: {self.failures.sum()} failures in {self.event_s.size} of {self.strain.size} frames>"

    def plot(self) -> Picture:
        """Return a picture of strain and failures over time."""
        frame = np.arange(self.strain.size)
        strain = Drawing("Strain", "frame", "strain", (series("", frame, self.strain, colour="force"),))
        failed = np.flatnonzero(self.failures)
        stems = series("", failed, self.failures[failed], "stems", "events")
        return Picture((strain, Drawing("Failures", "frame", "fibres", (stems,), x_range=(0.0, float(frame.size)))))


class FibreBundle(Struct, frozen=True):
    """Bundle of `fibres` fibres (7.1). Raises `BadValue` for values out of range.

    `stiffness` k_F, `mass` m, `damping` b_F and `creep` b_R are per fibre. `thresholds` are "weibull", with `shape` k
    and `scale` lambda (7.13), or "uniform" from 0 to `scale`. `model` is

    - "exact": a failed fibre is gone (7.1 to 7.7);
    - "mean": the damage is its mean at the largest strain so far (7.8 to 7.10), the failures a Poisson process
      (docs/models.md#fibre-bundles);
    - "inverse": a failed chain is stiffer by the share `stiffening`, at most `restructurings` times (7.16 to
      7.20); `compound` takes (7.18), averaged over the chains, instead of its linear form (7.19);
    - "inverse_mean": the same with mean damage (7.21 to 7.24).

    The bundle is renewed after `renewal_s` seconds without load. A mass or damping too small for frames to resolve is
    raised so that the motion settles within a frame.

    >>> FibreBundle(2000).critical_stress, FibreBundle(2000, thresholds="uniform").critical_stress
    (2753.4765..., 1250.0)
    """

    fibres: int
    shape: float = 4.0
    scale: float = 2.5
    stiffness: float = 1.0
    mass: float = 1e-3
    damping: float = 0.0065
    creep: float = 0.0
    model: str = "exact"
    thresholds: str = "weibull"
    restructurings: int = 20
    stiffening: float = 0.005
    compound: bool = False
    renewal_s: float = math.inf

    def __post_init__(self) -> None:
        integer("fibres", self.fibres, 1, 10**12, "1 to 1e12")
        number("shape", self.shape, 0.1, 50.0, "0.1 to 50")
        number("scale", self.scale, TINY, HUGE, "above 0")
        number("stiffness", self.stiffness, TINY, HUGE, "above 0")
        for name in ("mass", "damping", "creep"):
            number(name, getattr(self, name), 0.0, HUGE, "0 or more")
        choice("model", self.model, MODELS)
        choice("thresholds", self.thresholds, THRESHOLDS)
        integer("restructurings", self.restructurings, 1, 10_000, "1 to 10000")
        number("stiffening", self.stiffening, 0.0, 10.0, "0 to 10")
        require(isinstance(self.compound, bool), "compound", self.compound, "True or False")
        number("renewal_s", self.renewal_s, TINY, math.inf, "above 0 s")

    @property
    def critical_stress(self) -> float:
        """Quasi-static critical stress of a large bundle: the maximum of N (1 - P(x)) k_F x."""
        code = float(THRESHOLDS.index(self.thresholds))
        return float(critical_load(code, float(self.fibres), self.shape, self.scale, self.stiffness))

    def response(self, stress: ArrayLike, rate_hz: float, seed: int = 0) -> Fracture:
        """Return the response to the total load `stress` of (7.1), one value per frame at `rate_hz`.

        The load is linear between frames and 0 before the first.

        >>> ramp = np.linspace(0.0, 2000.0, 4800)  # below the critical stress of 2753.5
        >>> result = FibreBundle(2000, mass=0.0, damping=0.0).response(ramp, 48000.0)
        >>> round(result.strain[-1], 2), bool(30 < result.failures.sum() < 90)  # 2000 P(x) = 57
        (np.float64(1.02), True)
        """
        load = numbers("stress", stress)
        coefficients, state = COEFFICIENTS.zeros(), STATE.zeros()
        self.design(rate_hz, 1.0, coefficients)
        strain, damage, energy, failures, threshold = np.zeros((5, load.size))
        events = event_list(room=load.size)
        key, motion = stream_key(seed_of(seed), "fracture"), Motion(strain, damage, energy, failures, threshold)
        run(load, key, 0, coefficients, state, motion, events)
        return Fracture(strain, failures.astype(np.int64), energy, threshold, events.time[: len(events)] / rate_hz)

    def design(self, rate_hz: float, pressure: float, coefficients: Memory) -> None:
        """Compute the coefficients at `rate_hz`; `pressure` is the stress of (7.1) per unit of load."""
        number("rate_hz", rate_hz, TINY, HUGE, "above 0 Hz")
        p = PARAMETERS.zeros()
        p.thresholds, p.fibres = THRESHOLDS.index(self.thresholds), self.fibres
        p.shape, p.scale, p.stiffness = self.shape, self.scale, self.stiffness
        p.mass, p.damping, p.creep = self.mass, self.damping, self.creep
        p.restructurings, p.stiffening, p.renewal = self.restructurings, self.stiffening, self.renewal_s
        p.loudness = p.softness = 1.0
        design(p, float(MODELS.index(self.model)), pressure, float(rate_hz), coefficients)
        coefficients.compound = float(self.compound)


class Motion(NamedTuple):
    """Output of a run [frames]: strain, the share of failed fibres (7.15), and the energy released in each frame.

    `failures` and `threshold` are not written if they are empty.
    """

    strain: Floats
    damage: Floats
    energy: Floats
    failures: Floats
    threshold: Floats


_AHEAD = 8
"""Number of frames that are moved at once where nothing happens."""

_WEAR_FRAMES = 4.0
"""Mean damage is updated, by the midpoint rule, each time the strain has advanced as far as in this many frames."""


@kernel
def tail(state: Memory, coefficients: Memory) -> float:
    """Return a bound of |strain| without further load; infinite while a worn bundle waits for its renewal."""
    if state.worn > 0.0:
        return math.inf
    return math.sqrt(state.strain**2 + state.speed**2 / coefficients.kappa)


@kernel
def run(
    load: Floats,
    key: np.uint64,
    frame: int,
    coefficients: Memory,
    state: Memory,
    motion: Motion,
    events: Memory,
) -> None:
    """Run one tile, `load.size` frames from session frame `frame` on: `load` [frames] in, `motion` out.

    Failures are appended to `events`. `key` is the row's `stream_key(seed, node, tile)`; draws are numbered by frame,
    so that they do not depend on splits or sleep. `load` holds the value at the end of each frame; failures lie within
    it.
    """
    c, s, n = coefficients, state, load.size
    if s.designed != c.designs:
        s.breaking = threshold_strain(c, s.next_hazard) if s.worn > 0.0 else math.inf
        _set_step(c, s)
        s.designed = c.designs
    if not has_mean_damage(c) or s.worn == 0.0:
        s.wearing = math.inf
    i = 0
    while i < n:
        first, is_loaded = i, _stress(c, load[i]) > 0.0
        end = i + _begin(c, s, is_loaded, n - i, key, frame + i)
        i = _move(load, first, end, is_loaded, c, s, motion.strain)
        motion.damage[first:i] = s.failed / c.pool
        motion.energy[first:i] = 0.0
        failed, before = 0.0, s.breaking
        if s.strain > s.breaking:
            failed = _fail(c, s, key, frame + i - 1, events)
            motion.energy[i - 1], motion.damage[i - 1] = energy_released(c, failed, s.strain), s.failed / c.pool
        if motion.threshold.size:
            motion.threshold[first:i] = before
            motion.failures[i - 1], motion.threshold[i - 1] = failed, s.breaking
    s.breaking = min(s.breaking, NO_THRESHOLD)  # as finite as all states
    if not has_mean_damage(c) or s.worn == 0.0:
        s.wearing = 0.0


@kernel
def _begin(c: Memory, s: Memory, is_loaded: bool, most: int, key: np.uint64, frame: int) -> int:
    """Prepare a stretch that begins with a load or without; return its length, up to `most` frames.

    A load draws the thresholds of an intact bundle. Without load, a stretch ends before the frame that renews it, and
    where a bundle that hardly moves comes to rest.
    """
    if is_loaded:
        if s.worn == 0.0:
            s.next_hazard = first_hazard(c, key, frame * DRAWS, s.strain)
            s.breaking = threshold_strain(c, s.next_hazard)
            s.wearing = 0.0 if has_mean_damage(c) else math.inf
        s.worn = 1.0
    elif s.worn > 0.0:
        most = min(most, REST_INTERVAL - frame % REST_INTERVAL)
        if frame % REST_INTERVAL == 0 and abs(s.strain) < AT_REST and abs(s.speed) < AT_REST:
            s.strain = s.speed = 0.0
        if s.worn + 1.0 > c.renewal:
            s.worn = s.failed = s.next_hazard = s.peak = 0.0
            s.breaking = s.wearing = math.inf
            _set_step(c, s)
        elif c.renewal - s.worn < most:
            most = int(c.renewal - s.worn)
    if s.strain + 0.5 * s.speed > s.wearing:
        ahead = _WEAR_FRAMES * max(s.speed, 0.0)
        s.peak, s.wearing = s.strain + 0.5 * ahead, s.strain + ahead
        _set_step(c, s)
    return most


@inlined
def _move(load: Floats, first: int, end: int, is_loaded: bool, c: Memory, s: Memory, strain: Floats) -> int:
    """Move from frame `first` on, at most to `end`; return the frame reached.

    Ends before the load begins or ends, before mean damage is due, and after a frame in which a threshold is passed.
    """
    i = first
    while i + _AHEAD <= end and _moved(load[i : i + _AHEAD], is_loaded, False, c, s, strain[i : i + _AHEAD]):
        i += _AHEAD
    while i < end and _moved(load[i : i + 1], is_loaded, True, c, s, strain[i : i + 1]):
        i += 1
        if s.strain > s.breaking:
            break
    if not is_loaded and s.worn > 0.0:
        s.worn += i - first
    return i


@kernel
def _moved(load: Floats, is_loaded: bool, may_pass: bool, c: Memory, s: Memory, strain: Floats) -> bool:
    """Move by all frames of `load`, unless something ends the stretch in them; return whether it has moved.

    Only behind them it is tested whether anything does: a test of each frame would take twice as long as the motion. A
    threshold ends the stretch unless it `may_pass`, in the last frame.
    """
    step = s.step
    c0, c1, c2, c3, c4, c5, c6, c7 = step[0], step[1], step[2], step[3], step[4], step[5], step[6], step[7]
    x, w, before, former = s.strain, s.speed, s.load, s.strain
    largest, ahead, least, most = -math.inf, -math.inf, math.inf, -math.inf
    for i in range(load.size):
        stress = _stress(c, load[i])
        least, most, ahead = min(least, stress), max(most, stress), max(ahead, x + 0.5 * w)
        former = x
        x = c0 * former + (c1 * w + (c2 * before + c3 * stress))
        w = c5 * w + (c4 * former + (c6 * before + c7 * stress))
        before, strain[i] = stress, x
        largest = max(largest, x)
    loaded_throughout = least > 0.0 if is_loaded else most <= 0.0
    if not loaded_throughout or ahead > s.wearing or (largest > s.breaking and not may_pass):
        return False
    s.former, s.strain, s.speed, s.load = former, x, w, before
    return True


@kernel
def _fail(c: Memory, s: Memory, key: np.uint64, frame: int, events: Memory) -> float:
    """Fail what the strain of this frame has broken, and append the event; return the number of failures."""
    failed, s.next_hazard = fail(c, key, frame * DRAWS, s.next_hazard, s.strain, s.failed)
    s.failed += failed
    append(events, frame + crossing(s.former, s.strain, s.breaking), strength_of(c, failed, s.strain))
    s.breaking = threshold_strain(c, s.next_hazard)
    if not has_mean_damage(c):
        _set_step(c, s)
    return failed


@kernel
def _set_step(c: Memory, s: Memory) -> None:
    """Set the coefficients of the motion, from the fibres that are left."""
    step = bundle_step(c, stiffness_left(c, s.failed, s.peak))
    for k in range(8):
        s.step[k] = step[k]


@inlined
def _stress(c: Memory, load: float) -> float:
    """Return the stress of a load, limited to what keeps all numbers finite."""
    return min(max(c.pressure * load, -c.limit), c.limit)
