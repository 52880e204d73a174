"""Envelopes, marks and stretches of recordings: what is drawn of them without reading them whole."""

import shutil
import sqlite3
from contextlib import closing
from functools import partial
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from earlier_recordings import make_earlier
from long_recording import write_recording

from underfoot.errors import BadFile
from underfoot.files import cache_folder
from underfoot.floor.layout import default_floor
from underfoot.records import envelopes
from underfoot.records.exports import ExportSource, write_export
from underfoot.records.recording import Recording
from underfoot.records.recording_writer import Writer
from underfoot.records.summary import summary_of
from underfoot.records.survey import (
    RecordedForces,
    cache_survey,
    cached_files,
    has_envelopes,
    load_cached_survey,
    make_envelopes,
    open_envelopes,
    survey,
)

FLOOR = default_floor(1, 2)


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    """Four seconds of somebody who walks on two tiles."""
    return write_recording(tmp_path_factory.mktemp("recorded") / "walk.underfoot", 4.0, FLOOR)


@pytest.fixture
def recording(path):
    with Recording(path) as opened:
        yield opened


@pytest.fixture
def earlier(path, tmp_path, monkeypatch):
    """The same as an earlier version wrote it: neither envelopes nor marks."""
    monkeypatch.setenv("UNDERFOOT_CACHE", str(tmp_path / "cache"))
    copy = tmp_path / "earlier.underfoot"
    copy.write_bytes(path.read_bytes())
    make_earlier(copy, 2)
    return copy


def extremes_of(recording, source, edges):
    """Least and most between edges, of the samples themselves."""
    if source == "force":
        rows = recording.force_samples()
        at, values = rows[:, 0], envelopes.loads(rows[:, 2:])
    else:
        first, values = recording.acceleration(source)
        at = first + np.arange(len(values))
    parts = [values[(at >= low) & (at < high)] for low, high in pairwise(edges)]
    return np.array([part.min(axis=0) for part in parts]), np.array([part.max(axis=0) for part in parts])


@pytest.mark.parametrize("source", envelopes.SOURCES)
@pytest.mark.parametrize(("level", "frames"), [(envelopes.FINE, 480), (envelopes.COARSE, 4800)])
def test_an_envelope_is_the_least_and_the_most_of_its_samples(recording, source, level, frames):
    columns = 3 if source == "force" else 2
    envelope = envelopes.read(recording.envelope_base(), source, level, columns)
    edges = np.arange(0.0, 4 * 48_000 + 1, 4800 if level else 480)
    low, high = envelope.between(edges)
    least, most = extremes_of(recording, source, edges)
    if level == envelopes.FINE and source != "force":  # blocks in which nothing moves are one bin
        assert len(envelope) <= len(least)
    np.testing.assert_array_equal(low, least)
    np.testing.assert_array_equal(high, most)
    assert envelope.coarser(7).high.max() == most.max()


def test_the_overview_of_hours_has_fewer_bins_than_blocks_and_the_same_extremes(monkeypatch):
    """Of 8 h on 144 tiles every block in a bin would be 2.6 GB."""
    values = np.random.default_rng(3).normal(size=(9000, 2)).astype("<f4")
    begin = 100 * np.arange(9000) + 50_000 * (np.arange(9000) >= 5000)  # with a gap
    with closing(sqlite3.connect(":memory:")) as base:
        base.executescript(envelopes.TABLE)
        bins = [row.tobytes() for row in values]
        rows = [("force", 1, int(begin[k]), 100, 100, "[0, 2]", bins[k], bins[k]) for k in range(9000)]
        base.executemany("insert into envelope values (?, ?, ?, ?, ?, ?, ?, ?)", rows)
        whole = envelopes.read_overview(base, "force", envelopes.empty(3))
        monkeypatch.setattr(envelopes, "MOST_VALUES", 3 * 2500)
        merged = envelopes.read_overview(base, "force", envelopes.empty(3))
    assert (len(whole), whole.begin.tolist()) == (9000, begin.tolist())
    assert len(merged) <= 2500
    assert 500_000.0 in merged.end
    assert 550_000.0 in merged.begin
    edges = np.append(merged.begin, merged.end[-1])
    for found, true in zip(merged.between(edges), whole.between(edges), strict=True):
        np.testing.assert_array_equal(found, true)


def test_part_of_it_is_read_for_a_stretch(recording):
    part = envelopes.read(recording.envelope_base(), "force", envelopes.FINE, 3, 50_000.0, 60_000.0)
    assert part.begin[0] <= 50_000 < part.begin[0] + 4800
    assert 60_000 <= part.end[-1] < 64_801


def test_stretches_are_the_samples_between_two_frames(recording):
    rows = recording.force_samples()
    for begin, end in ((0, 48), (47_000, 53_000), (191_000, 1e9), (-5e6, 100), (3e5, 4e5)):
        expected = rows[(rows[:, 0] >= begin) & (rows[:, 0] < end)]
        np.testing.assert_array_equal(recording.force_samples_between(begin, end), expected)
    _, whole = recording.acceleration("measured")
    np.testing.assert_array_equal(recording.frames_between("measured", 4_000, 15_000), whole[4_000:15_000])
    assert np.isnan(recording.frames_between("measured", 192_000, 192_010)).all()
    assert recording.span == (0, 192_000)


def test_a_stretch_that_begins_where_samples_were_not_recorded_is_what_comes_after_them(path, tmp_path):
    copy = tmp_path / "slow.underfoot"
    copy.write_bytes(path.read_bytes())
    with closing(sqlite3.connect(copy)) as base, base:
        base.execute("delete from force where first >= 1000 and first < 2000")
    with Recording(copy) as recording:
        rows = recording.force_samples_between(60_000, 97_000)
        assert recording.gaps("force")
    assert rows[0, 0] == 96_000
    assert rows[-1, 0] == 96_960


def test_envelopes_of_an_earlier_recording_are_made_in_the_cache_and_gone_on_with(earlier, recording):
    with Recording(earlier) as old:
        assert not has_envelopes(old)
        make_envelopes(old, lambda share: False)  # stopped after the first piece
        assert not has_envelopes(old)
        shares = []
        make_envelopes(old, lambda share: shares.append(share) or True)
        assert has_envelopes(old)
        assert old.envelope_base() is None
        with closing(open_envelopes(old)) as base:
            made = envelopes.read(base, "commanded", envelopes.FINE, 2)
    own = envelopes.read(recording.envelope_base(), "commanded", envelopes.FINE, 2)
    np.testing.assert_array_equal(made.high, own.high)
    np.testing.assert_array_equal(made.begin, own.begin)


def test_marks_are_kept_in_the_file_also_of_an_earlier_version(earlier):
    with Recording(earlier) as old:
        assert old.marks() == []
        mark = old.add_mark(48_000, "turned round")
        old.add_mark(100)
    with Recording(earlier) as again:
        assert [(mark.frame, mark.text) for mark in again.marks()] == [(100, ""), (48_000, "turned round")]
        assert again.version == 2
        again.remove_mark(again.marks()[0].id)
        assert again.marks() == [mark]


def test_a_file_that_cannot_be_written_to_says_so(earlier, monkeypatch):
    monkeypatch.setattr(sqlite3, "connect", partial(sqlite3.connect, timeout=0.0))  # it waits for 5 s otherwise
    with Recording(earlier) as old, closing(sqlite3.connect(earlier)) as other:
        old.add_mark(1)
        other.execute("begin exclusive")
        with pytest.raises(BadFile, match="cannot be written to"):
            old.add_mark(2)


def test_a_survey_is_kept_with_its_figures_and_made_anew_for_another_file(earlier, path, tmp_path, monkeypatch):
    monkeypatch.setenv("UNDERFOOT_CACHE", str(tmp_path / "cache"))
    folder = cache_folder() / "recordings"
    folder.mkdir(parents=True)
    (folder / "listed.json").symlink_to("gone")  # as one that another program removes amid the look for the oldest
    with Recording(earlier) as old:
        assert load_cached_survey(old) is None
        made = survey(old, lambda so_far: True)
        cache_survey(old, made)
        old.add_mark(5)
    with Recording(earlier) as old, Recording(path) as other:
        kept = load_cached_survey(old)
        assert kept is not None
        assert repr(kept) == repr(made)
        assert len(kept.steps) >= 4
        assert kept.whole
        assert load_cached_survey(other) is None
        peaks = [max(step.force_n) for step in kept.steps]
        np.testing.assert_allclose(peaks, [max(s.step.peak1_n, s.step.peak2_n) for s in kept.steps], rtol=0.02)
        assert summary_of(earlier).steps == len(kept.steps)
        kept_file = cached_files(old)[0]
        kept_file.write_bytes(kept_file.read_bytes()[:-9])  # damaged
        assert (load_cached_survey(old), summary_of(earlier).steps) == (None, None)
        cache_survey(old, made)
    with closing(sqlite3.connect(earlier)) as base, base:
        base.execute("insert into about values ('begun', '2026-11-24T10:00:00')")
    with Recording(earlier) as again:  # on the same floor, as long, and in the place of the one before
        assert load_cached_survey(again) is None


def test_a_survey_of_a_part_is_not_kept_as_that_of_a_recording_that_has_grown(path, tmp_path, monkeypatch):
    monkeypatch.setenv("UNDERFOOT_CACHE", str(tmp_path / "cache"))
    growing = Path(shutil.copy(path, tmp_path))
    with Recording(growing) as recording, closing(Writer(growing, recording.about, resume=True)) as writer:
        made = survey(recording, lambda so_far: True)
        writer.put("vibration", recording.span[1], np.zeros((2400, 2)))
        writer.commit()
        cache_survey(recording, made)
        assert load_cached_survey(recording) is None


def test_a_mark_is_made_while_the_recording_is_surveyed_and_exported(path, tmp_path, monkeypatch):
    monkeypatch.setattr(sqlite3, "connect", partial(sqlite3.connect, timeout=0.0))  # it waits for 5 s otherwise
    copy = Path(shutil.copy(path, tmp_path))
    with Recording(copy) as read, Recording(copy) as marked:

        def mark(*_):
            return bool(marked.add_mark(1))

        survey(read, mark)
        surveyed = len(read.marks())
        write_export(ExportSource(read, progress=mark), tmp_path / "walk.csv")
        assert 0 < surveyed < len(read.marks())


def test_a_contact_is_where_its_rows_say(recording):
    rows = [found.rows for found in RecordedForces(recording).found() if len(found.rows)]
    time_s, id, x_m, y_m, force_n = (
        np.concatenate([getattr(part, name) for part in rows])
        for name in ("time_s", "contact", "x_m", "y_m", "force_n")
    )
    spans = survey(recording, lambda so_far: True).contacts
    assert spans
    for span in spans:
        mine = id == span.id
        told = np.array([span.at(at_s) for at_s in time_s[mine]])
        assert np.quantile(np.hypot(told[:, 0] - x_m[mine], told[:, 1] - y_m[mine]), 0.9) < 0.005
        assert np.quantile(np.abs(told[:, 2] - force_n[mine]), 0.9) < 0.05 * force_n[mine].max()


def test_a_survey_can_be_stopped(recording):
    assert not survey(recording, lambda so_far: False).whole


def test_a_tile_rests_at_what_it_reads_unloaded_however_seldom_that_is():
    """The tenth percentile of all bins was taken for it: eight people on 36 tiles began at -832 N."""
    rng = np.random.default_rng(1)
    count, block = 1200, 50
    share = np.arange(count) / count
    loads = np.tile([12.0, 30.0, 5.0, 0.0], (count, block, 1))
    step = 600.0 * np.sin(np.pi * np.linspace(0.05, 0.95, 12 * block)).reshape(12, block)
    loads[..., 0] += np.where(share[:, None] < 0.95, np.tile(step, (count // 12, 1)), 0.0)  # walked on
    loads[..., 1] += np.where(share[:, None] < 0.6, 600.0, 0.0)  # stood on for more than half of the time
    loads[..., 2] += 700.0  # stood on from the first to the last
    loads += rng.normal(0.0, 0.5, loads.shape)
    loads[..., 3] = np.nan
    at = np.arange(float(count))
    force = envelopes.Envelope(at, at + 1.0, loads.min(axis=1).astype(np.float32), loads.max(axis=1).astype(np.float32))
    np.testing.assert_allclose(envelopes.resting_n(force), [12.0, 30.0, 0.0, 0.0], atol=0.5)
    assert not envelopes.resting_n(envelopes.empty(2)).any()
