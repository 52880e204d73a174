"""A pool of worker processes, one per core, which run jobs one after another."""

import os
import signal
import threading
import time
from collections import Counter, deque
from collections.abc import Callable, Generator, Sequence
from contextlib import suppress
from multiprocessing.connection import Connection
from typing import TypeVar

from underfoot.engine.child_process import (
    ChildProcess,
    held_back,
    let_through,
    raise_at_end,
    run_tracker,
    wait_for_any,
)
from underfoot.errors import UnderfootError

Job = TypeVar("Job")
Answer = TypeVar("Answer")

MOST_TRIES = 3
"""Attempts at a job whose process dies."""
_STOP_SIGNALS = (signal.SIGINT, signal.SIGTERM)
"""Signals that end a worker, and its job, once it can clean up."""
_LOOK_S = 0.2
"""Interval in seconds at which `is_stopped` is asked while no results come."""
_LEAVE_S = 2.0
"""Seconds that processes may take to clean up once nobody waits for them."""


def cores() -> int:
    """Return the number of processes that can run at once.

    >>> cores() >= 1
    True
    """
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def in_parallel(
    work: Callable[[Job], Answer],
    jobs: Sequence[Job],
    processes: int,
    tries: int = 1,
    is_stopped: Callable[[], bool] = lambda: False,
) -> Generator[tuple[int, Answer | UnderfootError], None, None]:
    """Yield the number of each of `jobs` and what `work` returns or raises for it, in order of completion.

    Of errors, only an `UnderfootError` is yielded. `work` is a function of a module; jobs and results can be pickled.
    A process that dies is replaced; a job lost `tries` times has that as its error. Ctrl-C stops all processes; once
    `is_stopped` returns true, nothing more is yielded.
    """
    waiting = deque(enumerate(jobs))
    lost: Counter[int] = Counter()
    busy: dict[ChildProcess, int] = {}
    try:
        for _ in range(min(processes, len(jobs))):
            _give(_started(work), waiting, busy)
        while busy and not is_stopped():
            wait_for_any(busy, within_s=_LOOK_S)
            for child, number in list(busy.items()):
                answers = child.receive()
                if answers:
                    yield number, answers[0]
                    _give(child, waiting, busy)
                elif not child.is_alive:
                    del busy[child]
                    reason = child.end(_LEAVE_S)
                    lost[number] += 1
                    if lost[number] < tries:
                        waiting.appendleft((number, jobs[number]))
                    else:
                        yield number, UnderfootError(f"the process that worked on it died: {reason}")
                    if waiting:
                        _give(_started(work), waiting, busy)
    finally:
        until = time.perf_counter() + _LEAVE_S
        for child in busy:
            child.hang_up()
        for child in busy:
            child.end(max(until - time.perf_counter(), 0.0))


def run(connection: Connection, work: Callable[[Job], object]) -> None:
    """Run jobs until the connection ends, which ends a job, too, or Ctrl-C, which goes to all processes; the process's
    main function."""
    with suppress(EOFError, OSError, KeyboardInterrupt):
        signal.signal(signal.SIGTERM, signal.default_int_handler)
        if not let_through(*_STOP_SIGNALS):
            return  # it was stopped while it began; where both have come, each would raise
        raise_at_end(connection, signal.SIGTERM)
        try:
            while True:
                connection.send(_answer(work, connection.recv()))
        finally:
            for number in _STOP_SIGNALS:
                signal.signal(number, signal.SIG_IGN)


def _give(child: ChildProcess, waiting: deque[tuple[int, Job]], busy: dict[ChildProcess, int]) -> None:
    """Give a process the next job, or end it if there is none."""
    if waiting:
        busy[child], job = waiting.popleft()
        child.send(job)
    else:
        busy.pop(child, None)
        child.end(_LEAVE_S)


def _started(work: Callable[[Job], object]) -> ChildProcess:
    """Start a process that receives what ends it only once it can clean up; this one receives it after that, too."""
    run_tracker()  # which would let Ctrl-C through the first time
    stops: list[int] = []  # a signal may also reach another thread of this process, and is then noticed here
    is_main = threading.current_thread() is threading.main_thread()
    with held_back(*_STOP_SIGNALS):
        handlers = {
            number: signal.signal(number, lambda stop, _: stops.append(stop)) for number in _STOP_SIGNALS if is_main
        }
        try:
            child = ChildProcess("worker", __name__, work)
        finally:
            for number, handler in handlers.items():
                signal.signal(number, handler)
    try:
        for stop in stops:
            signal.raise_signal(stop)
    except BaseException:
        child.end(_LEAVE_S)
        raise
    return child


def _answer(work: Callable[[Job], object], job: Job) -> object:
    try:
        return work(job)
    except UnderfootError as error:
        return error
    except MemoryError:
        return UnderfootError("there is not enough memory for this")
