"""Steps that a person has left out of a recording's means, which keep all that was measured.

An entry names a step by the tile and the frame at which its contact began, not by its number: a later version may find
other steps before it.
"""

from collections.abc import Iterable, Sequence

from msgspec import Struct
from msgspec.structs import replace

from underfoot.floor.footsteps import Step

NEAR_S = 0.1
"""How far the beginning of a step may be from where it is named: no other step of its tile begins as soon."""


class LeftOut(Struct, frozen=True):
    """A step that does not count: the session `frame` and the `tile` of its beginning, why, who said so, and when."""

    frame: int
    tile: str
    why: str
    who: str
    when: str


def with_left_out(steps: Iterable[Step], entries: Sequence[LeftOut], first: int, rate_hz: float) -> list[Step]:
    """Return the steps, each with why it is left out; "" where it counts. Their times are seconds from frame `first`.

    >>> steps = [Step(k, "t1", "left", float(k), 600.0, *[0.0] * 7) for k in (1, 2)]
    >>> entries = [LeftOut(96_010, "t1", "stumbled", "anna", "2026-11-30T10:00:00")]
    >>> [step.left_out for step in with_left_out(steps, entries, 0, 48_000.0)]
    ['', 'stumbled']
    """
    on_tile: dict[str, list[LeftOut]] = {}
    for one in entries:
        on_tile.setdefault(one.tile, []).append(one)

    def told(step: Step) -> Step:
        at = first + step.start_s * rate_hz
        near = (one.why for one in on_tile.get(step.tile, ()) if abs(one.frame - at) <= NEAR_S * rate_hz)
        why = next(near, "")
        return step if step.left_out == why else replace(step, left_out=why)

    return [told(step) for step in steps]
