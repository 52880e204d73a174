"""Requirements on impacts: error, cost relative to free ringing, and no gain of energy."""

import math
from collections.abc import Callable, Iterable, Iterator

import numpy as np

from underfoot.bench import rows
from underfoot.bench.accuracy import CONTACTS, DAMPING_S_M, HAMMER, blow, drawn_modes
from underfoot.bench.requirements.requirement import Requirement, Timing
from underfoot.bench.timing import Run
from underfoot.layouts import Memory
from underfoot.models.modal import hammer
from underfoot.models.modal.impact import Hammer, ModalObject, strike

RATE = 48_000
MASS_KG, VELOCITY_M_S = HAMMER
_ASKED = {"soft": 1e-5, "medium": 1e-5, "hard": 1e-3}
_ERROR_OF_100 = 2.1e-6
_BEST_NS = {(10, "soft"): 9.5, (10, "medium"): 3.6, (10, "hard"): 4.8, (100, "medium"): 17.5}
"""Best times seen in ns per sample, for a number of modes with a blow every 0.1 s at a contact."""
_BEST_FREE_NS, _BEST_LASTING_NS = {10: 2.3, 100: 10.0}, 37.0
"""The same for free ringing, by modes, and for a hammer of 100 N resting on 10 modes."""
_PASS = 32


def requirements(quick: bool) -> Iterable[Requirement]:
    """Yield errors at 10 modes, the rigid wall, energy, and a standing load."""
    yield from errors(0.02 if quick else 0.05)
    yield from rigid_wall()
    yield from energy(2_000 if quick else 100_000)
    yield from standing()


def errors(seconds: float) -> Iterator[Requirement]:
    """Yield the relative L2 error of the displacement in `seconds` after a blow, for each contact, against a solver."""
    for name, asked in _ASKED.items():
        task = blow(name, round(seconds * RATE))
        found = task.error(task.methods[0].run(asked), asked)
        yield Requirement("impacts", f"error of the displacement, {name}, 10 modes", found, high=asked)


def timings() -> Iterator[Timing]:
    """Yield the cost of a sample: with 10 blows a second, ringing freely, and with a resting hammer."""
    for (count, name), best_ns in _BEST_NS.items():
        second = _second_of(count, CONTACTS[name], _ASKED[name] if count == 10 else _ERROR_OF_100, 10)
        yield _a_sample(f"10 blows a second, {count} modes, {name}", second, best_ns)
    for count, best_ns in _BEST_FREE_NS.items():
        second = _second_of(count, CONTACTS["medium"], _ASKED["medium"], 0)
        yield _a_sample(f"ringing freely, {count} modes", second, best_ns)
    second = _second_of(10, CONTACTS["medium"], _ASKED["medium"], 0, load_n=100.0)
    yield _a_sample("a hammer that stays, 10 modes", second, _BEST_LASTING_NS)


def _a_sample(what: str, second: Callable[[], None], best_ns: float) -> Timing:
    return Timing("impacts", what, Run(second), "ns a sample", 1e9 / RATE, best_ns)


def _second_of(
    count: int, contact: tuple[float, float], error: float, blows: int, load_n: float = 0.0
) -> Callable[[], None]:
    """Return a function that runs one second with this many blows, 0.1 s apart; with none, after an earlier blow."""
    stiffness, exponent = contact
    throws = [(k * RATE // 10, VELOCITY_M_S) for k in range(1 + blows)]
    numbers = {"mass": MASS_KG, "stiffness": stiffness, "exponent": exponent, "damping": DAMPING_S_M}
    row = rows.hit(drawn_modes(count), RATE, throws, **numbers, load=load_n, error=error)
    before, blocks = RATE // 10 // rows.BLOCK, RATE // rows.BLOCK
    rows.ringing(row, 0, before)()
    state = row.state.values
    begun = state.copy()
    run = rows.ringing(row, before, blocks)

    def second() -> None:
        state[:] = begun
        run()

    return second


def rigid_wall() -> Iterator[Requirement]:
    """Test the rebound speed from a mass that does not yield: mu v - ln(1 + mu v) = -mu w - ln(1 - mu w)."""
    from scipy.optimize import brentq

    wall = ModalObject([1.0], [0.0], [1e12], [1.0])
    lost = DAMPING_S_M * VELOCITY_M_S - math.log1p(DAMPING_S_M * VELOCITY_M_S)
    exact = brentq(lambda w: -DAMPING_S_M * w - math.log1p(-DAMPING_S_M * w) - lost, 0.0, 3.0, xtol=1e-15)
    hit = strike(Hammer(MASS_KG, VELOCITY_M_S, 1e7, 1.5, DAMPING_S_M), wall, 0.02, RATE, 1e-9)
    out = hit.force_n.sum() / RATE / MASS_KG - VELOCITY_M_S
    yield Requirement("impacts", "speed off a rigid wall against the closed form", abs(out / exact - 1.0), high=1e-7)


def energy(sets: int) -> Iterator[Requirement]:
    """Test random hammers on random objects: the largest gain of energy relative to the blow's, and the least force."""
    draw = np.random.default_rng(1)
    gained, least = -math.inf, math.inf
    for _ in range(sets):
        count, rate = int(100.0 ** draw.uniform()), 10.0 ** draw.uniform(math.log10(8e3), math.log10(192e3))
        modes = ModalObject(
            10.0 ** draw.uniform(0.0, math.log10(0.9 * rate), count),
            np.zeros(count) if draw.uniform() < 0.3 else draw.uniform(0.0, 1_000.0, count),
            10.0 ** draw.uniform(-4.0, 2.0, count),
            draw.uniform(0.01, 1.0, count),
        )
        mass, stiffness, exponent = 10.0 ** draw.uniform(-4.0, 1.0), 10.0 ** draw.uniform(3.0, 13.0), draw.uniform(1, 4)
        damping = 0.0 if draw.uniform() < 0.3 else 10.0 ** draw.uniform(-3.0, 1.5)
        numbers = {"mass": mass, "stiffness": stiffness, "exponent": exponent, "damping": damping, "error": 1e-3}
        numbers["substeps"] = float(draw.choice([0, 1, 2, 7]))
        row = rows.hit(modes, rate, [(0.0, 10.0 ** draw.uniform(-2.0, 1.0))], **numbers)
        gain, force = _strike_energies(row, modes)
        gained, least = max(gained, gain), min(least, force)
    yield Requirement("impacts", f"largest gain of energy in {sets} random sets", gained, "of the blow's", high=1e-11)
    yield Requirement("impacts", f"least force in {sets} random sets", least, "N", low=0.0)


def _strike_energies(row: Memory, modes: ModalObject) -> tuple[float, float]:
    """Return the largest rise of energy between two evaluations, relative to the blow's, and the least force."""
    force, acceleration = np.empty((2, _PASS))
    out, strikes = hammer.Response(force, acceleration, force[:0]), row.events
    first = last = 0.5 * row.hammer.mass * strikes.strength[0] ** 2
    gain, least = -math.inf, math.inf
    for part in range(6):
        hammer.ring(strikes, row.hammer, _PASS * part, row.object, row.state, out)
        strikes.count = 0.0
        least = min(least, float(force.min()))
        if row.state.in_contact or part % 2:  # otherwise it is within a block, where its phasors are those of the end
            now = energy_of(row.state, modes)
            gain, last = max(gain, (now - last) / first), now
    return gain, least


def energy_of(state: Memory, modes: ModalObject) -> float:
    """Return the energy (J) of hammer, contact and object from a row's memory: its outputs do not contain all of it."""
    frequencies, decays, masses, shapes = (np.asarray(values, np.float64) for values in modes)
    touching = state.in_contact != 0.0
    phasor = state.z if touching else state.end
    x, y = phasor.re[: frequencies.size], phasor.im[: frequencies.size]
    angular = 2.0 * np.pi * frequencies
    q, v = y / shapes, (angular * x - decays * y) / shapes
    exponent, depth = state.contact.exponent, max(state.penetration, 0.0)
    contact = state.contact.stiffness * depth ** (exponent + 1.0) / (exponent + 1.0) if touching else 0.0
    moving = 0.5 * state.mass * state.speed**2
    return float(moving + contact + 0.5 * (masses * (v**2 + (angular**2 + decays**2) * q**2)).sum())


def standing() -> Iterator[Requirement]:
    """Yield how far the contact force is from a load of 300 N that has stood for 4 s, as a share of it."""
    modes = ModalObject([80.0, 300.0], [30.0, 60.0], [0.5, 0.2], [1.0, 0.7])
    hit = strike(Hammer(2.0, 0.3, 1e5, 1.5, 2.0, load_n=300.0), modes, 4.0, 8_000.0, 1e-6)
    apart = float(np.abs(hit.force_n[-800:] / 300.0 - 1.0).max())
    yield Requirement("impacts", "a standing load of 300 N is off after 4 s by", apart, high=1e-9)
