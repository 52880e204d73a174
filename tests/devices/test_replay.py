"""A replayed force file: every sample once, at its own time, also over and over and across gaps."""

import numpy as np
import pytest

from underfoot.devices.force_source import MAX_SAMPLES
from underfoot.devices.replay import Replay
from underfoot.floor.forces import ForceSeries
from underfoot.floor.layout import default_floor

FLOOR = default_floor(1, 2)


def table(count=1_200, rate_hz=240.0, first_s=7.5):
    """Samples of which each corner's force says which sample it is."""
    force_n = np.arange(count)[:, None, None] + np.arange(8).reshape(2, 4) / 10.0
    return ForceSeries(first_s + np.arange(count) / rate_hz, force_n, rate_hz)


def pulled(source, ends):
    """Stamps, arrivals and forces of all samples that come by these frames."""
    parts = []
    for end in ends:
        count = MAX_SAMPLES
        while count == MAX_SAMPLES:
            count = source.pull(end)
            assert (source.arrivals[:count] < end).all()
            parts.append((source.stamps[:count].copy(), source.arrivals[:count].copy(), source.forces[:count].copy()))
    return [np.concatenate(column) for column in zip(*parts, strict=True)]


@pytest.mark.parametrize("step", [333, 1024, 300_000])
def test_every_sample_comes_once_at_its_own_time(step):
    """Also of a stretch an hour after its file began: the same forces from 0 s on give the same bytes."""
    forces = table(first_s=3_600.1)
    source = Replay(forces, FLOOR, 48_000)
    stamps, arrivals, force_n = pulled(source, range(0, 300_000 + step, step))
    np.testing.assert_array_equal(stamps, np.arange(1_200) * 200.0)
    np.testing.assert_array_equal(arrivals, stamps)
    np.testing.assert_array_equal(force_n, forces.force_n)
    assert source.is_finished


def test_it_begins_at_the_frame_it_is_told():
    source = Replay(table(), FLOOR, 48_000, start=96_000)
    assert source.pull(96_000) == 0
    assert source.pull(96_001) == 1
    assert source.stamps[0] == 96_000.0


def test_over_and_over_with_a_period_between_the_last_and_the_first():
    forces = table(count=100)
    stamps, _, force_n = pulled(Replay(forces, FLOOR, 48_000, repeats=True), range(0, 60_000, 480))
    np.testing.assert_allclose(np.diff(stamps), 200.0, atol=1e-6)
    np.testing.assert_array_equal(force_n, np.concatenate([forces.force_n] * 3)[: len(force_n)])
    assert len(force_n) > 250


def test_a_gap_in_the_file_stays_a_gap():
    whole = table()
    kept = np.r_[:400, 500:1200]
    gappy = ForceSeries(whole.time_s[kept], whole.force_n[kept], whole.rate_hz)
    stamps, _, _ = pulled(Replay(gappy, FLOOR, 48_000), [300_000])
    np.testing.assert_allclose(np.diff(stamps)[399], 101 * 200.0)
