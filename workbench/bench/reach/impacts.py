"""The reach of impacts: error, cost beside free ringing, and energy that is never made."""

import math
from collections.abc import Iterable, Iterator

import numpy as np

from underfoot.bench import naive, rows
from underfoot.bench.reach.row import Reach
from underfoot.bench.timing import Timed, timed
from underfoot.layouts import Memory
from underfoot.models.modal import hammer
from underfoot.models.modal.impact import Hammer, ModalObject, strike

RATE = 48_000
MASS_KG, VELOCITY_M_S, DAMPING_S_M = 0.02, 1.0, 0.3
"""The hammer of all figures here."""
CONTACTS = (("soft", 1e4, 1.5), ("medium", 1e7, 1.5), ("hard", 1e11, 1.8))
"""Name, stiffness in N/m^a and exponent a."""
_ASKED = {"soft": 1e-5, "medium": 1e-5, "hard": 1e-3}
_BEST_NS = {10: (25.0, 23.0), 100: (199.0, 91.0)}
"""The best times to meet, ns a sample at the medium contact for so many modes: a blow each 0.1 s, and free ringing."""
_ERROR_THERE = {10: 1e-5, 100: 2.1e-6}
_PASS = 32


def drawn_modes(count: int) -> ModalObject:
    """Frequencies, decays, masses and shapes of the struck object, slow decays first.

    >>> frequencies, decays, masses, shapes = drawn_modes(10)
    >>> bool((np.diff(decays) > 0.0).all()), frequencies.size
    (True, 10)
    """
    draw = np.random.default_rng(3)
    frequencies = np.sort(draw.uniform(50.0, 5_000.0 if count <= 10 else 15_000.0, count))
    decays = draw.uniform(5.0, 80.0, count)
    masses, shapes = 0.1 * draw.uniform(0.3, 2.0, count), draw.uniform(0.3, 1.0, count)
    order = np.argsort(decays)
    return ModalObject(frequencies[order], decays[order], masses[order], shapes[order])


def reaches(quick: bool) -> Iterable[Reach]:
    """Errors and costs at 10 and 100 modes, the rigid wall, energy, and a standing load."""
    yield from errors(0.02 if quick else 0.05)
    yield from _costs()
    yield from rigid_wall()
    yield from energy(2_000 if quick else 100_000)
    yield from standing()


def errors(seconds: float) -> Iterator[Reach]:
    times = np.arange(round(seconds * RATE)) / RATE
    for name, stiffness, exponent in CONTACTS:
        by = Hammer(MASS_KG, VELOCITY_M_S, stiffness, exponent, DAMPING_S_M)
        truth = naive.struck_object(by, drawn_modes(10), times, "DOP853", 1e-11, 0.25 / RATE)
        found = strike(by, drawn_modes(10), seconds, RATE, _ASKED[name]).displacement_m
        apart = float(np.linalg.norm(found - truth) / np.linalg.norm(truth))
        yield Reach("impacts", f"error of the displacement, {name}, 10 modes", apart, high=_ASKED[name])


def _costs() -> Iterator[Reach]:
    for name, stiffness, exponent in CONTACTS:
        struck, free = (_second_of(10, stiffness, exponent, _ASKED[name], blows) for blows in (10, 0))
        ratio = struck.seconds / struck.slowness / (free.seconds / free.slowness)
        # Times are asked at the medium contact. A soft one lasts 17 ms, each frame of which is one of contact.
        asked = 2.0 if name == "medium" else math.inf
        yield Reach("impacts", f"cost of 10 blows a second over free, {name}", ratio, "times", high=asked)
        most = 2.0 * _BEST_NS[10][1] * struck.slowness
        found = struck.seconds / RATE * 1e9
        yield Reach(
            "impacts", f"10 blows a second, twice the best free ringing, {name}", found, "ns a sample", high=most
        )
    for count, best in _BEST_NS.items():
        for blows, ns, what in zip((10, 0), best, ("10 blows a second", "free ringing"), strict=True):
            took = _second_of(count, 1e7, 1.5, _ERROR_THERE[count], blows)
            most = 1.5 * ns * took.slowness
            yield Reach(
                "impacts", f"{what}, {count} modes, medium", took.seconds / RATE * 1e9, "ns a sample", high=most
            )


def _second_of(count: int, stiffness: float, exponent: float, error: float, blows: int) -> Timed:
    """The time of a second with so many blows, 0.1 s apart; with none, of ringing from one before."""
    throws = [(k * RATE // 10, VELOCITY_M_S) for k in range(1 + blows)]
    numbers = {"mass": MASS_KG, "stiffness": stiffness, "exponent": exponent, "damping": DAMPING_S_M, "error": error}
    row = rows.hit(drawn_modes(count), RATE, throws, **numbers)
    before, blocks = RATE // 10 // rows.BLOCK, RATE // rows.BLOCK
    rows.ringing(row, 0, before)()
    state = row.state.values
    begun = state.copy()
    run = rows.ringing(row, before, blocks)

    def second() -> None:
        state[:] = begun
        run()

    return timed(second, 0.3, 200)


def rigid_wall() -> Iterator[Reach]:
    """The speed out of a blow on a mass that does not give way: mu v - ln(1 + mu v) = -mu w - ln(1 - mu w)."""
    from scipy.optimize import brentq

    wall = ModalObject([1.0], [0.0], [1e12], [1.0])
    lost = DAMPING_S_M * VELOCITY_M_S - math.log1p(DAMPING_S_M * VELOCITY_M_S)
    exact = brentq(lambda w: -DAMPING_S_M * w - math.log1p(-DAMPING_S_M * w) - lost, 0.0, 3.0, xtol=1e-15)
    hit = strike(Hammer(MASS_KG, VELOCITY_M_S, 1e7, 1.5, DAMPING_S_M), wall, 0.02, RATE, 1e-9)
    out = hit.force_n.sum() / RATE / MASS_KG - VELOCITY_M_S
    yield Reach("impacts", "speed off a rigid wall against the closed form", abs(out / exact - 1.0), high=1e-7)


def energy(sets: int) -> Iterator[Reach]:
    """Random hammers on random objects: the largest gain of energy, of what the blow brought, and the least force."""
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
    yield Reach("impacts", f"largest gain of energy in {sets} random sets", gained, "of the blow's", high=1e-11)
    yield Reach("impacts", f"least force in {sets} random sets", least, "N", low=0.0)


def _strike_energies(row: Memory, modes: ModalObject) -> tuple[float, float]:
    """The largest rise of energy from one look to the next, of the blow's own, and the least force."""
    force, acceleration = np.empty((2, _PASS))
    out, strikes = hammer.Response(force, acceleration, force[:0]), row.events
    first = last = 0.5 * row.hammer.mass * strikes.strength[0] ** 2
    gain, least = -math.inf, math.inf
    for part in range(6):
        hammer.ring(strikes, row.hammer, _PASS * part, row.object, row.state, out)
        strikes.count = 0.0
        least = min(least, float(force.min()))
        if row.state.in_contact or part % 2:  # else it is within a block, where its phasors are those of the end
            now = _energy_of(row.state, modes)
            gain, last = max(gain, (now - last) / first), now
    return gain, least


def _energy_of(state: Memory, modes: ModalObject) -> float:
    """Energy (J) of hammer, contact and object, read from a row's memory: what it puts out does not tell all of it."""
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


def standing() -> Iterator[Reach]:
    modes = ModalObject([80.0, 300.0], [30.0, 60.0], [0.5, 0.2], [1.0, 0.7])
    hit = strike(Hammer(2.0, 0.3, 1e5, 1.5, 2.0, load_n=300.0), modes, 4.0, 8_000.0, 1e-6)
    apart = float(np.abs(hit.force_n[-800:] / 300.0 - 1.0).max())
    yield Reach("impacts", "a standing load of 300 N is off after 4 s by", apart, high=1e-9)
