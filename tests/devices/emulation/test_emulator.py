"""The emulator: faults made and counted exactly, the same for a seed, and samples at any rate."""

import numpy as np
import pytest
from made_frames import expected_counts

from underfoot.devices.conversion import nominal_readings
from underfoot.devices.emulation.emulator import Emulator, TileClock
from underfoot.devices.emulation.faults import KINDS, FaultInjector, Faults
from underfoot.devices.framing.parser import Parser
from underfoot.devices.framing.wire_format import encode, rows_of, samples_of
from underfoot.devices.replay import Replay
from underfoot.devices.resampled import Resampled
from underfoot.devices.simulated_floor import SimulatedFloor
from underfoot.devices.transports.udp import UdpSender
from underfoot.errors import BadValue
from underfoot.floor.forces import ForceSeries
from underfoot.floor.layout import default_floor

RATE = 48_000.0
FIVE_PERCENT = Faults(*[0.05] * 5)


def samples(count, tiles=3):
    """Samples whose readings tell their number."""
    number = np.repeat(np.arange(count), tiles)
    out = np.zeros((len(number), 7), np.int64)
    out[:, 0], out[:, 1], out[:, 2] = np.tile(np.arange(tiles), count), number & 0xFFFF, 1000 * number
    out[:, 3:] = number[:, None] % 60_000
    return samples_of(out)


@pytest.mark.parametrize("csv", [False, True])
@pytest.mark.parametrize("seed", [1, 2])
def test_five_percent_of_each_fault_are_counted_exactly_and_no_wrong_sample_is_accepted(csv, seed):
    given = samples(4000)
    injector = FaultInjector(FIVE_PERCENT, seed, csv, keep=True)
    data = injector.send(given) + injector.end()
    parser = Parser()
    got = parser.feed(data).copy()
    counts = expected_counts(np.concatenate(injector.sent))
    assert {name: getattr(parser.counts, name) for name in counts} == counts
    np.testing.assert_array_equal(got["microseconds"], 1000 * got["sequence"])
    np.testing.assert_array_equal(got["readings"], np.repeat(got["sequence"][:, None], 4, axis=1))
    assert counts["lost"] == pytest.approx(
        injector.counts.lost + injector.counts.corrupted, abs=3 * 3
    )  # but for the ends
    assert counts["doubled"] == injector.counts.doubled
    assert all(getattr(injector.counts, kind) == pytest.approx(600, rel=0.2) for kind in KINDS)
    assert injector.counts.corrupted <= parser.counts.corrupted + 1 <= 2 * injector.counts.corrupted


def test_after_damage_the_next_frame_is_taken():
    """Each frame that went out intact is handed over, whatever went out before it."""
    injector = FaultInjector(Faults(corrupted=0.5), seed=5, keep=True)
    data = injector.send(samples(2000, tiles=1))
    sent = np.concatenate(injector.sent)
    got = Parser().feed(data)
    np.testing.assert_array_equal(got["sequence"], sent[sent[:, 2] == 1, 1])


@pytest.mark.parametrize("lengths", [[1], [7, 100], [6000]])
def test_faults_do_not_depend_on_how_frames_are_split(lengths):
    given = samples(2000)
    whole = FaultInjector(FIVE_PERCENT, seed=3)
    expected = whole.send(given) + whole.end()
    injector, parts, at, turn = FaultInjector(FIVE_PERCENT, seed=3), [], 0, 0
    while at < len(given):
        length = lengths[turn % len(lengths)]
        parts.append(injector.send(given[at : at + length]))
        at, turn = at + length, turn + 1
    assert b"".join([*parts, injector.end()]) == expected
    assert injector.counts == whole.counts


def test_without_faults_frames_go_out_as_they_are():
    given = samples(50)
    injector = FaultInjector()
    assert injector.send(given) + injector.end() == encode(rows_of(given))
    assert injector.counts.frames == 150


def test_late_frames_come_behind_so_many_more_of_their_tile():
    injector = FaultInjector(Faults(late=0.02, late_frames=30), seed=1, keep=True)
    injector.send(samples(2000, tiles=2))
    injector.end()
    sent = np.concatenate(injector.sent)
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
    emulator = Emulator(UdpSender("127.0.0.1", 9), source, clock=TileClock((1 << 32) - 500_000, 100.0))
    count = source.pull(48_000)
    sent = emulator.samples(source.stamps[:count], source.forces[:count])
    emulator.close()
    assert sent["tile"][:8].tolist() == [0, 1, 2, 3, 0, 1, 2, 3]
    np.testing.assert_array_equal(sent["readings"].reshape(count, 4, 4), nominal_readings(source.forces[:count]))
    assert len(Parser().feed(encode(rows_of(sent)))) == len(sent)
    passed = (sent["microseconds"][-1] - sent["microseconds"][0]) & 0xFFFF_FFFF
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
