"""The device's clock on the session's, against clocks whose drift and delays are known."""

import numpy as np
import pytest

from underfoot.devices import device_clock
from underfoot.kernels import allocating, kernel

RATE = 48_000.0


@allocating
@kernel
def followed(time_us, came, blocks, asked, epochs, clock, session):
    """What a device floor does with one tile: samples that came are seen, then set, whenever a block is asked for.

    Returns the frame to which each sample was set, NaN without one, and whether it came too late for that.
    """
    i, rate = 0, RATE
    out, late = np.full(len(came), np.nan), np.zeros(len(came), np.bool_)
    for k in range(len(blocks)):
        begin = blocks[k]
        device_clock.observe(session[0], 0, begin / rate * 1e6, asked[k], rate)
        first = i
        while i < len(came) and came[i] <= asked[k]:
            device_clock.observe(clock[0], epochs[i], time_us[i], came[i], rate)
            i += 1
        for j in range(first, i):
            arrived = device_clock.arrival_frame(clock[0], time_us[j], rate)
            lateness = begin - device_clock.sent_frame(session[0], arrived, rate)
            most = device_clock.MAX_DELAY_S * rate + blocks[1] - blocks[0]
            device_clock.note_lateness(clock[0], came[j], lateness, most, rate / 1000.0, rate)
        for j in range(first, i):
            arrived = device_clock.arrival_frame(clock[0], time_us[j], rate)
            frame = device_clock.sent_frame(session[0], arrived, rate) + clock[0].delay
            out[j] = device_clock.slewed(clock[0], time_us[j], frame, rate, device_clock.JUMP_S * rate)
            late[j] = begin > out[j]
    return out, late


class Run:
    """`seconds` of a device at 1 kHz whose clock is `ppm` slow, against a sound card whose clock is `card` ppm slow.

    Every sample takes 0.3 ms and then `jitter_ms` (exponential) more; `held` is a stretch (s) in which nothing gets
    through, and which then comes in this share of its time, `slowness`. `error_ms` is how far behind the true moment
    each sample was set, `late` whether it came too late for that.
    """

    def __init__(
        self, ppm=0.0, jitter_ms=0.2, block=128, seconds=30, card=0.0, held=None, restarts=False, slowness=0.0
    ):
        random = np.random.default_rng(4)
        count = seconds * 1000
        true_s = 0.0071 + np.arange(count) * 1e-3 * (1.0 + ppm * 1e-6)
        came_s = true_s + 0.3e-3 + random.exponential(jitter_ms * 1e-3, count)
        if held:
            kept = (came_s > held[0]) & (came_s < held[1])
            came_s[kept] = held[1] + slowness * (came_s[kept] - held[0])
        came_s = np.maximum.accumulate(came_s)
        blocks = np.arange(int(seconds * RATE / block) + 120) * float(block)
        asked_s = blocks / RATE * (1.0 + card * 1e-6) + random.exponential(0.1e-3, len(blocks))
        time_us = 5e6 + 1000.0 * np.arange(count)
        epochs = np.zeros(count, np.int64)
        if restarts:
            epochs[count // 2 :] = 1
            time_us[count // 2 :] -= time_us[count // 2]
        self.clocks, session = device_clock.DeviceClocks(1, RATE), device_clock.DeviceClocks(1, RATE)
        asked = np.maximum.accumulate(asked_s) * RATE
        out, late = followed(time_us, came_s * RATE, blocks, asked, epochs, self.clocks.table, session.table)
        assert np.isfinite(out).all()
        self.stamps = out
        begins_s = blocks[np.searchsorted(asked_s, came_s)] / RATE * (1.0 + card * 1e-6)
        self.needed_ms = (begins_s - true_s - 0.3e-3) * 1e3
        self.error_ms = (out / RATE * (1.0 + card * 1e-6) - true_s) * 1e3
        self.late = late
        self.fit = self.clocks.fit(0)


@pytest.mark.parametrize("ppm", [0.0, 43.0, -200.0, 5000.0])
@pytest.mark.parametrize("jitter_ms", [0.2, 2.0])
def test_drift_is_found_through_jitter(ppm, jitter_ms):
    run = Run(ppm, jitter_ms)
    assert run.fit.drift_ppm == pytest.approx(ppm, abs=10.0 * jitter_ms)
    assert 1e-6 * jitter_ms < run.fit.error_s < 0.3e-3 * max(jitter_ms, 1.0)  # the earliest of 250 is late by a 250th


@pytest.mark.parametrize("card", [0.0, -80.0])
@pytest.mark.parametrize("ppm", [43.0, -200.0])
def test_samples_are_evenly_spaced_and_there_in_time(ppm, card):
    run = Run(ppm, card=card)
    steps = np.diff(run.stamps)
    assert (steps > 0.0).all()
    settled = slice(5000, None)
    true = RATE * 1e-3 * (1.0 + (ppm - card) * 1e-6)
    assert steps[settled].mean() == pytest.approx(true, rel=2e-5)
    assert steps[settled].std() < 0.2  # frames, of 48; samples came up to a block and its jitter apart
    assert run.late[settled].mean() < 0.015
    assert run.error_ms[settled].min() > 0.3
    assert run.error_ms[settled].max() < 2.667 + 0.3 + 10 * 0.2


@pytest.mark.parametrize(("seconds", "slowness"), [(0.3, 0.0), (1.0, 0.0), (3.0, 0.05), (3.0, 0.45)])
def test_what_was_held_up_does_not_move_what_follows_nor_is_it_squeezed(seconds, slowness):
    """As where a connection or this computer stands still, and nothing is lost, whether it then comes at once or not:
    of what came in several reads the first had moved the clock.
    """
    calm, held = Run(43.0), Run(43.0, held=(20.0, 20.0 + seconds), slowness=slowness)
    after = slice(20_300 + round(1000 * seconds), None)
    assert np.diff(held.stamps[19_900:]).min() > 40.0
    assert held.late[19_990:20_290].mean() > 0.9
    np.testing.assert_allclose(held.error_ms[after], calm.error_ms[after], atol=1.0)
    assert held.fit.drift_ppm == pytest.approx(43.0, abs=2.0)


def test_a_device_that_begins_anew_is_fitted_anew():
    run = Run(43.0, restarts=True)
    assert run.fit.drift_ppm == pytest.approx(43.0, abs=2.0)
    assert (run.error_ms[16_000:] > 0.3).all()
    assert (run.error_ms[16_000:] < 8.0).all()


@pytest.mark.parametrize("until", [8000, 6000, 6200])
def test_a_connection_that_becomes_slower_for_good_or_a_while_is_followed_within_a_second(until):
    """Samples keep their order: as it becomes faster again, some come together, each less late than the one before."""
    clocks, came = device_clock.DeviceClocks(1, RATE), 0.0
    for i in range(8000):
        way = 48.0 + 0.08 * RATE if 4000 <= i < until else 48.0
        came = max(came, 48.0 * i + way)
        device_clock.observe(clocks.table[0], 0, 1000.0 * i, came, RATE)
        if i in (3999, 5000, 5999) or i >= 7000:
            assert device_clock.arrival_frame(clocks.table[0], 1000.0 * i, RATE) == pytest.approx(
                48.0 * i + way, abs=1.0
            )


@pytest.mark.parametrize("ppm", [0.0, 43.0, -5000.0])
@pytest.mark.parametrize("slower_s", [0.06, 0.3, 1.0])
def test_a_connection_that_becomes_faster_while_samples_are_lost_is_followed_at_once(slower_s, ppm):
    """It took the clock for one without drift: of one that is off by 0.5 % samples were set 4 to 22 ms aside."""
    clock, step = device_clock.DeviceClocks(1, RATE).table[0], 48.0 * (1.0 + ppm * 1e-6)
    for i in range(7000):
        came = step * i + (slower_s * RATE if i < 6000 else 0.0)
        if i >= 6000 or came <= step * 6000:  # else it is lost
            device_clock.observe(clock, 0, 1000.0 * i, came, RATE)
        if i >= 6000:
            assert device_clock.arrival_frame(clock, 1000.0 * i, RATE) == pytest.approx(came, abs=1.6)


@pytest.mark.parametrize("block", [64, 1024])
@pytest.mark.parametrize("jitter_ms", [0.1, 0.5, 1.0])
def test_samples_are_set_back_by_what_99_of_100_need(block, jitter_ms):
    """Against the jitter itself: what it needs is when the block behind a sample's arrival begins."""
    run = Run(43.0, jitter_ms, block, seconds=60)
    settled = slice(20_000, None)
    assert 0.005 < run.late[settled].mean() < 0.02
    needed = np.quantile(run.needed_ms[settled], 0.99)
    assert run.fit.delay_s * 1e3 == pytest.approx(needed, rel=0.15, abs=0.05)


def test_a_link_that_becomes_worse_is_followed_in_a_second_and_a_better_one_in_half_a_minute():
    table = device_clock.DeviceClocks(1, RATE).table
    random = np.random.default_rng(6)
    found = []
    for i in range(80_000):
        jitter = 480.0 if 20_000 <= i < 40_000 else 48.0
        device_clock.observe(table[0], 0, 1000.0 * i, 48.0 * i, RATE)
        device_clock.note_lateness(table[0], 48.0 * i, jitter * random.uniform(), 1000.0, 48.0, RATE)
        found.append(float(table["delay"][0]))
    calm, worse = np.array(found[10_000:20_000]), np.array(found[21_000:40_000])
    np.testing.assert_allclose(calm, 48.0, rtol=0.1)
    np.testing.assert_allclose(worse, 480.0, rtol=0.1)
    np.testing.assert_allclose(found[70_000:], 48.0, rtol=0.1)
    assert found[42_000] > 200.0


def test_a_link_that_begins_badly_is_judged_anew_within_seconds_and_one_that_was_never_late_at_once():
    bad, good = device_clock.DeviceClocks(2, RATE).table
    random = np.random.default_rng(6)
    for i in range(3_200):
        late = 480.0 if i < 200 else 48.0 * random.uniform()
        for clock, frames in ((bad, late), (good, -100.0 if i < 3_000 else 48.0)):
            device_clock.observe(clock, 0, 1000.0 * i, 48.0 * i, RATE)
            device_clock.note_lateness(clock, 48.0 * i, frames, 1000.0, 48.0, RATE)
        assert good["delay"] == 0.0 or i >= 3_000
    assert bad["delay"] == pytest.approx(48.0, rel=0.1)
    assert good["delay"] == pytest.approx(48.0, abs=0.5)


def test_what_is_held_up_for_longer_than_a_hold_can_be_does_not_move_it():
    table = device_clock.DeviceClocks(1, RATE).table
    for i in range(5000):
        device_clock.observe(table[0], 0, 1000.0 * i, 48.0 * i, RATE)
        device_clock.note_lateness(table[0], 48.0 * i, 1500.0 if i > 4000 else 40.0, 1024.0, 48.0, RATE)
    assert table["delay"][0] == 40.0
    device_clock.observe(table[0], 1, 0.0, 48.0 * 5000, RATE)  # the device begins anew, on the same link
    assert table["delay"][0] == 40.0


def test_a_mapping_moves_slowly_and_by_a_jump_at_once():
    table, most = device_clock.DeviceClocks(1, RATE).table, 0.05 * 48.0
    device_clock.observe(table[0], 0, 0.0, 0.0, RATE)
    jump = 1.01 * device_clock.JUMP_S * RATE
    placed = [
        device_clock.slewed(table[0], 1000.0 * i, 48.0 * i + beyond, RATE, device_clock.JUMP_S * RATE) - 48.0 * i
        for i, beyond in enumerate((10.0, 20.0, 0.0, jump + 10.0))
    ]
    assert placed == pytest.approx([10.0, 10.0 + most, 10.0, jump + 10.0])


def test_what_arrives_at_once_counts_once_as_late_as_its_oldest():
    one, four = (device_clock.DeviceClocks(1, RATE).table for _ in range(2))
    random = np.random.default_rng(6)
    for i in range(20_000):
        lateness = random.exponential(48.0)
        for table, times in ((one, 1), (four, 4)):
            for k in range(times):
                device_clock.observe(table[0], 0, 1000.0 * i, 48.0 * i, RATE)
                device_clock.note_lateness(table[0], 48.0 * i, lateness - k, 1000.0, 48.0, RATE)
    assert one["delay"][0] == four["delay"][0] > 0.0


def test_nothing_is_known_of_a_clock_before_its_first_second():
    clocks = device_clock.DeviceClocks(2, RATE)
    assert clocks.fit(0) is None
    for i in range(900):
        device_clock.observe(clocks.table[0], 0, 1000.0 * i, 49.0 * i, RATE)
    assert clocks.fit(0) is None
    assert clocks.fit(1) is None
    assert clocks.table["slope"][0] == 0.0
    for i in range(900, 3000):
        device_clock.observe(clocks.table[0], 0, 1000.0 * i, 49.0 * i, RATE)
    assert clocks.fit(0).drift_ppm == pytest.approx(1e6 * device_clock.MAX_DRIFT)  # no clock is as slow
    assert (clocks.known_s(0), clocks.known_s(1)) == (2.75, 0.0)


@pytest.mark.parametrize("slope", [0.0, 1e-4, -0.01])
def test_sent_undoes_arrival(slope):
    clocks = device_clock.DeviceClocks(1, RATE)
    for i in range(3000):
        device_clock.observe(clocks.table[0], 0, 7e9 + 1000.0 * i, 48.0 * i * (1 + slope) + 99.0, RATE)
    for time_us in (7e9, 7.001e9, 7.1e9):
        frame = device_clock.arrival_frame(clocks.table[0], time_us, RATE)
        assert device_clock.sent_frame(clocks.table[0], frame, RATE) == pytest.approx(time_us * RATE * 1e-6, abs=1e-3)
