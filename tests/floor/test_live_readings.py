"""Live readings to newtons: what the profile says in a script is what the engine has, sample by sample."""

import numpy as np
import pytest

from underfoot.devices.conversion import Conversion, nominal_force
from underfoot.floor.centroid_correction import CentroidCorrection
from underfoot.floor.curves import Compensation, Curve
from underfoot.floor.layout import default_floor
from underfoot.floor.profile import Centroid, Fsr, Profile
from underfoot.floor.simulated_sensors import SimulatedSensors
from underfoot.floor.simulated_tile import SimulatedTile
from underfoot.floor.tile_parameters import TileParameters

FLOOR = default_floor(1, 2)
SENSORS = np.array(FLOOR.tiles[0].sensors_m)
LINE = {"readings": (1_000.0, 41_000.0), "forces_n": (0.0, 400.0), "slopes": (0.01, 0.01)}
COMPENSATION = Compensation(
    **{**LINE, "forces_n": (0.0, 420.0), "slopes": (0.0105, 0.0105)},
    creep=0.02,
    relative=True,
    widths=(0.05, 0.12),
    weights=(0.9, 0.05, 0.06),
)
NONLINEAR = CentroidCorrection(
    gains=(1.05, 0.95, 1.02, 0.98),
    nonlinearity_scales_n=(5.0, 40.0),
    nonlinearity=((0.1, 0.05, 0.01), (0.0, -0.02, 0.03), (0.2, 0.0, 0.02), (-0.1, 0.04, 0.0)),
    powers=((0, 0), (1, 0), (0, 1), (2, 1)),
    displacement_m=((0.003, -0.002), (0.004, 0.001), (-0.002, 0.005), (0.001, 0.001)),
    area_m=((-0.1, -0.1), (0.1, -0.1), (0.1, 0.1), (-0.1, 0.1)),
)


def profile(compensation=None, correction=None, over_time=None):
    curve = Curve(family="line", unloaded_reading=1_000.0, full_scale_n=400.0, compensation=compensation, **LINE)
    part = None
    if correction is not None:
        part = Centroid(
            made="2026-01-01",
            sensors_m=FLOOR.tiles[0].sensors_m,
            least_n=20.0,
            correction=correction,
            over_time=over_time,
        )
    return Profile(tile="t1", fsr=Fsr(made="2026-01-01", sensors=(curve,) * 4), centroid=part)


def walked(count=2_000):
    """Readings of loads that come and go, at a thousand samples a second, and their times."""
    time_s = np.arange(count) * 1e-3
    load = np.maximum(np.sin(2.0 * np.pi * 1.3 * time_s[:, None] + np.arange(4) * 0.4), 0.0) * 30_000.0
    noise = np.random.default_rng(1).normal(0.0, 20.0, load.shape)
    return np.clip(1_000.0 + load + noise, 0, 65_535).astype(np.int64), time_s


def place_of(forces_n):
    return forces_n @ SENSORS / forces_n.sum(axis=1, keepdims=True)


@pytest.mark.parametrize("compensation", [None, COMPENSATION])
@pytest.mark.parametrize(
    ("correction", "over_time"), [(None, None), (NONLINEAR, None), (CentroidCorrection(), NONLINEAR)]
)
def test_live_newtons_are_those_of_the_profile_with_the_place_put_right(compensation, correction, over_time):
    known = profile(compensation, correction, over_time)
    readings, time_s = walked()
    scripted = known.force(readings) if compensation is None else known.force_over_time(readings, time_s)
    live = Conversion(FLOOR, {"t1": known}).newtons(
        np.zeros(len(readings), np.int64), readings, time_s, np.zeros(len(readings), np.int64)
    )
    np.testing.assert_allclose(live.sum(axis=1), scripted.sum(axis=1), atol=1e-9)
    if correction is None:
        np.testing.assert_allclose(live, scripted, atol=1e-9)
        return
    expected = known.position(scripted, over_time=compensation is not None)
    loaded = np.isfinite(expected[:, 0])
    np.testing.assert_allclose(place_of(live[loaded]), expected[loaded], atol=1e-9)
    np.testing.assert_allclose(live[~loaded], scripted[~loaded], atol=1e-9)
    assert 100 < loaded.sum() < len(loaded)


def test_any_split_gives_the_same_newtons_and_other_tiles_do_not_matter():
    readings, time_s = walked()
    known, rows = {"t1": profile(COMPENSATION, CentroidCorrection(), NONLINEAR)}, np.arange(2_000) % 2
    lives = np.zeros(2_000, np.int64)
    whole = Conversion(FLOOR, known).newtons(rows, readings, time_s, lives)
    parts = Conversion(FLOOR, known)
    cut = [
        parts.newtons(rows[a:b], readings[a:b], time_s[a:b], lives[a:b])
        for a, b in ((0, 7), (7, 1_000), (1_000, 2_000))
    ]
    np.testing.assert_array_equal(np.concatenate(cut), whole)
    np.testing.assert_array_equal(whole[1::2], nominal_force(readings[1::2]))
    mine = Conversion(FLOOR, known).newtons(*(values[::2].copy() for values in (rows, readings, time_s, lives)))
    np.testing.assert_array_equal(mine, whole[::2])


def test_a_tile_that_was_switched_on_again_has_rested():
    readings, time_s = walked(500)
    rows, lives = np.zeros(500, np.int64), np.zeros(500, np.int64)
    conversion = Conversion(FLOOR, {"t1": profile(COMPENSATION)})
    first = conversion.newtons(rows, readings, time_s, lives)
    assert not np.array_equal(
        conversion.newtons(rows, readings, time_s, lives), first
    )  # it has hysteresis and creep, and time ran back
    np.testing.assert_array_equal(conversion.newtons(rows, readings, time_s, lives + 1), first)


def test_simulated_sensors_are_read_as_a_script_would():
    known = profile(COMPENSATION, CentroidCorrection(), NONLINEAR)
    sensors = SimulatedSensors(FLOOR, TileParameters(), 1, 1_000.0, 64, {"t1": known})
    forces = np.zeros((64, 2, 4))
    forces[:, 0] = SimulatedTile(FLOOR.tiles[0], seed=1).corner_forces((0.03, -0.02), 300.0)
    sensors.read(forces, 0, 64, is_split=True)
    scripted = known.force_over_time(sensors.counts[:, 0], np.arange(64) * 1e-3)
    np.testing.assert_allclose(forces[:, 0].sum(axis=1), scripted.sum(axis=1), atol=1e-9)
    np.testing.assert_allclose(place_of(forces[:, 0]), known.position(scripted, over_time=True), atol=1e-9)
