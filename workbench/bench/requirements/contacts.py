"""Requirements on contacts: feet, sides and persons, against simulated people."""

import math
from collections.abc import Iterable

from underfoot.bench.identity import WalkAccuracy, simulate_walk
from underfoot.bench.requirements.requirement import Requirement
from underfoot.floor.layout import default_floor
from underfoot.floor.simulated_people import drawn_people

_QUICK_S, _FULL_S = 30.0, 600.0
_KINDS = ((1, "turn"), (1, "straight"), (1, "random"), (2, "crossing"), (4, "random"))


def requirements(quick: bool) -> Iterable[Requirement]:
    """Evaluate the usual walker and drawn people on 6 x 6 tiles, for ten minutes each; quick: for half a minute."""
    floor, seconds = default_floor(6, 6), _QUICK_S if quick else _FULL_S
    yield from _alone(simulate_walk(floor, (), seconds))
    for count, path in _KINDS:
        walked = simulate_walk(floor, drawn_people(count, path), seconds)
        yield from _together(f"{count} {path}", walked, is_required=path == "crossing")


def _alone(walked: WalkAccuracy) -> Iterable[Requirement]:
    yield Requirement("contacts", "one walker, splits", walked.splits, "feet", high=0.0)
    yield Requirement("contacts", "one walker, false joins", walked.joins, "contacts", high=0.0)
    yield Requirement(
        "contacts", "one walker, sides right", walked.sides_right / max(walked.steps, 1), "of 1", low=0.99
    )


def _together(name: str, walked: WalkAccuracy, *, is_required: bool) -> Iterable[Requirement]:
    least, most = (0.99, 0.0) if is_required else (-math.inf, math.inf)
    yield Requirement("contacts", f"{name}, splits", walked.splits, f"of {walked.feet} feet")
    yield Requirement("contacts", f"{name}, false joins", walked.joins, f"of {walked.feet} feet")
    yield Requirement("contacts", f"{name}, IDF1 of feet", walked.contacts.idf1, "of 1", low=least)
    yield Requirement("contacts", f"{name}, switches", walked.contacts.switches, "of a foot's contact", high=most)
    yield Requirement("contacts", f"{name}, MOTA of feet", walked.contacts.mota, "of 1")
    yield Requirement("contacts", f"{name}, sides right", walked.sides_right / max(walked.sided, 1), "of 1")
    yield Requirement("contacts", f"{name}, IDF1 of persons", walked.person_idf1, "of 1", low=least)
