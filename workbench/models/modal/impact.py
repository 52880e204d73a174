"""A hammer that strikes a modal object (equations 3.3 and 3.4), offline.

The scheme is in `contact_step`; `hammer` is the same hammer in real time.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from underfoot.arguments import number
from underfoot.errors import require
from underfoot.models.modal import contact_motion
from underfoot.models.modal import hammer as impact_row
from underfoot.models.modal.bank import checked_modes


@dataclass(frozen=True)
class Blow:
    """What a blow does, frame by frame."""

    force_n: NDArray[np.float64]
    """Contact force (N), never negative, the mean over each frame."""
    displacement_m: NDArray[np.float64]
    """Displacement of the struck point (m) at each frame; 0 at the first."""
    acceleration_m_s2: NDArray[np.float64]
    """Acceleration of the struck point (m/s^2), the mean over each frame."""
    substeps: int
    """Sub-steps of a frame while the hammer is there."""


def blow(
    mass_kg: float,
    velocity_m_s: float,
    stiffness: float,
    exponent: float,
    damping_s_m: float,
    frequencies_hz: ArrayLike,
    decays_per_s: ArrayLike,
    masses_kg: ArrayLike,
    shapes: ArrayLike,
    seconds: float,
    rate: float,
    error: float,
    load_n: float = 0.0,
) -> Blow:
    """Strike a modal object at rest with a hammer, `seconds` long at `rate` frames a second.

    The hammer (mass above 0, velocity 0 or more) touches the surface at frame 0 and presses it with k x^a (1 + mu x'),
    but never pulls: stiffness k above 0 (N/m^a), exponent a from 1 to 10, damping mu = lambda / k 0 or more (s/m). The
    object's modes: frequencies of the damped ringing (Hz) and decays b (1/s) as in equation 3.4, 0 or more; modal
    masses above 0 (kg); shapes at the struck point. A mode at or above half the rate takes part in the contact, but is
    left out of displacement and acceleration, where it would alias. `load_n` presses the hammer on (0 or more).

    `error`, 1e-12 to 0.5, is the relative L2 error asked of the displacement. Sub-steps are doubled until two runs
    agree to it, at most to 4096 a frame; where those do not suffice (a contact shorter than 1/200 of a frame) the error
    is larger, but energy is never gained. Rounding sets a floor near 1e-12. Raises `BadValue`.

    >>> hit = blow(0.02, 1.0, 1e7, 1.5, 0.0, [200.0], [10.0], [1.0], [1.0], seconds=0.01, rate=48_000, error=1e-6)
    >>> round(float(hit.force_n.sum()) / 48_000, 4)  # impulse, N s: less than 2 m v, since the object gives way
    0.0393
    """
    for name, value, lowest, highest, allowed in (
        ("mass_kg", mass_kg, 1e-12, 1e12, "1e-12 to 1e12 kg"),
        ("velocity_m_s", velocity_m_s, 0.0, 1e6, "0 to 1e6 m/s"),
        ("stiffness", stiffness, 1e-12, 1e20, "1e-12 to 1e20 N/m^a"),
        ("exponent", exponent, 1.0, 10.0, "1 to 10"),
        ("damping_s_m", damping_s_m, 0.0, 1e6, "0 to 1e6 s/m"),
        ("rate", rate, 1.0, 1e9, "1 to 1e9 Hz"),
        ("seconds", seconds, 0.0, 1e6, "0 to 1e6 s"),
        ("error", error, 1e-12, 0.5, "1e-12 to 0.5"),
        ("load_n", load_n, 0.0, 1e9, "0 to 1e9 N"),
    ):
        number(name, value, lowest, highest, allowed)
    frequencies, decays, masses, weights = checked_modes(
        frequencies_hz=frequencies_hz, decays_per_s=decays_per_s, masses_kg=masses_kg, shapes=shapes
    )
    order = np.argsort(decays, kind="stable")
    modes = (frequencies[order], decays[order], masses[order], weights[order])
    mobility = float((weights**2 / masses).sum())
    rate = float(rate)
    frames = round(float(seconds) * rate)
    require(frames <= 2**28, "seconds", seconds, f"at most 2^28 frames, {2**28 / rate:.6g} s at this rate")
    steps = impact_row.substeps(error, mass_kg, stiffness, exponent, velocity_m_s, mobility, rate)
    hammer = np.array([mass_kg, stiffness, exponent, damping_s_m, load_n, error, (steps + 1) // 2], dtype=np.float64)
    coarse = _run(hammer, velocity_m_s, modes, frames, rate)
    change = np.inf
    while True:
        hammer[-1] *= 2
        fine = _run(hammer, velocity_m_s, modes, frames, rate)
        before = change
        change = _distance(coarse, fine)
        if 4.0 * change <= error:
            return coarse
        # The error of one smooth contact falls 16-fold with each doubling; that of a rattle, hardly predictably.
        left = change / 3.0 if _contacts(fine) == 1 else 2.0 * change
        rounding = change < 1e-9 and change > 0.5 * before
        if left <= error or rounding or 2 * fine.substeps > impact_row.MOST_SUBSTEPS:
            return fine
        coarse = fine


_Modes = tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]


def _run(hammer: NDArray[np.float64], velocity_m_s: float, modes: _Modes, frames: int, rate: float) -> Blow:
    """One run, with the hammer's own number of sub-steps."""
    s = np.zeros(contact_motion.state_size(modes[0].size))
    t = np.zeros(contact_motion.tuning_size(modes[0].size))
    impact_row.tune(t, *modes, float(rate), 0.0)
    throw = np.array([0.0, velocity_m_s, 0.0])
    force, acceleration, displacement = np.empty(frames), np.empty(frames), np.empty(frames)
    impact_row.ring(s, t, hammer, throw, 1, force, acceleration, displacement, 0, frames)
    return Blow(force, displacement, acceleration, int(hammer[-1]))


def _distance(coarse: Blow, fine: Blow) -> float:
    """The relative L2 difference of two runs' displacements."""
    size = float(np.linalg.norm(fine.displacement_m))
    return float(np.linalg.norm(fine.displacement_m - coarse.displacement_m)) / size if size > 0.0 else 0.0


def _contacts(run: Blow) -> int:
    """How often contact begins, as far as whole frames show it."""
    touching = run.force_n > 0.0
    return int(np.count_nonzero(touching & np.diff(touching, prepend=False)))
