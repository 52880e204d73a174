"""A study whose drive is away when it begins, or a sound card, or whose floor has a faulty sensor."""

import os
import signal

from made_studies import TD

from underfoot.engine.reports import SensorFaults
from underfoot.studies.equipment import EquipmentChoice
from underfoot.studies.phase import Phase

RATING = {"id": "main", "kind": "trials", "method": {"kind": "rating", "parameters": {"blocks": 1}}}


def test_a_session_whose_drive_is_away_is_not_begun_all_the_same(bench, null_sink):
    """Its empty file could not be removed, and the window read Stop for good."""
    start, state = bench.workspace.start, bench.workspace.overview.state
    bench.choose(sounds={"noise": "pink"})
    bench.workspace.running.leave()
    start.equipment = EquipmentChoice(masking="")
    folder = bench.workspace.sessions.path(bench.workspace.study_list.study, "P2").parent
    server = min(null_sink.threads())
    os.kill(server, signal.SIGSTOP)
    try:
        bench.type_id("P2")
        bench.click(start.begin_button)
        away = folder.rename(folder.with_suffix(".away"))
        folder.touch()
        bench.click(start.begin_button)
        assert (state.text(), bench.window.controller.is_lent) == ("Stopped.", False)
        folder.unlink()
        away.rename(folder)
    finally:
        os.kill(server, signal.SIGCONT)
        bench.workspace.running.opener.join()
    start.equipment = EquipmentChoice()


def test_a_study_that_is_begun_while_a_sound_card_is_away_is_stopped_until_it_is_back(bench, monkeypatch):
    """A card that went away before was not known: what nobody felt was asked, and counted."""
    monkeypatch.setattr(bench.window.controller.session, "silence", "card B is not there; silent: t2")
    bench.choose(stages=[RATING], stimuli={"TD": TD})
    bench.until(Phase.STOPPED, Phase.READY)
    assert bench.runner.phase is Phase.STOPPED
    assert bench.runner.messages == ["card B is not there; silent: t2"]
    monkeypatch.undo()
    bench.click(bench.workspace.experimenter.pause)
    bench.until(Phase.READY)


def test_a_faulty_sensor_is_on_the_map_of_whoever_runs_a_study(bench):
    """They look there, and not into Monitor, which the study covers."""
    bench.choose(stages=[RATING], stimuli={"TD": TD})
    bench.window.bridge.reported.emit([SensorFaults({("t1", 3): "sensor 3 is dead"})])
    assert "t1: sensor 3 is dead." in bench.workspace.experimenter.map.accessibleDescription()
