"""The quick half of what `underfoot bench --stress` does to the program on purpose."""

import os
import shutil
import sqlite3
from contextlib import closing, suppress

import numpy as np
import pytest
import soundfile
from click.testing import CliRunner

from underfoot.__main__ import cli
from underfoot.bench import stress
from underfoot.bench.stress import corruption, damage, datagrams, full_disk, sinks
from underfoot.bench.stress.outcome import Effort, Outcome
from underfoot.bench.stress.valid_files import KINDS, Kind, read_error
from underfoot.errors import BadFile, BadValue, UnderfootError
from underfoot.records.recording import Recording
from underfoot.records.recording_writer import Writer


def told(outcomes):
    return [f"{outcome.what}: {outcome.found}" for outcome in outcomes if not outcome.passed]


@pytest.mark.parametrize("name", KINDS)
def test_damaged_files_of_a_kind_are_read_or_refused_in_one_line(name, monkeypatch):
    monkeypatch.setattr(damage, "KINDS", {name: KINDS[name]})
    (outcomes,) = damage.run(Effort(times=25, seed=11), lambda line: None)
    assert outcomes.times == 25
    assert outcomes.passed, outcomes.found


def test_more_files_than_a_share_are_tried_on_all_cores_and_none_is_begun_after_the_time(monkeypatch):
    monkeypatch.setattr(damage, "KINDS", {"profile": KINDS["profile"]})
    monkeypatch.setattr(damage, "SHARE", 10)
    (outcome,) = damage.run(Effort(times=25, seed=11), lambda line: None)
    assert outcome.passed, outcome.found
    assert outcome.times == 25
    (late,) = damage.run(Effort(times=25, seconds=0.0), lambda line: None)
    assert not late.passed
    assert late.times == 0


def test_kinds_of_files_take_turns_so_that_none_is_left_out_when_the_time_is_over(monkeypatch):
    begun = []
    monkeypatch.setattr(damage, "in_parallel", lambda work, shares, *_, **__: begun.extend(shares) or iter(()))
    outcomes = list(damage.run(Effort(times=3 * damage.SHARE), lambda line: None))
    assert [share.name for share in begun] == 3 * list(KINDS)
    assert [outcome.times for outcome in outcomes] == [0] * len(KINDS)
    assert "give more --seconds" in outcomes[0].found


def test_a_reader_that_lets_an_error_through_is_found(monkeypatch):
    def careless(path):
        np.frombuffer(path.read_bytes(), "<f8")

    kind = Kind(lambda path: path.write_bytes(bytes(80)), careless, None)
    monkeypatch.setattr(damage, "KINDS", {"patch": kind})
    monkeypatch.setattr(damage, "corrupt_database", lambda path, draw: path.write_bytes(b"seven b"))
    lines = []
    (outcomes,) = damage.run(Effort(times=5), lines.append)
    assert not outcomes.passed
    assert any("ValueError in test_stress.py" in line for line in lines)


def test_the_same_seed_damages_alike():
    data = bytes(range(256)) * 8
    for how in (corruption.corrupt_bytes, corruption.corrupt_head):
        first, second = (how(data, np.random.default_rng(4)) for _ in range(2))
        assert first == second != data


def test_a_sample_of_an_impossible_time_does_not_hold_up_a_replay(tmp_path):
    """A flipped bit makes a stamp of 1e80 frames; looking for its frame one by one would take for ever."""
    path = tmp_path / "a.underfoot"
    KINDS["recording"].write(path)
    with closing(sqlite3.connect(path, isolation_level=None)) as base:
        (data,) = base.execute("select data from force").fetchone()
        rows = np.frombuffer(data, "<f8").copy()
        rows[10 * 50] = 6.9e80
        base.execute("update force set data = ?", (rows.tobytes(),))
    assert "times that no session can have" in read_error(KINDS["recording"], path)
    with Recording(path) as recording, pytest.raises(BadFile):
        recording.force_samples()


def test_a_sound_whose_header_makes_hours_of_it_is_refused_before_it_is_resampled(tmp_path):
    path = tmp_path / "a.wav"
    soundfile.write(path, np.zeros(4800), 22_050)
    data = bytearray(path.read_bytes())
    for rate_hz in (3, 2_147_483_647):
        data[24:28] = rate_hz.to_bytes(4, "little")  # samples a second
        path.write_bytes(data)
        assert f"its header says {rate_hz} Hz; allowed: 100 to 1000000 Hz" in read_error(KINDS["sound file"], path)
    soundfile.write(path, np.zeros(600_000), 100, "PCM_U8")
    assert "it is 288000000 samples in memory; allowed: 268435456" in read_error(KINDS["sound file"], path)


def test_strangers_datagrams_are_left_out_and_floods_take_no_memory():
    outcomes = list(datagrams.run(Effort(times=2000), lambda line: None))
    assert not told(outcomes)
    assert "0 of 2000 taken" in outcomes[0].found


def test_what_no_shaker_may_get_reaches_none():
    assert not told(sinks.run(Effort(seconds=2.0), lambda line: None))


@pytest.mark.skipif(os.name != "posix", reason="files have no limit to their size elsewhere")
def test_a_full_disk_leaves_old_files_whole(tmp_path):
    with full_disk.small_disk(tmp_path):
        for trial in full_disk.TRIALS.values():
            found, good = trial(tmp_path)
            assert good, found


@pytest.mark.skipif(os.name != "posix", reason="files have no limit to their size elsewhere")
def test_what_a_killed_writer_left_can_be_read_where_the_disk_is_full(tmp_path):
    writer = Writer(
        tmp_path / "a.uf", {"patch": "{}", "floor": '{"tiles": [{}]}', "rate": "48000", "force_rate": "1000"}
    )
    writer.put("vibration", 0, np.ones((2400, 1), np.float32))
    writer.commit()
    disk = tmp_path / "disk"
    disk.mkdir()
    with full_disk.small_disk(disk):
        for name in ("a.uf", "a.uf-wal"):
            shutil.copy(tmp_path / name, disk)
        with suppress(OSError), (disk / "fill").open("wb", buffering=0) as file:
            while True:
                file.write(bytes(4096))
        with Recording(disk / "a.uf") as recording:
            assert len(recording.vibration()[1]) == 2400
    writer.close()


def test_one_row_is_asked_for_and_failures_are_an_error(monkeypatch):
    asked = {}

    def run(row, effort, progress):
        asked.update(row=row, effort=effort)
        return {"damage": [Outcome("patch", 3, "a traceback", passed=False)]}

    monkeypatch.setattr(stress, "run", run)
    done = CliRunner().invoke(cli, ["bench", "--stress", "damage", "--times", "3"])
    assert asked == {"row": "damage", "effort": Effort(3, None, 1)}
    assert "a traceback   FAILED" in done.stdout
    assert isinstance(done.exception, UnderfootError)
    CliRunner().invoke(cli, ["bench", "--stress", "--json"])
    assert asked["row"] == ""


def test_a_row_that_is_not_there_is_refused():
    with pytest.raises(BadValue, match="stress is 'nope'; allowed: kills, damage"):
        stress.run("nope")
