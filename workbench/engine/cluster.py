"""Jobs on an existing Dask cluster, with the interface that `worker_pool` has on one computer."""

import socket
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from urllib.parse import urlsplit

from underfoot.engine.worker_pool import MOST_TRIES, Answer, Job
from underfoot.errors import BadValue, DeviceError, UnderfootError, in_one_line
from underfoot.patch.custom_nodes import run_received
from underfoot.patch.node_files import NodeFile, running

CONNECT_S = 10.0
"""Time in seconds that the scheduler has to answer."""
_LEAST_JOBS, _JOBS_PER_THREAD = 4, 2
"""Jobs in progress at once: at least `_LEAST_JOBS`, and `_JOBS_PER_THREAD` for each thread of the cluster. This bounds
the results held in memory.
"""


def on_cluster(
    work: Callable[[Job], Answer], jobs: Sequence[Job], address: str
) -> Iterator[tuple[int, Answer | UnderfootError]]:
    """Yield the number of each of `jobs` and what `work` returns or raises for it, in order of completion.

    Of errors, only an `UnderfootError` is yielded. The cluster's scheduler is at `address`, as tcp://host:8786; its
    workers have this version of Underfoot. Jobs of a worker that dies are repeated by others. Raises `BadValue` if the
    package distributed is not installed, and `DeviceError` if the cluster cannot be reached or gives up.
    """
    try:
        from distributed import Client, as_completed
    except ModuleNotFoundError:
        raise BadValue('--cluster needs the package distributed: pip install "underfoot[cluster]"') from None
    _require_reachable(address)
    try:
        client = Client(address, timeout=CONNECT_S, set_as_default=False)
    except (OSError, ValueError) as error:
        raise DeviceError(f"the cluster {address} cannot be reached: {in_one_line(error)}") from None
    with client:
        waiting, places = deque(enumerate(jobs)), dict[str, int]()
        answers = as_completed(loop=client.loop)
        nodes = running()

        def give() -> None:
            most = max(_LEAST_JOBS, _JOBS_PER_THREAD * sum(client.nthreads().values()))
            while waiting and len(places) < most:
                number, job = waiting.popleft()
                future = client.submit(_with_nodes, nodes, work, job, pure=False, retries=MOST_TRIES)
                places[future.key] = number
                answers.add(future)

        give()
        for future in answers:
            number = places.pop(future.key)
            try:
                result = future.result()
            except UnderfootError as error:
                result = error
            except Exception as error:
                raise DeviceError(f"the cluster {address} gave up: {in_one_line(error)[:200]}") from None
            yield number, result
            del future, result
            give()


def _with_nodes(nodes: Sequence[NodeFile], work: Callable[[Job], Answer], job: Job) -> Answer:
    """Run `work` on a worker, with the caller's custom nodes loaded."""
    run_received(nodes)
    return work(job)


def _require_reachable(address: str) -> None:
    """Raise `DeviceError` at once if the scheduler does not answer, because the library would retry for long and leave
    a thread behind.
    """
    parts = urlsplit(address)
    try:
        host, port = parts.hostname, parts.port
        if not (parts.scheme and host and port):
            raise ValueError("allowed: tcp://HOST:PORT")
        socket.create_connection((host, port), CONNECT_S).close()
    except (OSError, ValueError) as error:
        raise DeviceError(f"the cluster {address} cannot be reached: {in_one_line(error)}") from None
