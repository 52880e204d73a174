"""Requirements on every model: what is required, what was measured, and whether it is met.

Each file here measures one family. Times must stay near the best one seen, scaled by how slow the processor is at that
moment (`timing.Timed`).
"""

from collections.abc import Callable, Iterable, Iterator

from underfoot.bench.reach import friction, impacts, materials, modes, signals, starts
from underfoot.bench.reach.row import SPEED, TO_COMPARE, Reach, Timing
from underfoot.engine.cluster import on_cluster
from underfoot.errors import UnderfootError

__all__ = ["FAMILIES", "HERE", "SPEED", "TIMINGS", "TO_COMPARE", "Reach", "Timing", "run", "timings"]

FAMILIES: dict[str, Callable[[bool], Iterable[Reach]]] = {
    "signals": signals.reaches,
    "impacts": impacts.reaches,
    "modes": modes.reaches,
    "materials": materials.reaches,
    "friction": friction.reaches,
}
"""The function that measures each family, quick or in full."""

HERE = ("signals",)
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
    quick: bool = False, tell: Callable[[str], None] = lambda line: None, cluster: str | None = None
) -> list[Reach]:
    """Measure every requirement that is not a time, here or, except `HERE`, on the Dask cluster at this address.

    The rows and their order are the same wherever they were computed. Raises what `on_cluster` does.
    """
    found: dict[str, list[Reach]] = {}
    away = [name for name in FAMILIES if cluster is not None and name not in HERE]
    for name in FAMILIES:
        if name not in away:
            tell(f"reach: {name}")
            found[name] = measured((name, quick))
    if cluster is not None:
        for number, rows in on_cluster(measured, [(name, quick) for name in away], cluster):
            if isinstance(rows, UnderfootError):
                raise rows
            tell(f"reach: {away[number]}, on the cluster")
            found[away[number]] = rows
    return [row for name in FAMILIES for row in found[name]]


def measured(job: tuple[str, bool]) -> list[Reach]:
    """Return the rows of a family, by its name; quick or in full."""
    name, quick = job
    return list(FAMILIES[name](quick))
