"""Simulated studies on many processes, or on a Dask cluster: the same people whoever computes them."""

import socket
from collections.abc import Callable, Iterator, Sequence
from typing import Any
from urllib.parse import urlsplit

from underfoot.engine.worker_pool import in_parallel
from underfoot.errors import BadValue, DeviceError, UnderfootError
from underfoot.experiments.simulation import Found, Job, simulate

MOST_TRIES = 3
"""A job whose process died is given to another one, so often."""
CONNECT_S = 10.0


def simulated_here(jobs: Sequence[Job], processes: int, seen: Callable[[int], None] | None = None) -> list[Found]:
    """What the people of all jobs estimate, on so many processes; `seen` is told how many jobs are done.

    A job whose process is killed is computed again by another.
    """
    done: dict[int, list[Found]] = {}
    waiting = list(range(len(jobs)))
    for tried in range(1, MOST_TRIES + 1):
        for place, result in _results(jobs, waiting, processes):
            if isinstance(result, UnderfootError):
                if tried == MOST_TRIES:
                    raise result
                continue
            done[place] = result
            if seen is not None:
                seen(len(done))
        waiting = [place for place in waiting if place not in done]
        if not waiting:
            break
    return [one for place in range(len(jobs)) for one in done[place]]


def _results(jobs: Sequence[Job], places: Sequence[int], processes: int) -> Iterator[tuple[int, Any]]:
    if processes == 1:
        yield from ((place, simulate(jobs[place])) for place in places)
        return
    for number, result in in_parallel(simulate, [jobs[place] for place in places], processes):
        yield places[number], result


def simulated_on_cluster(jobs: Sequence[Job], address: str, seen: Callable[[int], None] | None = None) -> list[Found]:
    """The same on an existing Dask cluster whose scheduler is at `address`, as tcp://host:8786.

    Its workers need Underfoot of this version. What a worker that dies has not given back is computed by others.
    `BadValue` where the package distributed is not installed, `DeviceError` where the cluster is not there.
    """
    try:
        from distributed import Client, as_completed
    except ModuleNotFoundError:
        raise BadValue('--cluster needs the package distributed: pip install "underfoot[cluster]"') from None
    _require_reachable(address)
    try:
        client = Client(address, timeout=CONNECT_S, set_as_default=False)
    except (OSError, ValueError) as error:
        raise DeviceError(f"the cluster {address} cannot be reached: {' '.join(str(error).split())}") from None
    with client:
        futures = client.map(simulate, jobs, pure=False, retries=MOST_TRIES)
        places = {future.key: place for place, future in enumerate(futures)}
        done: dict[int, list[Found]] = {}
        for future in as_completed(futures, loop=client.loop):
            try:
                done[places[future.key]] = future.result()
            except UnderfootError:
                raise
            except Exception as error:
                raise DeviceError(f"the cluster {address} gave up: {' '.join(str(error).split())[:200]}") from None
            if seen is not None:
                seen(len(done))
    return [one for place in range(len(jobs)) for one in done[place]]


def _require_reachable(address: str) -> None:
    """Say at once where nobody listens: the library would try for long, and leave a thread behind."""
    parts = urlsplit(address)
    try:
        host, port = parts.hostname, parts.port
        if not (parts.scheme and host and port):
            raise ValueError("allowed: tcp://HOST:PORT")
        socket.create_connection((host, port), CONNECT_S).close()
    except (OSError, ValueError) as error:
        raise DeviceError(f"the cluster {address} cannot be reached: {' '.join(str(error).split())}") from None
