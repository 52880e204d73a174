"""What tiles of hardware send becomes rows of forces: by hand, over a transport that gives what it is given."""

import itertools
import math
import threading
import time
import tracemalloc
from collections import deque
from contextlib import contextmanager

import numpy as np
import pytest
from bare_transport import BareTransport
from made_curves import line

from underfoot.devices import transport_reader
from underfoot.devices.conversion import Conversion, nominal_force
from underfoot.devices.device_floor import DeviceFloor
from underfoot.devices.framing.parser import Parser
from underfoot.devices.framing.wire_format import SAMPLE, csv_lines, encode, samples_of
from underfoot.devices.recurrence import LAST, OFTEN
from underfoot.devices.transport_reader import TransportReader
from underfoot.errors import BadValue, DeviceError
from underfoot.floor.curves import Curve
from underfoot.floor.layout import default_floor
from underfoot.floor.profile import Fsr, Profile

RATE = 48_000.0


class Given(BareTransport):
    """A transport over which comes what a test puts there."""

    def __init__(self):
        self._data = deque()
        self._some = threading.Event()

    def put(self, data):
        self._data.append(data)
        self._some.set()

    def read(self):
        if not self._data and not self._some.wait(0.02):
            return b""
        self._some.clear()
        return self._data.popleft() if self._data else b""


@contextmanager
def device_floor(floor, **options):
    """A floor of hardware, and a function that sends samples of it: (tile, sequence, microseconds, reading) each."""
    transport = Given()
    source = DeviceFloor(transport, floor, RATE, **options)
    source.start()

    def send(samples, write=encode):
        transport.put(write([[tile, number, time, *[reading] * 4] for tile, number, time, reading in samples]))

    try:
        yield source, send
    finally:
        source.close()


def pulled(source, until, accepted, step=128):
    """All rows, asked for block by block until so many frames were found and nothing more comes: stamps and forces."""
    state = {"frame": source.end, "idle": 0}
    stamps, forces, arrivals = [], [], []

    def poll():
        state["frame"] += step
        count = source.pull(state["frame"])
        stamps.extend(source.stamps[:count])
        arrivals.extend(source.arrivals[:count])
        forces.extend(source.forces[:count].copy())
        state["idle"] = 0 if count or source.counts.accepted < accepted else state["idle"] + 1
        return state["idle"] > 40

    until(poll, "all samples come", 20.0, every=step / RATE)
    return np.array(stamps), np.array(forces), np.array(arrivals)


def whole(forces):
    """Which tiles have a sample in each row, as text."""
    return ["".join("-x"[int(x)] for x in row) for row in np.isfinite(forces[:, :, 0])]


def test_readings_become_newtons_and_times_frames(until):
    floor = default_floor(1, 2)
    with device_floor(floor) as (source, send):
        send([(t, i, 1000 * i, 1000 + 20 * i + t) for i in range(200) for t in (0, 1)])
        stamps, forces, arrivals = pulled(source, until, 400)
    np.testing.assert_allclose(forces[:, 0], np.repeat(np.arange(200.0)[:, None], 4, axis=1), atol=1e-9)
    np.testing.assert_allclose(forces[:, 1] - forces[:, 0], 0.05, atol=1e-9)
    assert (np.diff(stamps) > 0.0).all()
    assert stamps[-1] - stamps[0] == pytest.approx(199 * 48.0, rel=0.06)
    assert (np.diff(arrivals) >= 0.0).all()
    assert source.late == 0


def test_a_lost_sample_is_missing_in_its_row_and_a_lost_row_is_not_there(until):
    with device_floor(default_floor(1, 2)) as (source, send):
        gone = {(5, 1), (9, 0), (12, 0), (12, 1)}
        send([(t, i, 1000 * i, i) for i in range(20) for t in (0, 1) if (i, t) not in gone])
        stamps, forces, _ = pulled(source, until, 36)
    assert whole(forces) == ["xx"] * 5 + ["x-"] + ["xx"] * 3 + ["-x"] + ["xx"] * 2 + ["xx"] * 7
    steps = np.rint(np.diff(stamps) / 48.0)
    assert steps.tolist() == [1.0] * 11 + [2.0] + [1.0] * 6


def test_a_sample_that_is_out_of_order_stands_where_it_belongs(until):
    with device_floor(default_floor(1, 2)) as (source, send):
        samples = [(t, i, 1000 * i, i) for i in range(20) for t in (0, 1)]
        samples[20], samples[23] = samples[23], samples[20]
        send(samples)
        _, forces, _ = pulled(source, until, 40)
    np.testing.assert_array_equal(forces[:, :, 0], nominal_force(np.arange(20))[:, None] * np.ones(2))


def test_tiles_of_clocks_of_their_own_join_the_nearest_row(until):
    """Two tiles that do not know of each other, half an hour apart by their own clocks."""
    with device_floor(default_floor(1, 2)) as (source, send):
        for i in range(0, 600, 3):
            send([(t, k, (2_000_000_000 + 137) * t + 1000 * k, k) for k in range(i, i + 3) for t in (0, 1)])
        _, forces, _ = pulled(source, until, 1200)
    both = np.isfinite(forces[:, :, 0]).all(axis=1)
    assert both.mean() > 0.9
    apart = forces[both][:, 1, 0] - forces[both][:, 0, 0]
    assert np.abs(apart).max() <= 1 / 20.0 + 1e-9


def test_the_first_tile_may_go_and_the_others_stay(until):
    with device_floor(default_floor(1, 2)) as (source, send):
        send([(t, i, 1000 * i, i) for i in range(400) for t in (0, 1) if t or i < 50])
        _, forces, _ = pulled(source, until, 450)
    assert whole(forces) == ["xx"] * 50 + ["-x"] * 350


def test_lines_of_text_are_samples_too(until):
    with device_floor(default_floor(1, 1), rate_hz=200.0) as (source, send):
        send([(0, i, 5000 * i, 3000) for i in range(50)], write=csv_lines)
        stamps, forces, _ = pulled(source, until, 49)
    assert len(forces) == 49  # the first line could have been the end of another
    assert (forces == 100.0).all()
    assert np.rint(np.diff(stamps) / 240.0).tolist() == [1.0] * 48


def test_a_tile_that_the_floor_does_not_have_and_a_wrong_rate_are_said(until):
    """But for a load cell on the line, which a calibration knows by its number. What these lose is no force of the
    floor: `Lost` was red for a load cell out of reach.
    """
    with device_floor(default_floor(1, 2), beside=(9,)) as (source, send):
        send([(t, i, 2000 * i, 0) for i in range(300) for t in (0, 2, 7, 9) if t != 9 or i % 3])
        pulled(source, until, 1100)
        said = source.take_notices()
        assert source.take_notices() == []
        assert (source.lost, source.counts.lost) == (0, 99)
    assert said[0] == "uncalibrated: t1, t2 (20 counts a newton are assumed)"
    assert "frames of tile 2, 7, which the floor does not have (0 to 1 are t1 to t2)" in said
    assert "tile t1 sends 500 samples a second by its microseconds, not 1000" in said


@pytest.mark.parametrize("times", [2, 10])
def test_a_tile_that_sends_twice_or_ten_times_as_often_as_said_is_felt_all_the_same(until, times):
    """Each of its samples belonged to the row of the one before, so that the first row was the last."""
    with device_floor(default_floor(1, 1)) as (source, send):
        send([(0, i, 1000 * i // times, 1000 + i) for i in range(300 * times)])
        stamps, forces, _ = pulled(source, until, 300 * times)
    assert len(stamps) == 300
    np.testing.assert_allclose(np.diff(stamps), 48.0, atol=1e-6)
    assert (np.diff(forces[:, 0, 0]) > 0.0).all()


def test_a_device_without_a_clock_is_said(until):
    """As of a first sketch; nothing was felt and nothing was said."""
    with device_floor(default_floor(1, 2)) as (source, send):
        send([(t, i, 1000 * i if t else 0, 0) for i in range(300) for t in (0, 1)])
        pulled(source, until, 300)
        assert "tile t1 sends the same microseconds in all frames, so its samples have no time" in source.take_notices()


def test_a_clock_that_runs_backwards_is_said(until):
    """Each second frame was a new start, and half of the samples were played, in silence."""
    with device_floor(default_floor(1, 2)) as (source, send):
        send([(t, i, 1000 * i if t else 1_000_000 - 1000 * i, 0) for i in range(300) for t in (0, 1)])
        pulled(source, until, 300)
        said = source.take_notices()
    assert "tile t1 sends microseconds that fall from frame to frame, so its samples have no time" in said


@pytest.mark.parametrize("step", [0, -1])
def test_frame_numbers_that_do_not_rise_are_said(until, step):
    """Nearly all frames were taken for old ones; nothing was felt and nothing was said."""
    with device_floor(default_floor(1, 2)) as (source, send):
        send([(t, i if t else (step * i) % 65536, 1000 * i, 0) for i in range(500) for t in (0, 1)])
        pulled(source, until, 500)
        said = source.take_notices()
    assert "tile t1 sends frame numbers that do not rise, so its frames are taken for old ones" in said


@pytest.mark.parametrize(
    ("number", "words"),
    [
        (lambda i, t: 2 * i + t, "tile t1: 50% of its frames are lost, by their numbers, which must rise by 1"),
        (lambda i, t: i % 256, "tile t1 began anew 5 times; is its power steady, and do its numbers go up to 65535,"),
        (lambda i, t: i % 256 << 8 | i >> 8, "tile t1 sends frame numbers that leap by 64 or more, and must rise by 1"),
        (lambda i, t: i // 5, "tile t1: 80% of its frames are left out: their numbers are not new; are they sent"),
    ],
)
def test_frame_numbers_that_are_not_those_of_a_tile_are_said(until, number, words):
    """A counter for all tiles (whose clocks stood still, it said), of eight bits, of swapped bytes, shared by five."""
    with device_floor(default_floor(1, 2)) as (source, send):
        send([(t, number(i, t), 1000 * i, 0) for i in range(1500) for t in (0, 1)])
        said = []
        until(lambda: said.extend(source.take_notices()) or words in str(said), "it is said", seen=lambda: said)
    assert not any("same microseconds" in line for line in said)


def test_damaged_frames_are_said_and_an_outage_is_none(until):
    def damaged(rows):
        data = bytearray(encode(rows))
        data[5 :: 23 * 10] = b"\1" * len(data[5 :: 23 * 10])
        return bytes(data)

    with device_floor(default_floor(1, 1)) as (source, send):
        send([(0, i, 1000 * i, 0) for i in (*range(600), *range(3000, 3600))])
        until(lambda: source.counts.lost == 2400, "all came")
        assert not any("lost" in line for line in source.take_notices())
        send([(0, i, 1000 * i, 0) for i in range(3600, 6000)], write=damaged)
        until(lambda: any(line.startswith("given: ") for line in source.take_notices()), "it is said")


def test_a_tile_that_is_silent_while_others_send_is_said_until_it_sends(until):
    """A board without power, or with another's number: nothing was said of its tile."""
    with device_floor(default_floor(1, 3)) as (source, send):
        said, numbers = [], itertools.count()

        def hears(tiles, words):
            number = next(numbers)
            send([(t, number, 16_667 * number, 1000) for t in tiles])
            said.extend(source.take_notices())
            return words in said

        until(lambda: hears((1,), "nothing comes from t1, t3, while others send"), "it is said", seen=lambda: said)
        until(lambda: hears((0, 1), "frames come from t1 now"), "it is said", seen=lambda: said)
        until(lambda: hears((0,), "nothing comes from t2, while others send"), "it is said", seen=lambda: said)
    assert not any("t3" in line for line in said[said.index("frames come from t1 now") :])


def test_the_silence_of_a_tile_that_sends_only_what_changes_is_said_five_times_an_hour(monkeypatch):
    """Each step on such a floor was two lines in an installation's log."""
    now, said = [1000.0], []
    monkeypatch.setattr(time, "perf_counter", lambda: now[0])
    source = DeviceFloor(Given(), default_floor(1, 2), RATE)
    for k in range(260):  # of a quarter of a second, and an hour before the last fifty
        source.reader.parser.feed(encode([[t, k, 0, *[k % 9] * 4] for t in (0, 1) if t == 0 or k % 20 < 10]))
        now[0] = 1000.25 + 0.25 * k + 3600.0 * (k >= 210)
        said += [line for line in source.take_notices() if "come" in line]
    assert said[::2] == [
        *["nothing comes from t2, while others send"] * 4,
        "nothing comes from t2, while others send; t2 so often that it is said no more for an hour",
        *["nothing comes from t2, while others send"] * 3,
    ]
    assert said[1::2] == ["frames come from t2 now"] * 7


def test_the_silence_of_a_line_and_what_cannot_be_read_are_said_five_times_an_hour(until, monkeypatch):
    """Of boards that sleep, and of a loose wire, they filled an installation's log."""
    said = []
    with device_floor(default_floor(1, 1)) as (source, send):
        for k in range(7):
            monkeypatch.setattr(transport_reader, "SILENT_S", 0.0)
            until(lambda: source.reader.trouble == "given: nothing comes", "it is trouble")
            monkeypatch.setattr(transport_reader, "SILENT_S", math.inf)  # or it may be trouble again before one looks
            send([(0, k, 1000 * k, 0)])
            until(lambda k=k: source.counts.accepted == k + 1 and not source.reader.trouble, "it came")
        said += [line for line in source.take_notices() if line.startswith("given")]
        for k in range(7, 14):
            monkeypatch.setattr(transport_reader, "SILENT_S", 0.0)
            source.reader.transport.put(bytes(600))
            until(lambda: "no frame" in source.reader.trouble, "it is trouble")
            monkeypatch.setattr(transport_reader, "SILENT_S", math.inf)
            send([(0, k, 1000 * k, 0)])
            until(lambda k=k: source.counts.accepted == k + 1 and not source.reader.trouble, "it came")
        lines = [line for line in source.take_notices() if "no frame" in line]
    assert len(lines) == OFTEN
    assert lines[-1].endswith(LAST)
    assert said[0] == "given: nothing comes"
    assert said[8:] == ["given: nothing comes; so often that it is said no more for an hour", "given sends again"]


def test_a_port_with_a_loose_plug_does_not_hide_that_others_go_away(until):
    """After the fifth time within an hour, the loss of another port, or of all, was told by nothing."""
    lost = iter([*["a is gone"] * (OFTEN + 2), "b is gone"])

    class Ports(BareTransport):
        def read(self):
            self.lost = list(itertools.islice(lost, 1))
            if not self.lost:
                raise DeviceError("all are gone")
            return b""

    reader = TransportReader(Ports(), lambda samples, when: None)
    reader.start()
    try:
        until(lambda: reader.trouble, "all are gone")
    finally:
        reader.close()
    often = ["a is gone"] * (OFTEN - 1)
    assert reader.take_notices() == [*often, f"a is gone; {LAST}", "b is gone", "all are gone; waiting for it"]


def test_what_cannot_be_read_is_said_after_a_silence_too(until, monkeypatch):
    """Of a board that boots for a second, and then sends at another rate, it was said that nothing comes."""
    monkeypatch.setattr(transport_reader, "SILENT_S", 0.0)
    with device_floor(default_floor(1, 1)) as (source, _):
        until(lambda: source.reader.trouble == "given: nothing comes", "it is trouble")
        source.reader.transport.put(bytes(600))
        until(lambda: "600 bytes came, but no frame" in source.reader.trouble, "the other trouble is told")
        silent, unread = (line for line in source.take_notices() if "given" in line)
    assert silent == "given: nothing comes"
    assert unread.startswith("given: 600 bytes came, but no frame: ")


def test_the_drift_of_a_device_clock_is_said_once_it_is_known(monkeypatch):
    """Six seconds of a clock whose second lasts 120 ppm longer, of which each sample takes 2 ms to arrive."""
    now = [1000.0]
    monkeypatch.setattr(time, "perf_counter", lambda: now[0])
    source = DeviceFloor(Given(), default_floor(1, 1), RATE)
    source.take_notices()
    said = []
    for block in range(600):
        sent = samples_of([[0, i, 1000 * i, 1000, 1000, 1000, 1000] for i in range(10 * block, 10 * block + 10)])
        now[0] = 1000.002 + 0.01 * (block + 1) * (1.0 + 120e-6)
        source.receive(sent, now[0])
        source.pull(480 * (block + 1))
        said += [(block, line) for line in source.take_notices()]
    ((block, line),) = said
    assert line.startswith("device clock: +120.0 ppm, fitted to 0.000 ms; samples are held for ")
    assert block == 500  # its first sample, at 5 s by the device's clock, closes the twentieth window of a quarter


def test_samples_keep_to_the_clock_of_a_card_that_is_slower_than_the_computers(monkeypatch):
    """Otherwise they were late by more and more: an hour of 100 ppm is a third of a second."""
    now = [1000.0]
    monkeypatch.setattr(time, "perf_counter", lambda: now[0])
    source, stamps = DeviceFloor(Given(), default_floor(1, 1), RATE), []
    for block in range(900):
        sent = samples_of([[0, i, 1000 * i, 1000, 1000, 1000, 1000] for i in range(10 * block, 10 * block + 10)])
        now[0] = 1000.0 + 0.01 * (block + 1)
        source.receive(sent, now[0])
        stamps += source.stamps[: source.pull(round(480 * (block + 1) / 1.001))].tolist()
    assert np.diff(stamps[-4000:]).mean() == pytest.approx(48.0 / 1.001, abs=0.002)


@pytest.mark.parametrize("block", [64, 480])
def test_latency_is_measured_from_when_a_sample_could_arrive_to_the_frame_that_it_changes(monkeypatch, block):
    """Even links and blocks: what a sample waits for is the next block, at most, and so long are all held."""
    now = [1000.0]
    monkeypatch.setattr(time, "perf_counter", lambda: now[0])
    source = DeviceFloor(Given(), default_floor(1, 1), RATE)
    sent, late = 0, []
    for end in range(block, 11 * 48_000, block):
        came = int((end - block) / 48.0 + 0.01) + 1
        for i in range(sent, came):
            source.receive(samples_of([[0, i, 1000 * i, 0, 0, 0, 0]]), 1000.0 + i * 1e-3)
        sent, now[0] = came, 1000.0 + (end - block) / RATE
        count = source.pull(end)
        late += list(source.arrivals[:count] > source.stamps[:count] + 1e-6)
    wait_s = max((-48 * i) % block for i in range(64)) / RATE
    assert source.latency_s == pytest.approx(wait_s, rel=0.02, abs=2e-5)
    assert np.mean(late[8_000:]) < 0.02


@pytest.mark.parametrize(
    "steps",
    [{202: -20_000}, {203: -3_000_000}, {200: -150_000, 301: 150_000, 352: -150_000}, {202: -9_000, 204: -90_000_000}],
)
def test_a_tile_whose_clock_steps_goes_on_within_two_samples(monkeypatch, steps):
    """Also in the middle of what a block takes, and again in the very next samples."""
    now = [1000.0]
    monkeypatch.setattr(time, "perf_counter", lambda: now[0])
    source, parser = DeviceFloor(Given(), default_floor(1, 2), RATE), Parser()
    time_us, stamps = 0, []
    for i in range(600):
        time_us += 1000 + steps.get(i, 0)
        now[0] = 1000.0 + 1e-3 * i
        sent = encode([[tile, i, time_us & 0xFFFF_FFFF, *[1000] * 4] for tile in (0, 1)])
        source.receive(parser.feed(sent), now[0])
        if i % 4 == 3:
            stamps += source.stamps[: source.pull(48 * i)].tolist()
    assert 600 - len(stamps) <= 2 * len(steps)
    assert np.diff(stamps).min() > 0.0


@pytest.mark.parametrize(("reading", "held_ms", "blocks", "least_s"), [
    (3_000, 70, 60, 0.475), (1_000, 70, 60, 0.425), (3_000, 300, 120, 0.196),
])  # fmt: skip
def test_the_time_under_a_foot_goes_on_where_samples_were_held_up_and_that_of_an_empty_tile_jumps(
    monkeypatch, reading, held_ms, blocks, least_s
):
    """At first all come late, as at the start of a busy machine, and then in time: half a second. By more than 0.2 s
    vibration does not lag under a foot, either.
    """
    now = [1000.0]
    monkeypatch.setattr(time, "perf_counter", lambda: now[0])
    source, stamps, sent = DeviceFloor(Given(), default_floor(1, 1), RATE), [], 0
    for block in range(400):
        now[0] = 1000.0 + 0.005 * block
        come = max(5 * block - held_ms * (block < blocks), 0)
        samples = [[0, i, 1000 * i, *[reading] * 4] for i in range(sent, come)]
        source.receive(samples_of(samples) if samples else np.zeros(0, SAMPLE), now[0])
        sent = max(come, sent)
        stamps += source.stamps[: source.pull(240 * (block + 1))].tolist()
    assert np.subtract(stamps[500:], stamps[:-500]).min() / RATE == pytest.approx(least_s, abs=0.007)
    assert source.latency_s < 0.02  # at the end both are where they belong


def test_a_rate_that_no_tile_has_is_refused():
    with pytest.raises(BadValue, match=r"rate_hz is 1\.0; allowed: 20 to 100000 Hz"):
        DeviceFloor(Given(), default_floor(1, 1), RATE, rate_hz=1.0)


def test_hundreds_of_blocks_leave_nothing_behind(until):
    floor = default_floor(2, 2)
    with device_floor(floor) as (source, send):
        send([(t, i, 1000 * i, i) for i in range(4000) for t in range(4)])
        until(lambda: source.counts.accepted == 16_000, "all came")
        source.close()  # what the reading thread allocates is its own
        source.pull(4800)
        ends = range(4928, 4928 + 128 * 1000, 128)
        tracemalloc.start()
        try:
            for end in ends[:100]:  # whatever is loaded at its first use
                source.pull(end)
            before, _ = tracemalloc.get_traced_memory()
            for end in ends[100:]:
                source.pull(end)
            after, _ = tracemalloc.get_traced_memory()
        finally:
            tracemalloc.stop()
    assert after - before < 512  # numbers that became longer


# --- readings to newtons ---


def calibrated(tile, uncalibrated=""):
    curve = line(slope=0.5, rest=100.0)
    last = Curve(uncalibrated=uncalibrated) if uncalibrated else curve
    return Profile(tile=tile, fsr=Fsr(made="2026-01-01", sensors=(curve, curve, curve, last)))


def test_a_profile_turns_readings_into_newtons_and_others_are_flagged():
    conversion = Conversion(default_floor(1, 2), {"t2": calibrated("t2")})
    rows = np.array([0, 1])
    readings = np.array([[1000, 3000, 5000, 1020], [100, 600, 1100, 350]])
    got = conversion.newtons(rows, readings, np.zeros(2), np.zeros(2, int))
    np.testing.assert_allclose(got, [[0.0, 100.0, 200.0, 1.0], [0.0, 250.0, 500.0, 125.0]])
    assert "uncalibrated: t1 (20 counts a newton are assumed)" in conversion.notices


def test_a_sensor_without_a_curve_is_nominal_and_named():
    conversion = Conversion(default_floor(1, 1), {"t1": calibrated("t1", "it reads the same at any load")})
    got = conversion.newtons(np.array([0]), np.array([[600, 600, 600, 3000]]), np.zeros(1), np.zeros(1, int))
    np.testing.assert_allclose(got, [[250.0, 250.0, 250.0, 100.0]])
    assert any("sensor 4 of t1 is not calibrated" in line for line in conversion.notices)
