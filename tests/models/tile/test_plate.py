"""The plate, compared with handbook values, the integrals of its modes, and the numbers of docs/models.md#plate."""

import math

import numpy as np
import pytest
from scipy.integrate import dblquad

from underfoot.models.tile.plate import Plate, modes, rigid_overlaps, shapes

SIZE = (0.304, 0.304)


@pytest.mark.parametrize(
    ("thickness_m", "density", "f1_hz"), [(0.0250, 210.0, 853.9), (0.0254, 210.0, 860.7), (0.0254, 170.0, 956.6)]
)
def test_the_thesiss_stiffness_gives_the_thesiss_frequency(thickness_m, density, f1_hz):
    plate = Plate("thesis", thickness_m=thickness_m, density_kg_m3=density)
    assert plate.frequency_hz(SIZE) == pytest.approx(f1_hz, abs=0.1)


def test_the_textbooks_sandwich_is_3_sqrt_3_times_as_stiff():
    thesis, textbook = Plate("thesis"), Plate("textbook")
    assert thesis.rigidity_nm() == pytest.approx(3419.0, rel=1e-3)
    assert textbook.rigidity_nm() == pytest.approx(17768.0, rel=1e-4)
    assert textbook.frequency_hz(SIZE) / thesis.frequency_hz(SIZE) == pytest.approx(math.sqrt(3.0 * math.sqrt(3.0)))


@pytest.mark.parametrize(("thickness_m", "f1_hz"), [(0.0375, 1344.0), (0.0125, 448.0)])
def test_plywood_is_stiffer_than_the_thesis_says(thickness_m, f1_hz):
    plywood = Plate("solid", thickness_m, modulus_pa=8e9, poisson=0.0, density_kg_m3=600.0)
    assert plywood.frequency_hz(SIZE) == pytest.approx(f1_hz, abs=0.5)


@pytest.mark.parametrize(("sides", "handbook"), [((0.3, 0.3), 0.01160), ((0.3, 0.36), 0.01353), ((0.3, 0.6), 0.01651)])
def test_the_static_deflection_is_the_handbooks(sides, handbook):
    """Timoshenko and Woinowsky-Krieger, section 34: w = alpha P a^2 / D, the shorter side a; Levy's single series,
    and its table, whose last digits are off by two in a thousand for long plates."""
    plate = Plate()
    sag = plate.static_deflection_m(sides, (0.0, 0.0), (0.0, 0.0), 500.0) * plate.rigidity_nm() / (500.0 * 0.3**2)
    odd = np.arange(1, 80, 2)
    alpha = odd * math.pi * sides[1] / (2.0 * sides[0])
    levy = float(np.sum((np.tanh(alpha) - alpha / np.cosh(alpha) ** 2) / odd**3)) / (2.0 * math.pi**3)
    assert sag == pytest.approx(levy, rel=3e-4)
    assert sag == pytest.approx(handbook, rel=2e-3)


def test_a_deflection_is_the_same_from_either_place_and_none_at_the_edge():
    plate = Plate()
    here, there = (0.05, -0.02), (-0.1, 0.07)
    assert plate.static_deflection_m(SIZE, here, there, 1.0) == pytest.approx(
        plate.static_deflection_m(SIZE, there, here, 1.0)
    )
    assert abs(plate.static_deflection_m(SIZE, (0.152, 0.03), here, 1.0)) < 1e-18


def test_modes_are_orthogonal_with_the_corrected_norm():
    """int eta_k eta_l = Lx Ly / 4 for k = l, else 0."""
    sides = (0.3, 0.4)
    weights, at = np.polynomial.legendre.leggauss(24)[::-1]
    x, y = np.meshgrid(0.15 * at, 0.2 * at, indexing="ij")
    eta = shapes(np.stack([x, y], axis=-1), sides, 4)
    gram = np.einsum("ijk,ijl,i,j->kl", eta, eta, 0.15 * weights, 0.2 * weights)
    np.testing.assert_allclose(gram, np.eye(16) * 0.3 * 0.4 / 4.0, atol=1e-14)


def test_only_modes_without_an_even_index_move_the_centre():
    moved = shapes((0.0, 0.0), SIZE, 5)
    for (m, n), eta in zip(modes(5), moved, strict=True):
        assert abs(eta) == pytest.approx(1.0 if m % 2 and n % 2 else 0.0, abs=1e-12)


@pytest.mark.parametrize("row", [0, 1, 2])
def test_overlaps_with_a_rigid_plate_are_the_integrals(row):
    overlaps = rigid_overlaps(3)
    rigid = (lambda x, y: 1.0, lambda x, y: 2.0 * x, lambda x, y: 2.0 * y)[row]
    for k in range(9):
        mean = dblquad(lambda y, x, k=k: rigid(x, y) * shapes((x, y), (1, 1), 3)[k], -0.5, 0.5, -0.5, 0.5)[0]
        assert overlaps[row, k] == pytest.approx(mean, abs=1e-9)


def test_the_transfer_tends_to_the_static_deflection_and_takes_any_number_of_shakers():
    plate = Plate()
    shakers = [(0.0, 0.0), (0.06, 0.06), (-0.1, 0.02)]
    at = (0.03, -0.05)
    found = plate.transfer([1.0], SIZE, at, shakers, orders=41)[0]
    for gain, place in zip(found, shakers, strict=True):
        sag = plate.static_deflection_m(SIZE, at, place, 1.0, orders=41)
        assert gain.real == pytest.approx(-((2.0 * math.pi) ** 2) * sag, rel=1e-5)


def test_a_mode_at_its_resonance_has_the_height_that_its_damping_gives():
    plate = Plate(damping=1e-3)
    height = abs(plate.transfer([plate.frequency_hz(SIZE)], SIZE, (0, 0), (0, 0), orders=1)[0, 0])
    assert height == pytest.approx(4.0 / plate.mass_kg(SIZE) / (2.0 * 1e-3))
