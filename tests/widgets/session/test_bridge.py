"""The bridge: what a running session on the simulator reports."""

import itertools
import os
import signal
from types import SimpleNamespace

import numpy as np
import pytest
from live import live

from underfoot.engine.commands import PressTile, Walk
from underfoot.engine.reports import Compiling, Fault, Notice, OutputChanged, PatchRefused, ProcessDied
from underfoot.floor.layout import default_floor
from underfoot.nodes import REGISTRY
from underfoot.patch.patch import Patch
from underfoot.widgets.session.bridge import Bridge

LONG_MS = 120_000
"""A first run compiles kernels."""


@pytest.fixture(scope="module")
def playing(until):
    patch = Patch().add("noise", REGISTRY).add("tile-output", REGISTRY)
    with live(patch.connect("noise.out", "tile-output.acceleration", REGISTRY), until) as made:
        made.complete()
        yield made


@pytest.fixture(scope="module")
def session(playing):
    return playing.session


@pytest.fixture
def followed(session, qtbot):
    """A bridge on the session, with its kernels loaded."""
    made = Bridge()
    made.attach(session, session.target.floor, session.target.rate)
    assert made.wait_for_kernels(LONG_MS / 1000)
    yield made
    made.detach()


def test_forces_come_in_order_with_loads_and_contacts(followed, qtbot):
    told = []
    followed.forces_tracked.connect(told.append)
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
    with qtbot.waitSignal(followed.steps_found, timeout=LONG_MS) as stepped:
        pass
    step = stepped.args[0][0]
    assert step.tile in default_floor().ids
    assert 300.0 < step.contact_ms < 1200.0


def test_vibration_is_read_only_where_it_is_wanted(followed, qtbot):
    with qtbot.assertNotEmitted(followed.vibration_read, wait=200):
        pass
    followed.wants_vibration = True
    pieces = []
    followed.vibration_read.connect(lambda first, samples: pieces.append((first, samples)))
    qtbot.waitUntil(lambda: len(pieces) > 10, timeout=LONG_MS)
    for (first, samples), (after, _) in itertools.pairwise(pieces):
        assert samples.shape[1] == 4
        assert after == first + len(samples)


def test_vibration_comes_at_its_frame_after_months_too(qtbot):
    """An integer of Qt has 32 bits: after 12 hours Monitor's vibration stood still, with a traceback a tick."""
    bridge, told, samples = Bridge(), [], np.ones((3, 4), np.float32)
    bridge.vibration_read.connect(lambda *them: told.append(them))
    bridge.response_read.connect(lambda *them: told.append(them))
    bridge.vibration_read.emit(1 << 40, samples)
    bridge.response_read.emit(1 << 40, samples, samples)
    assert [(first, *map(len, rest)) for first, *rest in told] == [(1 << 40, 3), (1 << 40, 3, 3)]


def test_a_press_is_seen_as_a_load(followed, session, qtbot):
    told = []
    followed.forces_tracked.connect(told.append)
    session.send(Walk(False))
    session.send(PressTile("t2", 0.0, 0.0, 300.0))
    qtbot.waitUntil(lambda: bool(told) and abs(told[-1].load_n[1] - 300.0) < 5.0, timeout=LONG_MS)
    session.send(PressTile("t2", 0.0, 0.0, 0.0))
    qtbot.waitUntil(lambda: abs(told[-1].load_n[1]) < 5.0, timeout=LONG_MS)
    session.send(Walk(True))


def test_health_and_costs_come_a_few_times_a_second(followed, qtbot):
    with qtbot.waitSignals([followed.health_reported, followed.costs_measured], timeout=LONG_MS):
        pass
    with qtbot.waitSignal(followed.health_reported) as health:
        pass
    assert health.args[0].running
    assert health.args[0].frame > 0


def test_a_floor_is_silent_while_nothing_comes_from_it_and_the_engine_runs(qtbot):
    """Not where the engine stands still, as on a busy machine, and has asked it for nothing."""
    floor = default_floor()
    quiet, some = (np.zeros(0), np.zeros((0, 4, 4))), (np.arange(16.0) * 48.0, np.zeros((16, 4, 4)))
    session = SimpleNamespace(poll=list, force=SimpleNamespace(read=lambda: quiet), force_rate_hz=1000.0)
    made, told = Bridge(), []
    made.floor_silent.connect(told.append)
    made.attach(session, floor, 48_000.0)
    assert made.wait_for_kernels(LONG_MS / 1000)

    def second(read, end_s, plays=True):
        session.force.read = lambda: (read[0] + 48_000.0 * (end_s - 0.016), read[1])
        for k in range(62):
            session.health, session.played_s = None, end_s - plays * (1.0 - k / 61)
            made.tick()

    second(quiet, 1.0, plays=False)
    assert told == []
    second(quiet, 2.0)
    assert told == [True]
    second(some, 3.0)
    assert told == [True, False]
    second(quiet, 4.0)
    made.detach()
    assert told == [True, False, True, False]


def test_nothing_is_told_after_the_bridge_has_left(followed, qtbot):
    followed.detach()
    with qtbot.assertNotEmitted(followed.ticked, wait=200):
        pass


def test_an_engine_that_is_given_up_is_not_called_started_again_and_its_floor_is_silent(
    followed, session, until, monkeypatch
):
    """The last feet stood in Monitor for good, those of samples that were read with the report as well."""
    said, silent, told = [], [], []
    followed.notified.connect(said.append)
    followed.floor_silent.connect(silent.append)
    followed.forces_tracked.connect(told.append)
    frame = session.health.frame
    until(lambda: session.health.frame > frame + 4800)  # samples wait to be read
    given_up = OutputChanged("the engine is not started any more", "nothing", "the engine has failed")
    monkeypatch.setattr(session, "poll", lambda: [ProcessDied("engine", "killed", False), given_up])
    followed.tick()
    assert said == ["The engine is not started any more."]
    assert silent == [True]
    assert not told


@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="this system cannot kill a process outright")
def test_an_engine_that_dies_comes_back_and_says_so(followed, playing, qtbot):
    said = []
    followed.notified.connect(said.append)
    with qtbot.waitSignal(followed.started, timeout=LONG_MS):
        os.kill(playing.session.pids["engine"], signal.SIGKILL)
    (stopped,) = (line for line in said if "engine stopped" in line)  # a busy machine may have more to say
    assert "patch goes on playing" in stopped
    with qtbot.waitSignal(followed.forces_tracked, timeout=LONG_MS):
        pass


def test_kernels_that_cannot_be_kept_are_told_once_they_are_compiled(qtbot, tmp_path, monkeypatch):
    """Each start took half a minute, and nobody knew why."""
    (tmp_path / "file").touch()
    monkeypatch.setenv("UNDERFOOT_CACHE", str(tmp_path / "file"))
    nothing = np.zeros(0), np.zeros((0, 4, 4))
    force, reports = SimpleNamespace(read=lambda: nothing), [Compiling(0, 2), Compiling(1, 2)]
    session = SimpleNamespace(poll=lambda: reports, force=force, force_rate_hz=1000.0, health=None)
    made, said = Bridge(), []
    made.notified.connect(said.append)
    made.attach(session, default_floor(), 48_000.0)
    made.tick()
    assert not said
    reports.append(Compiling(2, 2))
    made.tick()
    made.tick()
    made.detach()
    (told,) = said
    assert told.startswith(f"Kernels cannot be kept in {tmp_path / 'file'}")


def test_what_comes_and_goes_is_said_each_time_and_a_fault_once(qtbot):
    nothing = np.zeros(0), np.zeros((0, 4, 4))
    gone, back = OutputChanged("a card has gone", "udp, without sound", "no card"), OutputChanged("it is back", "")
    reports = [Fault("noise", "t1", 0), Notice("udp is back"), Notice(""), gone, back, PatchRefused.because("no x.wav")]
    patch = Patch().add("noise", REGISTRY).name("noise", "Hiss")
    session = SimpleNamespace(
        poll=lambda: reports,
        force=SimpleNamespace(read=lambda: nothing),
        force_rate_hz=1000.0,
        health=None,
        patch=patch,
    )
    made, said, outputs = Bridge(), [], []
    made.notified.connect(said.append)
    made.output_changed.connect(outputs.append)
    made.attach(session, default_floor(), 48_000.0)
    made.tick()
    made.tick()
    made.detach()
    assert said[0].startswith("Hiss produced a value that is not finite on tile t1")
    assert said[1:] == ["udp is back", "A card has gone.", "It is back.", "The patch is not played: no x.wav"] * 2
    assert outputs == [gone, back] * 2
