"""Recordings that were cut short or damaged: read as far as they are whole, or refused in one line."""

import os
import shutil
import sqlite3
from contextlib import closing, suppress
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from made_recordings import ABOUT

from underfoot.__main__ import cli
from underfoot.engine.session_replay import ReplayJob
from underfoot.errors import BadFile, BadValue
from underfoot.records.exports import ExportSource, write_export
from underfoot.records.recording import Recording
from underfoot.records.recording_format import APPLICATION_ID
from underfoot.records.recording_writer import Writer
from underfoot.records.summary import summary_of


@pytest.fixture
def whole(tmp_path):
    """A recording with some of everything."""
    path = tmp_path / "whole.uf"
    writer = Writer(path, ABOUT)
    for first in (0, 4800):
        for table in ("vibration", "commanded", "measured"):
            writer.put(table, first, np.ones((4800, 2), np.float32))
    samples = np.zeros((200, 10))
    samples[:, 0] = samples[:, 1] = 48.0 * np.arange(200)
    writer.put("force", 0, samples)
    writer.command(0, "play", '{"on": true}')
    writer.close()
    return path


def read_all(path):
    with Recording(path) as recording:
        recording.force_samples(), recording.vibration(), recording.commands(), recording.gaps()
        recording.acceleration("measured"), recording.acceleration("commanded")


def test_one_that_was_killed_before_its_first_block_is_empty_and_commands_say_so(tmp_path):
    path = tmp_path / "new.uf"
    Writer(path, ABOUT).close()
    with Recording(path) as recording:
        assert recording.force_samples().shape == (0, 10)
        assert recording.vibration()[1].shape == (0, 2)
        with pytest.raises(BadValue, match="table is 'forces'; allowed: force, "):
            recording.gaps("forces")
    for command in ("monitor", "steps"):
        said = CliRunner().invoke(cli, [command, str(path)])
        assert isinstance(said.exception, BadFile)
        assert "holds no force samples" in str(said.exception)


@pytest.mark.parametrize("data", [b"", bytes(5000)], ids=["empty", "zeros"])
@pytest.mark.parametrize("command", [("monitor",), ("render", "-o", "out.wav"), ("export", "-o", "out.csv")])
def test_what_is_named_as_a_recording_is_refused_as_one(tmp_path, command, data):
    path = tmp_path / "lost.UNDERFOOT"
    path.write_bytes(data)
    said = CliRunner().invoke(cli, [*command, str(path)])
    assert isinstance(said.exception, BadFile)
    assert str(said.exception).startswith(f"{path} is not a recording")


def test_a_file_with_our_number_and_nothing_else_is_refused_and_let_go_of(tmp_path):
    path = tmp_path / "empty.uf"
    with closing(sqlite3.connect(path)) as base:
        base.execute(f"pragma application_id = {APPLICATION_ID}")
        base.execute("create table other (a)")
    with pytest.raises(BadFile, match="is not a recording"):
        Recording(path)
    path.unlink()  # nothing holds it: where that matters, this fails


@pytest.mark.parametrize("mark", ["5, x'ff00'", "9e99, ''", "4000000000000000000, ''"])
def test_marks_of_no_frame_or_text_are_said_in_a_line(whole, mark):
    """Exports ended with a traceback."""
    with closing(sqlite3.connect(whole)) as base, base:
        base.execute(f"insert into mark (frame, text) values ({mark})")
    with Recording(whole) as recording, pytest.raises(BadFile, match=r"table mark cannot be read: an entry is not of"):
        recording.marks()


@pytest.mark.parametrize("text", ["[", '{"t1": 2}'])
def test_calibrations_that_cannot_be_read_are_said_in_a_line(whole, text):
    with closing(sqlite3.connect(whole)) as base, base:
        base.execute("insert into about values ('calibrations', ?)", (text,))
    with Recording(whole) as recording, pytest.raises(BadFile, match=r"whole\.uf: its calibrations cannot be read: "):
        assert recording.calibrations


@pytest.mark.parametrize("entry", ["x'00', 'a'", "'calibrations', x'00'"])
def test_one_that_says_of_itself_what_is_no_text_is_refused(whole, entry):
    with closing(sqlite3.connect(whole)) as base, base:
        base.execute(f"insert into about values ({entry})")
    with pytest.raises(BadFile, match="what it says of itself is no text"):
        Recording(whole)


def test_one_with_more_frames_than_there_are_numbers_for_is_refused(whole):
    with closing(sqlite3.connect(whole)) as base, base:
        base.execute("update vibration set count = 9223372036854775807 where first > 0")
    with Recording(whole) as recording, pytest.raises(BadFile, match="vibration cannot be read: its rows are numbered"):
        assert recording.span


@pytest.mark.parametrize("suffix", [".wav", ".h5"])
@pytest.mark.parametrize(
    "lie",
    [
        "update vibration set first = 1099511627776 where first > 0",
        "update vibration set first = first + 1099511627776",
        "update vibration set count = 1099511627776 where first > 0",
        "update force set data = ?",
    ],
)
def test_silence_of_months_is_not_written_and_what_is_before_it_can_be(whole, tmp_path, suffix, lie):
    """A number in the file says so; it took until the disk was full."""
    samples = np.zeros((200, 10))
    samples[199, :2] = 2.0**40
    with closing(sqlite3.connect(whole)) as base, base:
        base.execute(lie, [samples.tobytes()] * lie.count("?"))
    path = tmp_path / f"out{suffix}"
    with Recording(whole) as recording:
        with pytest.raises(BadFile, match=r"whole.uf has no vibration for 265.1 days from 0(\.[12])? s on; allowed: "):
            write_export(ExportSource(recording), path)
        assert not path.exists()
        write_export(ExportSource(recording, stretch_s=(0.0, 0.1)), path)
    assert path.exists()
    if "vibration set count" in lie:
        with pytest.raises(BadFile, match=r"whole.uf cannot be replayed: it lasts 265.1 days; allowed: up to a day"):
            ReplayJob(whole).run()


@pytest.mark.parametrize("key", ["rate", "force_rate"])
def test_one_of_a_rate_that_no_session_has_is_refused(whole, key):
    with closing(sqlite3.connect(whole)) as base, base:
        base.execute("update about set value = '1e-300' where key = ?", (key,))
    with pytest.raises(BadFile, match=f"does not say its {key}"):
        Recording(whole)


@pytest.mark.parametrize("key", ["floor", "rate", "force_rate", "patch"])
def test_one_that_lacks_what_it_needs_says_what(whole, key):
    with closing(sqlite3.connect(whole)) as base:
        base.execute("delete from about where key = ?", (key,))
        base.commit()
    with pytest.raises(BadFile, match=f"does not say its {key}"):
        Recording(whole)


def test_tables_that_are_gone_or_hold_something_else_are_named(whole):
    with closing(sqlite3.connect(whole)) as base:
        base.executescript(
            "drop table measured; update vibration set data = x'00'; update about set value = '[' where key = 'x'"
        )
    with Recording(whole) as recording:
        with pytest.raises(BadFile, match="table measured cannot be read"):
            recording.acceleration("measured")
        with pytest.raises(BadFile, match="table vibration cannot be read"):
            recording.vibration()
        assert len(recording.force_samples()) == 200


@pytest.mark.parametrize(("table", "columns"), [("measured", 2), ("force", 10)])
def test_a_block_of_another_size_than_it_says_is_refused_with_its_row(whole, table, columns):
    """Half a block was taken for that of one tile, and read as that of both; of forces NumPy's words were told."""
    with closing(sqlite3.connect(whole)) as base, base:
        base.execute(f"update {table} set data = substr(data, 1, length(data) / 2)")
    said = rf"table {table} .*: its block from row \d+ on has \d+ numbers for \d+ rows of {columns}"
    with Recording(whole) as recording, pytest.raises(BadFile, match=said):
        list(recording.blocks(table))


@pytest.mark.parametrize("tiles", ["'[0,'", "cast(x'5b30ff5d' as text)"], ids=["no list", "no text"])
def test_the_summary_of_one_whose_envelopes_are_damaged_is_refused(whole, tiles):
    with closing(sqlite3.connect(whole)) as base:
        base.executescript(f"update envelope set tiles = {tiles}")
    with pytest.raises(BadFile, match="table envelope cannot be read"):
        summary_of(whole)


def test_damaged_files_are_read_or_refused_in_one_line(whole, tmp_path):
    data = bytearray(whole.read_bytes())
    rng = np.random.default_rng(1)
    refused = 0
    for k in range(200):
        broken = bytearray(data)
        for at in rng.integers(0, len(data) if k % 2 else 4096, rng.integers(1, 30)):
            broken[at] = rng.integers(0, 256)
        if k % 5 == 0:
            del broken[int(rng.integers(100, len(data))) :]
        path = tmp_path / f"{k}.uf"
        path.write_bytes(bytes(broken))
        with suppress(BadFile):
            read_all(path)
            refused -= 1
        refused += 1
    assert 20 < refused < 200


def test_one_that_was_copied_in_part_says_how_much_is_missing(whole):
    """It is no other file, as which SQLite's message reads."""
    with whole.open("r+b") as file:
        file.truncate(round(0.6 * whole.stat().st_size))
    with pytest.raises(BadFile, match=r"whole.uf is cut off: 40 % of it are missing; copy it again"):
        Recording(whole)


def test_one_that_ends_while_somebody_reads_it_is_whole_and_in_one_file_when_they_end(tmp_path):
    path = tmp_path / "followed.uf"
    writer = Writer(path, ABOUT)
    writer.put("vibration", 0, np.ones((4800, 2), np.float32))
    writer.commit()
    with Recording(path) as reader:
        assert len(reader.vibration()[1]) == 4800
        writer.put("vibration", 4800, np.ones((4800, 2), np.float32))
        writer.close()
        assert len(reader.vibration()[1]) == 9600
    assert [file.name for file in tmp_path.iterdir()] == ["followed.uf"]
    with Recording(path) as recording:
        assert len(recording.vibration()[1]) == 9600


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() == 0, reason="such a user may write anywhere")
@pytest.mark.parametrize("protected", ["folder", "file and folder"])
def test_a_recording_that_was_read_when_it_ended_is_read_from_a_folder_that_is_protected(tmp_path, protected):
    """Its writer could not put its log away; SQLite then opens it only where it can write a file beside it."""
    path = tmp_path / "walk.underfoot"
    writer = Writer(path, ABOUT)
    writer.put("force", 0, np.ones((10, 10)))
    writer.commit()
    with Recording(path):
        writer.close()
    if "file" in protected:
        path.chmod(0o444)
    tmp_path.chmod(0o555)
    try:
        with Recording(path) as recording:
            assert len(recording.force_samples()) == 10
    finally:
        tmp_path.chmod(0o755)


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() == 0, reason="such a user may write anywhere")
def test_what_a_killed_writer_left_is_read_from_an_archive_that_is_protected(tmp_path):
    """All of it was still in the log, and SQLite has to lock a file to read its log without a third one beside it."""
    archive = tmp_path / "archive"
    archive.mkdir()
    writer = Writer(tmp_path / "walk.underfoot", ABOUT)
    writer.put("force", 0, np.ones((10, 10)))
    writer.commit()
    for name in ("walk.underfoot", "walk.underfoot-wal"):
        Path(shutil.copy(tmp_path / name, archive)).chmod(0o444)
    writer.close()
    archive.chmod(0o555)
    try:
        with Recording(archive / "walk.underfoot") as recording:
            assert len(recording.force_samples()) == 10
    finally:
        archive.chmod(0o755)


@pytest.mark.parametrize(
    "program",
    ["create trigger t after insert on mark begin delete from force; end",
     "drop table command; create view command as with recursive c(id) as (select 0 union all select id + 1 from c) "
     "select id, id as frame, 'play' as kind, '{}' as body from c"],
    ids=["trigger", "view"],
)  # fmt: skip
def test_one_with_programs_of_its_own_is_refused(whole, program):
    with closing(sqlite3.connect(whole)) as base:
        base.executescript(program)
    with pytest.raises(BadFile, match="is not a recording: it has views or triggers, which are programs, and not run"):
        Recording(whole)


@pytest.mark.parametrize("text", [b"", b"no recording at all", b"SQLite format 3\0" + bytes(200)])
def test_other_files_are_refused_in_one_line(tmp_path, text):
    path = tmp_path / "b.uf"
    path.write_bytes(text)
    with pytest.raises(BadFile, match="is not a recording"):
        Recording(path)
    with pytest.raises(BadFile, match="no such file"):
        Recording(tmp_path / "c.uf")
