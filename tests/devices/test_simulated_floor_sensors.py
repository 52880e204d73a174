"""The simulated floor with sensors that err: held against single tiles, and against the ideal floor."""

import msgspec
import numpy as np
import pytest
from made_curves import line

from underfoot.devices.force_source import SENSOR_HZ
from underfoot.devices.simulated_floor import SimulatedFloor, recorded
from underfoot.errors import BadFile
from underfoot.floor.layout import default_floor
from underfoot.floor.profile import Fsr as FsrPart
from underfoot.floor.profile import Profile
from underfoot.floor.simulated_tile import SimulatedTile
from underfoot.floor.tile_parameters import Split, TileParameters
from underfoot.models.gait import Walker
from underfoot.models.tile.fsr import FULL_COUNTS, Fsr

FLOOR = default_floor()
NON_IDEAL = TileParameters()
IDEAL = TileParameters(
    sensors=Fsr(spread=0.0, hysteresis=0.0, creep=0.0, noise_counts=0.0),
    split=Split(deviation=0.0, placement_m=0.0),
)


def pulled(source, end, step=480, begin=0):
    forces = []
    for at in range(begin + step, end + step, step):
        count = source.pull(min(at, end))
        forces.append(source.forces[:count].copy())
    return np.concatenate(forces)


def test_perfect_parts_read_what_the_ideal_floor_reads():
    found = pulled(SimulatedFloor(FLOOR, simulation=IDEAL), 96_000)
    ideal = pulled(SimulatedFloor(FLOOR), 96_000)
    pressed = ideal > -IDEAL.suspension.mass_kg * 9.81 / 4.0  # below that the plate lifts, and nothing is left to read
    np.testing.assert_allclose(found[pressed], ideal[pressed], atol=1.0)
    assert pressed.mean() > 0.99


def test_every_tile_is_the_simulated_tile_of_its_id():
    source = SimulatedFloor(FLOOR, seed=3, simulation=NON_IDEAL)
    counts = []
    for at in range(480, 48_001, 480):
        counts.append(source.sensors.counts[: source.pull(at)].copy())
    counts = np.concatenate(counts)
    ideal = pulled(SimulatedFloor(FLOOR, seed=3), 48_000)
    for row, tile in enumerate(FLOOR.tiles):
        alone = SimulatedTile(tile, NON_IDEAL, 3)
        np.testing.assert_array_equal(counts[:, row], alone.sense(ideal[:, row] @ alone.split.T))


def test_uncalibrated_it_errs_as_parts_do_and_says_so():
    source = SimulatedFloor(FLOOR, simulation=NON_IDEAL)
    found, ideal = pulled(source, 10 * 48_000), pulled(SimulatedFloor(FLOOR), 10 * 48_000)
    assert source.notices == ("uncalibrated: t1, t2, t3, t4 (the nominal curve of the sensors is assumed)",)
    loaded = ideal > 100.0
    off = np.abs(found[loaded] / ideal[loaded] - 1.0)
    assert 0.03 < np.median(off) < 0.4
    assert np.abs(found[: int(0.19 * SENSOR_HZ)]).max() < 10.0


def test_a_profile_turns_counts_into_newtons():
    curve = line(slope=1000.0 / FULL_COUNTS, rest=0.0, full=1000.0)
    profile = Profile(tile="t2", fsr=FsrPart(made="2024-05-01", sensors=(curve,) * 4))
    source = SimulatedFloor(FLOOR, simulation=NON_IDEAL, profiles={"t2": profile})
    assert "t2" not in source.notices[0]
    source.pull(9600)
    count = source.pull(19_200)
    expected = profile.force(source.sensors.counts[:count, 1])
    np.testing.assert_allclose(source.forces[:count, 1], expected, atol=1e-9)
    assert np.ptp(expected) > 1.0


@pytest.mark.parametrize("step", [7, 333, 20_000])
def test_it_does_not_depend_on_how_it_is_pulled(step):
    whole, parts = (SimulatedFloor(FLOOR, simulation=NON_IDEAL) for _ in range(2))
    for source in (whole, parts):
        source.press(1, 0.05, 0.03, 200.0)
    assert pulled(whole, 96_000).tobytes() == pulled(parts, 96_000, step).tobytes()


def test_the_parameters_walker_walks_and_keeps_to_its_path():
    """Stepping on the spot, it gives the floor its weight on average."""
    walker = Walker(weight_n=250.0, cadence_per_min=150.0, step_width_m=0.0)
    source = SimulatedFloor(FLOOR, simulation=msgspec.structs.replace(IDEAL, walker=walker, path_m=((0.15, 0.15),)))
    total = pulled(source, 20 * 48_000)[2000:].sum(axis=2)
    assert total[:, 0].mean() == pytest.approx(250.0, rel=0.02)
    np.testing.assert_allclose(total[:, 1:], 0.0, atol=4.0)


def test_a_foot_that_rolls_less_moves_its_centroid_less():
    reach = []
    for start, share in ((0.05, 0.9), (0.4, 0.1)):
        walker = Walker(step_length_m=0.0, step_width_m=0.0, toe_out_deg=0.0, variation=0.0, cadence_per_min=40.0,
            roll_start=start, roll_reach=share)  # fmt: skip
        source = SimulatedFloor(FLOOR, simulation=msgspec.structs.replace(IDEAL, walker=walker, path_m=((0.15, 0.15),)))
        forces = pulled(source, 48_000)[:, 0]
        loaded = forces[forces.sum(axis=1) > 200.0]
        reach.append(np.ptp(loaded @ np.array(FLOOR.tiles[0].sensors_m)[:, 0] / loaded.sum(axis=1)))
    assert reach[0] > 3.0 * reach[1] > 0.0


def test_shear_of_a_walking_foot_moves_its_centroid_ahead_and_then_behind():
    walker = Walker(step_length_m=0.0, step_width_m=0.0, toe_out_deg=0.0, variation=0.0, cadence_per_min=40.0)
    ways = []
    for shear in (0.0, 0.17):
        parameters = msgspec.structs.replace(
            IDEAL, walker=walker, path_m=((0.15, 0.15),), split=Split(deviation=0.0, placement_m=0.0, shear=shear)
        )
        forces = pulled(SimulatedFloor(FLOOR, simulation=parameters), 3 * 48_000)[:, 0]
        load = forces.sum(axis=1)
        ways.append(np.where(load > 200.0, forces @ np.array(FLOOR.tiles[0].sensors_m)[:, 0] / load, np.nan))
    moved = ways[1] - ways[0]
    first = np.flatnonzero(np.isfinite(moved))[0]
    assert moved[first] == pytest.approx(0.17 * 0.02, rel=0.1)
    assert np.nanmin(moved) < -0.5 * 0.17 * 0.02


def test_a_hands_shear_moves_it_the_way_that_was_drawn():
    parameters = msgspec.structs.replace(IDEAL, split=Split(deviation=0.0, placement_m=0.0, shear=0.17))
    source = SimulatedFloor(FLOOR, walking=False, simulation=parameters)
    source.press(0, 0.02, -0.01, 400.0)
    last = pulled(source, 48_000)[-1, 0]
    off = last @ np.array(FLOOR.tiles[0].sensors_m) / last.sum() - [0.02, -0.01]
    assert np.hypot(*off) == pytest.approx(0.17 * 0.02, rel=0.02)


def write_walk(path, floor, time_s, force_n):
    names = [f"{tile.id}.{sensor}" for tile in floor.tiles for sensor in range(1, 5)]
    table = np.column_stack([time_s, force_n.reshape(len(time_s), -1)])
    np.savetxt(path, table, delimiter=",", header=",".join(["time_s", *names]), comments="", fmt="%.9g")


def test_a_recording_walks_over_and_over(tmp_path):
    time_s = 5.0 + np.arange(101) / 100.0
    force_n = np.zeros((101, 4, 4))
    force_n[:, 2] = (100.0 + 50.0 * np.sin(np.arange(101) * 0.3))[:, None]
    write_walk(tmp_path / "walk.csv", FLOOR, time_s, force_n)
    table = recorded(str(tmp_path / "walk.csv"), FLOOR)
    assert table.shape == (1001, 4, 4)
    np.testing.assert_allclose(table[::10], force_n, atol=1e-6)
    source = SimulatedFloor(FLOOR, simulation=msgspec.structs.replace(IDEAL, recording=str(tmp_path / "walk.csv")))
    found = pulled(source, 48 * 2500)
    np.testing.assert_allclose(found[:2002], np.concatenate([table, table]), atol=0.6)


def test_a_recording_that_is_not_there_is_refused():
    with pytest.raises(BadFile, match=r"no\.csv cannot be read"):
        SimulatedFloor(FLOOR, simulation=TileParameters(recording="no.csv"))
