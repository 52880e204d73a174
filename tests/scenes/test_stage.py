"""A scene on a running session: what it strikes is felt, gives the same bytes again, and ends cleanly."""

import numpy as np
import pytest
from live import live

from underfoot.devices.simulated_floor import SimulatedFloor
from underfoot.engine.commands import Play, Strike, from_text, to_text
from underfoot.engine.loop import Loop, LoopOptions
from underfoot.engine.render import render_source
from underfoot.engine.reports import CommandApplied
from underfoot.engine.rings import Reader
from underfoot.engine.session_replay import RecordedForce
from underfoot.engine.status import Field
from underfoot.errors import BadValue
from underfoot.floor.contacts import SILENT_S
from underfoot.floor.layout import default_floor
from underfoot.nodes import REGISTRY
from underfoot.patch.patch import Patch
from underfoot.scenes import discover
from underfoot.scenes.cues import Strike as SceneStrike
from underfoot.scenes.rehearsal import rehearse
from underfoot.scenes.stage import Stage

FLOOR = default_floor()
BEFORE = Patch(title="before")


def test_a_scene_is_felt_and_its_commands_give_the_same_bytes_again(until):
    with live(BEFORE, until, start=False) as session:
        silent_floor_has_nobody(session.session)
        samples, rows, reports = Reader(session.session.memory.force), [], []
        pond = discover()["frozen-pond"](FLOOR)
        stage = Stage(session.session, pond)
        session.session.start()
        assert session.session.patch.title == "Frozen pond"
        felt = []

        def is_felt_for_a_while():
            rows.append(samples.read()[1])
            reports.extend(session.reports)
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
        played = session.played(0, felt[0] + 12_000)
        broken_scene_leaves(session, lambda moment: 1 / 0, ZeroDivisionError)
        misspelt = SceneStrike("nobody", 0.1, 0.1)  # was silent, and nobody knew why
        broken_scene_leaves(session, lambda moment: [misspelt], BadValue)
    done = [report for report in reports if isinstance(report, CommandApplied)]
    assert any(isinstance(one.command, Strike) for one in done)
    source = RecordedForce(rows, FLOOR, 1000.0)
    loop = Loop(discover()["frozen-pond"].patch(REGISTRY), REGISTRY, source, LoopOptions(block=256))
    for one in done:
        loop.send(from_text(*to_text(one.command)), one.frame)
    assert played.any()
    assert np.array_equal(loop.play(len(played))[:, :4], played)


def silent_floor_has_nobody(session):
    """Whose line is gone, as the clock of the session tells: the last foot stood there until it was back."""
    rows = np.zeros((1000, 2 + 4 * len(FLOOR.tiles)))
    rows[:, 0] = rows[:, 1] = np.arange(1000) * 48.0
    rows[500:, 2:6] = 150.0
    stage = Stage(session, discover()["touch-widgets"](FLOOR))
    session.memory.force.write(rows, len(rows))
    ends_s = (0.999 + SILENT_S, 0.999 + SILENT_S + 0.002, 9.0)
    moments = []
    for frame in (round(48_000.0 * end_s) for end_s in ends_s):
        session.memory.status.put(Field.FRAME, frame)
        moments.append([(round(one.time_s, 3), len(one.contacts), len(one.up)) for one in stage.tick()])
    assert moments[0][-1] == (0.99, 1, 0)
    assert moments[1:] == [[(1.0, 1, 0), (1.49, 0, 1)], []]
    session.memory.status.put(Field.FRAME, 0.0)
    stage.close()


def broken_scene_leaves(session, step, error):
    """What a scene raises goes through, and the patch from before comes back."""
    scene = discover()["touch-widgets"](FLOOR)
    scene.step = step
    stage = Stage(session.session, scene)

    def fails():
        try:
            stage.tick()
        except error:
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
        return render_source(patch, source, 0.4, LoopOptions(block=block), commands=commands).samples

    some, others = played(64), played(1000)
    assert np.array_equal(some, others)
    onsets = [np.flatnonzero(some[:, tile])[0] for tile in (0, 1)]
    assert onsets[1] - onsets[0] == pytest.approx(4800 + 0.0101 * 48_000, abs=1.0)


@pytest.mark.parametrize("name", ["frozen-pond", "touch-widgets"])
def test_a_walk_stays_below_the_limit(name):
    scene = discover()[name](FLOOR)
    done = rehearse(scene, SimulatedFloor(FLOOR), 6.0)
    commands = ((0, Play(True)), *done.commands(FLOOR))
    samples = render_source(scene.patch(REGISTRY), SimulatedFloor(FLOOR), 6.0, commands=commands).samples
    assert 0.001 < np.abs(samples[:, :4]).max() < 0.5  # of full scale, 20 m/s^2
    assert np.abs(samples[:, 4:]).max(initial=0.0) < 0.95
