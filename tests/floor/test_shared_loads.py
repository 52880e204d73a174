"""Two feet on one tile: what each bears is known again from the load of both."""

import numpy as np
import pytest

from underfoot.floor.shared_loads import shared


def test_two_feet_whose_load_is_one_are_known_again():
    time_s = np.arange(150) * 0.004
    first_n = 600.0 * np.clip((0.36 - time_s) / 0.12, 0.0, 1.0)
    second_n = 600.0 * np.clip((time_s - 0.24) / 0.12, 0.0, 1.0)
    first_m = np.column_stack([0.05 + 0.2 * time_s, 0.02 + 0.0 * time_s])
    second_m = np.column_stack([-0.10 + 0.3 * (time_s - 0.3), -0.06 + 0.0 * time_s])
    force_n = first_n + second_n
    centroid_m = (first_n[:, None] * first_m + second_n[:, None] * second_m) / force_n[:, None]
    feet = shared(np.column_stack([time_s, centroid_m, force_n]), 0.31)
    assert feet.first_s == pytest.approx(0.24, abs=0.012)
    assert feet.last_s == pytest.approx(0.36, abs=0.012)
    together = (time_s > 0.25) & (time_s < 0.35)
    share, one_m, other_m = feet.shares(time_s[together], centroid_m[together])
    np.testing.assert_allclose(share * force_n[together], second_n[together], atol=3.0)
    np.testing.assert_allclose(one_m, first_m[together], atol=0.005)
    np.testing.assert_allclose(other_m, second_m[together], atol=0.005)
