"""A rig of hardware: a line's frames become readings, with a load cell beside them."""

import threading
from types import SimpleNamespace

import numpy as np
import pytest
from bare_transport import BareTransport

from underfoot.calibration.procedure import run
from underfoot.calibration.procedures.plate import PlateProcedure
from underfoot.calibration.rig import Sound
from underfoot.calibration.rigs.device import DeviceRig, ReferenceSensor, TileClock, displacement_of, load_cell_of
from underfoot.calibration.rigs.plate import PlateRig, SimulatedFootsteps
from underfoot.devices import transport_reader
from underfoot.devices.framing.wire_format import encode, samples_of
from underfoot.devices.plate import PlateServo
from underfoot.errors import BadValue, DeviceError
from underfoot.floor.layout import default_floor
from underfoot.floor.profile import Profile
from underfoot.floor.simulated_tile import SimulatedTile


class Line(BareTransport):
    """A port that gives what is put into it, and says when all of it was taken; `now_s` is when that was sent."""

    def __init__(self, name="line"):
        self.name, self._waiting, self._more = name, [], threading.Condition()
        self.now_s, self._is_drained = 0.0, False

    def put(self, frames):
        with self._more:
            self._waiting.append((encode(frames), 1e-6 * float(frames[-1, 2])))
            self._is_drained = False

    def read(self):
        with self._more:
            if self._waiting:
                data, self.now_s = self._waiting.pop(0)
                return data
            self._is_drained = True  # who comes back for more has handed on what it had
            self._more.notify_all()
            self._more.wait(0.005)
            return b""

    def drained(self):
        """Wait until the reader has come back for more in vain: then what it had is in the rig."""
        with self._more:
            assert self._more.wait_for(lambda: self._is_drained, 60.0)


@pytest.fixture
def line(monkeypatch):
    """A line of which all comes when it was sent, by the clock of its reader, however late a busy machine reads it."""
    line = Line()
    monkeypatch.setattr(transport_reader, "time", SimpleNamespace(perf_counter=lambda: line.now_s))
    return line


def gathered(rig, line):
    line.drained()
    return rig.read()


def frames(tile, begin, count, readings):
    rows = [[tile, (begin + i) & 0xFFFF, 1000 * (begin + i), *readings(begin + i)] for i in range(count)]
    return np.array(rows)


def test_readings_are_evenly_timed_and_only_of_this_tile(line):
    rig = DeviceRig(line, 3)
    try:
        line.put(frames(3, 0, 50, lambda i: (i, 1, 2, 3)))
        line.put(frames(4, 0, 50, lambda i: (9, 9, 9, 9)))
        readings = gathered(rig, line)
        assert readings.values[:, 0].tolist() == list(range(50))
        assert np.diff(readings.time_s) == pytest.approx(np.full(49, 1e-3), abs=1e-9)
        assert readings.force_n is None
        assert rig.read().time_s.size == 0
        with pytest.raises(BadValue, match="carries no sound"):
            rig.play(Sound(np.zeros(1), 48000, "none"))
    finally:
        rig.close()


def test_a_load_cell_on_the_same_line_is_read_at_the_tile_s_times(line):
    rig = DeviceRig(line, 0, ReferenceSensor(tile=9, sensor=1, units_per_count=0.5, zero=100.0))
    try:
        both = np.empty((100, 7), dtype=int)
        both[0::2] = frames(0, 0, 50, lambda i: (i, 0, 0, 0))
        both[1::2] = frames(9, 0, 50, lambda i: (0, 100 + 4 * i, 0, 0))
        line.put(both)
        readings = gathered(rig, line)
        assert readings.force_n == pytest.approx(2.0 * readings.values[:, 0])
    finally:
        rig.close()


def test_a_load_cell_is_read_at_the_tile_s_times_however_seldom_the_rig_is_read(line):
    rig = DeviceRig(line, 0, ReferenceSensor(tile=9))
    try:
        for i in range(200):
            line.put(np.concatenate([frames(0, i, 1, lambda i: (i, 0, 0, 0)), frames(9, i, 1, lambda i: (i, 0, 0, 0))]))
        readings = gathered(rig, line)
        assert readings.force_n == pytest.approx(readings.values[:, 0])
    finally:
        rig.close()


def test_readings_wait_for_a_load_cell_that_is_slower_than_the_tile(line):
    now_s = [0.0]
    rig = DeviceRig(line, 0, ReferenceSensor(tile=9), silent_s=3.0, clock=lambda: now_s[0])
    try:
        cell, tile = (frames(k, 0, 500, lambda i: (i, 0, 0, 0)) // [1, 1, 1000, 1, 1, 1, 1] for k in (9, 0))
        cell = cell[:401:100]
        cell[:, 1] //= 100
        taken = []
        for k, row in enumerate(cell):
            line.put(np.concatenate([[row], tile[100 * k :][:1]]))
            line.put(tile[100 * k + 1 :][:99])
            taken.append(gathered(rig, line))
        values = np.concatenate([readings.values[:, 0] for readings in taken])
        assert values.tolist() == list(range(401))
        forces = np.concatenate([readings.force_n for readings in taken if readings.time_s.size])
        assert forces == pytest.approx(values, abs=1e-3)
        assert rig.read().time_s.size == 0
        now_s[0] = 3.1
        with pytest.raises(DeviceError, match="nothing comes of tile number 9"):
            rig.read()
    finally:
        rig.close()


@pytest.mark.parametrize("drift", [-0.01, 0.01])
def test_a_load_cell_on_a_board_with_a_clock_of_its_own_stays_with_the_tile(drift, line):
    rig = DeviceRig(line, 0, ReferenceSensor(tile=9))
    try:
        for begin in range(0, 5000, 10):
            cell, tile = (frames(k, begin, 10, lambda i: (i, 0, 0, 0)) for k in (9, 0))
            cell[:, 2] = np.rint((1.0 + drift) * cell[:, 2])
            line.put(np.concatenate([cell, tile]))
        readings = gathered(rig, line)
        assert readings.force_n == pytest.approx(readings.values[:, 0], abs=8.0)
    finally:
        rig.close()


@pytest.mark.parametrize(("tile_late_s", "cell_late_s"), [(0.0, 0.05), (0.05, 0.0)])
def test_a_load_cell_whose_line_holds_up_what_it_carries_stays_with_the_tile(tile_late_s, cell_late_s):
    """It was later by the mean, and where it came by radio, forces of feet 5 % off, and the calibration good."""
    clock, random = TileClock(), np.random.default_rng(1)
    for k in range(800):
        at_us, (tile_late, cell_late) = 10_000 * k, random.uniform(0.0, 1.0, 2)
        one = samples_of([[0, k, at_us, 0, 0, 0, 0]])
        tile_s = clock.times(0, one, 1e-6 * at_us + tile_late_s * tile_late)
        cell_s = clock.times(1, one, 1e-6 * at_us + cell_late_s * cell_late)
        assert k < 300 or abs(cell_s - tile_s) < 0.005


def test_what_a_tile_reads_while_its_load_cell_is_silent_is_left_out(line):
    rig = DeviceRig(line, 0, ReferenceSensor(tile=9))
    try:
        line.put(np.concatenate([frames(k, 0, 100, lambda i: (i, 0, 0, 0)) for k in (9, 0)]))
        line.put(frames(0, 100, 1000, lambda i: (i, 0, 0, 0)))
        line.put(np.concatenate([frames(k, 1100, 100, lambda i: (i, 0, 0, 0)) for k in (9, 0)]))
        readings = gathered(rig, line)
        assert readings.values[:, 0].tolist() == [*range(100), *range(1101, 1200)]
        assert readings.force_n == pytest.approx(readings.values[:, 0])
    finally:
        rig.close()


def test_a_line_on_which_nothing_comes_is_said_to_be_so_after_the_same_time_however_seldom_it_is_read():
    """It was counted in reads, and a page with questions, which is read more seldom, said it after 8 s instead of 3."""
    now_s = [0.0]
    rig = DeviceRig(Line("nowhere"), 0, silent_s=3.0, clock=lambda: now_s[0])
    try:
        now_s[0] = 2.9
        for _ in range(2000):
            assert rig.read().time_s.size == 0
        for end_s in (3.1, 6.2):
            now_s[0] = end_s
            with pytest.raises(DeviceError, match="nothing comes of tile number 0"):
                rig.read()
            rig.read()
    finally:
        rig.close()


def test_a_cell_is_named_in_a_word():
    assert load_cell_of("9.2:-0.05:120") == ReferenceSensor(9, 1, -0.05, 120.0)
    for text in ("9", "9.5:1:0", "9.1:0:0", "a.1:1:1"):
        with pytest.raises(BadValue):
            load_cell_of(text)


class Walker:
    """A person on a plate: what simulated feet press goes over the line of a real rig, as counts."""

    def __init__(self, seed=1):
        tile = default_floor(1, 1).tiles[0]
        self.feet, self.line, self.sent = SimulatedFootsteps(SimulatedTile(tile, seed=seed), seed), Line(), 0
        cell, displacement = load_cell_of("9.1:0.05:120"), displacement_of("9.2:0.001:200")
        self.rig = DeviceRig(self.line, 0, cell, displacement=displacement)
        self.close, self.press = self.rig.close, self.feet.press

    def read(self):
        felt = self.feet.read()
        begin, self.sent = self.sent, self.sent + len(felt.time_s)
        counts = np.rint(np.column_stack([felt.force_n / 0.05 + 120.0, felt.displacement_mm / 0.001 + 200.0])).clip(0)
        both = np.empty((2 * len(counts), 7), dtype=int)
        both[0::2] = frames(0, begin, len(counts), lambda i: felt.values[i - begin].astype(int))
        both[1::2] = frames(9, begin, len(counts), lambda i: (*counts[i - begin].astype(int), 0, 0))
        self.line.put(both)
        return gathered(self.rig, self.line)


def test_a_plate_is_calibrated_through_a_load_cell_and_a_displacement_sensor_on_the_line():
    walker = Walker()
    servo = PlateServo("simulated", clock=walker.feet.now)
    rig = PlateRig(walker, servo)
    try:
        result = run(PlateProcedure(default_floor(1, 1).tiles[0]), rig, {"footsteps": 3, "positions": (0.0, 1.0)})
    finally:
        rig.close()
    found = result.apply(Profile(tile="t1")).plate.stiffness_n_mm
    np.testing.assert_allclose(found, [40.0, 160.0], rtol=0.02)


def test_a_displacement_sensor_is_named_in_a_word():
    assert displacement_of("9.2:-0.001:120") == ReferenceSensor(9, 1, -0.001, 120.0)
    with pytest.raises(BadValue, match=r"displacement is .9\.2.; allowed: TILE\.SENSOR:MM_PER_COUNT:ZERO"):
        displacement_of("9.2")
