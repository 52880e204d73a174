"""Stimuli that follow the force, begun by a key: from the feet that stand there, and not from an empty floor."""

import os
import signal
from pathlib import Path

import pytest
from made_studies import TD, made_protocol, protocol_text
from people import taking_part

from underfoot.engine.session_memory import ForceReader
from underfoot.experiments.protocol import Protocol
from underfoot.nodes import REGISTRY
from underfoot.patch import preset_files
from underfoot.patch.patch import Patch
from underfoot.studies.apparatus import Apparatus, TimedStimulus
from underfoot.studies.equipment import Equipment
from underfoot.studies.floor_watch import FloorWatch
from underfoot.studies.phase import Phase
from underfoot.studies.presenter import IDLE, Presenter
from underfoot.studies.stimulus_patches import StimulusPatches, unheard

STIMULI = {"TD": TD, "WD": {**TD, "patch": "stimulus-wd"}, "WC": {**TD, "patch": "stimulus-wc", "measured_m_s2": 11.6}}


def test_what_events_start_begins_with_the_presentation():
    """Else a rhythm that somebody starts by stepping on would be heard from its middle."""
    patch, ends = unheard(Patch.load(preset_files.patches()["tacton-it1"], REGISTRY))
    assert [node.id for node in patch.nodes] == ["tile", "hand", "step"]
    assert set(ends) == {"hand.out", "step.onset"}


def commanded(runner):
    entry = runner.study.entries[-1]
    return entry.trial.intervals[-1].stimulus, entry.facts["commanded_m_s2"]


def test_changes_of_force_are_followed_from_the_load_of_who_stands_there(session, until, tmp_path):
    """The jump from 0 N to it was felt, at up to five times the protocol's level; also where it is felt again."""
    protocol = made_protocol("rating", {"blocks": 1}, STIMULI, plays=2)
    with taking_part(session, protocol, tmp_path / "a.session", until) as person:
        person.until_phase(Phase.READY)
        person.press(600.0)
        felt = {}
        for presentations in (2, 1, 1):
            person.until_phase(Phase.READY)
            person.wait(0.5)
            for _ in range(presentations):
                person.present()
            person.answer_page()
            felt |= [commanded(person.runner)]
    assert (felt["TD"], felt["WD"]) == (0.0, 0.0)
    assert felt["WC"] == pytest.approx(0.43, rel=0.1)  # it follows the force itself


def test_a_change_of_force_during_a_presentation_is_felt(session, until, tmp_path):
    protocol = made_protocol("rating", {"blocks": 1}, {"WD": STIMULI["WD"]})
    with taking_part(session, protocol, tmp_path / "a.session", until) as person:
        person.until_phase(Phase.READY)
        person.press(600.0)
        person.wait(0.5)
        person.runner.start()
        person.until(lambda: person.runner.presenter.since_frame is not None, "it is heard")
        person.press(900.0)
        person.until_phase(Phase.ANSWERING)
        person.answer_page()
        _, peak = commanded(person.runner)
    assert peak > 0.1


def test_learning_plays_no_jump_of_the_force(session, until, tmp_path):
    learn = {"id": "learn", "kind": "learn"}
    stage = {"id": "main", "kind": "trials", "method": {"kind": "rating", "parameters": {"blocks": 1}}}
    protocol = Protocol.loads(protocol_text(stages=[learn, stage], stimuli=STIMULI, present_s=0.3))
    with taking_part(session, protocol, tmp_path / "a.session", until) as person:
        person.until_phase(Phase.PAGE)
        person.press(600.0)
        person.wait(0.5)
        peaks = {}
        for name in ("TD", "WC"):
            begin = session.health.frame
            person.runner.play(name)
            person.until(lambda: session.patch == IDLE, "it has been played")
            peaks[name] = abs(person.runner.presenter.played(begin, session.health.frame)[1]).max()
    assert peaks["TD"] < 1e-9
    assert peaks["WC"] == pytest.approx(0.43, rel=0.1)


def test_a_stimulus_lasts_for_what_is_played_of_it_while_the_engine_stands_still(session, until):
    """By another clock it ended unfelt where a busy machine stalled the engine."""
    watch = FloorWatch(ForceReader(session.memory.force), session.target.floor, 48_000.0, session.force_rate_hz)
    protocol, engine = made_protocol("rating"), session.pids["engine"]
    stimuli = StimulusPatches(protocol, None)
    stimulus = TimedStimulus(Apparatus(session, protocol, stimuli, Equipment(), Presenter(session), watch, len))
    os.kill(engine, signal.SIGSTOP)
    until(lambda: Path(f"/proc/{engine}/stat").read_text().rpartition(") ")[2].startswith("T"), "it stands still")
    stimulus.begin(session.patch)
    assert [stimulus.has_ended(1e-6) for _ in range(3)] == [False] * 3
    os.kill(engine, signal.SIGCONT)
    until(lambda: stimulus.has_ended(1e-6), "it ends")
