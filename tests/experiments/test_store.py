"""Sessions on disk: nothing is lost or repeated, whenever the program is killed; and what is wrong is one line."""

import os
import random
import shutil
import signal
import sqlite3
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from pathlib import Path
from threading import Barrier

import numpy as np
import pytest
from made_patches import patch_of
from made_studies import TD, first_answers, made_protocol, preset_protocol, protocol_text, walked

from underfoot.engine.target import Target
from underfoot.errors import BadFile, BadValue
from underfoot.experiments.excerpts import Excerpt
from underfoot.experiments.protocol import Protocol
from underfoot.experiments.store import SessionFile
from underfoot.experiments.study import Study
from underfoot.floor.layout import default_floor
from underfoot.nodes import REGISTRY
from underfoot.patch import preset_files
from underfoot.studies.set_up import set_up_of

WRITER = """
import sys, time
sys.path.insert(0, {helpers!r})
from made_studies import first_answers, preset_protocol
from underfoot.experiments.store import SessionFile
protocol = preset_protocol("identification-impact")
file = SessionFile.open(sys.argv[1])
study = file.study(protocol)
while not study.is_done:
    key = study.page.key
    print("asked", key, flush=True)
    file.add(study.answer(first_answers(study.page)))
    print("kept", key, flush=True)
"""


def made(path, name="identification-impact", participant="P1"):
    return SessionFile.create(path, preset_protocol(name), participant, preset_files.protocols()[name].parent)


def test_a_session_that_is_killed_at_random_moments_goes_on_at_the_next_page(tmp_path):
    """Between kills it answers some pages; every page is kept once, in the order of a session that nobody killed."""
    path = tmp_path / "p1.session"
    made(path).close()
    whole = [page.key for page in walked(Study(preset_protocol("identification-impact"), "P1"))]
    chance = random.Random(3)
    kept = []
    code = WRITER.format(helpers=os.path.join(os.path.dirname(__file__), "..", "helpers"))
    for _ in range(6):
        child = subprocess.Popen([sys.executable, "-c", code, str(path)], stdout=subprocess.PIPE, text=True)
        for _ in range(chance.randint(1, 35)):
            line = child.stdout.readline()
        os.kill(child.pid, signal.SIGKILL)
        said = line + child.communicate()[0]
        whole_lines = said[: said.rfind("\n") + 1].splitlines()  # the last may be cut short
        kept += [text.split()[1] for text in whole_lines if text.startswith("kept")]
        file = SessionFile.open(path)
        study = file.study(preset_protocol("identification-impact"))
        keys = [f"{e.stage}.{e.kind}" + (f".{e.trial.number}.{e.attempt}" if e.trial else "") for e in study.entries]
        assert keys == whole[: len(keys)]
        assert set(kept) <= set(keys)
        file.close()
    assert len(keys) > 3


def test_the_file_holds_all_that_is_needed_to_read_it_alone(tmp_path):
    file = made(tmp_path / "a.session")
    assert set(file.patches()) == {"stimulus-wc", *(f"tacton-it{i}" for i in range(1, 9))}
    assert file.about["participant"] == "P1"
    file.add_note("heel, not sole")
    file.close()
    again = SessionFile.open(tmp_path / "a.session")
    assert [(note.entry, note.text) for note in again.notes()] == [(0, "heel, not sole")]
    again.close()
    assert os.listdir(tmp_path) == ["a.session"]


def test_a_session_goes_on_in_one_place_only_and_can_be_read_everywhere(tmp_path):
    """Two windows each stored their answers to the same pages, and no study went on with both."""
    path, link = tmp_path / "a.session", tmp_path / "linked" / "b.session"  # a link had a lock of its own
    link.parent.mkdir()
    link.symlink_to(path)
    with closing(made(path)) as file, closing(SessionFile.open(link)) as other:
        study = file.study(preset_protocol("identification-impact"))
        file.add(study.answer(first_answers(study.page)))
        assert len(other.entries()) == 1
        with pytest.raises(BadFile, match="is gone on with in another window or terminal; end it there first"):
            other.add(study.answer(first_answers(study.page)))
        file.close()
        other.write_waiting()
        assert len(other.entries()) == 2
    kept = path.read_bytes()
    with closing(SessionFile.open(path)) as file:
        assert len(file.entries()) == 2
        # so it can also be read from a folder that cannot be written
        assert sorted(os.listdir(tmp_path)) == ["a.session", "linked"]
    assert path.read_bytes() == kept


def test_of_two_windows_that_begin_a_session_in_one_moment_one_has_it(tmp_path):
    """The later file replaced the earlier, in which the other window went on without a word."""
    path = tmp_path / "a.session"

    def begun(both):
        both.wait()
        try:
            return made(path)
        except BadFile as error:
            return str(error)

    with ThreadPoolExecutor(2) as windows:
        for _ in range(3):
            both = Barrier(2)
            found = sorted(windows.map(begun, [both] * 2), key=lambda one: isinstance(one, str))
            with closing(found[0]) as file:
                assert "is there already" in found[1] or "file exists" in found[1]
                with closing(SessionFile.open(path)) as third, pytest.raises(BadFile, match="in another window"):
                    third.hold()  # before anything is written
                file.add_note("it is the one that is there")
            path.unlink()


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() == 0, reason="such a user may write anywhere")
def test_what_a_killed_program_left_is_read_from_a_folder_that_is_protected(tmp_path):
    """It was called no session: its file says that there may be a log beside it, which SQLite would write."""
    archive = tmp_path / "archive"
    archive.mkdir()
    with closing(made(tmp_path / "a.session")) as file:
        file.hold()
        Path(shutil.copy(file.path, archive)).chmod(0o444)
    archive.chmod(0o555)
    try:
        with closing(SessionFile.open(archive / "a.session")) as file:
            assert file.participant == "P1"
    finally:
        archive.chmod(0o755)


def test_a_session_that_is_moved_away_takes_answers_once_it_is_back(tmp_path):
    """It took them, to where nobody would look for them, or to nowhere, and left an empty file in its place."""
    protocol = made_protocol("rating")
    path, away = tmp_path / "a.session", tmp_path / "away"
    with closing(SessionFile.create(path, protocol, "P1")) as file:
        study = file.study(protocol)
        file.add(study.answer({"rating": 20.0}))
        path.rename(away)
        gone = "is not there any more, or is another file; put it back where it was, and go on"
        with pytest.raises(BadFile, match=gone):
            file.add(study.answer({"rating": 30.0}))
        assert not path.exists()
        path.write_bytes(b"as a program that keeps folders alike puts it there")
        with pytest.raises(BadFile, match=gone):
            file.write_waiting()
        away.replace(path)
        file.write_waiting()
        assert file.entries() == study.entries


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() == 0, reason="such a user may look anywhere")
def test_an_answer_is_kept_while_the_folder_cannot_be_looked_into(tmp_path):
    """As where a network is away for a moment: that was an error of Python's."""
    protocol, folder = made_protocol("rating"), tmp_path / "share"
    folder.mkdir()
    with closing(SessionFile.create(folder / "a.session", protocol, "P1")) as file:
        study = file.study(protocol)
        file.hold()
        folder.chmod(0)
        try:
            with pytest.raises(BadFile, match="cannot be written"):
                file.add(study.answer({"rating": 20.0}))
        finally:
            folder.chmod(0o755)
        file.write_waiting()
        assert file.entries() == study.entries


def test_what_is_felt_is_written_while_the_study_goes_on(tmp_path):
    """A slow disk, here one that is locked, made a presentation last longer, and the answer come later."""
    protocol = made_protocol("rating")
    with (
        closing(SessionFile.create(tmp_path / "a.session", protocol, "P1")) as file,
        closing(sqlite3.connect(tmp_path / "a.session", isolation_level=None)) as other,
    ):
        study = file.study(protocol)
        file.hold()
        other.execute("begin immediate")
        file.keep_felt(study.unanswered({"onset_s": 1.0}))
        assert not other.execute("select * from entry").fetchall()
        other.execute("rollback")
        assert file.has_felt
        assert file.add(study.answer({"rating": 20.0})) == 1
        assert file.entries() == study.entries


def test_a_disk_that_has_no_room_for_a_stretch_is_said_to_have_none(tmp_path):
    """SQLite had given the writing up by itself, and it was said that there was nothing to take back."""
    resource = pytest.importorskip("resource")
    protocol = made_protocol("rating")
    values = np.random.default_rng(0).normal(size=(1_200_000, 1))  # more than SQLite holds back
    stretch = Excerpt("vibration", 0, 0.0, 48_000.0, ("t1",), values)
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    with closing(SessionFile.create(tmp_path / "a.session", protocol, "P1")) as file:
        study = file.study(protocol)
        file.begin_packing([stretch])
        resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, hard))
        try:
            with pytest.raises(BadFile, match=r"cannot be written: (disk I/O error|database or disk is full)"):
                file.add(study.answer({"rating": 20.0}), [stretch])
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
        file.write_waiting()
        assert file.entries() == study.entries
        assert len(file.excerpts(1)) == 1


def test_stretches_come_back_as_they_were(tmp_path):
    file = made(tmp_path / "a.session")
    study = file.study(preset_protocol("identification-impact"))
    force = np.random.default_rng(1).uniform(0.0, 900.0, (50, 4))
    vibration = np.random.default_rng(2).normal(size=(4800, 2))
    number = file.add(
        study.answer(first_answers(study.page)),
        [
            Excerpt("force", 0, 96.0, 1000.0, ("t1.1", "t1.2", "t1.3", "t1.4"), force),
            Excerpt("vibration", 0, 480.0, 48_000.0, ("t1", "t2"), vibration),
        ],
    )
    first, second = file.excerpts(number)
    assert (first.columns, first.first, first.rate_hz) == (("t1.1", "t1.2", "t1.3", "t1.4"), 96.0, 1000.0)
    np.testing.assert_allclose(first.values, force, rtol=1e-6)
    np.testing.assert_allclose(second.values, vibration, atol=np.abs(vibration).max() / 65000)
    file.close()


def test_a_trial_that_is_spoiled_afterwards_is_asked_again(tmp_path):
    protocol = made_protocol("rating")
    file = SessionFile.create(tmp_path / "a.session", protocol, "P1")
    study = file.study(protocol)
    trial = study.page.trial
    file.add(study.answer({"rating": 20.0}))
    before = study.without_last("telephone")
    file.replace_last(before.entries[-1])
    again = file.study(protocol)
    assert (again.page.trial, again.page.attempt) == (trial, 2)
    file.close()


def test_another_protocol_is_refused(tmp_path):
    file = made(tmp_path / "a.session")
    with pytest.raises(BadFile, match="was begun with another protocol"):
        file.study(preset_protocol("detection-threshold"))
    file.close()
    with pytest.raises(BadFile, match="is there already"):
        made(tmp_path / "a.session")


def test_a_session_goes_on_with_the_protocol_and_the_patches_that_it_was_begun_with(tmp_path):
    """Though both were changed, or are gone."""
    patch = tmp_path / "patches" / "mine.json"
    patch.parent.mkdir()
    patch.write_bytes(preset_files.patches()["stimulus-wc"].read_bytes())
    stimuli = {"mine": {"patch": "patches/mine.json"}, "X": {}}
    first = Protocol.loads(protocol_text(stimuli=stimuli, title="first"), folder=tmp_path)
    SessionFile.create(tmp_path / "a.session", first, "P1", tmp_path).close()
    begun_with = patch.read_bytes()

    file = SessionFile.open(tmp_path / "a.session")
    assert file.is_of(first, tmp_path)
    assert not file.is_of(Protocol.loads(protocol_text(title="second")), tmp_path)
    assert file.as_begun(tmp_path) == (first, tmp_path)  # as long as nothing was changed
    patch.write_bytes(preset_files.patches()["stimulus-td"].read_bytes())
    assert not file.is_of(first, tmp_path)
    for missing in (False, True):
        patch.unlink() if missing else None
        protocol, folder = file.as_begun(tmp_path)
        assert protocol == first
        assert (folder / "patches" / "mine.json").read_bytes() == begun_with
        assert file.study(protocol).page.stage == "main"
    file.close()
    assert not folder.exists()


def test_a_patch_that_was_changed_since_reads_the_sound_files_beside_it_as_before(tmp_path):
    patch = patch_of(("wav-player.out", "tile-output.acceleration"), wav_player={"file": "ice.wav"})
    patch.save(tmp_path / "mine.json")
    protocol = Protocol.loads(protocol_text(stimuli={"mine": {"patch": "mine.json"}, "X": {}}), "", tmp_path)
    SessionFile.create(tmp_path / "a.session", protocol, "P1", tmp_path).close()
    patch.set("tile-output", "level", 0.5, REGISTRY).save(tmp_path / "mine.json")
    with closing(SessionFile.open(tmp_path / "a.session")) as file:
        begun, folder = file.as_begun(tmp_path)
        played = begun.stimuli["mine"].at(0.0, folder)
    assert played.node("wav-player").parameters["file"] == str(tmp_path / "ice.wav")
    assert played.node("tile-output").parameters == {}


@pytest.mark.parametrize("file", ["ice.wav", "../sounds/ice.wav"])
def test_a_sound_file_that_a_setting_names_is_there_though_the_patch_was_changed_since(file, tmp_path):
    """Also where the session lies in another folder, and the terminal is given only that."""
    study, sessions = tmp_path / "study", tmp_path / "sessions"
    for folder in (study, sessions, tmp_path / "sounds"):
        folder.mkdir()
    (study / file).write_bytes(b"as it was")
    patch = patch_of(("wav-player.out", "tile-output.acceleration"))
    patch.save(study / "mine.json")
    stimuli = {"mine": {"patch": "mine.json", "settings": {"wav-player.file": file}}, "X": {}}
    protocol = Protocol.loads(protocol_text(stimuli=stimuli), "", study)
    SessionFile.create(sessions / "a.session", protocol, "P1", study).close()
    with closing(SessionFile.open(sessions / "a.session")) as session:
        assert session.as_begun() == (protocol, study)
        patch.set("tile-output", "level", 0.5, REGISTRY).save(study / "mine.json")
        begun, folder = session.as_begun()
        played = begun.stimuli["mine"].at(0.0, folder)
        assert Path(played.node("wav-player").parameters["file"]).read_bytes() == b"as it was"
        assert folder != study


def test_a_session_that_is_shared_shows_no_folder_of_the_computer(tmp_path):
    study, sessions = tmp_path / "anna" / "study", tmp_path / "anna" / "sessions"
    for folder in (study, sessions):
        folder.mkdir(parents=True)
    target = Target(default_floor(), "replay", str(study / "walk.csv"), profiles=str(study / "profiles"))
    protocol = Protocol.loads(protocol_text(), "", study)
    with closing(SessionFile.create(sessions / "a.session", protocol, "P1", study)) as session:
        session.set_up(set_up_of(target))
    assert str(tmp_path).encode() not in (sessions / "a.session").read_bytes()
    moved = (tmp_path / "anna").rename(tmp_path / "ben")  # both folders together
    with closing(SessionFile.open(moved / "sessions" / "a.session")) as session:
        assert session.folder == moved / "study"
        assert (session.about["target"], session.about["profiles"]) == ("replay:walk.csv", "profiles")


def test_a_session_is_read_though_its_protocol_would_not_be_begun_any_more(tmp_path):
    """It was measured with a factor that has a column's name, and a staircase of what has no level."""
    staircases = {"kind": "staircases", "parameters": {"followed": ["X"]}}
    stage = {"id": "main", "kind": "trials", "method": staircases}
    text = protocol_text(stages=[stage], stimuli={"TD": TD, "X": {"factors": {"block": 1.0}}})
    with pytest.raises(BadFile, match=r"X\.factors is 'block'"):
        Protocol.loads(text)
    measured = Protocol.loads(text, of_session=True)
    SessionFile.create(tmp_path / "p.session", measured, "P1", tmp_path).close()
    with closing(SessionFile.open(tmp_path / "p.session")) as file:
        assert file.as_begun()[0] == measured


def test_a_session_whose_patch_would_lie_elsewhere_writes_nothing_there(tmp_path):
    made(tmp_path / "a.session").close()
    with closing(sqlite3.connect(tmp_path / "a.session", isolation_level=None)) as base:
        base.execute("insert into patch values ('../../out.json', x'00')")
    file = SessionFile.open(tmp_path / "a.session")
    with pytest.raises(BadValue, match="a file beside the protocol or below"):
        file.as_begun(tmp_path)
    file.close()


def test_a_study_whose_method_needs_what_is_not_installed_does_not_begin(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "questplus", None)
    with pytest.raises(BadValue, match=r'needs the package questplus: pip install "underfoot\[adaptive\]"'):
        SessionFile.create(tmp_path / "p1.session", preset_protocol("detection-bayesian"), "P1")
    assert not list(tmp_path.iterdir())


def test_what_is_no_session_is_said_in_one_line(tmp_path):
    (tmp_path / "a").write_text("nothing")
    sqlite3.connect(tmp_path / "b").execute("create table x (y)").connection.close()
    for name in ("a", "b", "c"):
        with pytest.raises(BadFile) as raised:
            SessionFile.open(tmp_path / name)
        assert "\n" not in str(raised.value)


def test_a_session_that_was_copied_in_part_says_how_much_is_missing(tmp_path):
    path = tmp_path / "P1.session"
    SessionFile.create(path, made_protocol("rating"), "P1").close()
    os.truncate(path, path.stat().st_size // 2)
    with pytest.raises(BadFile, match=r"P1.session is cut off: 50 % of it are missing; copy it again"):
        SessionFile.open(path)


def test_a_session_of_a_newer_version_is_refused(tmp_path):
    made(tmp_path / "a.session").close()
    base = sqlite3.connect(tmp_path / "a.session")
    base.execute("pragma user_version = 9")
    base.close()
    with pytest.raises(BadFile, match="a newer Underfoot wrote it"):
        SessionFile.open(tmp_path / "a.session")


def test_no_file_is_made_for_what_is_no_id(tmp_path):
    with pytest.raises(BadValue, match="participant is 'P 01'; allowed: an id of letters"):
        SessionFile.create(tmp_path / "a.session", made_protocol("rating", {"blocks": 1}, {"X": {}}), "P 01")
    assert not list(tmp_path.iterdir())
