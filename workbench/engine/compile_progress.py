"""Progress of two processes that compile the same kernels, from opposite ends of the list."""

from underfoot.engine.reports import Compiling


class CompileProgress:
    """The number of parts that the engine and the compiler have ready together, below the total until both are done.

    It decreases only where a process is forgotten. One that begins anew, as for another patch, passes again what is in
    the cache by now: what was shown stays until it is further. Another total is that of another list, which begins.

    >>> progress = CompileProgress()
    >>> progress.take("engine", Compiling(2, 9)), progress.take("compiler", Compiling(1, 9))
    ([Compiling(ready=2, total=9)], [Compiling(ready=3, total=9)])
    >>> progress.take("compiler", Compiling(0, 9)), progress.take("compiler", Compiling(2, 9))
    ([], [Compiling(ready=4, total=9)])
    >>> progress.take("engine", Compiling(2, 9)), progress.take("engine", Compiling(9, 9))
    ([], [Compiling(ready=8, total=9)])
    >>> progress.take("compiler", Compiling(5, 7))
    [Compiling(ready=5, total=7)]
    """

    def __init__(self) -> None:
        self._ready: dict[str, int] = {}
        self._shown = self._total = 0

    def take(self, process: str, report: Compiling) -> list[Compiling]:
        """Return the progress to show after a report of one process, if it has increased."""
        if report.total != self._total:
            self.clear()
            self._total = report.total
        before = self._shown
        self._ready[process] = report.ready
        ready = min(sum(self._ready.values()), report.total - 1)  # `Started` or `Compiled` tells of the last part
        self._shown = max(before, ready)
        return [Compiling(ready, report.total)] if ready > before or not before else []

    def forget(self, process: str) -> bool:
        """Forget the progress of a process; return whether there was any."""
        is_known = self._ready.pop(process, 0) > 0
        self._shown = sum(self._ready.values())
        return is_known

    def clear(self) -> None:
        """Forget all."""
        self._ready.clear()
        self._shown = 0
