"""Hammer strikes on a modal object (equations 3.3 and 3.4), offline.

The scheme is in `contact_step`; `hammer` is its real-time version.
"""

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from underfoot.arguments import number
from underfoot.errors import require
from underfoot.layouts import Memory
from underfoot.models.modal import contact_motion, hammer, phasors
from underfoot.models.modal.bank import checked_modes
from underfoot.models.signals.events import event_list


class ModalObject(NamedTuple):
    """Struck object, one number per mode in each list.

    Frequencies of the damped ringing (Hz) and decays b (1/s) as in equation 3.4, at least 0; modal masses above 0 (kg);
    shapes at the struck point.
    """

    frequencies_hz: ArrayLike
    decays_per_s: ArrayLike
    masses_kg: ArrayLike
    shapes: ArrayLike


@dataclass(frozen=True)
class Hammer:
    """Hammer that touches the surface at frame 0 and presses it with k x^a (1 + mu x'), but never pulls.

    Mass above 0 (kg), velocity at least 0 (m/s), stiffness k above 0 (N/m^a), exponent a from 1 to 10, damping
    mu = lambda / k at least 0 (s/m), and a constant load on it, at least 0 (N). Raises `BadValue`.
    """

    mass_kg: float
    velocity_m_s: float
    stiffness: float
    exponent: float = 1.5
    damping_s_m: float = 0.0
    load_n: float = field(default=0.0, kw_only=True)

    def __post_init__(self) -> None:
        for name, lowest, highest, allowed in (
            ("mass_kg", 1e-12, 1e12, "1e-12 to 1e12 kg"),
            ("velocity_m_s", 0.0, 1e6, "0 to 1e6 m/s"),
            ("stiffness", 1e-12, 1e20, "1e-12 to 1e20 N/m^a"),
            ("exponent", 1.0, 10.0, "1 to 10"),
            ("damping_s_m", 0.0, 1e6, "0 to 1e6 s/m"),
            ("load_n", 0.0, 1e9, "0 to 1e9 N"),
        ):
            number(name, getattr(self, name), lowest, highest, allowed)


@dataclass(frozen=True)
class Impact:
    """Response to a strike, frame by frame."""

    force_n: NDArray[np.float64]
    """Contact force (N), never negative; mean over each frame."""
    displacement_m: NDArray[np.float64]
    """Displacement of the struck point (m) at each frame; 0 at the first."""
    acceleration_m_s2: NDArray[np.float64]
    """Acceleration of the struck point (m/s^2); mean over each frame."""
    substeps: int
    """Sub-steps per frame while the hammer is present."""


def strike(by: Hammer, target: ModalObject, seconds: float, rate: float, error: float) -> Impact:
    """Strike a modal object at rest and return `seconds` of response at `rate` frames per second.

    A mode at or above half the rate takes part in the contact, but is left out of displacement and acceleration, where
    it would alias. `error`, 1e-12 to 0.5, is the relative L2 error asked of the displacement. Sub-steps are doubled
    until two runs agree to it, at most to 4096 per frame; where those do not suffice (a contact shorter than 1/200 of a
    frame) the error is larger, but energy is never gained. Rounding sets a floor near 1e-12. Raises `BadValue`.

    >>> hit = strike(Hammer(0.02, 1.0, 1e7), ModalObject([200.0], [10.0], [1.0], [1.0]), 0.01, 48_000, error=1e-6)
    >>> round(float(hit.force_n.sum()) / 48_000, 4)  # impulse, N s: less than 2 m v, as the object yields
    0.0393
    """
    number("rate", rate, 1.0, 1e9, "1 to 1e9 Hz")
    number("seconds", seconds, 0.0, 1e6, "0 to 1e6 s")
    number("error", error, 1e-12, 0.5, "1e-12 to 0.5")
    modes = np.array(checked_modes(**target._asdict()))
    modes = np.ascontiguousarray(modes[:, np.argsort(modes[1], kind="stable")])
    mobility = float((modes[3] ** 2 / modes[2]).sum())
    rate = float(rate)
    frames = round(float(seconds) * rate)
    require(frames <= 2**28, "seconds", seconds, f"at most 2^28 frames, {2**28 / rate:.6g} s at this rate")
    steps = hammer.substeps(_thrown(by, error), by.velocity_m_s, mobility, rate)
    steps = (steps + 1) // 2
    coarse = _run(by, modes, steps, frames, rate)
    change = np.inf
    while True:
        steps *= 2
        fine = _run(by, modes, steps, frames, rate)
        before = change
        change = _distance(coarse, fine)
        if 4.0 * change <= error:
            return coarse
        # The error of one smooth contact falls 16-fold with each doubling; that of a rattle is hardly predictable.
        left = change / 3.0 if _contacts(fine) == 1 else 2.0 * change
        rounding = change < 1e-9 and change > 0.5 * before
        if left <= error or rounding or 2 * fine.substeps > hammer.MOST_SUBSTEPS:
            return fine
        coarse = fine


def _run(by: Hammer, modes: NDArray[np.float64], substeps: int, frames: int, rate: float) -> Impact:
    """Run once with `substeps` sub-steps per frame."""
    sizes = phasors.sizes(modes.shape[1])
    known, state = contact_motion.OBJECT.zeros(**sizes), contact_motion.STATE.zeros(row=sizes["row"])
    hammer.design(modes, 1.0, 1.0, rate, 0.0, known)
    thrown = _thrown(by, 0.0)
    thrown.substeps = substeps
    out = hammer.Response(np.empty(frames), np.empty(frames), np.empty(frames))
    hammer.ring(event_list((0.0, by.velocity_m_s)), thrown, 0, known, state, out)
    return Impact(out.force, out.displacement, out.acceleration, substeps)


def _thrown(by: Hammer, error: float) -> Memory:
    """Return the hammer for kernels."""
    thrown = hammer.HAMMER.zeros()
    thrown.mass, thrown.stiffness, thrown.exponent = by.mass_kg, by.stiffness, by.exponent
    thrown.damping, thrown.load, thrown.error = by.damping_s_m, by.load_n, error
    return thrown


def _distance(coarse: Impact, fine: Impact) -> float:
    """Return the relative L2 difference of the displacements of two runs."""
    size = float(np.linalg.norm(fine.displacement_m))
    return float(np.linalg.norm(fine.displacement_m - coarse.displacement_m)) / size if size > 0.0 else 0.0


def _contacts(run: Impact) -> int:
    """Return the number of contacts, as far as whole frames resolve them."""
    touching = run.force_n > 0.0
    return int(np.count_nonzero(touching & np.diff(touching, prepend=False)))
