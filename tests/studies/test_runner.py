"""Studies on the real engine and the simulated floor, by keys and by steps; what was felt is kept with the answer."""

import json
import os
import resource
import socket
import sqlite3
from contextlib import contextmanager
from datetime import datetime
from pathlib import Path

import msgspec
import numpy as np
import pytest
import soundfile
from made_patches import patch_of
from made_studies import TD, made_protocol, protocol_text
from people import open_session, taking_part
from wired import ends

from underfoot.devices.emulation.emulator import Emulator
from underfoot.devices.emulation.plate import EmulatedPlate
from underfoot.devices.plate import Plate, PlateCalibration
from underfoot.devices.replay import Replay
from underfoot.engine.commands import Strike, TileEqualiser
from underfoot.engine.reports import OutputChanged
from underfoot.engine.target import Target
from underfoot.errors import BadFile, BadValue
from underfoot.experiments.protocol import Protocol
from underfoot.experiments.store import SessionFile
from underfoot.floor.forces import ForceSeries
from underfoot.floor.layout import default_floor
from underfoot.patch.patch import Patch
from underfoot.studies.equipment import Equipment
from underfoot.studies.floor_watch import SILENT_S
from underfoot.studies.markers import LslMarkers, SerialTrigger
from underfoot.studies.page_words import text_of
from underfoot.studies.phase import Phase
from underfoot.studies.presenter import IDLE

RATED = {"id": "main", "kind": "trials", "method": {"kind": "rating", "parameters": {"blocks": 1}}}
CONSTANT = {"patch": "stimulus-wc", "scaled_by": "gain.gain", "measured_m_s2": 11.6, "level_m_s2": 2.0}


def rated(start, **stage):
    parameters = {"rated": ["TD", "WC", "X"], "blocks": 1}
    return made_protocol("rating", parameters, {"TD": TD, "WC": CONSTANT, "X": {}}, start=start, **stage)


@pytest.mark.parametrize("start", ["key", "step", "crossings"])
def test_a_study_runs_to_its_end_and_keeps_what_was_felt(start, session, until, tmp_path):
    path = tmp_path / "p1.session"
    protocol = rated(start, block_pause_s=0.1)
    with taking_part(session, protocol, path, until) as person:
        person.until_phase(Phase.READY)
        if start == "key":
            person.press(600.0)  # who stands on the tile feels what a key begins
        person.finish_study()
    file = SessionFile.open(path)
    entries = file.entries()
    assert [entry.kind for entry in entries] == ["trials"] * 3
    for number, entry in enumerate(entries, 1):
        name = entry.trial.intervals[0].stimulus
        force, *measured, vibration = file.excerpts(number)
        assert force.values.sum(axis=1).max() == pytest.approx(600.0, rel=0.05)
        assert entry.facts["most_force_n"] == pytest.approx(600.0, rel=0.05)
        assert entry.facts["response_s"] >= 0.0
        if name == "X" or (name, start) == ("TD", "key"):  # who stands still changes no force
            assert entry.facts["commanded_m_s2"] == 0.0
            assert vibration.columns == ()
            assert "onset_s" not in entry.facts
        else:
            assert entry.facts["commanded_m_s2"] == pytest.approx(np.abs(vibration.values).max(), rel=0.01)
            assert 0.05 < entry.facts["commanded_m_s2"] < 6.0
            (felt,) = measured  # the simulated plate's accelerometer, under the foot
            frames = min(len(felt.values), len(vibration.values))  # on a busy machine one comes a block later
            assert felt.values.shape[1] == vibration.values.shape[1]
            assert frames > 0.95 * max(len(felt.values), len(vibration.values))
            assert entry.facts["measured_m_s2"] == pytest.approx(np.abs(felt.values).max(), rel=0.3)
            assert np.corrcoef(felt.values[:frames, 0], vibration.values[:frames, 0])[0, 1] > 0.5
        if name == "WC" and start != "key":
            assert 0.0 <= entry.facts["onset_after_step_s"] < 0.02
    file.close()


def test_a_stimulus_reads_its_sound_files_beside_the_protocol(session, until, tmp_path, monkeypatch):
    """In a setting, too; a session has a folder of its own, in which they were sought."""
    (folder := tmp_path / "study").mkdir()
    hum = np.sin(2.0 * np.pi * 100.0 * np.arange(48_000) / 48_000)
    for name, size in (("soft", 0.1), ("loud", 0.4)):
        soundfile.write(folder / f"{name}.wav", size * hum, 48_000)
    player = patch_of(("wav-player.out", "tile-output.acceleration"), wav_player={"file": "soft.wav"})
    player.save(folder / "player.json")
    stimuli = {"soft": {"patch": "player.json"}, "loud": {"patch": "player.json"}}
    stimuli["loud"]["settings"] = {"wav-player.file": "loud.wav"}
    text = protocol_text(stages=[RATED], stimuli=stimuli, present_s=0.3)
    monkeypatch.chdir(tmp_path)
    folder = Path("study")
    protocol = Protocol.loads(text, folder=folder)
    with taking_part(session, protocol, tmp_path / "a.session", until, folder=folder) as person:
        person.until_phase(Phase.READY)
        Patch(title="edited meanwhile").save(folder / "player.json")  # which is not what the session was begun with
        person.press(600.0)
        person.finish_study()
        kept = person.runner.file.entries()
    felt = {entry.trial.intervals[0].stimulus: entry.facts["commanded_m_s2"] for entry in kept}
    assert felt["loud"] == pytest.approx(4.0 * felt["soft"], rel=0.05)
    assert felt["soft"] > 0.0


def test_a_stimulus_that_cannot_be_played_is_prepared_again_when_the_study_goes_on(session, until, tmp_path):
    """It waited for ever."""
    player = patch_of(("wav-player.out", "tile-output.acceleration"), wav_player={"file": "hum.wav"})
    player.save(tmp_path / "player.json")
    text = protocol_text(stages=[RATED], stimuli={"hum": {"patch": "player.json"}, "X": {}})
    protocol = Protocol.loads(text, folder=tmp_path)
    with taking_part(session, protocol, tmp_path / "a.session", until, folder=tmp_path) as person:
        for _ in range(2):
            person.until_phase(Phase.STOPPED)
            assert person.runner.messages[-1].endswith("hum.wav cannot be played: there is no such file")
            person.runner.go_on()
        person.until_phase(Phase.STOPPED)
        soundfile.write(tmp_path / "hum.wav", np.full(480, 0.1), 48_000)
        person.runner.go_on()
        person.until_phase(Phase.READY)


def test_a_sound_file_that_is_missing_is_told_before_the_first_trial(session, until, tmp_path):
    """It was told in the middle of a session, when its trial came."""
    patch_of(("wav-player.out", "tile-output.acceleration")).save(tmp_path / "player.json")
    stimuli = {
        name: {"patch": "player.json", "settings": {"wav-player.file": f"{name}.wav"}} for name in ("ice", "hum", "mud")
    }
    for name in ("ice", "hum"):
        soundfile.write(tmp_path / f"{name}.wav", np.full(480, 0.1), 48_000)
    protocol = Protocol.loads(protocol_text(stages=[RATED], stimuli=stimuli), folder=tmp_path)
    with taking_part(session, protocol, tmp_path / "a.session", until, folder=tmp_path) as person:
        assert person.until_phase(Phase.STOPPED, Phase.READY) is Phase.STOPPED
        assert person.runner.messages[-1].endswith("mud.wav cannot be played: there is no such file")


def test_who_has_crossed_back_is_not_told_to_while_answering(session, until, tmp_path):
    with taking_part(session, rated("crossings"), tmp_path / "a.session", until) as person:
        person.until_phase(Phase.READY)
        person.step()
        person.until(lambda: person.runner.hint == "Now back.")
        person.step()
        person.until_phase(Phase.ANSWERING)
        assert person.runner.hint == ""


def test_two_intervals_follow_one_another_and_feedback_is_read_before_the_first(session, until, tmp_path):
    parameters = {"standard": "WC", "comparisons": ["TD"], "blocks": 2}
    stimuli = {"TD": TD | {"correct": "comparison"}, "WC": CONSTANT}
    waits = {"start": "step", "interval_pause_s": 0.2, "feedback": True}
    protocol = made_protocol("constant-stimuli", parameters, stimuli, **waits)
    with taking_part(session, protocol, tmp_path / "a.session", until) as person:
        person.answer_page()
        file, before = person.runner.file, text_of(person.runner)
        kinds = [(excerpt.part, excerpt.kind) for excerpt in file.excerpts(1)]
        person.until_phase(Phase.READY)
        person.present()
        assert (person.runner.interval, text_of(person.runner)) == (2, "")  # the last one would be the first interval
    assert before in ("The last one: right.", "The last one: wrong.")
    assert kinds == [(part, kind) for part in (0, 1) for kind in ("force", "measured", "vibration")]


def test_a_study_that_was_left_goes_on_at_the_next_trial(session, until, tmp_path):
    path = tmp_path / "a.session"
    two = made_protocol("rating", {"blocks": 1}, {"WC": CONSTANT, "X": {}}, start="step")
    with taking_part(session, two, path, until) as person:
        person.answer_page()
        next_page = person.runner.page.key
    session.send(TileEqualiser("t1", calibration="2026-05-02 a07be6c51f98"))
    with taking_part(session, two, path, until) as person:
        person.until_phase(Phase.READY)
        assert person.runner.page.key == next_page
    with taking_part(session, two, path, until) as person:
        person.finish_study()
    session.send(TileEqualiser("t1"))
    file = SessionFile.open(path)
    assert [entry.trial.number for entry in file.entries()] == [1, 2]
    notes = [(note.entry, note.text) for note in file.notes()]
    file.close()
    assert notes == [(1, "calibrations in use: t1: Vibration 2026-05-02 a07be6c51f98")]  # once, since it was so


def test_a_spoiled_trial_is_kept_and_presented_again(session, until, tmp_path):
    with taking_part(session, rated("step"), tmp_path / "a.session", until) as person:
        person.until_phase(Phase.READY)
        trial = person.runner.page.trial
        person.present()
        person.runner.spoil("a door slammed")
        person.answer_page()
        person.runner.repeat_last("pressed too early")
        person.answer_page()
        kept = person.runner.file.entries()
    assert [(entry.trial.number, entry.attempt, entry.spoiled) for entry in kept] == [
        (trial.number, 1, "a door slammed"),
        (trial.number, 2, "pressed too early"),
        (trial.number, 3, ""),
    ]


@contextmanager
def full_disk():
    """No file of this process can grow: the system refuses it, as a full disk does."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (1, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


def test_an_answer_that_the_disk_refuses_waits_until_there_is_room(session, until, tmp_path):
    with taking_part(session, rated("key"), tmp_path / "a.session", until) as person:
        runner = person.runner
        person.answer_page()
        person.until_phase(Phase.READY)
        person.present()
        number = runner.page.trial.number
        with full_disk():
            with pytest.raises(BadFile, match="cannot be written"):
                runner.answer({"rating": 70.0})
            assert runner.phase is Phase.STOPPED
            with pytest.raises(BadFile, match="cannot be written"):
                runner.go_on()
            assert runner.phase is Phase.STOPPED
        with pytest.raises(BadValue, match="nothing of this trial"):  # it would be of the next one, with what was felt
            runner.spoil("once more")
        runner.go_on()
        person.finish_study()
        kept = runner.file.entries()
    assert [entry.trial.number for entry in kept] == [1, 2, 3]
    assert kept[number - 1].answers == {"rating": 70.0}
    again = SessionFile.open(tmp_path / "a.session")
    assert again.study(rated("key")).is_done
    assert again.excerpts(number)
    again.close()


def test_stop_silences_at_once_and_the_trial_begins_anew(session, until, tmp_path):
    with taking_part(session, rated("key"), tmp_path / "a.session", until) as person:
        runner = person.runner
        person.until_phase(Phase.READY)
        person.press(600.0)
        runner.start()
        runner.stop("by the participant")
        assert runner.session.memory.status.panic
        assert runner.phase is Phase.STOPPED
        with pytest.raises(BadValue):
            runner.answer({"rating": 1.0})
        runner.go_on()
        person.until_phase(Phase.READY)
        assert not runner.session.memory.status.panic
        assert runner.page.attempt == 1
        assert [note.text for note in runner.file.notes()] == ["stopped: by the participant", "went on"]


def test_who_does_not_agree_stops_the_study_and_that_is_kept(session, until, tmp_path):
    stages = [{"id": "consent", "kind": "consent"}, {"id": "rest", "kind": "pause", "seconds": 3600.0}]
    protocol = Protocol.loads(protocol_text(stages=stages))
    path = tmp_path / "a.session"
    with taking_part(session, protocol, path, until) as person:
        runner = person.runner
        person.until_phase(Phase.PAGE)
        runner.answer({"agreed": "no"})
        assert (runner.phase, runner.study.entries) == (Phase.STOPPED, [])
        assert [note.text for note in runner.file.notes()] == ["stopped: the participant does not agree to take part"]
        runner.go_on()
        runner.answer({"agreed": "yes"})
        kept = sqlite3.connect(path)  # while the session is open: consent is there the moment it is given
        ((at, body),) = kept.execute("select at, body from entry").fetchall()
        kept.close()
        assert json.loads(body)["answers"] == {"agreed": "yes"}
        assert datetime.fromisoformat(at) >= datetime.fromisoformat(json.loads(body)["facts"]["started_at"])
        person.until_phase(Phase.PAUSE)
        runner.end_pause()  # by the experimenter
        assert runner.phase is Phase.END
        assert runner.study.entries[-1].facts["left_s"] > 3500.0
        with pytest.raises(BadValue, match="phase is 'end'; allowed: a pause"):
            runner.end_pause()


def test_an_answer_cannot_come_before_its_presentation(session, until, tmp_path):
    with taking_part(session, rated("step"), tmp_path / "a.session", until) as person:
        person.until_phase(Phase.READY)
        with pytest.raises(BadValue, match="phase is 'ready'"):
            person.runner.answer({"rating": 1.0})
        with pytest.raises(BadValue):
            person.runner.start()


def test_a_button_on_the_floor_is_pressed_by_a_foot_or_missed(session, until, tmp_path):
    parameters = {"widths_m": [0.1], "distances_m": [0.05], "bearings_deg": [0.0], "repeats": 2, "sessions": 1,
                  "origin_m": [0.1525, 0.1525]}  # fmt: skip
    protocol = made_protocol("target-selection", {**parameters, "visible_s": 1.5, "pause_s": 0.1})
    with taking_part(session, protocol, tmp_path / "a.session", until) as person:
        runner = person.runner
        target = person.until(lambda: runner.target, "a button appears")
        person.press(80.0, target.x_m - 0.1525, target.y_m - 0.1525)
        person.until(lambda: len(runner.study.entries) == 1, "the press is taken")
        assert runner.selected == target  # which is shown as a white disc
        person.press(0.0)
        person.until(lambda: runner.target and runner.selected is None, "the next button appears")
        person.until_phase(Phase.END)
        first, second = (entry.answers for entry in runner.file.entries())
    assert (first["selected"], second["selected"]) == ("yes", "no")
    assert 0.0 < first["time_s"] < 1.5


def test_who_comes_back_from_a_button_has_its_pause_whatever_follows(session, until, tmp_path):
    """A trial that was repeated, or one of the next stage, came at once, with the foot still out on the floor."""
    parameters = {"widths_m": [0.1], "distances_m": [0.05], "bearings_deg": [0.0], "repeats": 1, "sessions": 1,
                  "origin_m": [0.1525, 0.1525], "visible_s": 0.1, "pause_s": 60.0}  # fmt: skip
    buttons = {"id": "buttons", "kind": "trials", "method": {"kind": "target-selection", "parameters": parameters}}
    protocol = Protocol.loads(protocol_text(stages=[buttons, RATED], stimuli={"X": {}}))
    with taking_part(session, protocol, tmp_path / "a.session", until) as person:
        runner = person.runner
        person.until(lambda: runner.page.stage == "main" and runner.seconds_left > 30.0, "the button is missed")
        runner.repeat_last("a door slammed")
        assert (runner.page.stage, runner.seconds_left > 30.0) == ("buttons", True)


def test_the_plate_goes_to_the_stiffness_of_each_trial_and_never_under_a_load(session, until, tmp_path):
    """Where a trial has none, it goes to where it is: a catch trial came four seconds sooner than others."""
    emulated = EmulatedPlate()
    known = PlateCalibration(positions=(0.0, 1.0), stiffness_n_mm=(40.0, 160.0), made="2026-05-03")
    plate = Plate(emulated.name, known, move_s=1.0)
    stimuli = {"soft": {"stiffness_n_mm": 52.0}, "hard": {"stiffness_n_mm": 146.0}, "none": {}}
    protocol = made_protocol("rating", {"blocks": 1}, stimuli, start="step")
    try:
        with taking_part(session, protocol, tmp_path / "a.session", until, equipment=Equipment(plate)) as person:
            runner = person.runner
            noted = [f"calibrations in use: plate: Stiffness {known.identity}"]
            assert [note.text for note in runner.file.notes()] == noted
            person.until(lambda: runner.hint == "The plate moves.", "the plate moves")
            person.press(600.0)
            person.until(lambda: runner.hint == "The plate moves. Please step off.", "the plate waits")
            person.until(lambda: emulated.servo.moves and not emulated.servo.is_moving, "it has begun, and been held")
            held = emulated.servo.position
            person.wait(0.4)
            assert (len(emulated.servo.moves), emulated.servo.position) == (1, held)
            person.press(0.0)
            person.finish_study()
        felt, wanted, now = [entry.trial.intervals[0].stimulus for entry in runner.study.entries], [], 52.0
        for name in felt:
            now = stimuli[name].get("stiffness_n_mm", now)
            wanted.append(known.position(now))
        assert [move[1] for move in emulated.servo.moves] == pytest.approx([wanted[0], *wanted], abs=1e-4)
        assert {move[2] for move in emulated.servo.moves} == {1.0}
        set_for = [e.trial.intervals[0].stimulus for e in runner.study.entries if "stiffness_set" in e.facts]
        assert sorted(set_for) == ["hard", "soft"]
    finally:
        emulated.close()


def test_learning_and_level_play_what_is_asked_for(session, until, tmp_path):
    stages = [
        {"id": "level", "kind": "level", "stimulus": "WC"},
        {"id": "learn", "kind": "learn", "seconds": 30.0},
        {"id": "main", "kind": "trials", "method": {"kind": "rating", "parameters": {"blocks": 1}}},
    ]
    protocol = Protocol.loads(protocol_text(stages=stages, stimuli={"WC": CONSTANT}, present_s=0.3))
    with taking_part(session, protocol, tmp_path / "a.session", until) as person:
        runner = person.runner

        def strikes():
            return sum(isinstance(getattr(one, "command", None), Strike) for one in person.reports)

        person.until_phase(Phase.PAGE)
        person.press(600.0)
        assert runner.session.patch != IDLE, "what is to be lowered plays at once"
        for _ in range(3):
            runner.adjust(-1, is_fine=False)
        person.until(lambda: runner.session.health.peak > 0.005, "the noise is felt")
        person.wait(0.5)
        assert strikes() <= 2, "one event by hand for the page, and one for the level"
        runner.answer({})
        person.reports.clear()
        runner.play("WC")
        person.until(lambda: runner.session.health.peak > 0.005, "the stimulus is felt")
        person.until(lambda: runner.session.health.peak < 0.001, "it ends by itself")
        person.wait(1.0)
        assert strikes() == 1, "none of nothing, three times as long"
        runner.answer({})
        assert runner.study.gain_db == -6.0
        person.finish_study()
        (entry,) = [entry for entry in runner.file.entries() if entry.trial is not None]
    assert entry.facts["commanded_m_s2"] < 2.0


def test_who_leaves_the_floor_in_a_presentation_stops_it(session, until, tmp_path):
    made = made_protocol("rating", {"blocks": 1}, {"WC": CONSTANT})
    protocol = msgspec.structs.replace(made, present_s=20.0)
    with taking_part(session, protocol, tmp_path / "a.session", until) as person:
        person.until_phase(Phase.READY)
        person.press(600.0)
        person.until(lambda: person.runner.watch.is_on, "somebody stands there")
        person.runner.start()
        person.until(lambda: person.runner.session.health.peak > 0.01, "it is felt")
        person.press(0.0)
        person.until_phase(Phase.STOPPED)
        assert person.runner.hint == "Stopped: the participant left the floor."


def test_a_floor_that_is_unplugged_in_a_presentation_stops_it(until, tmp_path):
    """What was not felt is no trial: it begins anew when the study goes on."""
    floor = default_floor(1, 1)
    times = np.arange(60_000) / 1000.0
    sender, transport = ends("udp")
    target = Target(floor, kind="udp", source=transport.name.partition(":")[2])
    standing = Replay(ForceSeries(times, np.full((len(times), 1, 4), 150.0), 1000.0), floor, 48_000.0)
    emulator = Emulator(sender, standing)
    emulator.start()
    try:
        protocol = msgspec.structs.replace(made_protocol("rating", {"blocks": 1}, {"X": {}}), present_s=60.0)
        with (
            open_session(until, target) as opened,
            taking_part(opened, protocol, tmp_path / "a", until, silent_s=SILENT_S) as person,
        ):
            runner = person.runner
            person.until_phase(Phase.READY)
            runner.start()
            emulator.close()
            person.until_phase(Phase.STOPPED)
            assert runner.hint == "Stopped: no force comes from the floor."
            assert opened.memory.status.panic
            assert runner.page.attempt == 1
            assert runner.file.entries() == []
    finally:
        emulator.close()


def test_a_sound_card_that_goes_away_stops_a_study_until_it_is_back(session, until, tmp_path, monkeypatch):
    """What was not felt is no trial."""
    gone = OutputChanged("the card has gone", "the simulator, without sound", "the card is not there")
    with taking_part(session, rated("key"), tmp_path / "a", until) as person:
        runner = person.runner
        person.until_phase(Phase.READY)
        runner.start()
        monkeypatch.setattr(session, "silence", gone.silence)
        runner.poll([gone])
        person.poll()
        assert runner.phase is Phase.STOPPED
        runner.go_on()
        person.until_phase(Phase.STOPPED)
        assert runner.messages == [gone.text, *["the card is not there"] * 2]
        monkeypatch.undo()
        runner.go_on()
        person.until_phase(Phase.READY)
        assert runner.file.entries() == []


def test_a_trigger_that_is_unplugged_is_said_and_the_study_goes_on(session, until, tmp_path):
    pytest.importorskip("pty")
    master, slave = os.openpty()
    name = os.ttyname(slave)
    trigger = SerialTrigger(name)
    for end in (master, slave):
        os.close(end)
    protocol = made_protocol("rating", {"blocks": 1}, {"WC": CONSTANT}, start="step")
    with taking_part(session, protocol, tmp_path / "a", until, equipment=Equipment(markers=[trigger])) as person:
        person.finish_study()
        assert person.runner.messages == [f"no markers reach the trigger {name}: it was unplugged"]
        assert len(person.runner.file.entries()) == 1


def test_those_who_want_marks_get_them(session, until, tmp_path):
    """A byte for each on a real pseudo-terminal, and LSL streams where that is installed."""
    pylsl, tty = map(pytest.importorskip, ("pylsl", "tty"))
    master, slave = os.openpty()
    tty.setraw(slave)
    os.set_blocking(master, False)
    told_s = {}

    class Lsl(LslMarkers):
        def mark(self, what, text, time_s=None, ago_s=0.0):
            told_s[what] = time_s
            super().mark(what, text, time_s, ago_s)

    trigger, lsl = SerialTrigger(os.ttyname(slave)), Lsl(default_floor(1, 1), 1000.0)
    (found,) = pylsl.resolve_byprop("source_id", f"underfoot-markers-{socket.gethostname()}", timeout=120.0)
    inlet = pylsl.StreamInlet(found)
    inlet.open_stream(timeout=120.0)
    protocol = made_protocol("rating", {"blocks": 1}, {"WC": CONSTANT}, start="step")
    with taking_part(session, protocol, tmp_path / "a", until, equipment=Equipment(markers=[trigger, lsl])) as person:
        person.finish_study()
        (entry,) = person.runner.file.entries()
        samples = []
        last = ["answer main.1"]
        until(lambda: samples.append(inlet.pull_sample(timeout=0.1)) or samples[-1][0] == last, "all marks")
    assert list(os.read(master, 100)) == [1, 2, 3, 4]
    assert [words for words, _ in samples if words] == [[f"{what} main.1"] for what in told_s]
    assert list(told_s) == ["begin", "onset", "end", "answer"]
    assert told_s["onset"] - told_s["begin"] == pytest.approx(entry.facts["onset_after_step_s"], abs=1e-6)
    inlet.close_stream()
    for end in (master, slave):
        os.close(end)
