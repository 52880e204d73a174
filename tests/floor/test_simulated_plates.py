"""Plates that play, held against SciPy's continuous systems and against the simulated tile that is calibrated."""

from itertools import pairwise

import msgspec
import numpy as np
import pytest
from msgspec.structs import replace
from scipy.signal import lsim

from underfoot.calibration.science.sweep import exponential, train
from underfoot.calibration.science.transfer_function import measure
from underfoot.errors import BadValue
from underfoot.floor.layout import Floor, default_floor
from underfoot.floor.simulated_plates import FADE, SimulatedPlates, foot_places_m
from underfoot.floor.simulated_tile import SimulatedTile
from underfoot.floor.tile_parameters import Accelerometer, TileParameters
from underfoot.models.tile.shaker import Shaker

RATE = 48_000.0
FLOOR = default_floor(1, 2)
QUIET = TileParameters(accelerometer=Accelerometer(noise=0.0))


class Played:
    """Plates that are given drive and load, cut as one likes."""

    def __init__(self, floor=FLOOR, parameters=QUIET, measured_at="accelerometer", block=256, channels=None):
        count = len(floor.tiles)
        channels = list(range(count)) if channels is None else channels
        self.plates = SimulatedPlates(floor, parameters, channels, RATE, block, measured_at)
        self.block, self.count, self.width = block, count, max(channels) + 1

    def play(self, drive, force_n, at_m=(0.0, 0.0), cuts=None, frame=0):
        """`drive` (n, channels); `force_n` (n, tiles) on one place. Blocks are cut at `cuts`, or all alike."""
        n = len(drive)
        signals = np.zeros((3, self.count, n))
        signals[0], signals[1], signals[2] = force_n.T, at_m[0], at_m[1]
        edges = sorted({0, n, *(cuts if cuts is not None else range(0, n, self.block))})
        out, silent = np.zeros((n, self.count)), np.zeros(self.count, np.int64)
        for a, b in pairwise(edges):
            silent[:] = np.where(np.any(drive[a:b, : self.count] != 0.0, axis=0), -1, 0)
            given = np.ascontiguousarray(drive[a:b], np.float32)
            now = np.ascontiguousarray(signals[:, :, a:b])  # as in a session: one version of the kernel for both
            self.plates.apply(given, int((silent < 0).sum()), silent, now, frame + a, 0, b - a)
            out[a:b] = self.plates.out[: b - a]
        return out


def noise(n, width=2, seed=1, size=0.01):
    return (size * np.random.default_rng(seed).standard_normal((n, width))).astype(np.float32).astype(np.float64)


@pytest.mark.parametrize("load", ["none", "standing", "corner"])
def test_a_plate_under_a_constant_load_gives_the_bits_of_the_simulated_tile(load):
    """To the bit: the tile of the same seed, which the wizards measure, under a load that does not change."""
    drive, tile = noise(2000), FLOOR.tiles[1]
    place = {"none": (0.0, 0.0), "standing": (0.0, 0.0), "corner": tuple(0.75 * x for x in tile.sensors_m[0])}[load]
    force_n = np.full((2000, 2), 0.0 if load == "none" else 600.0)
    found = Played().play(drive, force_n, place)[:, 1]
    truth = SimulatedTile(tile, QUIET, seed=1).respond(drive[:, 1], RATE, load)
    np.testing.assert_array_equal(found, truth.astype(np.float32))


@pytest.mark.parametrize("load", ["none", "standing"])
def test_a_linear_plate_is_that_of_scipys_simulation(load):
    """Of a shaker that is linear: SciPy's simulation of shaker and body as continuous systems."""
    tile, time = FLOOR.tiles[0], np.arange(3000) / RATE
    linear = msgspec.structs.replace(QUIET, shaker=Shaker(ceiling_n=1e6, bias=0.0))
    parameters = linear.drawn(1, tile.id)
    drive = np.interp(time, [0, 0.005, 0.01, 0.03], [0, 0.01, -0.007, 0.004])
    motor, body = parameters.shaker.poles(), parameters.assembly(tile, load).poles(parameters.accelerometer_m(tile))

    def answered(system, given):
        total = system.direct * given
        for pole, residue in zip(system.poles, system.residues, strict=True):
            both = pole.imag > 0
            bottom = np.poly([pole, pole.conj()] if both else [pole]).real
            top = [2 * residue.real, -2 * (residue * pole.conj()).real] if both else [residue.real]
            total = total + lsim((top, bottom), given, time)[1]
        return total

    truth = answered(body, answered(motor, drive))
    found = SimulatedTile(tile, linear, seed=1).respond(drive, RATE, load)
    np.testing.assert_allclose(found, truth, rtol=0, atol=1e-9 * np.abs(truth).max())


@pytest.mark.parametrize("force_n", [0.0, 600.0])
def test_the_sweep_of_the_wizard_says_the_same_of_a_plate_in_real_time(force_n):
    """Its equalisers rest on it. At a hundredth of full scale the shaker is linear, as a transfer function is."""
    sweep = train(exponential(10.0, 2000.0, 4.0, RATE, 0.01), 1, RATE)
    drive = np.column_stack([sweep, np.zeros(sweep.size)])
    heard = Played().play(drive, np.full(drive.shape, force_n))[:, 0]
    found = measure(sweep, heard, RATE)
    inside = (found.frequencies_hz >= 60.0) & (found.frequencies_hz <= 700.0)
    truth = SimulatedTile(FLOOR.tiles[0], QUIET).transfer(
        found.frequencies_hz[inside], "standing" if force_n else "none"
    )
    assert np.abs(20.0 * np.log10(found.magnitude[inside] / np.abs(truth))).max() < 0.1


def test_bytes_do_not_depend_on_blocks_while_a_foot_comes_rolls_and_goes():
    """Under the foot, a plate at rest begins to move in the middle of a span."""
    n = 9600
    drive = noise(n, size=0.05)
    drive[:1610] = drive[7000:] = 0.0
    drive[2000:2300, 0] = 0.0
    force_n = np.zeros((n, 2))
    force_n[1500:6000] = 400.0
    along = np.interp(np.arange(n), [1500, 6000], [-0.12, 0.12])
    whole = Played(block=n).play(drive, force_n, (along, 0.3 * along))
    for seed in range(3):
        cuts = np.random.default_rng(seed).integers(1, n, 400)
        np.testing.assert_array_equal(Played(block=n).play(drive, force_n, (along, 0.3 * along), cuts), whole)


def test_a_foot_changes_what_the_plate_does_without_a_click():
    """A sine that goes on while a foot comes down: no step in the output is greater than the two sines' own."""
    n = 9600
    tone = 0.05 * np.sin(2 * np.pi * 150.0 * np.arange(n) / RATE)
    drive, force_n = np.stack([tone, tone], axis=1), np.zeros((n, 2))
    force_n[4800:] = 500.0
    found = Played().play(drive, force_n)[:, 0]
    free, stood_on = found[2000:4800], found[-2000:]
    own = max(np.abs(np.diff(free)).max(), np.abs(np.diff(stood_on)).max())
    assert np.abs(np.diff(found[4700 : 4900 + FADE])).max() < 1.5 * own
    assert abs(np.std(free) / np.std(stood_on) - 1.0) > 0.1  # there is something to see


def test_a_foot_that_rolls_changes_what_the_plate_does_without_a_click():
    """Heel to toe over the tile while a sine goes on: as smooth as the sine with a foot that stands."""
    n = 24_000
    tone = 0.05 * np.sin(2 * np.pi * 150.0 * np.arange(n) / RATE)
    drive, force_n = np.stack([tone, tone], axis=1), np.full((n, 2), 500.0)
    along = np.interp(np.arange(n), [4800, 20_000], [-0.1, 0.1])
    found = Played(block=n).play(drive, force_n, (along, 0.3 * along))[:, 0]
    stands = [np.abs(np.diff(found[part])).max() for part in (slice(2400, 4800), slice(21_600, n))]
    assert np.abs(np.diff(found[4800:21_600])).max() < 1.5 * max(stands)


def test_under_the_foot_nothing_is_felt_unless_somebody_stands_there():
    drive, force_n = noise(3000), np.zeros((3000, 2))
    force_n[1000:, 1] = 500.0
    found = Played(measured_at="foot").play(drive, force_n)
    assert not found[:, 0].any()
    assert not found[:1000, 1].any()
    assert np.std(found[2000:, 1]) > 0.0


def test_a_plate_that_has_rung_out_is_exactly_at_rest():
    played = Played()
    drive, force_n = noise(48_000), np.zeros((48_000, 2))
    drive[100:] = 0.0
    found = played.play(drive, force_n)
    assert played.plates.awake() == (False, False)
    assert not found[-1000:].any()
    last = np.flatnonzero(found[:, 0])[-1]
    assert 100 < last < 47_000
    again = played.play(drive[:500], force_n[:500], frame=48_000)
    np.testing.assert_array_equal(again, found[:500])


def test_what_a_long_block_left_does_not_come_back_after_short_ones():
    drive = noise(48_000)
    drive[256:] = 0.0
    played = Played(block=256)
    found = played.play(drive, np.zeros((48_000, 2)), cuts=range(256, 48_000 - 255, 64))
    assert found[:256].any()
    assert played.plates.awake() == (False, False)
    assert not found[-256:].any()


def test_tiles_on_one_channel_share_its_drive_and_one_without_a_channel_is_still():
    drive, force_n = noise(1000, width=1), np.zeros((1000, 2))
    found = Played(channels=[0, 0]).play(np.repeat(drive, 2, axis=1)[:, :1], force_n)
    assert found[:, 0].any()
    assert found[:, 1].any()
    assert not Played(channels=[0, -1]).play(drive, force_n)[:, 1].any()


def test_a_foot_anywhere_is_within_a_decibel_of_the_exact_plate():
    """Of impulses on a tile that a foot stands on, beside the transfer function with the foot at that very place."""
    tile = FLOOR.tiles[0]
    drawn = QUIET.drawn(1, tile.id)
    frequencies = np.arange(20.0, 1000.0, 5.0)
    n, worst_db = 14_400, 0.0
    drive, force_n = np.zeros((n, 2)), np.full((n, 2), 600.0)
    drive[10] = 1e-3
    shaker = drawn.shaker.transfer(frequencies)
    for x, y in ((0.0083, 0.0083), (-0.081, 0.033), (0.12, -0.107), (-0.055, -0.058)):
        found = Played(block=n).play(drive, force_n, (x, y))[:, 0].astype(np.float64)
        # what goes in is a triangle of two samples, and has its spectrum
        turn = np.exp(-2j * np.pi * np.outer(frequencies, np.arange(n) - 10) / RATE)
        response = turn @ found / (1e-3 * np.sinc(frequencies / RATE) ** 2)
        body = replace(drawn.assembly(tile, "standing"), foot_m=(x, y))
        truth = shaker * body.transfer(frequencies, drawn.accelerometer_m(tile))
        worst_db = max(worst_db, np.abs(20.0 * np.log10(np.abs(response / truth))).max())
    assert worst_db < 1.0


def test_places_of_a_foot_are_a_grid_and_other_points_of_measurement_are_refused():
    places = np.array(foot_places_m(FLOOR.tiles[0]))
    assert places.shape == (289, 2)
    assert np.abs(places).max() < 0.5 * FLOOR.tiles[0].size_m[0]
    with pytest.raises(BadValue, match="measured_at is 'ear'; allowed: accelerometer, foot"):
        SimulatedPlates(Floor(FLOOR.tiles), None, [0, 1], RATE, 64, measured_at="ear")
