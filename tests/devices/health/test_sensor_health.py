"""Faults of sensors, made on simulated and measured walks; and no alarm where there is none."""

from functools import cache

import numpy as np
import pytest
from measured import WALKS, needs_data, walk

from underfoot.devices.conversion import nominal_force, nominal_readings
from underfoot.devices.health.sensor_health import SensorHealth
from underfoot.devices.simulated_floor import SimulatedFloor
from underfoot.floor.layout import default_floor

FLOOR = default_floor(3, 3)
"""The walker goes round on eight of nine tiles: over t2 from t1 to t3, along x."""


@cache
def walked(rows=3, columns=3, seconds=30, seed=1):
    """A walker's forces on a floor, (n, tiles, 4)."""
    source = SimulatedFloor(default_floor(rows, columns), seed=seed)
    parts = []
    for end in range(12_000, seconds * 48_000 + 1, 12_000):
        parts.append(source.forces[: source.pull(end)].copy())
    return np.concatenate(parts)


def found(floor, force_n, rate_hz=1000.0, readings=None, chunk=700, clocks_s=0.0):
    """What is said of sensors that read these newtons; `clocks_s` is when the clock of each tile began, ago."""
    return fed(floor, force_n, rate_hz, readings, chunk, clocks_s).take_notices()


def fed(floor, force_n, rate_hz=1000.0, readings=None, chunk=700, clocks_s=0.0):
    health = SensorHealth(floor, rate_hz)
    counts = nominal_readings(force_n) if readings is None else readings(force_n)
    newtons = nominal_force(counts)
    tiles = len(floor.tiles)
    time_s = np.arange(len(force_n)) / rate_hz
    ago_s = np.broadcast_to(clocks_s, tiles)
    for a in range(0, len(force_n), chunk):
        part = slice(a, min(a + chunk, len(force_n)))
        n = part.stop - a
        rows, when = np.tile(np.arange(tiles), n), np.repeat(time_s[part], tiles)
        health.feed(rows, when + ago_s[rows], when, counts[part].reshape(-1, 4), newtons[part].reshape(-1, 4))
    return health


def changed(forces, tile, sensor, change):
    out = forces.copy()
    out[:, tile, sensor] = change(out[:, tile, sensor])
    return out


# --- no alarm ---


@needs_data
@pytest.mark.parametrize("name", [*WALKS, "floor14/floor"])
def test_real_walks_name_nobody(name):
    floor, forces = walk(name)
    assert found(floor, forces.force_n, forces.rate_hz) == []


@pytest.mark.parametrize(("rows", "columns"), [(3, 3), (2, 2), (1, 4), (2, 4)])
def test_simulated_walks_name_nobody(rows, columns):
    """Tiles at which the walker turns, as of 2 x 4, were called turned."""
    assert found(default_floor(rows, columns), walked(rows, columns)) == []


def test_sensors_of_different_gain_and_noise_name_nobody():
    random = np.random.default_rng(5)
    forces = walked() * random.uniform(0.75, 1.25, (1, 9, 4)) + random.normal(0.0, 1.0, walked().shape)
    assert found(FLOOR, forces) == []


def test_what_rests_for_a_moment_at_each_step_is_not_stuck():
    """At ten bits sensors do while a foot rolls on, often at one number where they are least sensitive."""
    step = np.zeros((400, 1, 4))
    step[100:200, 0, 1:] = np.linspace(100.0, 300.0, 100)[:, None]
    rests = [changed(step, 0, 0, lambda f, n=rest_n: f + n * (step[:, 0, 1] > 0.0)) for rest_n in range(50, 90, 5)]
    assert found(default_floor(1, 1), np.concatenate([*rests, *rests[:1] * 8])) == []


def test_a_corner_that_lifts_is_not_reversed():
    """Of good tiles that were not calibrated, where the plate's weight alone is 40 N of such an FSR."""
    forces = np.zeros((20_000, 1, 4))
    forces[1000:19_000, 0] = [-37.0, 1471.0, 441.0, 190.0]
    assert found(default_floor(1, 1), forces) == []


def test_what_sensors_creep_after_a_foot_calls_none_dead():
    """Of good tiles that were not calibrated: 207 N over one sensor read 1322 N, and 105 N once the foot had gone."""
    forces = np.zeros((20_000, 1, 4))
    forces[1000:2000, 0] = [119.8, 1322.4, -1.3, 6.7]
    forces[2000:19_000, 0] = [5.8, 104.8, 0.1, 5.7]
    assert found(default_floor(1, 1), forces) == []


def test_boards_of_eight_bits_name_nobody():
    """Sensors of every tile that was walked on were stuck, and some noisy, whose readings went one step to and fro."""
    forces = np.zeros((6000, 1, 4))
    forces[3000:, 0] = np.linspace([60.0, 80.0, 80.0, 80.0], [60.0, 300.0, 300.0, 300.0], 3000)
    forces += np.random.default_rng(1).normal(0.0, 0.1, forces.shape)
    lines = [
        found(default_floor(1, 1), forces, readings=lambda f, step=step: (nominal_readings(f) + 24) // step * step)
        for step in (256, 128)
    ]
    assert lines == [[], ["tile t1: sensor 1 is saturated (stays at 2176 while the load on its tile changes)"]]


def test_who_stands_still_in_a_corner_names_nobody():
    forces = np.zeros((20_000, 1, 4))
    forces[1000:19_000, 0, 0] = 700.0
    assert found(default_floor(1, 1), forces) == []


# --- one fault ---


@pytest.mark.parametrize("reads", [0, 1000, 40_000])
def test_a_dead_sensor(reads):
    def readings(force_n):
        counts = nominal_readings(force_n)
        counts[:, 1, 0] = reads
        return counts

    (line,) = found(FLOOR, walked(), readings=readings)
    assert line.startswith(f"tile t2: sensor 1 is dead (reads {reads} while its neighbours carry ")
    assert int(line.split()[-2]) >= 100


@pytest.mark.parametrize("rest", [1000, 60_000])
def test_a_reversed_sensor(rest):
    """Sensor and resistor of one divider are exchanged; its tile was too light and its centroid wrong, in silence."""

    def readings(force_n):
        counts = nominal_readings(force_n)
        counts[:, 1, 3] = np.maximum(rest - (counts[:, 1, 3] - 1000), 0)
        return counts

    (line,) = found(FLOOR, walked(), readings=readings)
    assert line.startswith("tile t2: sensor 4 is reversed (it falls while its neighbours carry ")


def test_a_sensor_at_the_end_of_its_range():
    (line,) = found(FLOOR, changed(4.0 * walked(), 1, 0, lambda f: np.minimum(f, 150.0)))
    assert line == "tile t2: sensor 1 is saturated (stays at 4000 while the load on its tile changes)"
    (line,) = found(FLOOR, changed(walked(), 1, 0, lambda f: 100.0 * f))
    assert line == "tile t2: sensor 1 is saturated (stays at 65535 while the load on its tile changes)"
    (line,) = found(FLOOR, changed(4.0 * walked(), 1, 0, lambda f: np.minimum(f, 3095.0 / 20.0)))
    assert line.endswith("(stays at 4095 while the load on its tile changes; does its device send 12 bits that belong "
                         "at the top of 16?)")  # fmt: skip


def test_a_sensor_that_is_stuck_is_not_called_saturated():
    """Its divider was looked at, and not its mount."""
    late = np.arange(len(walked())) > 10_000
    (line,) = found(FLOOR, changed(walked(), 1, 0, lambda f: np.where(late, 40.0, f)))
    assert line == "tile t2: sensor 1 is stuck (stays at 1800 while the load on its tile changes)"


@pytest.mark.parametrize(("stays_n", "times"), [(40.0, 2), (15.0, 0), (150.0, 0)])
def test_what_stands_on_a_tile_or_a_zero_that_has_moved_is_told_once_until_it_is_empty(stays_n, times):
    """Of a bag, or a sensor that was 40 N off from one day to the next, steps on its tile were lost in silence."""
    stays = np.zeros((14_000, 1, 4))
    stays[500:, 0, 1] = stays_n
    stays[7000:] *= 1.3  # it goes on moving
    for step in range(700, 14_000, 320):
        stays[step : step + 30, 0] += 150.0
    lines = found(default_floor(1, 1), np.concatenate([stays, stays]), rate_hz=50.0, chunk=50)
    assert len(lines) == times
    assert all(line.startswith("tile t1 has borne 40 N for a minute") for line in lines)


def test_a_loose_sensor():
    loaded = np.flatnonzero(walked()[:, 1, 0] > 80.0)
    out = np.zeros(len(walked()), bool)
    for start in loaded[:: len(loaded) // 12]:
        out[start : start + 6] = True
    (line,) = found(FLOOR, changed(walked(), 1, 0, lambda f: np.where(out, 0.0, f)))
    assert line == "tile t2: sensor 1 is loose (fell to nothing 3 times while its tile was loaded)"


def test_falls_before_a_tile_began_anew_are_no_falls_within_a_minute():
    """After hours its clock began at 0, and what fell once in two minutes from then on was called loose."""
    health = SensorHealth(default_floor(1, 1), 100.0)
    for began_s in (36_000.0, 0.0, 120.0):
        forces = np.full((400, 4), 150.0) + np.arange(400)[:, None] % 2
        forces[:100], forces[300:303, 0] = 0.0, 0.0
        time_s = began_s + np.arange(400) / 100.0
        health.feed(np.zeros(400, int), time_s, time_s, (20 * forces).astype(int), forces)
    assert not health.take_notices()


@pytest.mark.parametrize(("well_s", "times"), [(61, 2), (30, 1)])
def test_a_fault_is_named_again_where_its_sensor_was_well_for_a_while(well_s, times):
    """What failed again a week after its repair was not said in a session that went on."""
    stands = [(2, False), (3, True), (2, False), (well_s, False), (2, False), (3, True), (2, False)]
    forces = np.concatenate([np.full((100 * s, 1, 4), 150.0 * (k % 2)) for k, (s, _) in enumerate(stands)])
    is_dead = np.concatenate([np.full(100 * s, dead) for s, dead in stands])
    forces[is_dead, 0, 2] = 0.0
    said = found(default_floor(1, 1), forces, rate_hz=100.0)
    assert [line.partition(" (")[0] for line in said] == ["tile t1: sensor 3 is dead"] * times


def test_faults_are_there_for_as_long_as_they_last():
    """The map of the floor marks them: noise that has stopped, and a sensor that is well again, are not there."""
    hum = 8.0 * np.sin(2.0 * np.pi * 50.0 * np.arange(3000) / 1000.0)[:, None, None] * np.array([0.0, 1.0, 0.0, 0.0])
    stands = np.full((3000, 1, 4), 150.0)
    well = np.concatenate([np.zeros((3000, 1, 4)), np.full((61_000, 1, 4), 150.0)])
    dead = changed(stands, 0, 2, np.zeros_like)
    floor = default_floor(1, 1)
    parts = [hum, np.zeros((3000, 1, 4)), dead, well]
    known = [fed(floor, np.concatenate(parts[:n])).faults for n in (1, 2, 3, 4)]
    assert [list(faults) for faults in known] == [[("t1", 2)], [], [("t1", 3)], []]
    assert known[0]["t1", 2].startswith("sensor 2 is noisy (swings by 8 N 50 times")
    assert len(found(floor, np.concatenate([hum, parts[1], hum]))) == 1  # shakers come and go: it is told once


def test_all_sensors_of_which_some_are_swapped_are_faulty():
    faults = fed(default_floor(), swapped(2, (0, 1), walked(2, 2))).faults
    assert list(faults) == [("t3", 1), ("t3", 2), ("t3", 3), ("t3", 4)]
    assert set(faults.values()) == {"sensors 1 and 2 or 3 and 4 are swapped"}


@pytest.mark.parametrize("hum_n", [8.0, 40.0])
def test_a_noisy_tile(hum_n):
    """Its steps were gone, in silence: each wave of the hum of the mains was a contact."""
    hum = hum_n * np.sin(2.0 * np.pi * 50.0 * np.arange(len(walked())) / 1000.0)
    forces = walked().copy()
    forces[:, 1] += hum[:, None]
    (line,) = found(FLOOR, forces)
    assert line == (
        f"tile t2: sensors 1, 2, 3, 4 are noisy (swings by {hum_n:.0f} N 50 times a second with nobody on the tile; "
        "hum of the mains, or its shaker?)"
    )


def swapped(tile, pair, forces=None):
    out = (walked() if forces is None else forces).copy()
    out[:, tile, list(pair)] = out[:, tile, list(pair[::-1])]
    return out


@pytest.mark.parametrize("pair", [(0, 2), (1, 3)])
def test_sensors_across_from_each_other_are_told_by_the_direction_in_which_feet_roll(pair):
    """Also of boards with a clock each, which are switched on one after the other."""
    lines = found(FLOOR, swapped(1, pair), clocks_s=100.0 * np.arange(9))
    turned = "counter-clockwise" if pair == (0, 2) else "clockwise"
    names = f"{pair[0] + 1} and {pair[1] + 1}"
    assert lines == [f"tile t2: sensors {names} are swapped, or it is turned by 90 degrees {turned}"]


@pytest.mark.parametrize(("side", "tile", "pair"), [(2, 2, (0, 1)), (3, 1, (0, 2))])
def test_swapped_sensors_that_were_put_right_are_well_again(side, tile, pair):
    """They were marked until another session."""
    walks = walked(side, side)
    health = fed(default_floor(side, side), np.concatenate([swapped(tile, pair, walks), *[walks] * 3]), chunk=7000)
    wrong, right = health.take_notices()
    assert wrong.endswith("swapped") or "swapped, or" in wrong
    assert right == f"tile t{tile + 1}: its sensors are in their places now"
    assert not health.faults


def test_steps_that_come_from_no_other_tile_do_not_say_that_swapped_sensors_are_right():
    """Those across from each other balance as they are: who goes to and fro on their tile ended the mark."""
    walks = swapped(1, (0, 2))
    alone = walks * (np.arange(9) == 1)[:, None]
    health = fed(FLOOR, np.concatenate([walks, alone, alone]), chunk=7000)
    assert len(health.take_notices()) == 1
    assert set(health.faults) == {("t2", sensor) for sensor in (1, 2, 3, 4)}


@pytest.mark.parametrize(
    ("order", "turn"), [([1, 2, 3, 0], "90 degrees counter-clockwise"), ([2, 3, 0, 1], "180 degrees")]
)
def test_a_turned_tile_is_told_by_the_direction_in_which_feet_roll(order, turn):
    """Two of its sensors were said to be swapped, or nothing was."""
    forces = walked().copy()
    forces[:, 1] = forces[:, 1][:, order]
    (line,) = found(FLOOR, forces)
    assert line.endswith(f"it is turned by {turn}")


@pytest.mark.parametrize(("tile", "pair"), [(1, (0, 1)), (6, (0, 1)), (7, (2, 3)), (8, (1, 2))])
def test_sensors_beside_each_other_are_not_called_a_turned_tile(tile, pair):
    """Feet that roll over them seem to go another way, too, but the diagonals do not balance."""
    lines = found(FLOOR, swapped(tile, pair, walked(seconds=60)))
    assert not any("turned" in line for line in lines)


@pytest.mark.parametrize(("pair", "other"), [((0, 1), (2, 3)), ((1, 2), (0, 3))])
def test_sensors_beside_each_other_are_told_from_their_loads(pair, other):
    (line,) = found(default_floor(), swapped(2, pair, walked(2, 2)))
    both = [f"{a + 1} and {b + 1}" for a, b in (pair, other)]
    assert line in {f"tile t3: sensors {a} or {b} are swapped" for a, b in (both, both[::-1])}


def test_what_the_shaker_of_an_empty_tile_made_hides_no_swapped_sensors():
    time_s = np.arange(3000) / 1000.0
    shaken = np.tile(7.5 * np.sin(2.0 * np.pi * 73.0 * time_s)[:, None, None], (1, 4, 4))
    lines = found(default_floor(), np.concatenate([shaken, swapped(2, (0, 1), walked(2, 2))]))
    assert sum("noisy" in line for line in lines) == 4
    assert [line for line in lines if "noisy" not in line] == ["tile t3: sensors 1 and 2 or 3 and 4 are swapped"]


def test_it_does_not_depend_on_how_the_stream_is_cut():
    forces = changed(swapped(3, (0, 2)), 1, 0, np.zeros_like)
    assert found(FLOOR, forces, chunk=37) == found(FLOOR, forces, chunk=100_000) != []


def test_a_fault_is_told_where_samples_come_one_by_one():
    """As of a board alone: what was found with the last sample that had come was never told."""
    forces = np.concatenate([np.zeros((20, 1, 4)), np.full((120, 1, 4), 150.0) * [1.0, 0.0, 1.0, 1.0]])
    (line,) = found(default_floor(1, 1), forces, rate_hz=100.0, chunk=1)
    assert line == "tile t1: sensor 2 is dead (reads 1000 while its neighbours carry 450 N)"
