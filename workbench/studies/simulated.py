"""Simulated studies on many processes, or on a Dask cluster: the same people whoever computes them."""

from collections.abc import Callable, Iterable, Sequence
from typing import Any

from underfoot.engine.cluster import on_cluster
from underfoot.engine.worker_pool import MOST_TRIES, in_parallel
from underfoot.errors import UnderfootError
from underfoot.experiments.simulation import EstimateRow, Job, simulate


def simulate_locally(
    jobs: Sequence[Job],
    processes: int,
    seen: Callable[[int], None] | None = None,
    is_stopped: Callable[[], bool] = lambda: False,
) -> list[EstimateRow]:
    """What the people of all jobs estimate, on so many processes; `seen` is told how many jobs are done.

    A job whose process is killed is computed again by another. Once `is_stopped`, what there is comes back.
    """
    if processes == 1:
        return _gathered(((place, simulate(job)) for place, job in enumerate(jobs)), seen)
    return _gathered(in_parallel(simulate, jobs, processes, MOST_TRIES, is_stopped), seen)


def simulate_on_cluster(
    jobs: Sequence[Job], address: str, seen: Callable[[int], None] | None = None
) -> list[EstimateRow]:
    """The same on an existing Dask cluster whose scheduler is at `address`, as tcp://host:8786 (`engine.cluster`)."""
    return _gathered(on_cluster(simulate, jobs, address), seen)


def _gathered(results: Iterable[tuple[int, Any]], seen: Callable[[int], None] | None) -> list[EstimateRow]:
    """All that was found, in the order of the jobs; the first error is raised."""
    done: dict[int, list[EstimateRow]] = {}
    for place, result in results:
        if isinstance(result, UnderfootError):
            raise result
        done[place] = result
        if seen is not None:
            seen(len(done))
    return [one for place in sorted(done) for one in done[place]]
