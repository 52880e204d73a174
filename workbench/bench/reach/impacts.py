"""The reach of impacts: error, cost beside free ringing, and energy that is never made."""

import math
from collections.abc import Iterable, Iterator

import numpy as np
from numpy.typing import NDArray

from underfoot.bench import naive, rows
from underfoot.bench.reach.row import Reach
from underfoot.bench.timing import Timed, timed
from underfoot.memory import aligned_zeros
from underfoot.models.modal import contact_motion, impact
from underfoot.models.modal import hammer as impact_row

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


def drawn_modes(count: int) -> naive.Modes:
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
    return frequencies[order], decays[order], masses[order], shapes[order]


def reaches(quick: bool) -> Iterable[Reach]:
    """Errors and costs at 10 and 100 modes, the rigid wall, energy, and a standing load."""
    yield from _errors(0.02 if quick else 0.05)
    yield from _costs()
    yield from _rigid_wall()
    yield from _energy(2_000 if quick else 100_000)
    yield from _standing()


def _errors(seconds: float) -> Iterator[Reach]:
    times = np.arange(round(seconds * RATE)) / RATE
    for name, stiffness, exponent in CONTACTS:
        blow = (MASS_KG, VELOCITY_M_S, stiffness, exponent, DAMPING_S_M)
        truth = naive.struck_object(blow, drawn_modes(10), times, "DOP853", 1e-11, 0.25 / RATE)
        found = impact.blow(*blow, *drawn_modes(10), seconds, RATE, _ASKED[name]).displacement_m
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
    s, t = aligned_zeros(contact_motion.state_size(count)), aligned_zeros(contact_motion.tuning_size(count))
    impact_row.tune(t, *drawn_modes(count), float(RATE), 0.0)
    hammer = np.array([MASS_KG, stiffness, exponent, DAMPING_S_M, 0.0, error, 0.0])
    throws = np.array([(k * RATE // 10, VELOCITY_M_S, 0.0) for k in range(1 + blows)])
    before, blocks = RATE // 10 // rows.BLOCK, RATE // rows.BLOCK
    rows.hit(s, t, hammer, throws[:1].ravel(), 0, before)()
    ringing = s.copy()
    run = rows.hit(s, t, hammer, throws[1:].ravel(), before, blocks)

    def second():
        s[:] = ringing
        run()

    return timed(second, 0.3, 200)


def _rigid_wall() -> Iterator[Reach]:
    """The speed out of a blow on a mass that does not give way: mu v - ln(1 + mu v) = -mu w - ln(1 - mu w)."""
    from scipy.optimize import brentq

    wall = [1.0], [0.0], [1e12], [1.0]
    lost = DAMPING_S_M * VELOCITY_M_S - math.log1p(DAMPING_S_M * VELOCITY_M_S)
    exact = brentq(lambda w: -DAMPING_S_M * w - math.log1p(-DAMPING_S_M * w) - lost, 0.0, 3.0, xtol=1e-15)
    hit = impact.blow(MASS_KG, VELOCITY_M_S, 1e7, 1.5, DAMPING_S_M, *wall, 0.02, RATE, 1e-9)
    out = hit.force_n.sum() / RATE / MASS_KG - VELOCITY_M_S
    yield Reach("impacts", "speed off a rigid wall against the closed form", abs(out / exact - 1.0), high=1e-7)


def _energy(sets: int) -> Iterator[Reach]:
    """Random hammers on random objects: the largest gain of energy, of what the blow brought, and the least force."""
    draw = np.random.default_rng(1)
    gained, least = -math.inf, math.inf
    for _ in range(sets):
        count, rate = int(100.0 ** draw.uniform()), 10.0 ** draw.uniform(math.log10(8e3), math.log10(192e3))
        modes = (
            10.0 ** draw.uniform(0.0, math.log10(0.9 * rate), count),
            np.zeros(count) if draw.uniform() < 0.3 else draw.uniform(0.0, 1_000.0, count),
            10.0 ** draw.uniform(-4.0, 2.0, count),
            draw.uniform(0.01, 1.0, count),
        )
        mass, stiffness, exponent = 10.0 ** draw.uniform(-4.0, 1.0), 10.0 ** draw.uniform(3.0, 13.0), draw.uniform(1, 4)
        damping = 0.0 if draw.uniform() < 0.3 else 10.0 ** draw.uniform(-3.0, 1.5)
        hammer = np.array([mass, stiffness, exponent, damping, 0.0, 1e-3, float(draw.choice([0, 1, 2, 7]))])
        gain, force = _blow_energies(modes, hammer, 10.0 ** draw.uniform(-2.0, 1.0), rate)
        gained, least = max(gained, gain), min(least, force)
    yield Reach("impacts", f"largest gain of energy in {sets} random sets", gained, "of the blow's", high=1e-11)
    yield Reach("impacts", f"least force in {sets} random sets", least, "N", low=0.0)


def _blow_energies(
    modes: naive.Modes, hammer: NDArray[np.float64], velocity: float, rate: float
) -> tuple[float, float]:
    """The largest rise of energy from one look to the next, of the blow's own, and the least force."""
    s, t = np.zeros(contact_motion.state_size(modes[0].size)), np.zeros(contact_motion.tuning_size(modes[0].size))
    impact_row.tune(t, *modes, rate, 0.0)
    force, acceleration = np.empty((2, _PASS))
    first = last = 0.5 * hammer[0] * velocity**2
    gain, least = -math.inf, math.inf
    throw = np.array([0.0, velocity, 0.0])
    for part in range(6):
        impact_row.ring(s, t, hammer, throw, int(part == 0), force, acceleration, force[:0], _PASS * part, _PASS)
        least = min(least, float(force.min()))
        if (
            s[contact_motion.IN_CONTACT] or part % 2
        ):  # else the row is within a block, where its phasors are those of the end
            now = _energy_of(s, t, modes)
            gain, last = max(gain, (now - last) / first), now
    return gain, least


def _energy_of(s: NDArray[np.float64], t: NDArray[np.float64], modes: naive.Modes) -> float:
    """Energy (J) of hammer, contact and object, read from a row's memory: what it puts out does not tell all of it."""
    frequencies, decays, masses, shapes = modes
    touching = s[contact_motion.IN_CONTACT] != 0.0
    first = contact_motion.Z if touching else contact_motion.END
    x, y = contact_motion.rows_of(s, t)[first : first + 2, : frequencies.size]
    angular = 2.0 * np.pi * frequencies
    q, v = y / shapes, (angular * x - decays * y) / shapes
    stiffness, exponent, way = s[contact_motion.STIFFNESS], s[contact_motion.EXPONENT], max(s[contact_motion.WAY], 0.0)
    contact = stiffness * way ** (exponent + 1.0) / (exponent + 1.0) if touching else 0.0
    moving = 0.5 * s[contact_motion.MASS] * s[contact_motion.SPEED] ** 2
    return float(moving + contact + 0.5 * (masses * (v**2 + (angular**2 + decays**2) * q**2)).sum())


def _standing() -> Iterator[Reach]:
    modes = [80.0, 300.0], [30.0, 60.0], [0.5, 0.2], [1.0, 0.7]
    hit = impact.blow(2.0, 0.3, 1e5, 1.5, 2.0, *modes, 4.0, 8_000.0, 1e-6, load_n=300.0)
    apart = float(np.abs(hit.force_n[-800:] / 300.0 - 1.0).max())
    yield Reach("impacts", "a standing load of 300 N is off after 4 s by", apart, high=1e-9)
