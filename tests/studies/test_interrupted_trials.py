"""What was felt and not answered is kept: by a program that is killed, and by a study that is stopped."""

import os
import shutil
import signal
from contextlib import closing

import pytest
from made_studies import made_protocol
from people import open_session, taking_part

from underfoot.engine.reports import ProcessDied
from underfoot.errors import BadFile, BadValue
from underfoot.experiments.store import SessionFile
from underfoot.experiments.table import rows_of
from underfoot.studies.phase import Phase

CONSTANT = {"patch": "stimulus-wc", "scaled_by": "gain.gain", "measured_m_s2": 11.6, "level_m_s2": 2.0}
PROTOCOL = made_protocol("rating", {"blocks": 2}, {"WC": CONSTANT}, start="step")


def as_killed(path, copy):
    """Copy a session that is open, as it would be found if the program were killed now."""
    for suffix in ("", "-wal"):
        shutil.copy(f"{path}{suffix}", f"{copy}{suffix}")
    return copy


def test_a_trial_that_was_felt_when_the_program_is_killed_is_kept_and_told(until, tmp_path):
    """It left no trace: it was felt once more, and nobody knew; nor of one during which the study was stopped."""
    path = tmp_path / "a.session"
    with open_session(until) as session:
        with taking_part(session, PROTOCOL, path, until) as person:
            runner = person.runner
            with closing(SessionFile.open(path)) as other, pytest.raises(BadFile, match="gone on with in another"):
                other.hold()
            person.until_phase(Phase.READY)
            assert not runner.file.has_felt
            person.press(600.0)
            person.until(lambda: runner.file.has_felt, "it is felt")
            assert runner.phase is Phase.PRESENTING
            killed = as_killed(path, tmp_path / "killed.session")
            runner.stop("by the participant")
            runner.go_on()
            person.press(0.0)
            person.until_phase(Phase.READY)
            person.present()
            runner.answer({"rating": 1.0})
            person.until_phase(Phase.READY)
            person.present()
            runner.repeat_last("slipped")  # while the next one is felt
            assert not runner.file.has_felt
            kept = [(entry.trial.number, entry.attempt, entry.spoiled) for entry in runner.file.entries()]
            assert kept == [(1, 1, "stopped by the participant"), (1, 2, "slipped")]
            felt = "main.trials.2.1 was felt, and comes after the one that is repeated"
            assert [note.text for note in runner.file.notes()][-2:] == [felt, "answer of main taken back: slipped"]
        with taking_part(session, PROTOCOL, killed, until) as person:
            told = "trial 1 of main was felt and not answered when the session ended; it comes again"
            assert person.runner.messages == [told]
            person.until_phase(Phase.READY)
            person.present()
    with closing(SessionFile.open(killed)) as file:  # and it was left while a rating was asked for
        rows = rows_of(PROTOCOL, "P1", file.entries())
    felt = [(row["trial"], row["attempt"], row["spoiled"], "onset_s" in row, "rating" in row) for row in rows]
    assert felt == [(1, attempt, "interrupted before the answer", True, False) for attempt in (1, 2)]
    assert rows[1]["most_force_n"] > 300.0


def test_what_is_presented_again_after_a_stop_is_felt(until, tmp_path):
    """It was presented in the silence of the stop, as were all trials after it; so were those before preparation."""
    with open_session(until) as session, taking_part(session, PROTOCOL, tmp_path / "a.session", until) as person:
        runner = person.runner
        with pytest.raises(BadValue, match="phase is 'preparing'; allowed: what follows the preparation"):
            runner.spoil("too soon")
        for again in (lambda: runner.spoil("a door slammed"), lambda: runner.repeat_last("slipped")):
            person.until_phase(Phase.READY)
            if not runner.study.entries:
                with pytest.raises(BadValue, match="plays is 0; allowed: 1 or more: nothing of this trial"):
                    runner.spoil("nobody felt it")
                person.present()
            runner.stop("by the experimenter")
            again()
            person.until_phase(Phase.READY)
            person.present()
            runner.answer({"rating": 1.0})
            assert runner.study.entries[-1].facts["commanded_m_s2"] > 0.1
        assert [entry.spoiled for entry in runner.study.entries] == ["a door slammed", "slipped", ""]
        stopped, went_on, back = "stopped: by the experimenter", "went on", "answer of main taken back: slipped"
        assert [note.text for note in runner.file.notes()] == [stopped, went_on, stopped, back, went_on]


def test_a_trial_that_awaits_a_key_is_presented_though_the_engine_was_lost(until, tmp_path):
    """It waited for good: the new engine begins with what was asked for while there was none, and reports no change."""
    protocol = made_protocol("rating", {"blocks": 1, "rated": ["TD"]})
    with open_session(until) as session, taking_part(session, protocol, tmp_path / "a.session", until) as person:
        person.until_phase(Phase.READY)
        os.kill(session.pids["engine"], signal.SIGKILL)
        person.until(lambda: person.runner.messages, "it is told")
        assert person.runner.phase is Phase.WAITING
        person.until_phase(Phase.READY)
        person.runner.start()
        person.runner.poll([ProcessDied("engine", "it ended")])  # while it is felt, so that it is spoiled
        person.finish_study()
        assert [entry.spoiled for entry in person.runner.file.entries()] == ["the engine was lost: it ended", ""]
