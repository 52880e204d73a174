"""What the experimenter is shown of a study on a floor of hardware, here tiles that send over UDP."""

import math
from contextlib import closing

import numpy as np
import pytest
from made_studies import made_protocol
from msgspec import structs
from people import open_session, taking_part
from wired import ends

from underfoot.devices.emulation.emulator import Emulator
from underfoot.devices.replay import Replay
from underfoot.engine.target import Target
from underfoot.experiments.protocol import Stage
from underfoot.experiments.store import SessionFile
from underfoot.experiments.study import is_over
from underfoot.floor.forces import ForceSeries
from underfoot.floor.layout import default_floor
from underfoot.studies.phase import Phase
from underfoot.widgets.experiment.experimenter_view import ExperimenterView

CONSTANT = {"patch": "stimulus-wc", "scaled_by": "gain.gain", "measured_m_s2": 11.6, "level_m_s2": 2.0}


class Standing(Replay):
    """Tiles with as much on each as the test says."""

    force_n = 0.0

    def pull(self, end):
        count = super().pull(end)
        self.forces[:count] = self.force_n / 4
        return count


@pytest.fixture
def tile():
    sender, transport = ends("udp")
    second = ForceSeries(np.arange(1000) / 1000.0, np.zeros((1000, 1, 4)), 1000.0)
    source = Standing(second, default_floor(1, 1), 48_000.0, repeats=True)
    with closing(Emulator(sender, source)) as emulator:
        emulator.start()
        source.target = Target(source.floor, kind="udp", source=transport.name.partition(":")[2])
        yield source


def test_the_experimenter_reads_that_nobody_stands_there_as_long_as_it_is_so(qapp, tile, until, tmp_path):
    view = ExperimenterView()
    protocol = made_protocol("rating", {"blocks": 1}, {"WC": CONSTANT}, title="How soft?")
    protocol = structs.replace(protocol, stages=(*protocol.stages, Stage(id="thanks", kind="read")))
    with open_session(until, tile.target) as session, taking_part(session, protocol, tmp_path / "a", until) as person:
        runner = person.runner
        view.begin(runner, "a study")

        def shown():
            view.show_runner(runner)
            return view.news.text()

        person.until_phase(Phase.READY)
        person.until(lambda: shown() == "Nobody stands on the floor: 0 N.", "it is said")
        assert not view.news.isHidden()
        assert view.page.text().startswith("How soft?  ·  trial 1 of block 1")  # it was called by its id, main
        told = []
        for _ in range(6):
            view.live.clear()
            view.show_runner(runner)
            told.append(view.live.text() != "")
        assert sum(told) == 1  # figures are readable: not every tick changes them
        tile.force_n = 600.0
        person.until(lambda: "Nobody" not in shown(), "somebody stands there")
        tile.force_n = 0.0
        person.until(lambda: shown().startswith("Nobody stands on the floor"), "nobody stands there again")
        runner.stop("by the participant")
        shown()
        assert view.state.text().split("  ·  ")[0] == "Stopped by the participant."
        runner.go_on()
        person.until_phase(Phase.READY)
        person.until(lambda: not runner.watch.is_on, "the visit ends")  # 0.4 s after the last contact
        runner.start()
        person.until_phase(Phase.ANSWERING)
        assert "Nobody" not in shown()  # to answer, one may leave the floor
        runner.answer({"rating": 50.0})
        shown()
        assert view.state.text().startswith("every answer is kept")
        runner.stop("by the participant")
    with closing(SessionFile.open(tmp_path / "a")) as file:
        assert is_over(protocol, "P1", file.entries())  # though nobody went on from the word of thanks


def test_in_a_double_blind_study_the_experimenter_is_shown_neither_vibration_nor_answers(bench):
    stage = {"id": "main", "kind": "trials", "method": {"kind": "rating", "parameters": {"blocks": 1}}}
    bench.choose(stages=[stage], stimuli={"WC": CONSTANT, "B": CONSTANT, "C": CONSTANT, "X": {}}, double_blind=True)
    desk = bench.workspace.experimenter
    bench.rate(trials=4)
    bench.until(Phase.END)
    bench.workspace.running.background.join()
    shown = bench.runner.watch.now_s
    bench.wait(lambda: bench.runner.watch.now_s > shown + 0.1)  # what was drawn would be shown
    assert not desk.drawings.plots
    assert desk.live.text().endswith("N on the floor")
    level, asleep = bench.window.main_bar.level, bench.window.main_bar.asleep
    assert (level.peak_db, asleep.text()) == (-math.inf, "–")
    bench.workspace.running.leave()
    bench.wait(lambda: level.peak_db > -math.inf and "of 4 tiles" in asleep.text())
