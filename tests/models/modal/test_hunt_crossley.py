"""A blow on a rigid wall, against a solver at tight tolerance."""

import numpy as np
import pytest
from scipy import integrate

from underfoot.errors import BadValue
from underfoot.models.modal.hunt_crossley import wall_impact


@pytest.mark.parametrize(
    ("mass", "velocity", "stiffness", "exponent", "damping"),
    [(0.05, 0.5, 1e5, 1.5, 0.3), (0.02, 2.0, 1e7, 1.5, 3.0), (1.0, 0.1, 1e4, 1.0, 0.0), (0.1, 1.0, 1e9, 2.5, 1e-6)],
)
def test_a_blow_is_what_a_solver_makes_of_it(mass, velocity, stiffness, exponent, damping):
    def rates(_, z):
        force = stiffness * max(z[0], 0.0) ** exponent * (1.0 + damping * z[1])
        return z[1], -force / mass

    def parted(_, z):
        return z[0]

    def turned(_, z):
        return z[1]

    parted.terminal, parted.direction = True, -1.0
    solved = integrate.solve_ivp(
        rates, (0.0, 1.0), (0.0, velocity), "DOP853", events=(parted, turned), rtol=1e-11, atol=1e-15
    )
    found = wall_impact(mass, velocity, stiffness, exponent, damping, 2001)
    assert found.restitution == pytest.approx(-solved.y[1, -1] / velocity, rel=1e-6)
    assert found.penetration_m.max() == pytest.approx(solved.y_events[1][0][0], rel=1e-5)
    work = np.trapezoid(found.force_n, found.penetration_m)
    assert work == pytest.approx(0.5 * mass * velocity**2 * (1.0 - found.restitution**2), rel=1e-3, abs=1e-9)


def test_what_is_not_above_0_is_refused():
    with pytest.raises(BadValue, match="mass_kg"):
        wall_impact(0.0, 1.0, 1e5, 1.5, 0.3)
