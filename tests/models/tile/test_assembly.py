"""The whole tile, held against rigid bodies, a static solution, and SciPy's solution of its equations of motion."""

import math

import numpy as np
import pytest
from scipy.linalg import expm

from underfoot.errors import BadValue
from underfoot.models.filtering import poles
from underfoot.models.tile.assembly import Assembly, Foot
from underfoot.models.tile.plate import Plate
from underfoot.models.tile.suspension import Suspension

SIZE = (0.304, 0.304)
MOUNTS = tuple((0.133 * x, 0.133 * y) for x, y in ((1, 1), (-1, 1), (-1, -1), (1, -1)))
HEARD = (0.076, 0.044)
F = np.geomspace(5.0, 20_000.0, 500)


def tile(**changes):
    return Assembly(**{"plate": Plate(), "suspension": Suspension(), "size_m": SIZE, "mounts_m": MOUNTS} | changes)


STIFF = Plate(modulus_pa=1e12)
TILES = {
    "plain": tile(),
    "off centre": tile(shakers_m=((0.03, 0.02),)),
    "two shakers": tile(shakers_m=((0.1, 0.0), (-0.1, 0.05)), shaker_kg=0.5),
    "standing": tile(foot=Foot()),
    "corner": tile(foot=Foot(), foot_m=(0.1, 0.1)),
    "oblong": tile(size_m=(0.3, 0.4)),
    "thesis": tile(plate=Plate("thesis")),
    "damped": tile(plate=Plate(damping=0.5), suspension=Suspension(damping=0.9)),
}


@pytest.mark.parametrize("name", TILES)
def test_its_poles_are_the_same_system_as_its_equations(name):
    solved, summed = TILES[name].transfer(F, HEARD), TILES[name].poles(HEARD).transfer(F)
    assert np.abs(summed - solved).max() < 1e-9 * np.abs(solved).max()


def test_all_of_its_shakers_drive_a_tile():
    """The first alone did, and the others weighed: of shakers side by side a foot to the left was one to the right."""
    places = ((0.1, 0.0), (-0.1, 0.05))
    both, *alone = (tile(shakers_m=at, shaker_kg=0.0).transfer(F, HEARD) for at in (places, places[:1], places[1:]))
    np.testing.assert_allclose(both, sum(alone), rtol=1e-9, atol=1e-12)


def test_a_stiff_plate_is_the_lumped_model_of_the_thesis():
    assembly = tile(plate=STIFF)
    np.testing.assert_allclose(
        assembly.transfer(F[F < 300.0], (0.0, 0.0)), Suspension().transfer(F[F < 300.0]), rtol=0.02
    )


def test_a_stiff_plate_tilts_as_a_rigid_body():
    """Of plate (m L^2 / 12), frame along the edges (m L^2 / 6) and mounts at their places."""
    plate, shaker_kg = STIFF, 1.0
    panel = plate.mass_kg(SIZE)
    inertia = panel * SIZE[0] ** 2 / 12.0 + (2.7 - panel - shaker_kg) * SIZE[0] ** 2 / 6.0
    stiff = 4.0 * Suspension().stiffness_n_m * 0.133**2
    tilts = tile(plate=plate, shaker_kg=shaker_kg).undamped()[0][1:3] / (2.0 * math.pi)
    np.testing.assert_allclose(tilts, math.sqrt(stiff / inertia) / (2.0 * math.pi), rtol=2e-3)


def test_a_heavy_frame_leaves_the_plate_its_own_modes():
    plate = Plate()
    heavy = tile(suspension=Suspension(mass_kg=500.0), shaker_kg=0.0)
    bends = np.sort(heavy.undamped()[0][3:] / (2.0 * math.pi))
    np.testing.assert_allclose(bends, np.sort(plate.frequencies_hz(SIZE)), rtol=2e-3)


def test_held_still_at_its_edges_the_plate_answers_as_equation_4_9():
    """With mounts and frame too heavy to move, and a shaker without mass."""
    plate = Plate()
    held = tile(suspension=Suspension(mass_kg=500.0, modulus_pa=1e10), shaker_kg=0.0)
    f = np.linspace(3000.0, 6000.0, 50)
    alone = plate.transfer(f, SIZE, HEARD, [(0.0, 0.0)])[:, 0]
    np.testing.assert_allclose(held.transfer(f, HEARD), alone, rtol=0.02)


def test_a_slow_force_moves_it_as_statics_has_it():
    """Four mounts share the force, and the plate sags between its edges."""
    assembly, w = tile(orders=21), 2.0 * math.pi * 0.01
    moved = -assembly.transfer([0.01], (0.0, 0.0))[0].real / w**2
    sag = Plate().static_deflection_m(SIZE, (0.0, 0.0), (0.0, 0.0), 1.0, orders=21)
    assert moved == pytest.approx(Suspension().deflection_m(1.0) + sag, rel=1e-6)


def test_shaker_and_accelerometer_may_change_places():
    middle, aside = (0.0, 0.0), (0.07, 0.03)
    here, there = (tile(shakers_m=(at,), shaker_kg=0.0) for at in (middle, aside))
    np.testing.assert_allclose(here.transfer(F, aside), there.transfer(F, middle), rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("name", ["plain", "standing", "corner"])
def test_in_real_time_it_moves_as_its_equations_of_motion(name):
    """A force that rises, falls and stops; the oracle steps displacements and velocities by SciPy's exponential."""
    assembly = TILES[name]
    mass, damping, stiffness = assembly.matrices()
    n, rate, inverse = len(mass), 48_000.0, np.linalg.inv(mass)
    time = np.arange(480) / rate
    force = np.interp(time, [0.0, 0.001, 0.003, 0.004], [0.0, 40.0, -20.0, 0.0])
    whole = np.zeros((2 * n + 2, 2 * n + 2))
    whole[:n, n : 2 * n] = np.eye(n)
    whole[n : 2 * n, : 2 * n + 1] = inverse @ np.column_stack([-stiffness, -damping, assembly.shape((0.0, 0.0))])
    whole[2 * n, 2 * n + 1] = 1.0
    ahead = expm(whole / rate)
    state, expected = np.zeros(2 * n + 2), np.zeros(480)
    for i in range(480):
        expected[i] = assembly.shape(HEARD) @ (whole @ state)[n : 2 * n]
        state[2 * n + 1] = rate * (force[i + 1] - force[i]) if i < 479 else 0.0
        state = ahead @ state
    found = np.empty(480)
    poles.run(*assembly.poles(HEARD).at_rate(rate), force[:480], found)
    assert np.abs(found - expected).max() < 1e-9 * np.abs(expected).max()


def test_the_thesiss_tile_has_the_measured_antiresonance_which_neither_cause_has_alone():
    f = np.linspace(600.0, 830.0, 461)
    level = np.abs(TILES["plain"].transfer(f, HEARD))
    assert f[np.argmin(level)] == pytest.approx(775.0, abs=10.0)
    for other in (tile(shaker_kg=0.0), TILES["thesis"]):
        level = np.abs(other.transfer(f, HEARD))
        assert level.min() > 0.95 * min(level[0], level[-1])


def test_a_foot_damps_the_heave_and_has_the_corrected_resonances():
    assert Foot().leg_hz() == pytest.approx(3.9, abs=0.05)
    assert Foot(body_kg=2.7).leg_hz() == pytest.approx(16.8, abs=0.05)
    f = np.linspace(40.0, 60.0, 41)
    loose, stood_on = (np.abs(TILES[name].transfer(f, HEARD)).max() for name in ("plain", "standing"))
    assert stood_on < 0.3 * loose


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"suspension": Suspension(mass_kg=1.5)}, "mass_kg is 1.5; allowed: more than plate and shakers weigh"),
        ({"shakers_m": ((0.2, 0.0),)}, "shakers_m is"),
        ({"foot": Foot(), "foot_m": (0.0, -0.5)}, "shakers_m is|foot_m is"),
    ],
)
def test_what_cannot_be_built_is_refused(changes, message):
    with pytest.raises(BadValue, match=message):
        tile(**changes)
