"""A scene on a running session: what it strikes is felt, recorded, replayed to the same bytes, and ended cleanly."""

import numpy as np
import pytest
from live import live

from underfoot.devices.simulated_floor import SimulatedFloor
from underfoot.engine.commands import Play, Strike
from underfoot.engine.loop import LoopOptions
from underfoot.engine.render import render
from underfoot.engine.session_replay import replay
from underfoot.floor.layout import default_floor
from underfoot.nodes import REGISTRY
from underfoot.patch.patch import Patch
from underfoot.records.recording import Recording
from underfoot.scenes import discover
from underfoot.scenes.rehearsal import rehearse
from underfoot.scenes.stage import Stage

FLOOR = default_floor()
BEFORE = Patch(title="before")


def test_a_scene_is_felt_recorded_and_replayed_to_the_same_bytes(until, tmp_path):
    path = tmp_path / "pond.underfoot"
    with live(BEFORE, until, record=path, start=False) as session:
        pond = discover()["frozen-pond"](FLOOR)
        stage = Stage(session.session, pond)
        until(path.exists, "it is recorded")
        session.session.start()
        assert session.session.patch.title == "Frozen pond"
        felt = []

        def is_felt_for_a_while():
            stage.take(session.reports)
            session.reports.clear()
            stage.tick()
            felt.extend(first for first, frames in session.parts[-3:] if frames.any())
            return felt and session.end > felt[0] + 24_000

        session.until(is_felt_for_a_while, "the ice cracks")
        assert pond.slips > 0
        assert min(stage.latencies_s) > 0.0
        stage.close()
        stage.close()  # once is enough
        assert session.session.patch == BEFORE
        assert stage.tick() == []
        session.session.stop_recording()
        broken_scene_leaves(session)
    with Recording(path) as recording:
        kinds = [kind for _, kind, _ in recording.commands()]
        _, played = recording.vibration()
    assert "Strike" in kinds
    assert played.any()
    again = replay(path, REGISTRY, block=256).samples
    assert np.array_equal(again[: len(played)], played)


def broken_scene_leaves(session):
    """What a scene raises goes through, and the patch from before comes back."""
    scene = discover()["touch-widgets"](FLOOR)
    scene.step = lambda moment: 1 / 0
    stage = Stage(session.session, scene)

    def fails():
        try:
            stage.tick()
        except ZeroDivisionError:
            return True
        return False

    session.until(fails, "the scene fails")
    stage.close()
    assert session.session.patch == BEFORE


def test_strikes_come_as_much_later_as_they_say_at_any_block():
    patch = discover()["frozen-pond"].patch(REGISTRY)
    commands = ((0, Play(True)), (4800, Strike("crack", "t1", 1.0, 0.0)), (9600, Strike("crack", "t2", 1.0, 0.0101)))

    def played(block):
        source = SimulatedFloor(FLOOR, walking=False)
        return render(patch, REGISTRY, source, 0.4, LoopOptions(block=block), commands=commands).samples

    some, others = played(64), played(1000)
    assert np.array_equal(some, others)
    onsets = [np.flatnonzero(some[:, tile])[0] for tile in (0, 1)]
    assert onsets[1] - onsets[0] == pytest.approx(4800 + 0.0101 * 48_000, abs=1.0)


@pytest.mark.parametrize("name", ["frozen-pond", "touch-widgets"])
def test_a_walk_stays_below_the_limit(name):
    scene = discover()[name](FLOOR)
    done = rehearse(scene, SimulatedFloor(FLOOR), 6.0)
    commands = ((0, Play(True)), *done.commands(FLOOR))
    samples = render(scene.patch(REGISTRY), REGISTRY, SimulatedFloor(FLOOR), 6.0, commands=commands).samples
    assert 0.001 < np.abs(samples[:, :4]).max() < 0.5  # of full scale, 20 m/s^2
    assert np.abs(samples[:, 4:]).max(initial=0.0) < 0.95
