"""What a person has noted of a recording's steps: which means leave out, and the body weight of who made them.

What was measured stays. A step is named by the tile and the frame at which its contact began, not by its number: a
later version may find other steps before it.
"""

import math
from collections.abc import Iterable, Sequence

from msgspec import Struct
from msgspec.structs import replace

from underfoot.errors import BadValue, require
from underfoot.floor.footsteps import Step
from underfoot.number_parsing import parse_quantity

NEAR_S = 0.1
"""How far the beginning of a step may be from where it is named: no other step of its tile begins as soon."""
LIGHTEST_N, HEAVIEST_N = 30.0, 5000.0
"""Body weights: from an infant's of 3 kg on."""


class LeftOut(Struct, frozen=True):
    """A step that does not count: the session `frame` and the `tile` of its beginning, why, who said so, and when."""

    frame: int
    tile: str
    why: str
    who: str
    when: str


class BodyWeight(Struct, frozen=True):
    """The body weight of a `person` of the recording, with 0 of all who have no other, N; how it is known, who said
    so, and when."""

    person: int
    weight_n: float
    source: str
    who: str
    when: str


class Notes(Struct, frozen=True):
    """All that is noted of a recording's steps, whose times are seconds from session frame `first` on, of `rate_hz`
    frames a second."""

    first: int
    rate_hz: float
    left_out: Sequence[LeftOut] = ()
    body_weights: Sequence[BodyWeight] = ()

    def on(self, steps: Iterable[Step]) -> list[Step]:
        """Return the steps with what is noted of them.

        >>> steps = [Step(k, "t1", "left", float(k), 600.0, *[0.0] * 7, person=k) for k in (1, 2)]
        >>> said = ("anna", "2026-11-30T10:00:00")
        >>> left_out, weights = [LeftOut(96_010, "t1", "stumbled", *said)], [BodyWeight(1, 700.0, "typed", *said)]
        >>> [(step.left_out, step.body_weight_n) for step in Notes(0, 48_000.0, left_out, weights).on(steps)]
        [('', 700.0), ('stumbled', nan)]
        """
        on_tile: dict[str, list[LeftOut]] = {}
        for one in self.left_out:
            on_tile.setdefault(one.tile, []).append(one)
        weights_n = {one.person: one.weight_n for one in self.body_weights}

        def noted(step: Step) -> Step:
            at = self.first + step.start_s * self.rate_hz
            near = (one.why for one in on_tile.get(step.tile, ()) if abs(one.frame - at) <= NEAR_S * self.rate_hz)
            weight_n = weights_n.get(step.person, weights_n.get(0, math.nan))
            return replace(step, left_out=next(near, ""), body_weight_n=weight_n)

        return [noted(step) for step in steps]


def body_weight_n(text: str) -> float:
    """Return a body weight that was typed, in N; `BadValue` for another value, or for one without its unit.

    >>> body_weight_n("71,4 kg"), body_weight_n("700 N")
    (700.19481, 700.0)
    """
    if not text.strip()[-1:].isalpha():
        raise BadValue(f"the body weight is {text!r}; allowed: with its unit, such as 71.4 kg or 700 N")
    weight_n = parse_quantity(text, "N")
    require(LIGHTEST_N <= weight_n <= HEAVIEST_N, "the body weight", text, "3 to 500 kg, or 30 to 5000 N")
    return weight_n
