"""Run time of one node as a function of its error."""

import hashlib
import json
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from importlib import import_module
from typing import Any

import numpy as np
from llvmlite import binding

from underfoot.array_cache import ArrayCache
from underfoot.drawing import Drawing, Series
from underfoot.errors import BadValue
from underfoot.kernel_cache import digest
from underfoot.parameters import Choice, Number
from underfoot.patch.node import NodeType, RequestedError

_POINTS = ArrayCache("error-curves", in_memory=256, on_disk=2000)
_BATCH_S, _BATCHES = 2e-3, 5
"""Least duration of a batch of runs that is timed, and number of batches."""


@dataclass(frozen=True)
class ErrorPoint:
    """A requested error, the error found, and the run time in ms."""

    asked: float
    found: float
    ms: float


@dataclass(frozen=True)
class ErrorCurve:
    """Measurements of a node so far: `points` by rising error, `here` at its present value, `left` to come.

    `of` is the quantity whose error it is, and `cost` the work whose time it is.
    """

    of: str
    cost: str
    here: ErrorPoint
    points: tuple[ErrorPoint, ...] = ()
    left: int = 0

    def data(self) -> dict[str, Any]:
        """Return it as plain data."""
        return asdict(self)

    def description(self) -> str:
        """Describe the node's present point in one line, and whether all errors cost the same.

        >>> ErrorCurve("of the CDF", "a slip", ErrorPoint(1e-3, 2e-4, 0.05)).description()
        'requested 0.001, found 0.0002 (of the CDF) in 0.05 ms (a slip)'
        """
        here = self.here
        line = f"requested {here.asked:.2g}, found {here.found:.2g} ({self.of}) in {here.ms:.3g} ms ({self.cost})"
        is_flat = self.points and not self.left and len(self._least_ms()) == 1
        return f"{line}; all errors that can be requested take the same time" if is_flat else line

    def drawing(self) -> Drawing:
        """Return the curve as a drawing, with the node's present point."""
        least_ms = self._least_ms()
        found, ms = np.array(sorted(least_ms)), np.array([least_ms[error] for error in sorted(least_ms)])
        at, took = np.array([self.here.found]), np.array([least_ms[self.here.found]])
        series = (Series("", found, ms, "dots"), Series("", found, ms), Series("here", at, took, "dots", "force"))
        x = (0.5 * found[0], 2.0 * found[-1]) if found[0] > 0.0 else None
        y = (0.7 * float(ms.min()), 1.4 * float(ms.max()))
        return Drawing("", "error found", "run time, ms", series, x_log=True, y_log=True, x_range=x, y_range=y)

    def _least_ms(self) -> dict[float, float]:
        """Return the shortest time for each error, because equal errors require equal work."""
        least: dict[float, float] = {}
        for point in (*self.points, self.here):
            least[point.found] = min(point.ms, least.get(point.found, np.inf))
        return least


def error_curve(type: NodeType, given: Mapping[str, Any]) -> Iterator[ErrorCurve]:
    """Measure a node with these parameters: first at its present error, then at others, one at a time.

    Each item has all results so far. Raises `BadValue` for a node without a requested error.

    >>> from underfoot.nodes import REGISTRY
    >>> *_, curve = error_curve(REGISTRY["impact"], {"error": 1e-4, "stiffness": 1e9})
    >>> curve.here.asked, len(curve.points), curve.points[-1].found < 1e-6 < curve.points[0].found
    (0.0001, 7, True)
    """
    requested_error = type.requested_error
    if requested_error is None:
        raise BadValue(f"the node is a {type.type}; allowed: one with a requested error. It is {type.accuracy}")
    values = type.values(given)
    others = _errors_to_try(type)
    curve = ErrorCurve(
        requested_error.of, requested_error.cost, _point(type, requested_error, values), left=len(others)
    )
    yield curve
    for error in others:
        point = _point(type, requested_error, {**values, "error": error})
        curve = replace(curve, points=(*curve.points, point), left=curve.left - 1)
        yield curve


def _errors_to_try(type: NodeType) -> list[Any]:
    """Return the errors to measure of a node type, largest and cheapest first."""
    parameter = type.parameters["error"]
    if isinstance(parameter, Choice):
        return sorted(parameter.options, key=float, reverse=True)
    assert isinstance(parameter, Number)
    decades = round(np.log10(parameter.high / parameter.low))
    return [float(error) for error in np.geomspace(parameter.high, parameter.low, decades + 1)]


def _point(type: NodeType, requested_error: RequestedError, values: Mapping[str, Any]) -> ErrorPoint:
    by = import_module(requested_error.measured_by)
    functions = [by.timed_work, by.measured_error, *type.binding.functions.values()]
    found, ms = _POINTS.get(
        _name(functions, values), lambda: np.array([by.measured_error(values), 1e3 * _least_s(by.timed_work(values))])
    )
    return ErrorPoint(float(values["error"]), float(found), float(ms))


def _least_s(work: Callable[[], Any]) -> float:
    """Return the shortest processor time of a run over several batches; other load on the machine only lengthens it."""
    work()
    began = time.thread_time()
    work()
    times = max(int(_BATCH_S / max(time.thread_time() - began, 1e-6)), 1)
    spent = []
    for _ in range(_BATCHES if times > 1 else 1):
        began = time.thread_time()
        for _ in range(times):
            work()
        spent.append((time.thread_time() - began) / times)
    return min(spent)


def _name(functions: Sequence[Any], values: Mapping[str, Any]) -> str:
    """Return a digest of all that determines a measurement: the functions' code, callees included, values and
    processor.
    """
    code = [digest(function) for function in functions]
    text = json.dumps([code, dict(values), binding.get_host_cpu_name()], sort_keys=True, default=str)
    return hashlib.sha256(text.encode()).hexdigest()[:32]
