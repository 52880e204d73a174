"""Dynamics of a whole tile: plate, frame, suspension and shaker as one modal system, with or without a foot.

The plate hangs by hinged edges in a stiff frame that heaves and tilts on the mounts; the shaker is bolted to the plate.
The shaker's mass matters as much as the plate's stiffness: with the textbook stiffness and 1.1 kg at the centre the
thesis's tile has an antiresonance at 775 Hz, as in figure 4.13; neither alone produces it.

Coordinates: heave of the frame, its tilts about both axes (as displacement of the edge's midpoint), the plate's modes
relative to it (`plate.modes`), then foot and body if present.
"""

import math
from collections.abc import Iterable
from typing import Annotated

import msgspec
import numpy as np
from msgspec import Struct
from numpy.typing import ArrayLike, NDArray

from underfoot.arguments import require_within
from underfoot.errors import require
from underfoot.models.filtering.poles import Poles, of_outputs
from underfoot.models.tile import plate as plates
from underfoot.models.tile.plate import Plate
from underfoot.models.tile.suspension import Suspension

_RIGID = 3


class Foot(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Standing foot (figure 4.12): its mass on sole and flesh, and a body above it on the leg.

    The thesis takes a leg of 30 kN/m and 50 kg and finds 150 Hz; that is 3.9 Hz (docs/models.md#whole-tile-and-foot).
    Near 150 Hz, where the measured response changes with load, the foot resonates on its sole. Raises `BadValue`
    outside the ranges.

    >>> round(Foot().leg_hz(), 1), round(Foot().sole_hz())
    (3.9, 145)
    """

    mass_kg: Annotated[float, (0.01, 20.0)] = 1.2
    sole_n_m: Annotated[float, (1e3, 1e8)] = 1e6
    sole_damping: Annotated[float, (0.0, 5.0)] = 0.4
    body_kg: Annotated[float, (1.0, 500.0)] = 50.0
    leg_n_m: Annotated[float, (1e2, 1e7)] = 30e3
    leg_damping: Annotated[float, (0.0, 5.0)] = 0.3

    def __post_init__(self) -> None:
        require_within(self)

    def leg_hz(self) -> float:
        """Return the resonance frequency of the body on the leg, Hz."""
        return math.sqrt(self.leg_n_m / self.body_kg) / (2.0 * math.pi)

    def sole_hz(self) -> float:
        """Return the resonance frequency of the foot on its sole, Hz."""
        return math.sqrt(self.sole_n_m / self.mass_kg) / (2.0 * math.pi)


class Assembly(Struct, frozen=True):
    """Tile of `size_m` with mounts (4, 2) and shakers (n, 2), each of `shaker_kg`, in the tile's frame, metres.

    The frame is the suspended mass less plate and shakers. A `foot` stands at `foot_m`. Raises `BadValue` if the
    suspended mass is less than plate and shakers, and for a position off the tile.
    """

    plate: Plate
    suspension: Suspension
    size_m: tuple[float, float]
    mounts_m: tuple[tuple[float, float], ...]
    shakers_m: tuple[tuple[float, float], ...] = ((0.0, 0.0),)
    shaker_kg: float = 1.1
    foot: Foot | None = None
    foot_m: tuple[float, float] = (0.0, 0.0)
    orders: int = plates.ORDERS

    def __post_init__(self) -> None:
        on_it = all(abs(place[i]) <= 0.5 * self.size_m[i] for place in (*self.shakers_m, self.foot_m) for i in (0, 1))
        require(on_it, "shakers_m", self.shakers_m, f"places on a tile of {self.size_m[0]:g} x {self.size_m[1]:g} m")
        least = self.plate.mass_kg(self.size_m) + len(self.shakers_m) * self.shaker_kg
        mass = self.suspension.mass_kg
        require(mass > least, "mass_kg", mass, f"more than plate and shakers weigh, {least:.3g} kg")

    def shape(self, at_m: ArrayLike) -> NDArray[np.float64]:
        """Return the displacement of the surface at positions (..., 2) per coordinate: (..., coordinates)."""
        at = np.asarray(at_m, dtype=np.float64)
        rigid = np.concatenate([np.ones((*at.shape[:-1], 1)), at / (0.5 * np.array(self.size_m))], axis=-1)
        beyond = np.zeros((*at.shape[:-1], 2 if self.foot else 0))
        return np.concatenate([rigid, plates.shapes(at, self.size_m, self.orders), beyond], axis=-1)

    def matrices(self) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        """Return mass, damping and stiffness, each (coordinates, coordinates)."""
        modal = slice(_RIGID, _RIGID + self.orders**2)
        n = modal.stop + (2 if self.foot else 0)
        mass, damping, stiffness = np.zeros((n, n)), np.zeros((n, n)), np.zeros((n, n))
        panel = self.plate.mass_kg(self.size_m)
        natural = 2.0 * math.pi * self.plate.frequencies_hz(self.size_m, self.orders)
        inert = self.plate.modal_mass_kg(self.size_m)
        mass[range(_RIGID), range(_RIGID)] = panel * np.array([1.0, 1.0 / 3.0, 1.0 / 3.0]) + self._frame_kg()
        mass[:_RIGID, modal] = panel * plates.rigid_overlaps(self.orders)
        mass[modal, :_RIGID] = mass[:_RIGID, modal].T
        mass[modal, modal] = inert * np.eye(len(natural))
        stiffness[modal, modal] = inert * np.diag(natural**2)
        damping[modal, modal] = inert * np.diag(2.0 * self.plate.damping * natural)
        for place in self.shakers_m:
            moved = self.shape(place)
            mass += self.shaker_kg * np.outer(moved, moved)
        # Mounts support the frame, which is stiff: they do not act on the plate's modes.
        mount = self.suspension.stiffness_n_m
        loss = self.suspension.damping * math.sqrt(mount * self.suspension.mass_kg)
        for place in self.mounts_m:
            moved = self.shape(place)
            moved[_RIGID:] = 0.0
            stiffness += mount * np.outer(moved, moved)
            damping += loss * np.outer(moved, moved)
        if self.foot is not None:
            self._stand(self.foot, mass, damping, stiffness)
        return mass, damping, stiffness

    def transfer(self, frequencies_hz: ArrayLike, at_m: ArrayLike) -> NDArray[np.complex128]:
        """Return acceleration at `at_m` per newton of each shaker, all driven alike: complex, one value per frequency.

        >>> tile = Assembly(Plate(), Suspension(), (0.304, 0.304), ((0.13, 0.13), (-0.13, 0.13), (-0.13, -0.13),
        ...     (0.13, -0.13)))
        >>> gain = abs(tile.transfer([300.0, 775.0], (0.076, 0.044))) * 2.7  # of a rigid tile: 1
        >>> gain.round(2)
        array([1.01, 0.27])
        """
        mass, damping, stiffness = self.matrices()
        drive, shape_there = self.shape(self.shakers_m).sum(axis=0), self.shape(at_m)
        omega = 2.0 * math.pi * np.asarray(frequencies_hz, dtype=np.float64)[:, None, None]
        moved = np.linalg.solve(stiffness + 1j * omega * damping - omega**2 * mass, drive[:, None].astype(complex))
        return np.asarray(-(omega[:, 0, 0] ** 2) * (moved[..., 0] @ shape_there))

    def undamped(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return angular frequencies in ascending order, 1/s, and mode shapes as columns, of unit modal mass."""
        mass, _, stiffness = self.matrices()
        inverse = np.linalg.inv(np.linalg.cholesky(mass))
        squares, vectors = np.linalg.eigh(inverse @ stiffness @ inverse.T)
        return np.sqrt(np.maximum(squares, 0.0)), inverse.T @ vectors

    def poles(self, at_m: ArrayLike) -> Poles:
        """Return `transfer` as poles, which `poles.run` runs in real time."""
        return self.poles_at([at_m])[0]

    def poles_at(self, places_m: Iterable[ArrayLike]) -> list[Poles]:
        """Return `poles` for several positions from one solution."""
        natural, vectors = self.undamped()
        _, damping, _ = self.matrices()
        lost = vectors.T @ damping @ vectors
        n = len(natural)
        driven = vectors.T @ self.shape(self.shakers_m).sum(axis=0)
        # States: displacements times angular frequency, and velocities. Equal units keep the system well conditioned.
        a = np.block([[np.zeros((n, n)), np.diag(natural)], [-np.diag(natural), -lost]])
        b = np.concatenate([np.zeros(n), driven])
        shape_there = [vectors.T @ self.shape(at_m) for at_m in places_m]
        return of_outputs(a, b, [(one @ a[n:], float(one @ driven)) for one in shape_there])

    def _frame_kg(self) -> NDArray[np.float64]:
        """Return the frame's mass in heave and in both tilts, distributed evenly along the edges."""
        x, y = self.size_m
        kg = self.suspension.mass_kg - self.plate.mass_kg(self.size_m) - len(self.shakers_m) * self.shaker_kg
        return kg * np.array([1.0, (y + x / 3.0) / (x + y), (x + y / 3.0) / (x + y)])

    def _stand(
        self, foot: Foot, mass: NDArray[np.float64], damping: NDArray[np.float64], stiffness: NDArray[np.float64]
    ) -> None:
        """Add a standing foot to the plate: tile - sole - foot - leg - body."""
        n = len(mass)
        mass[n - 2, n - 2], mass[n - 1, n - 1] = foot.mass_kg, foot.body_kg
        sole, leg = -self.shape(self.foot_m), np.zeros(n)
        sole[n - 2] = leg[n - 1] = 1.0
        leg[n - 2] = -1.0
        sole_loss = 2.0 * foot.sole_damping * math.sqrt(foot.sole_n_m * foot.mass_kg)
        leg_loss = 2.0 * foot.leg_damping * math.sqrt(foot.leg_n_m * foot.body_kg)
        for link, spring, loss in ((sole, foot.sole_n_m, sole_loss), (leg, foot.leg_n_m, leg_loss)):
            stiffness += spring * np.outer(link, link)
            damping += loss * np.outer(link, link)
