"""A recording's new name: nothing is overwritten, and nothing that is being written is lost."""

import shutil
import sqlite3
import subprocess
import sys
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest
from long_recording import write_recording
from made_recordings import ABOUT

from underfoot.errors import BadFile, BadValue
from underfoot.floor.layout import default_floor
from underfoot.records import renaming
from underfoot.records.recording import Recording
from underfoot.records.recording_writer import Writer
from underfoot.records.renaming import rename_recording
from underfoot.records.survey import RecordedForces, Survey, cache_survey, load_cached_survey
from underfoot.sqlite_files import opened


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    return write_recording(tmp_path_factory.mktemp("walks") / "walk.underfoot", 1.0, default_floor(1, 2))


@pytest.fixture
def walk(tmp_path, written):
    return Path(shutil.copy(written, tmp_path))


def frames(path):
    with closing(Recording(path)) as recording:
        return len(recording.vibration()[1])


def test_it_has_the_new_name_and_what_was_found_in_it_stays_known(walk):
    with closing(Recording(walk)) as recording:
        known = Survey(until_s=RecordedForces(recording).length_s, whole=True)
        cache_survey(recording, known)
    named = rename_recording(walk, " Monday, second walk ")
    assert named == walk.with_name("Monday, second walk.underfoot")
    assert not walk.exists()
    with closing(Recording(named)) as recording:
        assert load_cached_survey(recording) == known
    assert rename_recording(named, "v1.2") == walk.with_name("v1.2.underfoot")
    assert rename_recording(walk.with_name("v1.2.underfoot"), "v1.2.underfoot") == walk.with_name("v1.2.underfoot")


@pytest.mark.parametrize("name", ["", "  ", "..", "a/b", "a\\b", "C:walk", "what?", "two\nlines", "Nul", "x" * 201])
def test_what_is_no_file_name_is_refused_in_one_line(walk, name):
    with pytest.raises(BadValue, match=r"is not a file name; allowed: .*") as said:
        rename_recording(walk, name)
    assert "\n" not in str(said.value)
    assert walk.exists()


def test_another_recording_is_never_overwritten(walk, monkeypatch):
    other = write_recording(walk.with_name("other.underfoot"), 0.5, default_floor(1, 2))
    with pytest.raises(BadFile, match=r"other.underfoot is there already; choose another name"):
        rename_recording(walk, "other")
    monkeypatch.setattr(type(other), "exists", lambda self: False)  # it appeared after the look
    with pytest.raises(BadFile, match=r"other.underfoot is there already"):
        rename_recording(walk, "other")
    monkeypatch.undo()
    assert (frames(walk), frames(other)) == (48_000, 24_000)


def test_a_file_system_without_links_renames_too(walk, monkeypatch):
    def no_link(*_):
        raise PermissionError(1, "Operation not permitted")

    monkeypatch.setattr("os.link", no_link)
    assert frames(rename_recording(walk, "stick")) == 48_000
    assert not walk.exists()


def test_letter_case_alone_can_be_changed(walk):
    assert rename_recording(walk, "Walk").name in {path.name for path in walk.parent.iterdir()}


def test_one_that_is_being_written_keeps_its_name_and_everything(tmp_path, monkeypatch):
    monkeypatch.setattr(renaming, "PATIENCE_S", 0.05)
    path = tmp_path / "now.underfoot"
    writer = Writer(path, ABOUT)
    for first in (0, 4800):
        writer.put("vibration", first, np.ones((4800, 2), np.float32))
        with pytest.raises(BadFile, match=r"now.underfoot cannot be renamed: it is being recorded or read; wait"):
            rename_recording(path, "later")
        writer.commit()
    writer.close()
    assert frames(rename_recording(path, "later")) == 9600


def test_a_writer_that_ends_soon_is_waited_for(tmp_path, monkeypatch):
    path = tmp_path / "now.underfoot"
    writer = Writer(path, ABOUT)
    writer.put("vibration", 0, np.ones((4800, 2), np.float32))
    monkeypatch.setattr(renaming, "PATIENCE_S", 60.0)
    monkeypatch.setattr(renaming.time, "sleep", lambda seconds: writer.close())
    assert frames(rename_recording(path, "later")) == 4800


def test_what_a_killed_writer_left_beside_it_comes_along(tmp_path):
    path = tmp_path / "killed.underfoot"
    Writer(path, ABOUT).close()
    code = f"""
import os, numpy as np
from pathlib import Path
from underfoot.records.recording_writer import Writer
writer = Writer(Path({str(path)!r}), {ABOUT!r}, resume=True)
writer.put("vibration", 0, np.ones((4800, 2), np.float32))
writer.commit()
os._exit(1)
"""
    assert subprocess.run([sys.executable, "-c", code]).returncode == 1
    assert (tmp_path / "killed.underfoot-wal").exists()
    assert frames(rename_recording(path, "found")) == 4800
    assert [file.name for file in tmp_path.iterdir()] == ["found.underfoot"]


def test_a_reader_elsewhere_goes_on_reading_but_cannot_mark_what_moved(walk):
    with closing(Recording(walk)) as elsewhere:
        named = rename_recording(walk, "named")
        assert len(elsewhere.vibration()[1]) == 48_000
        with pytest.raises(BadFile, match=r"walk.underfoot cannot be written to: it was moved or removed"):
            elsewhere.add_mark(480, "here")
    assert frames(named) == 48_000


def test_a_damaged_file_can_be_renamed_too(tmp_path):
    path = tmp_path / "lost.underfoot"
    path.write_bytes(bytes(5000))
    assert rename_recording(path, "damaged").read_bytes() == bytes(5000)
    with pytest.raises(sqlite3.DatabaseError), closing(sqlite3.connect(tmp_path / "damaged.underfoot")) as base:
        base.execute("select 1 from about")


def test_whoever_opens_the_old_name_too_late_makes_no_file_of_it(tmp_path):
    with pytest.raises(sqlite3.OperationalError):
        opened(tmp_path / "moved a moment ago.underfoot")
    assert not list(tmp_path.iterdir())
