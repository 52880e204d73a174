"""The free plate against Leissa's frequencies, and what a mass at its middle does to each of its modes."""

import math

import numpy as np
import pytest

from underfoot.models.tile.free_plate import free_modes


def test_frequencies_are_those_of_leissa():
    """Leissa 1973, completely free, square, Poisson's ratio 0.3: w L^2 sqrt(rho h / D); his are upper bounds."""
    leissa = [13.489, 19.789, 24.432, 35.024, 35.024, 61.526]
    found = 2.0 * math.pi * 0.5**2 * free_modes(0.5, 4.0, 9.0).frequencies_hz[:6] * math.sqrt(9.0 / 4.0)
    np.testing.assert_allclose(found, leissa, rtol=0.012)
    assert (found < leissa).all()


def test_a_mass_at_the_middle_lowers_the_ring_and_leaves_modes_that_do_not_move_it():
    bare, loaded = (free_modes(0.3, 1e4, 5.0, kg) for kg in (0.0, 0.2))
    assert loaded.frequencies_hz[0] == pytest.approx(bare.frequencies_hz[0], rel=1e-9)
    assert loaded.frequencies_hz[2] == pytest.approx(bare.frequencies_hz[1], rel=1e-9)
    assert loaded.frequencies_hz[1] < bare.frequencies_hz[2]
    middle, corner, other, _ = loaded.shape([[0.0, 0.0], [0.15, 0.15], [-0.15, 0.15], [0.15, 0.0]], 1)
    assert corner == pytest.approx(other)
    assert middle * corner < 0.0


def test_a_shape_is_the_same_at_one_place_as_among_others():
    found = free_modes(0.3, 1e4, 5.0)
    places = np.array([[0.15, 0.15], [0.15, 0.0], [0.0, 0.0], [0.02, -0.11]])
    for mode in range(3):
        shape = found.shape(places, mode)
        np.testing.assert_allclose([found.shape(place, mode) for place in places], shape)
        assert np.abs(shape[:2]).max() == pytest.approx(1.0), "at the corners, or at the middle of the edges"
    assert found.shape([0.0, 0.0], 0) == pytest.approx(0.0, abs=1e-12), "nodal lines cross at the middle"
