"""Footsteps and contacts in recorded forces, tracked as a session's would be."""

import signal
import time

import numpy as np
import pytest
from measured import needs_data, walk

from underfoot.floor.contacts import ContactTracker
from underfoot.widgets.session.footstep_tracker import FootstepTracker

pytestmark = needs_data
LONG_S = 120.0
"""A first run compiles kernels."""


@pytest.fixture
def recorded():
    return walk("adult/walk1")


def ready(floor, forces, **options):
    tracker = FootstepTracker(floor, 48_000.0, forces.rate_hz, **options)
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
        told, new = tracker.track(60.0)
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
    told, _ = tracker.track(60.0)
    contacts = ContactTracker(floor, forces.rate_hz)
    contacts.feed(forces.time_s[: len(told.time_s)], forces.force_n[: len(told.time_s)])
    np.testing.assert_allclose(told.force_n, forces.force_n[: len(told.time_s)] - contacts.baseline_n, atol=1e-9)


def test_a_long_backlog_is_tracked_in_chunks(recorded):
    floor, forces = recorded
    tracker = ready(floor, forces, chunk=512)
    tracker.add(forces.time_s * 48_000.0, forces.force_n)
    lengths = []
    while (told := tracker.track(0.0)[0]) is not None:
        lengths.append(len(told.time_s))
    assert len(lengths) > 1
    assert max(lengths) <= 512 // len(floor.tiles)
    assert sum(lengths) == len(forces.time_s)


@pytest.fixture
def busy_processor():
    """Other work has the processor for 0.2 s whenever this process has had some milliseconds of it."""
    before = signal.signal(signal.SIGVTALRM, lambda *_: time.sleep(0.2))
    signal.setitimer(signal.ITIMER_VIRTUAL, 0.004, 0.004)
    yield
    signal.setitimer(signal.ITIMER_VIRTUAL, 0.0)
    signal.signal(signal.SIGVTALRM, before)


def test_what_waits_is_caught_up_with_also_on_a_busy_processor(recorded, busy_processor):
    floor, forces = recorded
    tracker = ready(floor, forces)
    for at in range(0, len(forces.time_s), 4):
        tracker.add(forces.time_s[at : at + 4] * 48_000.0, forces.force_n[at : at + 4])
    told, _ = tracker.track(0.2)
    assert len(told.time_s) == len(forces.time_s)
