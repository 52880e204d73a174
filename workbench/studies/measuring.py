"""Measurements of a presentation: onset and peak of the vibration, peak force, and excerpts of both signals."""

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from underfoot.experiments.excerpts import Excerpt
from underfoot.studies.floor_watch import FloorWatch
from underfoot.studies.presenter import AUDIBLE, Presenter

BEFORE_S = 0.2
"""Time before a presentation from which force and vibration are kept."""


@dataclass
class TrialRecord:
    """Measurements of a trial's presentations so far. `facts` and `excerpts` are stored with its answer."""

    started_at: str = ""
    plays: int = 0
    first_s: float = math.nan
    """Session seconds at which the present one began: a key was pressed, or the first force of a step came."""
    ended: float = math.nan
    """Time at which the last presentation ended, in seconds of `time.perf_counter`."""
    onset_s: float = math.nan
    """Session seconds at which the last one's vibration began; NaN where there was none."""
    facts: dict[str, Any] = field(default_factory=dict)
    excerpts: list[Excerpt] = field(default_factory=list)
    kept: tuple[int, bool] = (0, False)
    """Of how many plays the session file knows, and whether also that the last one has ended."""
    _looked_frame: int = 0
    """The frame up to which the onset was looked for."""
    _awaited: list[tuple[int, tuple[int, int, int], NDArray[np.intp]]] = field(default_factory=list)
    """Intervals, frames and tiles whose accelerometer samples are incomplete: a card's arrive up to a second late."""

    def begin_anew(self) -> None:
        """Discard all measurements before the trial is presented, for the first time or again."""
        self.plays += 1
        self.facts, self.excerpts, self._awaited = {}, [], []

    def look_for_onset(self, presenter: Presenter, by_foot: bool) -> None:
        """Note the onset as soon as it is there, while the presentation goes on."""
        if "onset_s" not in self.facts:
            rate, end = presenter.session.target.rate, presenter.end_frame
            first = max(round(self.first_s * rate), self._looked_frame)
            self._note_onset(presenter.onset_frame(first, end), rate, by_foot)
            self._looked_frame = end

    def measure(self, presenter: Presenter, watch: FloorWatch, interval: int, by_foot: bool) -> None:
        """Measure an interval that has just ended. With `by_foot`, time counts from the step's first force."""
        session = presenter.session
        rate, end_s = session.target.rate, max(watch.now_s, self.first_s)
        begin_s, end = max(self.first_s - BEFORE_S, 0.0), round(end_s * rate) + rate
        first, played = presenter.played(round(begin_s * rate), end)
        force_s, forces = watch.forces_between(begin_s, end_s)
        largest = np.abs(played[max(round(self.first_s * rate) - first, 0) :]).max(axis=0, initial=0.0)
        sounding = np.flatnonzero(largest > AUDIBLE * presenter.full_scale)
        if math.isnan(self.onset_s):  # else it was noted, and may be longer ago than what is kept
            self._note_onset(presenter.onset_frame(round(self.first_s * rate), end), rate, by_foot)
        peak = float(largest[sounding].max(initial=0.0))
        most = float(np.nan_to_num(forces.sum(axis=2)).max(initial=0.0)) if forces.size else 0.0
        self.facts |= {
            "commanded_m_s2": max(float(f"{peak:.5g}"), self.facts.get("commanded_m_s2", 0.0)),
            "most_force_n": max(round(most, 1), self.facts.get("most_force_n", 0.0)),
            "shown_s": round(end_s - self.first_s, 4),
            "latency_s": round(session.health.latency_s, 6),
        }
        tiles = [tile.id for tile in session.target.floor.tiles]
        corners = tuple(f"{tile}.{k}" for tile in tiles for k in (1, 2, 3, 4))
        flat = forces.reshape(len(forces), len(corners))
        self.excerpts.append(Excerpt("force", interval, force_s, watch.force_hz, corners, flat))
        names, samples = tuple(tiles[k] for k in sounding), played[:, sounding]
        self.excerpts.append(Excerpt("vibration", interval, first / rate, float(rate), names, samples))
        loaded = np.argmax(np.nan_to_num(forces.sum(axis=2)).max(axis=0)) if most > 0.0 else 0
        frames = round(begin_s * rate), round(self.first_s * rate), end
        self._awaited.append((interval, frames, np.union1d(sounding, loaded)))
        if presenter.measured_until >= end_s * rate:
            self.complete(presenter)

    def complete(self, presenter: Presenter) -> None:
        """Add the accelerometers' signals of the intervals, which are complete when the answer is given."""
        for interval, frames, tiles in self._awaited:
            self._keep_measured(presenter, interval, frames, tiles)
        self._awaited = []

    def _keep_measured(
        self, presenter: Presenter, interval: int, frames: tuple[int, int, int], tiles: NDArray[np.intp]
    ) -> None:
        """Store the accelerometer signals of `tiles`: the stimulated ones and the one the participant stood on."""
        target = presenter.session.target
        first, measured = presenter.measured(frames[0], frames[2])
        there = [k for k in tiles if len(measured) and np.isfinite(measured[:, k]).all()]
        if not there:
            return
        samples = measured[:, there]
        begin = max(frames[1] - first, 0)
        peak = float(np.abs(samples[begin:]).max(initial=0.0))
        self.facts["measured_m_s2"] = max(float(f"{peak:.5g}"), self.facts.get("measured_m_s2", 0.0))
        names = tuple(target.floor.tiles[k].id for k in there)
        self.excerpts.append(Excerpt("measured", interval, first / target.rate, float(target.rate), names, samples))

    def _note_onset(self, frame: int | None, rate: int, by_foot: bool) -> None:
        """Store the onset of the first interval that vibrates."""
        self.onset_s = math.nan if frame is None else frame / rate
        if frame is not None and "onset_s" not in self.facts:
            self.facts["onset_s"] = round(self.onset_s, 6)
            if by_foot:
                self.facts["onset_after_step_s"] = round(self.onset_s - self.first_s, 6)
