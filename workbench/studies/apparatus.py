"""The apparatus of a study: session, stimuli and equipment, shared by all of its trials."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from underfoot.engine.patch_edits import moved_numbers
from underfoot.engine.session import Session
from underfoot.experiments.excerpts import Excerpt
from underfoot.experiments.protocol import Protocol
from underfoot.experiments.study import Page
from underfoot.patch.patch import Patch
from underfoot.studies.equipment import Equipment
from underfoot.studies.floor_watch import FloorWatch
from underfoot.studies.markers import place_of
from underfoot.studies.presenter import Presenter
from underfoot.studies.stimulus_patches import StimulusPatches, unheard


@dataclass(frozen=True)
class Apparatus:
    """Session, stimuli and equipment of a study. `pack` begins to compress excerpts."""

    session: Session
    protocol: Protocol
    stimuli: StimulusPatches
    equipment: Equipment
    presenter: Presenter
    watch: FloorWatch
    pack: Callable[[Sequence[Excerpt]], object]

    def mark(self, what: str, page: Page, time_s: float | None = None) -> None:
        """Send a marker for an event on this page, of now or of the session's `time_s`."""
        ago_s = 0.0 if time_s is None else self.session.played_s - time_s
        self.equipment.mark(what, place_of(page), time_s, ago_s)


class TimedStimulus:
    """A stimulus that plays for a given time of the session. An event by hand starts those that wait for one.

    Before, it runs unheard until it has settled: what follows changes of the force would play the jump from 0 N to the
    load of the feet that stand there.
    """

    def __init__(self, apparatus: Apparatus) -> None:
        self._apparatus = apparatus
        self._unheard: Patch | None = None
        self._until_s: float | None = math.inf  # None until what was requested plays

    def prepare(self, patch: Patch) -> None:
        """Run a stimulus unheard, so that it can begin at once."""
        self._apparatus.presenter.request(*unheard(patch))

    def begin(self, patch: Patch) -> None:
        """Request the patch of a stimulus; its time begins when it plays."""
        session = self._apparatus.session
        self._until_s = None
        if session.moved_numbers(patch) is not None:  # it plays, at another level
            self._unheard = None
            self._apparatus.presenter.request(patch)
            return
        if self._unheard is None or moved_numbers(self._unheard, patch, session.registry) is None:
            self.prepare(patch)
        self._unheard = patch
        self._let_be_heard()

    def has_ended(self, seconds: float) -> bool:
        """Return whether `seconds` of the patch have been played; send the event when it begins to play."""
        presenter = self._apparatus.presenter
        self._let_be_heard()
        if presenter.since_frame is None or self._unheard is not None:
            return False
        session = self._apparatus.session
        if self._until_s is None:
            most_loaded = int(np.argmax(self._apparatus.watch.loads_n))  # on the tile under the participant
            presenter.strike(session.target.floor.tiles[most_loaded].id)
            self._until_s = session.played_s + seconds
            return False
        if session.played_s < self._until_s:
            return False
        self._until_s = math.inf
        return True

    def _let_be_heard(self) -> None:
        """Play the patch that has run unheard for long enough; nodes that do not follow the force begin anew."""
        if self._unheard is not None and self._apparatus.presenter.has_settled():
            self._apparatus.presenter.request(self._unheard, anew=True)
            self._unheard = None
