"""The simulated tile: its draws, its split, its sensors, and its plate against its own transfer function."""

import numpy as np
import pytest
from scipy.signal import csd, welch

from underfoot.errors import BadValue
from underfoot.floor.layout import LOADS, Tile, default_floor
from underfoot.floor.simulated_sensors import SimulatedSensors
from underfoot.floor.simulated_tile import Plant, SimulatedTile
from underfoot.floor.tile_parameters import Accelerometer, Split, TileParameters
from underfoot.models import gait
from underfoot.models.tile.fsr import Fsr
from underfoot.models.tile.shaker import Shaker

TILE = default_floor(1, 1).tiles[0]
PLACES = np.stack(np.meshgrid(np.linspace(-0.13, 0.13, 9), np.linspace(-0.13, 0.13, 9)), axis=-1).reshape(-1, 2)
SENSORS = np.array(TILE.sensors_m)
QUIET = TileParameters(accelerometer=Accelerometer(noise=0.0, range_m_s2=1e4))


def centroid(forces):
    return forces @ SENSORS / forces.sum(axis=-1, keepdims=True)


def test_the_seed_decides_everything():
    one, same, other = (SimulatedTile(TILE, seed=seed) for seed in (4, 4, 5))
    forces = one.corner_forces(PLACES, 400.0)
    np.testing.assert_array_equal(forces, same.corner_forces(PLACES, 400.0))
    assert one.sense(forces).tobytes() == same.sense(forces).tobytes() != other.sense(forces).tobytes()
    assert one.parts == same.parts != other.parts
    assert one.parameters != other.parameters


def test_tiles_of_one_floor_are_drawn_apart():
    first, second = (SimulatedTile(tile, seed=1) for tile in default_floor(1, 2).tiles)
    assert first.parts != second.parts
    assert (first.split != second.split).any()


def test_a_tile_of_values_at_the_ends_of_their_ranges_is_drawn_within_them():
    kind = TileParameters(sensors=Fsr(hysteresis=1.0, creep=0.4), shaker=Shaker(resonance_hz=500.0, colour_hz=1e4))
    for seed in range(20):
        tile = SimulatedTile(TILE, kind, seed)
        assert max(part.hysteresis for part in tile.parts) <= 1.0
        assert tile.parameters.shaker.colour_hz <= 1e4


def test_the_sum_is_kept_and_the_split_is_as_far_from_bilinear_as_real_plates():
    shares = []
    for seed in range(60):
        forces = SimulatedTile(TILE, seed=seed).corner_forces(PLACES, 500.0)
        np.testing.assert_allclose(forces.sum(axis=1), 500.0)
        ideal = gait.corner_forces(500.0, *PLACES.T, TILE.sensors_m)
        shares.append(float(np.sqrt(np.mean((forces - ideal) ** 2))) / 500.0)
    assert min(shares) > 0.006
    assert max(shares) < 0.033
    assert max(shares) > 2.0 * min(shares)


def test_centroids_are_about_a_millimetre_off_and_right_without_placement():
    off = [centroid(SimulatedTile(TILE, seed=s).corner_forces(PLACES, 500.0)) - PLACES for s in range(60)]
    assert 0.0005 < np.sqrt(np.mean(np.square(off))) < 0.002
    exact = SimulatedTile(TILE, TileParameters(split=Split(placement_m=0.0)), 3)
    np.testing.assert_allclose(centroid(exact.corner_forces(PLACES, 500.0)), PLACES, atol=1e-12)


def test_a_corner_that_lifts_carries_nothing_and_the_others_carry_what_statics_says():
    """Three supports are statically determinate: sum and both moments, plate included, solved for by themselves."""
    lifted = 0
    for seed in range(30):
        tile = SimulatedTile(TILE, TileParameters(split=Split(deviation=0.03, placement_m=0.0)), seed)
        for force in (30.0, 150.0, 600.0):
            carried = tile.corner_forces(PLACES, force) + tile.preload_n
            assert carried.min() > -1e-9
            weight = 4.0 * tile.preload_n
            for row, place in zip(carried, PLACES, strict=True):
                off = row < 1e-9
                if off.sum() == 1:
                    lifted += 1
                    supports = np.vstack([np.ones(3), SENSORS[~off].T])
                    expected = np.linalg.solve(supports, [force + weight, *(force * place)])
                    np.testing.assert_allclose(row[~off], expected, rtol=1e-9, atol=1e-9)
    assert lifted > 100


def test_only_as_much_twist_goes_as_lifts_a_corner():
    tile = SimulatedTile(TILE, seed=6)
    wild = (gait.corner_forces(400.0, *PLACES.T, TILE.sensors_m) @ tile.split.T) + tile.preload_n
    pulls = wild.min(axis=1) < 0.0
    carried = tile.corner_forces(PLACES, 400.0) + tile.preload_n
    np.testing.assert_allclose(carried[~pulls], wild[~pulls], rtol=1e-12)
    np.testing.assert_allclose(carried[pulls].min(axis=1), 0.0, atol=1e-9)
    assert 0 < pulls.sum() < len(pulls)


def test_a_plate_pressed_beyond_its_sensors_is_held_down_by_both_corners_there():
    tile = SimulatedTile(TILE, TileParameters(split=Split(placement_m=0.0)), 3)
    carried = tile.corner_forces([0.15, 0.02], 1000.0) + tile.preload_n
    held = carried[SENSORS[:, 0] < 0.0]
    np.testing.assert_allclose(held, held.mean())
    assert held.mean() == pytest.approx(0.5 * (0.5 * 4.0 * tile.preload_n - 0.5 * 1000.0 * (0.15 / 0.1335 - 1.0)))
    np.testing.assert_allclose(centroid(carried - tile.preload_n), [0.15, 0.02], atol=1e-12)


def test_the_floor_in_real_time_reads_what_the_tile_alone_reads():
    tile, floor = SimulatedTile(TILE, seed=9), default_floor(1, 1)
    split = np.ascontiguousarray(gait.corner_forces(500.0, *PLACES.T, TILE.sensors_m)[:, None, :])
    sensors = SimulatedSensors(floor, TileParameters(), 9, 1000.0, len(PLACES))
    sensors.read(split, 0, len(PLACES))
    np.testing.assert_array_equal(sensors.counts[:, 0], tile.sense(tile.corner_forces(PLACES, 500.0)))


def test_shear_moves_the_centroid_by_depth_times_its_share():
    tile = SimulatedTile(TILE, TileParameters(split=Split(placement_m=0.0)), 3)
    moved = centroid(tile.corner_forces([0.02, 0.03], 600.0, (102.0, 0.0)))
    np.testing.assert_allclose(moved, [0.02 + 0.17 * TILE.sensor_depth_m, 0.03], atol=1e-12)
    leaning = SimulatedTile(TILE, TileParameters(split=Split(placement_m=0.0, shear=0.17)), 3)
    off = centroid(leaning.corner_forces(PLACES, 600.0)) - PLACES
    np.testing.assert_allclose(np.hypot(*off.T), 0.17 * TILE.sensor_depth_m, rtol=1e-9)


def test_no_load_reads_the_tiles_own_weight():
    tile = SimulatedTile(TILE, TileParameters(sensors=Fsr(spread=0.0, noise_counts=0.0, creep=0.0)), 1)
    counts = tile.sense(np.zeros((3, 4)))
    assert counts.min() == counts.max() == round(float(Fsr(spread=0.0).counts(tile.preload_n)))
    assert tile.preload_n == pytest.approx(2.7 * 9.81 / 4.0, rel=0.01)


def test_readings_do_not_depend_on_cuts_and_settling_ends_hysteresis_and_creep():
    forces = SimulatedTile(TILE).corner_forces(PLACES, 400.0)
    whole, parts = SimulatedTile(TILE), SimulatedTile(TILE)
    expected = whole.sense(forces)
    found = np.concatenate([parts.sense(forces[:17]), parts.sense(forces[17:18]), parts.sense(forces[18:])])
    assert expected.tobytes() == found.tobytes()
    calm = SimulatedTile(TILE, TileParameters(sensors=Fsr(noise_counts=0.0)))
    first = calm.sense(np.zeros((1, 4)))
    calm.sense(np.full((5000, 4), 200.0))
    assert (calm.sense(np.zeros((1, 4))) > first).all()
    calm.settle()
    np.testing.assert_array_equal(calm.sense(np.zeros((1, 4))), first)


@pytest.mark.parametrize("load", LOADS)
def test_what_is_played_comes_back_as_the_truth_says(load):
    """Welch's estimate from a minute of noise, small enough for the shaker to be linear."""
    tile, rate = SimulatedTile(TILE, QUIET, 2), 8000
    drive = np.random.default_rng(1).normal(0.0, 0.01, 60 * rate)
    heard = tile.respond(drive, rate, load)
    f, cross = csd(drive, heard, rate, nperseg=2 * rate)
    power = welch(drive, rate, nperseg=2 * rate)[1]
    band = (f >= 40.0) & (f <= 700.0)
    expected = tile.transfer(f[band], load)
    # Straight lines between samples, which the real drive is between, take sinc^2 off at each of two stages.
    expected = expected * np.sinc(f[band] / rate) ** 4
    np.testing.assert_allclose(np.abs(cross[band] / power[band]), np.abs(expected), rtol=0.05)


def test_a_foot_changes_the_response_and_a_corner_changes_it_otherwise():
    tile = SimulatedTile(TILE, QUIET, 2)
    none, standing, corner = (np.abs(tile.transfer([49.0, 150.0], load)) for load in LOADS)
    assert standing[0] < 0.5 * none[0]
    assert corner[1] < 0.8 * none[1]
    assert corner[1] != pytest.approx(standing[1], rel=0.05)


def test_responses_do_not_depend_on_cuts():
    drive = np.random.default_rng(2).normal(0.0, 0.2, 5000)
    whole, parts = SimulatedTile(TILE), SimulatedTile(TILE)
    expected = whole.respond(drive, 48_000.0)
    cut = np.split(drive, [1, 64, 1088, 4000])
    assert expected.tobytes() == np.concatenate([parts.respond(part, 48_000.0) for part in cut]).tobytes()


def test_a_sine_is_distorted_more_the_louder_it_is():
    time = np.arange(16_000) / 16_000.0

    def distortion(level):
        heard = SimulatedTile(TILE, QUIET, 1).respond(level * np.sin(2.0 * np.pi * 300.0 * time), 16_000.0)[-8000:]
        lines = np.abs(np.fft.rfft(heard))[150::150]
        return np.sqrt(np.sum(lines[1:5] ** 2)) / lines[0]

    quiet, middle, loud = (distortion(level) for level in (0.02, 0.3, 0.9))
    assert quiet < 0.005
    assert quiet < middle < loud
    assert 0.05 < loud < 0.3


def test_the_accelerometer_has_noise_and_clips_and_the_drive_clips_at_full_scale():
    device = Accelerometer(noise=1e-3, range_m_s2=5.0)
    tile = SimulatedTile(TILE, TileParameters(accelerometer=device), 1)
    noise = tile.respond(np.zeros(48_000), 48_000.0)
    assert noise.std() == pytest.approx(1e-3 * np.sqrt(24_000.0), rel=0.02)
    loud = tile.respond(np.sin(np.arange(48_000) * 2.0 * np.pi * 50.0 / 48_000.0), 48_000.0)
    assert loud.max() == 5.0
    assert loud.min() == -5.0
    steps = np.sign(np.sin(np.arange(4800) * 2.0 * np.pi * 100.0 / 48_000.0))
    within, beyond = (SimulatedTile(TILE, QUIET, 1).respond(level * steps, 48_000.0) for level in (1.0, 7.0))
    np.testing.assert_array_equal(within, beyond)


def test_a_tile_of_another_size_has_a_plate_and_frame_to_match():
    large = Tile("a", (0.6, 1.2), (0.0, 0.0), sensors_m=((0.21, 0.35), (-0.21, 0.35), (-0.21, -0.35), (0.21, -0.35)))
    parameters = TileParameters()
    mass = parameters.suspension_of(large).mass_kg
    frame = 2.7 - parameters.plate.mass_kg((0.304, 0.304)) - 1.1
    assert mass == pytest.approx(210.0 * 0.0254 * 0.72 + 1.1 + frame * 1.8 / 0.608)
    assert np.isfinite(SimulatedTile(large).respond(np.ones(100), 48_000.0, "corner")).all()


def test_a_tile_moves_in_real_time():
    """The answer to a small kick, in short blocks and in place, against the truth."""
    tile, rate = SimulatedTile(TILE, QUIET), 16_000.0
    plant = Plant(TILE, tile.parameters, rate, "corner")
    heard = np.zeros(16_000)
    heard[10] = 1e-4
    for at in range(0, len(heard), 64):
        block = heard[at : at + 64]
        plant.run(block, block, len(block))
    f = np.fft.rfftfreq(len(heard), 1.0 / rate)
    band = (f >= 30.0) & (f <= 1500.0)
    kick = 1e-4 * np.exp(-2j * np.pi * f[band] * 10.0 / rate) * np.sinc(f[band] / rate) ** 4
    truth = tile.transfer(f[band], "corner")
    np.testing.assert_allclose(np.fft.rfft(heard)[band] / kick, truth, atol=0.02 * np.abs(truth).max())


@pytest.mark.parametrize("sensors", [((0.1, 0), (0, 0.1), (-0.1, 0), (0, -0.1)), ((0.1, 0.1),) * 4])
def test_sensors_that_are_no_upright_rectangle_are_refused(sensors):
    with pytest.raises(BadValue, match="sensors_m is"):
        SimulatedTile(Tile("a", (0.3, 0.3), (0.0, 0.0), sensors_m=sensors))


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda tile: tile.sense(np.zeros((3, 3))), "forces_n is"),
        (lambda tile: tile.sense(np.full((3, 4), np.nan)), "forces_n is"),
        (lambda tile: tile.sense(np.zeros((3, 4)), 0.0), "rate_hz is 0.0"),
        (lambda tile: tile.respond([1.0, np.inf], 48_000.0), "drive is"),
        (lambda tile: tile.respond([0.0], 10.0), "rate_hz is 10.0"),
        (lambda tile: tile.respond([0.0], 48_000.0, "sitting"), "load is 'sitting'; allowed: none, standing, corner"),
        (lambda tile: tile.corner_forces([np.nan, 0.0], 1.0), "at_m is"),
        (lambda tile: tile.corner_forces([0.0, 0.0], np.inf), "force_n is"),
    ],
)
def test_values_that_cannot_be_are_refused(call, message):
    with pytest.raises(BadValue, match=message):
        call(SimulatedTile(TILE))
