"""The apparatus of a study: session, stimuli and equipment, shared by all of its trials."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from underfoot.engine.session import Session
from underfoot.experiments.protocol import Protocol
from underfoot.experiments.store import Excerpt
from underfoot.experiments.study import Page
from underfoot.patch.patch import Patch
from underfoot.studies.equipment import Equipment
from underfoot.studies.floor_watch import FloorWatch
from underfoot.studies.markers import place_of
from underfoot.studies.presenter import Presenter
from underfoot.studies.stimulus_patches import StimulusPatches


@dataclass(frozen=True)
class Apparatus:
    """Session, stimuli and equipment of a study. `clock` is in seconds; `pack` begins to compress excerpts."""

    session: Session
    protocol: Protocol
    stimuli: StimulusPatches
    equipment: Equipment
    presenter: Presenter
    watch: FloorWatch
    clock: Callable[[], float]
    pack: Callable[[Sequence[Excerpt]], object]

    @property
    def played_s(self) -> float:
        """Elapsed time of the session in seconds."""
        return self.session.health.frame / self.session.target.rate

    def mark(self, what: str, page: Page, ago_s: float = 0.0) -> None:
        """Send a marker for an event on this page, `ago_s` seconds ago."""
        self.equipment.mark(what, place_of(page), ago_s)


class TimedStimulus:
    """A stimulus that plays for a given time. An event by hand starts those that wait for one."""

    def __init__(self, apparatus: Apparatus) -> None:
        self._apparatus = apparatus
        self._until: float | None = None

    def begin(self, patch: Patch) -> None:
        """Request the patch of a stimulus; its time begins when it plays."""
        self._apparatus.presenter.request(patch)
        self._until = None

    def has_ended(self, seconds: float) -> bool:
        """Return whether the patch has played for `seconds`; send the event when it begins to play."""
        presenter, clock = self._apparatus.presenter, self._apparatus.clock
        if presenter.since_frame is None:
            return False
        if self._until is None:
            most_loaded = int(np.argmax(self._apparatus.watch.loads_n))  # on the tile under the participant
            presenter.strike(self._apparatus.session.target.floor.tiles[most_loaded].id)
            self._until = clock() + seconds
            return False
        if clock() < self._until:
            return False
        self._until = None
        return True
