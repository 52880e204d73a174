"""Rhythms: that the eight are distinct and fit their bar, and that their events fall where they should."""

import itertools
from fractions import Fraction

import numpy as np
import pytest
from event_rows import rows_of

from underfoot.models.signals.events import event_list
from underfoot.models.signals.rhythm import RHYTHMS, play

RATE = 48000.0


def played(of, frames, block, start=0.0, frame=0, repeats=None, bar_frames=None):
    bar_frames = of.bar_s * RATE if bar_frames is None else bar_frames
    found = []
    for first in range(0, frames, block):
        count = min(block, frames - first)
        events = event_list(room=100)
        repeats_now = of.repeats if repeats is None else repeats
        play(of.table(), bar_frames, repeats_now, start, frame + first, frame + first + count, RATE, events)
        found.append(rows_of(events))
        onsets = np.floor(found[-1][:, 0])
        assert ((onsets >= frame + first) & (onsets < frame + first + count)).all()
    return np.concatenate(found)


@pytest.mark.parametrize("of", RHYTHMS, ids=lambda of: of.name)
def test_each_rhythm_plays_every_note_of_every_bar_once(of):
    start = 1234.567
    events = played(of, 150_000, 480, start)
    bar = of.bar_s * RATE
    exact = [start + (r + note.step / 24) * bar for r in range(of.repeats) for note in of.notes]
    np.testing.assert_allclose(events[:, 0], exact, rtol=3e-16)
    np.testing.assert_array_equal(events[:, 1], [note.amplitude for note in of.notes] * of.repeats)
    np.testing.assert_allclose(events[:, 2], [note.length / 24 * of.bar_s for note in of.notes] * of.repeats)


@pytest.mark.parametrize("block", [1, 7, 32, 1024, 150_000])
def test_any_split_gives_the_same_events(block):
    of = RHYTHMS[7]
    frames = 5000 if block < 32 else 50_000
    np.testing.assert_array_equal(played(of, frames, block, 0.25), played(of, frames, frames, 0.25))


def test_a_bar_that_changes_where_a_note_is_due_neither_loses_nor_doubles_it():
    draw, of = np.random.default_rng(3), np.array([(step / 24, 1 / 24, 1.0) for step in range(24)])
    for _ in range(200):
        step, due = 32 * draw.integers(20, 60), draw.integers(3, 24)
        change, events = int(due * step), event_list(room=100)
        play(of, 24.0 * step, 0, 0.0, 0, change, RATE, events)
        assert len(events) == due
        bar = draw.uniform(4800.0, 192_000.0)  # as the node goes on: at the new pace, from here
        play(of, bar, 0, change - change * (bar / (24.0 * step)), change, change + 32, RATE, events)
        assert events.time[due] == pytest.approx(change, abs=1e-9)
        assert len(events) == due + 1


def test_a_rhythm_for_ever_does_not_drift_in_a_day():
    of = RHYTHMS[4]
    frame = 24 * 3600 * 48000
    bar = 0.7 * RATE / 3
    events = played(of, 100_000, 64, 0.5, frame, repeats=0, bar_frames=bar)
    assert len(events) == pytest.approx(100_000 / bar * 3, abs=3)
    for time, _, _ in events:
        steps = (Fraction(float(time)) - Fraction(1, 2)) / Fraction(bar) * 24
        assert abs(steps - round(steps)) * Fraction(bar) / 24 < Fraction(1, 10**5)
        assert round(steps) % 24 in {note.step for note in of.notes}


def test_nothing_sounds_before_the_start_nor_after_the_last_bar():
    of = RHYTHMS[0]
    assert len(played(of, 1000, 64, 5000.0)) == 0
    assert len(played(of, 1000, 64, 0.0, int(of.bar_s * RATE) * of.repeats)) == 0


def test_a_full_list_leaves_the_rest_out():
    events = event_list(room=2)
    play(RHYTHMS[0].table(), 28800.0, 3, 0.0, 0, 100_000, RATE, events)
    assert events.time.tolist() == [0.0, 7200.0]
    assert len(events) == 2


def test_a_tiny_bar_still_ends():
    events = event_list(room=1000)
    play(RHYTHMS[0].table(), 0.0, 0, 0.0, 0, 480, RATE, events)
    assert len(events) == 40


def test_the_eight_are_named_accented_and_within_the_thesis():
    assert [of.name for of in RHYTHMS] == [f"R{i}" for i in range(1, 9)]
    for of in RHYTHMS:
        assert 0.45 <= of.bar_s <= 0.75
        assert of.repeats in (3, 4)
        assert of.notes[0] == max(of.notes, key=lambda note: note.amplitude)
        assert all(note.amplitude < of.notes[0].amplitude for note in of.notes[1:])
        assert of.notes[0].step == 0
        ends = [note.step + note.length for note in of.notes]
        assert all(
            end <= following for end, following in zip(ends, [*(note.step for note in of.notes[1:]), 24], strict=True)
        )


def test_any_two_rhythms_differ_in_a_sixth_of_the_bar_and_in_their_onsets():
    def sounding(of):
        return {step for note in of.notes for step in range(note.step, note.step + note.length)}

    for one, other in itertools.combinations(RHYTHMS, 2):
        assert len(sounding(one) ^ sounding(other)) >= 4, (one.name, other.name)
        assert {note.step for note in one.notes} != {note.step for note in other.notes}
