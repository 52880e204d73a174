"""The suspension, compared with a rigid plate on four springs and the numbers of docs/models.md#suspension."""

import numpy as np
import pytest

from underfoot.errors import BadValue
from underfoot.models.tile.suspension import Suspension, deflection_at_resonance_m


def test_the_suspension_has_the_corrected_numbers():
    thesis = Suspension()
    assert thesis.resonance_hz() == pytest.approx(49.01, abs=0.005)
    sags = [1e3 * thesis.deflection_m(1000.0, load) for load in ("shared", "one mount", "corner")]
    assert sags == pytest.approx([3.91, 15.62, 11.72], abs=0.006)
    assert 4.0 * 1e3 * deflection_at_resonance_m(50.0, 2.7, 1000.0) == pytest.approx(15.0, abs=0.05)
    assert deflection_at_resonance_m(thesis.resonance_hz(), 2.7, 1000.0) == pytest.approx(thesis.deflection_m(1000.0))


def test_a_corner_sinks_as_statics_has_it():
    """A rigid plate on four springs, loaded over one: heave and two tilts, solved."""
    corners = np.array([(1, 1, 1), (1, -1, 1), (1, -1, -1), (1, 1, -1)], float)
    k = Suspension().stiffness_n_m
    moved = np.linalg.solve(k * corners.T @ corners, 1000.0 * corners[0])
    assert Suspension().deflection_m(1000.0, "corner") == pytest.approx(corners[0] @ moved)


def test_far_above_its_resonance_the_suspension_lets_the_mass_alone():
    assert abs(Suspension().transfer([5000.0])[0]) == pytest.approx(1.0 / 2.7, rel=1e-3)


def test_a_load_that_nobody_knows_is_refused():
    with pytest.raises(BadValue, match="load is 'edge'"):
        Suspension().deflection_m(1.0, "edge")
