"""Simulated studies on several processes, or on a Dask cluster, with identical results."""

from collections.abc import Callable, Iterable, Sequence

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
    """Return the estimates of all jobs, computed by `processes` processes; `seen` receives the number of finished jobs.

    Another process repeats the job of a killed process. When `is_stopped` returns True, the estimates so far are
    returned.
    """
    if processes == 1:
        return _gathered(((place, simulate(job)) for place, job in enumerate(jobs)), seen)
    return _gathered(in_parallel(simulate, jobs, processes, MOST_TRIES, is_stopped), seen)


def simulate_on_cluster(
    jobs: Sequence[Job], address: str, seen: Callable[[int], None] | None = None
) -> list[EstimateRow]:
    """Return the same, computed by a Dask cluster whose scheduler is at `address`, as tcp://host:8786
    (`engine.cluster`).
    """
    return _gathered(on_cluster(simulate, jobs, address), seen)


def _gathered(
    results: Iterable[tuple[int, list[EstimateRow] | UnderfootError]], seen: Callable[[int], None] | None
) -> list[EstimateRow]:
    """Return all estimates in the order of the jobs; raise the first error."""
    done: dict[int, list[EstimateRow]] = {}
    for place, result in results:
        if isinstance(result, UnderfootError):
            raise result
        done[place] = result
        if seen is not None:
            seen(len(done))
    return [one for place in sorted(done) for one in done[place]]
