"""The emulator: faults made and counted exactly, the same for a seed, and samples at any rate."""

import numpy as np
import pytest

from underfoot.devices.conversion import nominal_readings
from underfoot.devices.emulation.emulator import Emulator, UdpWay
from underfoot.devices.emulation.faults import KINDS, Faults, FaultyLine
from underfoot.devices.framing.parser import Counts, Parser
from underfoot.devices.framing.wire_format import FRAME, encode
from underfoot.devices.replay import Replay
from underfoot.devices.resampled import Resampled
from underfoot.devices.simulated_floor import SimulatedFloor
from underfoot.errors import BadValue
from underfoot.floor.forces import ForceSeries
from underfoot.floor.layout import default_floor

RATE = 48_000.0
FIVE_PERCENT = Faults(*[0.05] * 5)


def rows(count, tiles=3):
    number = np.repeat(np.arange(count), tiles)
    out = np.zeros((len(number), 7), np.int64)
    out[:, 0], out[:, 1], out[:, 2] = np.tile(np.arange(tiles), count), number & 0xFFFF, 1000 * number
    out[:, 3:] = number[:, None] % 60_000
    return out


def expected(sent):
    """What must be counted of frames that went out in this order: rows of tile, sequence, sound or not."""
    good = lost = doubled = reordered = 0
    for tile in np.unique(sent[:, 0]):
        seen, newest = set(), -1
        for number in sent[(sent[:, 0] == tile) & (sent[:, 2] == 1), 1].tolist():
            if number in seen:
                doubled += 1
                continue
            seen.add(number)
            reordered += number < newest
            newest = max(newest, number)
        good += len(seen)
        lost += newest - min(seen) + 1 - len(seen)
    return {"good": good, "lost": lost, "doubled": doubled, "reordered": reordered}


@pytest.mark.parametrize("csv", [False, True])
@pytest.mark.parametrize("seed", [1, 2])
def test_five_percent_of_each_fault_are_counted_exactly_and_no_wrong_sample_is_accepted(csv, seed):
    given = rows(4000)
    line = FaultyLine(FIVE_PERCENT, seed, csv, keep=True)
    data = line.send(given) + line.end()
    parser = Parser()
    got = parser.feed(data).copy()
    counts = expected(np.concatenate(line.sent))
    assert {name: getattr(parser.counts, name) for name in counts} == counts
    np.testing.assert_array_equal(got[:, 2], 1000 * got[:, 1])
    np.testing.assert_array_equal(got[:, 3:7], np.repeat(got[:, 1:2], 4, axis=1))
    assert counts["lost"] == pytest.approx(line.made.lost + line.made.corrupted, abs=3 * 3)  # but for the ends
    assert counts["doubled"] == line.made.doubled
    assert all(getattr(line.made, kind) == pytest.approx(600, rel=0.2) for kind in KINDS)
    assert line.made.corrupted <= parser.counts.corrupted + 1 <= 2 * line.made.corrupted


def test_after_damage_the_next_frame_is_taken():
    """Each frame that went out sound is handed over, whatever went out before it."""
    line = FaultyLine(Faults(corrupted=0.5), seed=5, keep=True)
    data = line.send(rows(2000, tiles=1))
    sent = np.concatenate(line.sent)
    got = Parser("binary").feed(data)
    np.testing.assert_array_equal(got[:, 1], sent[sent[:, 2] == 1, 1])


@pytest.mark.parametrize("lengths", [[1], [7, 100], [6000]])
def test_faults_do_not_depend_on_how_frames_are_split(lengths):
    given = rows(2000)
    whole = FaultyLine(FIVE_PERCENT, seed=3)
    expected = whole.send(given) + whole.end()
    line, parts, at, turn = FaultyLine(FIVE_PERCENT, seed=3), [], 0, 0
    while at < len(given):
        length = lengths[turn % len(lengths)]
        parts.append(line.send(given[at : at + length]))
        at, turn = at + length, turn + 1
    assert b"".join([*parts, line.end()]) == expected
    assert line.made == whole.made


def test_without_faults_frames_go_out_as_they_are():
    given = rows(50)
    line = FaultyLine()
    assert line.send(given) + line.end() == encode(given)
    assert line.made.frames == 150


def test_late_frames_come_behind_so_many_more_of_their_tile():
    line = FaultyLine(Faults(late=0.02, late_frames=30), seed=1, keep=True)
    line.send(rows(2000, tiles=2))
    line.end()
    sent = np.concatenate(line.sent)
    order = sent[sent[:, 0] == 1, 1]
    place = np.empty(2000, int)
    place[order] = np.arange(2000)
    behind = (place - np.arange(2000))[:1900]
    assert set(behind[behind > 5]) <= {28, 29, 30, 31}
    assert (behind > 5).sum() > 10


@pytest.mark.parametrize(
    ("faults", "message"),
    [
        ({"lost": 1.5}, "lost is 1.5; allowed: 0 to 1"),
        ({"lost": 0.6, "late": 0.6}, "all faults together is 1.2; allowed: at most 1"),
        ({"late_frames": 100}, "late_frames is 100; allowed: 1 to 60"),
        ({"unplugged": ((1.0, 0.0),)}, r"unplugged is \(1.0, 0.0\); allowed: from 0 s on, for more than 0 s"),
    ],
)
def test_faults_that_cannot_be_are_refused(faults, message):
    with pytest.raises(BadValue, match=message):
        Faults(**faults)


def test_tiles_send_what_they_feel_by_one_drifting_clock():
    source = SimulatedFloor(default_floor())
    emulator = Emulator(UdpWay("127.0.0.1", 9), source, microseconds=(1 << 32) - 500_000, drift_ppm=100.0)
    count = source.pull(48_000)
    frames = emulator.frames(source.stamps[:count], source.forces[:count])
    emulator.close()
    assert frames[:8, 0].tolist() == [0, 1, 2, 3, 0, 1, 2, 3]
    np.testing.assert_array_equal(frames[:, 3:].reshape(count, 4, 4), nominal_readings(source.forces[:count]))
    assert len(Parser().feed(encode(frames))) == len(frames)
    passed = (frames[-1, 2] - frames[0, 2]) & 0xFFFF_FFFF
    assert passed == round(1000 * (count - 1) / (1 + 100e-6))


@pytest.mark.parametrize("rate_hz", [250.0, 1000.0, 1600.0])
def test_another_rate_lies_on_straight_lines_and_leaves_gaps_open(rate_hz):
    time_s = np.r_[np.arange(100), np.arange(150, 300)] / 240.0
    force_n = np.random.default_rng(2).normal(0.0, 100.0, (250, 4, 4))
    source = Replay(ForceSeries(time_s, force_n, 240.0), default_floor(), RATE)
    resampled = Resampled(source, rate_hz, RATE)
    stamps, forces = [], []
    for end in range(1000, 70_000, 1000):
        count = resampled.pull(end)
        stamps.append(resampled.stamps[:count].copy())
        forces.append(resampled.forces[:count].copy())
    at_s, got = np.concatenate(stamps) / RATE, np.concatenate(forces)
    wanted = np.arange(int(299 / 240.0 * rate_hz) + 1) / rate_hz
    wanted = wanted[(wanted <= 99 / 240.0 + 1e-9) | (wanted >= 150 / 240.0 - 1e-9)]
    np.testing.assert_allclose(at_s, wanted, atol=1e-9)
    np.testing.assert_allclose(got[:, 2, 1], np.interp(wanted, time_s, force_n[:, 2, 1]), atol=1e-6)


def test_counts_are_plain_numbers():
    assert Counts() == Counts(0, 0, 0, 0, 0, 0, 0)
    assert FRAME == 23
