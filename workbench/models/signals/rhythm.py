"""Rhythms of notes on a bar of 24 steps (thesis 3.3.7), and their playback as events."""

import math

import numpy as np
from msgspec import Struct

from underfoot.kernels import Floats, kernel
from underfoot.layouts import Memory
from underfoot.models.signals.events import append

STEPS = 24
"""Steps in a bar."""
_ROUNDING = 1e-6
"""Frames by which an onset may be rounded down and still be in the frame where it is due: within a day at 48 kHz."""
ONSET, LENGTH, AMPLITUDE = range(3)
"""Columns of a table of notes: onset and length as fractions of the bar, and amplitude."""


class Note(Struct, frozen=True):
    """Note that starts at `step` (0 to 23) and lasts `length` whole steps within the bar; `amplitude` 0 to 1."""

    step: int
    length: int
    amplitude: float


class Rhythm(Struct, frozen=True):
    """Bar of notes, one at a time and in order, played `repeats` times (0: endless).

    The first note is the accent of the bar: it starts at step 0 and none is stronger.
    """

    name: str
    bar_s: float
    repeats: int
    notes: tuple[Note, ...]

    def table(self) -> Floats:
        """Return the notes as the array [note, 3] for `play`."""
        return np.array([(note.step / STEPS, note.length / STEPS, note.amplitude) for note in self.notes])


def rhythm(name: str, bar_s: float, repeats: int, *notes: tuple[int, int, float]) -> Rhythm:
    """Return a rhythm of bars of `bar_s`, `repeats` times, with notes (step, length, amplitude).

    >>> rhythm("two", 0.6, 3, (0, 6, 1.0), (12, 6, 0.5)).table().tolist()  # steps of a bar's 24
    [[0.0, 0.25, 1.0], [0.5, 0.25, 0.5]]
    """
    return Rhythm(name, bar_s, repeats, tuple(Note(*note) for note in notes))


RHYTHMS = (
    rhythm("R1", 0.60, 3, (0, 4, 1.0), (6, 4, 0.6), (12, 4, 0.6), (18, 4, 0.6)),
    rhythm("R2", 0.75, 3, (0, 11, 1.0), (12, 5, 0.6), (18, 5, 0.6)),
    rhythm("R3", 0.45, 4, (0, 3, 1.0), (4, 3, 0.6), (8, 13, 0.7)),
    rhythm("R4", 0.60, 4, (0, 6, 1.0), (8, 6, 0.6), (16, 6, 0.6)),
    rhythm("R5", 0.70, 3, (0, 7, 1.0), (9, 7, 0.6), (18, 5, 0.8)),
    rhythm("R6", 0.50, 4, (0, 15, 1.0), (20, 2, 0.5)),
    rhythm("R7", 0.75, 3, (0, 2, 1.0), (3, 2, 0.5), (6, 2, 0.5), (9, 2, 0.5), (12, 2, 0.5)),
    rhythm("R8", 0.65, 4, (0, 5, 1.0), (6, 2, 0.5), (9, 5, 0.7), (15, 2, 0.5), (18, 5, 0.7)),
)
"""Eight distinct rhythms. The thesis shows its own only as a picture (3.5); these follow its spirit: four even notes,
long and two short, a gallop, a triplet, 3+3+2, one long with an upbeat, a run and a rest, and five notes of alternating
lengths."""


@kernel
def play(
    notes: Floats, bar_frames: float, repeats: int, start: float, frame: int, end: int, rate: float, events: Memory
) -> None:
    """Append the notes with onset frames in [frame, end) to `events`: times, amplitudes and durations.

    `notes` [note, 3] is a table (`Rhythm.table`), `start` the session frame (float64, sub-sample) of the first bar,
    `repeats` 0 for endless. Repeat r of a note has the time `start + (r + step / 24) bar_frames`, computed directly, so
    nothing drifts. `bar_frames` below 48 count as 48. Stretches partition the rhythm: no note is lost or doubled, also
    where a bar changes as a note is due, which rounding puts a little before or after. Notes without room in `events`
    are left out.

    >>> from underfoot.models.signals.events import event_list
    >>> events = event_list(room=10)
    >>> play(RHYTHMS[0].table(), 28800.0, 3, 0.5, 0, 20000, 48000.0, events)
    >>> events.time[: len(events)]
    array([5.00000e-01, 7.20050e+03, 1.44005e+04])
    """
    bar = max(bar_frames, 2.0 * STEPS)
    bar_s = bar / rate
    repeat = max(int((frame - start) / bar) - 1, 0)
    while repeats == 0 or repeat < repeats:
        if start + repeat * bar >= end:
            break
        for i in range(notes.shape[0]):
            time = start + (repeat + notes[i, ONSET]) * bar
            due = math.floor(time + _ROUNDING)
            if frame <= due < end and len(events) < events.room:
                append(events, max(time, due), notes[i, AMPLITUDE], notes[i, LENGTH] * bar_s)
        repeat += 1
