"""Which loads fit into one foot, and which load is a foot's own toes, by where it comes down as the foot rolls."""

import numpy as np
import pytest

from underfoot.devices.simulated_floor import SimulatedFloor
from underfoot.floor.layout import default_floor
from underfoot.floor.loads import fits_in_foot, toes_m
from underfoot.floor.simulated_loads import feet_down
from underfoot.floor.simulated_people import drawn_people


@pytest.fixture(scope="module")
def foot():
    """Samples (time, x, y, force) of a simulated walker's foot, and the direction in which it rolls."""
    source = SimulatedFloor(default_floor(6, 6), people=drawn_people(1, "straight"))
    time_s = np.arange(0.0, 4.0, 0.002)
    down = feet_down(source.footfalls, source.curves, time_s)
    mine = down.footfall == 3
    rows = np.column_stack([down.time_s[mine], down.x_m[mine], down.y_m[mine], down.force_n[mine]])
    rows = rows[rows[:, 3] >= 50.0]
    rolled = rows[-1, 1:3] - rows[0, 1:3]
    return rows, rolled / np.hypot(*rolled)


@pytest.mark.parametrize(("ahead_m", "is_toes"), [(0.08, True), (0.0, True), (-0.015, True), (-0.08, False)])
def test_a_load_behind_a_foot_that_has_rolled_is_not_its_toes(foot, ahead_m, is_toes):
    """Another's foot may come down there; 0.015 m is within the error of a centroid."""
    track, towards = foot
    late = track[int(0.8 * len(track))]
    first = late.copy()
    first[1:3] += ahead_m * towards
    found = toes_m(first[None], track, 0.0)
    assert (found is not None) == is_toes
    assert found is None or found == pytest.approx(abs(ahead_m), abs=0.01)


def test_a_foot_fits_into_its_box_however_it_is_turned():
    turned = np.exp(1j * np.radians(np.arange(180.0)))
    for length_m, breadth_m, fits in ((0.325, 0.125, True), (0.325, 0.135, False), (0.335, 0.125, False)):
        corners = (length_m * np.array([1, 1, -1, -1]) + 1j * breadth_m * np.array([1, -1, -1, 1])) / 2.0
        places_m = corners * turned[:, None]
        assert all(fits_in_foot(np.column_stack([one.real, one.imag])) == fits for one in places_m)
