"""Footsteps and contacts in recorded forces, tracked as a session's would be."""

import numpy as np
import pytest
from measured import needs_data, walk

from underfoot.floor.contacts import ContactTracker
from underfoot.widgets.session.footstep_tracker import CHUNK, FootstepTracker

pytestmark = needs_data
LONG_S = 120.0
"""A first run compiles kernels."""


@pytest.fixture
def recorded():
    return walk("adult/walk1")


def ready(floor, forces):
    tracker = FootstepTracker(floor, 48_000.0, forces.rate_hz)
    assert tracker.wait_for_kernels(LONG_S)
    return tracker


@pytest.mark.parametrize("chunk", [1, 7, 10_000])
def test_footsteps_are_the_same_in_any_pieces(recorded, chunk):
    floor, forces = recorded
    tracker = ready(floor, forces)
    steps, loads = [], []
    for at in range(0, len(forces.time_s), chunk):
        piece = slice(at, at + chunk)
        tracker.add(forces.time_s[piece] * 48_000.0, forces.force_n[piece])
        told, new = tracker.track(1_000)
        steps += new
        loads.append(told.force_n.sum(axis=2))
    steps += tracker.finish()
    assert [round(step.contact_ms) for step in steps] == [617, 617]
    assert [step.peak1_n for step in steps] == pytest.approx([1029, 966], abs=3)
    assert len(np.concatenate(loads)) == len(forces.time_s)


def test_forces_are_less_their_baseline(recorded):
    floor, forces = recorded
    tracker = ready(floor, forces)
    tracker.add(forces.time_s * 48_000.0, forces.force_n)
    told, _ = tracker.track(1_000)
    contacts = ContactTracker(floor, forces.rate_hz)
    contacts.feed(forces.time_s[: len(told.time_s)], forces.force_n[: len(told.time_s)])
    np.testing.assert_allclose(told.force_n, forces.force_n[: len(told.time_s)] - contacts.baseline_n, atol=1e-9)


def test_a_foot_on_a_tile_that_falls_silent_is_lifted(recorded):
    """As in the engine: it stood in Monitor, and in what is sent to other programs, until the tile sent again."""
    floor, forces = recorded
    loads_n = forces.force_n.sum(axis=2)
    loaded, tile = np.unravel_index(loads_n.argmax(), loads_n.shape)
    force_n = forces.force_n.copy()
    force_n[loaded:, tile] = np.nan
    tracker = ready(floor, forces)
    tracker.add(forces.time_s[: loaded + 100] * 48_000.0, force_n[: loaded + 100])
    told, _ = tracker.track(1_000)
    assert all(tile not in contact.tiles for contact in told.contacts)
    assert told.load_n[tile] == pytest.approx(0.0, abs=1.0)
    assert np.isnan(told.force_n[-1, tile]).all()  # nothing is drawn that was not sent


def test_a_long_backlog_is_tracked_in_chunks(recorded):
    floor, forces = recorded
    tracker = ready(floor, forces)
    force_n = np.tile(forces.force_n, (4, 1, 1))
    tracker.add(np.arange(len(force_n)) * 48_000.0 / forces.rate_hz, force_n)
    lengths = []
    while (told := tracker.track(1)[0]) is not None:
        lengths.append(len(told.time_s))
    assert len(lengths) > 1
    assert max(lengths) <= CHUNK // len(floor.tiles)
    assert sum(lengths) == len(force_n)


def test_what_waits_is_caught_up_with_while_more_comes(recorded):
    floor, forces = recorded
    tracker = ready(floor, forces)
    pieces = [slice(at, at + 4) for at in range(0, len(forces.time_s), 4)]
    waiting = 2 * len(pieces) // 3
    for piece in pieces[:waiting]:
        tracker.add(forces.time_s[piece] * 48_000.0, forces.force_n[piece])
    for piece in pieces[waiting:]:
        tracker.add(forces.time_s[piece] * 48_000.0, forces.force_n[piece])
        told, _ = tracker.track()
    assert told.time_s[-1] == pytest.approx(forces.time_s[-1])
