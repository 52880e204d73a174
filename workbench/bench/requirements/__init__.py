"""Requirements on every model: what is required, what was measured, and whether it is met.

Each file here measures one family. Times must stay near the best one seen, scaled by how slow the processor is at that
moment (`timing.Timed`).
"""

from collections.abc import Callable, Iterable, Iterator

from underfoot.bench.requirements import contacts, friction, impacts, materials, modes, signals, starts
from underfoot.bench.requirements.requirement import COMPARISON_ONLY, SPEED, Requirement, Timing
from underfoot.engine.cluster import on_cluster
from underfoot.errors import UnderfootError

__all__ = ["COMPARISON_ONLY", "FAMILIES", "LOCAL_ONLY", "SPEED", "TIMINGS", "Requirement", "Timing", "run", "timings"]

FAMILIES: dict[str, Callable[[bool], Iterable[Requirement]]] = {
    "signals": signals.requirements,
    "impacts": impacts.requirements,
    "modes": modes.requirements,
    "materials": materials.requirements,
    "friction": friction.requirements,
    "contacts": contacts.requirements,
}
"""The function that measures each family, quick or in full."""

LOCAL_ONLY = ("signals",)
"""Families with a row that compares run times; these are never computed on another machine."""

TIMINGS: tuple[Callable[[], Iterable[Timing]], ...] = (
    impacts.timings,
    modes.timings,
    materials.timings,
    friction.timings,
    starts.timings,
)
"""Timings of the families, measured by turns (`timing.timed_in_turn`)."""


def timings() -> Iterator[Timing]:
    """Yield all timings."""
    for of_family in TIMINGS:
        yield from of_family()


def run(
    quick: bool = False, progress: Callable[[str], None] = lambda line: None, cluster: str | None = None
) -> list[Requirement]:
    """Measure every requirement that is not a time, here or, except `LOCAL_ONLY`, on the Dask cluster at this address.

    The rows and their order are the same wherever they were computed. Raises what `on_cluster` does.
    """
    found: dict[str, list[Requirement]] = {}
    away = [name for name in FAMILIES if cluster is not None and name not in LOCAL_ONLY]
    for name in FAMILIES:
        if name not in away:
            progress(f"requirements: {name}")
            found[name] = measured((name, quick))
    if cluster is not None:
        for number, rows in on_cluster(measured, [(name, quick) for name in away], cluster):
            if isinstance(rows, UnderfootError):
                raise rows
            progress(f"requirements: {away[number]}, on the cluster")
            found[away[number]] = rows
    return [row for name in FAMILIES for row in found[name]]


def measured(job: tuple[str, bool]) -> list[Requirement]:
    """Return the rows of a family, by its name; quick or in full."""
    name, quick = job
    return list(FAMILIES[name](quick))
