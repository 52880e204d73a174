"""Result of a calibration: figures, a verdict, pictures and raw data, and the change of a profile."""

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from msgspec import structs
from numpy.typing import NDArray

from underfoot.drawing import Drawing
from underfoot.errors import BadMeasurement

if TYPE_CHECKING:
    from underfoot.floor.profile import Part, Profile


@dataclass(frozen=True)
class Result:
    """Result: `quantities` (name, value, unit), a `verdict` in plain words, drawings, and the raw data.

    `good` says whether the result may be used. `raw` are tables: name, the header of a CSV, and its rows (numbers; a
    column `tile` of the header is not among them). `before` and `after` of a correction are among the quantities and
    drawings. Nothing changes until `apply` is called and the profile that it returns is saved.
    """

    kind: str
    title: str
    quantities: tuple[tuple[str, float, str], ...]
    verdict: str
    good: bool
    warnings: tuple[str, ...] = ()
    drawings: tuple[Drawing, ...] = ()
    raw: tuple[tuple[str, str, NDArray[np.float64]], ...] = ()
    part: "Part | None" = None
    """What it changes in a profile; None without a conclusion."""
    tile: str = ""
    """The tile whose profile it may change; "" for any."""
    method: str = ""
    """Method of measurement, in a few sentences for the report."""
    is_simulated: bool = False
    """Whether the tile was simulated, which the report says."""
    conditions: str = ""
    """What a person noted of the measurement, for the report."""

    def with_origin(self, *, simulated: bool, conditions: str = "") -> "Result":
        """Return the result with whether its tile was simulated, also in its part: hardware with the profile is told.

        So are the `conditions` that a person noted. A part says nothing of hardware, and nothing of no note.
        """
        told = {name: value for name, value in (("simulated", simulated), ("conditions", conditions)) if value}
        part = self.part and structs.replace(self.part, **told)
        return replace(self, is_simulated=simulated, conditions=conditions, part=part)

    def apply(self, profile: "Profile") -> "Profile":
        """Return the profile with this result; the previous values are kept in its history."""
        if self.part is None:
            return profile
        return profile.with_part(self.part, tile=self.tile)

    @property
    def figures(self) -> dict[str, float]:
        """Return the quantities by name."""
        return {name: value for name, value, _ in self.quantities}


class Inconclusive(BadMeasurement):
    """All was measured, and leads to no result, for the reason in the message."""
