"""The bridge: what a running session on the simulator reports, and feet in recorded forces."""

import itertools
import os
import signal
from pathlib import Path

import numpy as np
import pytest

from underfoot.engine.commands import PressTile, Walk
from underfoot.engine.reports import Started
from underfoot.engine.session import Session
from underfoot.engine.target import Target
from underfoot.floor.contacts import ContactTracker
from underfoot.floor.forces import read_forces
from underfoot.floor.layout import Floor, default_floor
from underfoot.nodes import REGISTRY
from underfoot.patch.patch import Patch
from underfoot.widgets.session import bridge
from underfoot.widgets.session.bridge import Bridge, Feet

DATA = Path(__file__).resolve().parents[2] / "../shared/data"
LONG_MS = 120_000
"""A first run compiles kernels."""


@pytest.fixture(scope="module")
def session(until):
    patch = Patch().add("noise", REGISTRY).add("tile-output", REGISTRY)
    made = Session(Target(default_floor()), patch.connect("noise.out", "tile-output.acceleration", REGISTRY), REGISTRY)
    made.start()
    until(lambda: any(isinstance(r, Started) for r in made.poll()), "the engine runs", seconds=LONG_MS / 1000)
    yield made
    made.close()


@pytest.fixture
def followed(session, qtbot):
    """A bridge on the session, with its kernels loaded."""
    made = Bridge()
    made.follow(session, session.target.floor, session.target.rate)
    assert bridge._kernels_loaded.wait(LONG_MS / 1000)
    yield made
    made.leave()


def test_forces_come_in_order_with_loads_and_contacts(followed, qtbot):
    told = []
    followed.forces.connect(told.append)
    qtbot.waitUntil(lambda: any(forces.contacts for forces in told) and len(told) > 30, timeout=LONG_MS)
    times = np.concatenate([forces.time_s for forces in told])
    assert (np.diff(times) > 0).all()
    for forces in told:
        assert forces.force_n.shape == (len(forces.time_s), 4, 4)
        assert forces.load_n.shape == forces.untared.shape == (4,)
    loaded = next(forces for forces in told if forces.contacts)
    assert loaded.load_n.max() > 20.0
    assert loaded.force_n[-1].sum(axis=1) == pytest.approx(loaded.load_n, abs=1e-6)


def test_footsteps_come_as_they_happen(followed, qtbot):
    with qtbot.waitSignal(followed.stepped, timeout=LONG_MS) as stepped:
        pass
    step = stepped.args[0][0]
    assert step.tile in default_floor().ids
    assert 300.0 < step.contact_ms < 1200.0


def test_vibration_is_read_only_where_it_is_wanted(followed, qtbot):
    with qtbot.assertNotEmitted(followed.vibrated, wait=200):
        pass
    followed.wants_vibration = True
    pieces = []
    followed.vibrated.connect(lambda first, samples: pieces.append((first, samples)))
    qtbot.waitUntil(lambda: len(pieces) > 10, timeout=LONG_MS)
    for (first, samples), (after, _) in itertools.pairwise(pieces):
        assert samples.shape[1] == 4
        assert after == first + len(samples)


def test_a_press_is_seen_as_a_load(followed, session, qtbot):
    told = []
    followed.forces.connect(told.append)
    session.send(Walk(False))
    session.send(PressTile("t2", 0.0, 0.0, 300.0))
    qtbot.waitUntil(lambda: bool(told) and abs(told[-1].load_n[1] - 300.0) < 5.0, timeout=LONG_MS)
    session.send(PressTile("t2", 0.0, 0.0, 0.0))
    qtbot.waitUntil(lambda: abs(told[-1].load_n[1]) < 5.0, timeout=LONG_MS)
    session.send(Walk(True))


def test_health_and_costs_come_a_few_times_a_second(followed, qtbot):
    with qtbot.waitSignals([followed.health, followed.costs], timeout=LONG_MS):
        pass
    with qtbot.waitSignal(followed.health) as health:
        pass
    assert health.args[0].running
    assert health.args[0].frame > 0


def test_nothing_is_told_after_the_bridge_has_left(followed, qtbot):
    followed.leave()
    with qtbot.assertNotEmitted(followed.ticked, wait=200):
        pass


@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="this system cannot kill a process outright")
def test_an_engine_that_dies_comes_back_and_says_so(followed, session, qtbot):
    said = []
    followed.noticed.connect(said.append)
    with qtbot.waitSignal(followed.started, timeout=LONG_MS):
        os.kill(session.pids["engine"], signal.SIGKILL)
    assert len(said) == 1
    assert "engine stopped" in said[0]
    assert "patch plays on" in said[0]
    with qtbot.waitSignal(followed.forces, timeout=LONG_MS):
        pass


def test_what_is_said_is_said_once(qtbot):
    made, said = Bridge(), []
    made.noticed.connect(said.append)
    for text in ("no card", "no card", "", "no channel"):
        made._say_once(text)
    assert said == ["no card", "no channel"]


# --- feet ---


@pytest.fixture
def walk():
    csv = DATA / "adult/walk1.csv"
    if not csv.exists():
        pytest.skip(f"{csv} is not here")
    floor = Floor.load(csv.with_suffix(".floor.json"))
    return floor, read_forces(csv, floor)


def _ready(floor, forces):
    feet = Feet(floor, 48_000.0, forces.rate_hz)
    assert bridge._kernels_loaded.wait(LONG_MS / 1000)
    return feet


@pytest.mark.parametrize("chunk", [1, 7, 10_000])
def test_feet_are_the_same_in_any_pieces(walk, chunk):
    floor, forces = walk
    feet = _ready(floor, forces)
    steps, loads = [], []
    for at in range(0, len(forces.time_s), chunk):
        piece = slice(at, at + chunk)
        feet.take(forces.time_s[piece] * 48_000.0, forces.force_n[piece])
        told, new = feet.follow(60.0)
        steps += new
        loads.append(told.force_n.sum(axis=2))
    steps += feet._counter.finish()
    assert [round(step.contact_ms) for step in steps] == [617, 617]
    assert [step.peak1_n for step in steps] == pytest.approx([1029, 966], abs=3)
    assert len(np.concatenate(loads)) == len(forces.time_s)


def test_forces_are_less_their_baseline(walk):
    floor, forces = walk
    feet = _ready(floor, forces)
    feet.take(forces.time_s * 48_000.0, forces.force_n)
    told, _ = feet.follow(60.0)
    tracker = ContactTracker(floor, forces.rate_hz)
    tracker.feed(forces.time_s[: len(told.time_s)], forces.force_n[: len(told.time_s)])
    np.testing.assert_allclose(told.force_n, forces.force_n[: len(told.time_s)] - tracker.baseline_n, atol=1e-9)


def test_a_long_backlog_is_followed_bit_by_bit(walk, monkeypatch):
    floor, forces = walk
    feet = _ready(floor, forces)
    monkeypatch.setattr(bridge, "_CHUNK", 512)
    feet.take(forces.time_s * 48_000.0, forces.force_n)
    lengths = []
    while (told := feet.follow(0.0)[0]) is not None:
        lengths.append(len(told.time_s))
    assert len(lengths) > 1
    assert max(lengths) <= bridge._CHUNK // 2
    assert sum(lengths) == len(forces.time_s)
