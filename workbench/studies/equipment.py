"""What a study can have beside the floor: the plate, masking sound, and those who want marks."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from underfoot.devices.plate import Plate
from underfoot.studies.markers import Markers
from underfoot.studies.masking import Masking


@dataclass(frozen=True)
class Equipment:
    """All of it is optional; `close` lets go of it."""

    plate: Plate | None = None
    masking: Masking | None = None
    markers: Sequence[Markers] = ()

    def mark(self, what: str, words: str, ago_s: float = 0.0) -> None:
        """Tell all markers that something happened so long ago."""
        for one in self.markers:
            one.mark(what, words, ago_s)

    def forces(self, force_n: NDArray[np.float64]) -> None:
        """Give all markers new force samples, [sample, tile]."""
        for one in self.markers:
            one.forces(force_n)

    def close(self) -> None:
        """Let go of plate, sound and markers."""
        for one in (self.plate, self.masking, *self.markers):
            if one is not None:
                one.close()
