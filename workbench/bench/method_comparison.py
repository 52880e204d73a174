"""Run time against error of several methods for one task, each over the values of a knob."""

import statistics
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Point:
    """One value of a knob: median run time, and error."""

    knob: float
    seconds: float
    error: float


@dataclass(frozen=True)
class Curve:
    """A method over its knob."""

    method: str
    knob: str
    naive: bool
    points: tuple[Point, ...]


@dataclass(frozen=True)
class Comparison:
    """The results of a task."""

    model: str
    task: str
    error: str
    curves: tuple[Curve, ...]


@dataclass(frozen=True)
class Method:
    """A method of computing a task: `run(knob)`. Naive methods are the baseline."""

    name: str
    knob: str
    values: Sequence[float]
    run: Callable[[float], Any]
    naive: bool = False


@dataclass(frozen=True)
class Task:
    """A quantity to compute, the name of its error, and `error(result, knob)`."""

    model: str
    task: str
    error_is: str
    error: Callable[[Any, float], float]
    methods: Sequence[Method]


def measured(task: Task, budget_s: float) -> Comparison:
    """Time each method at each value of its knob: the median of up to 20 runs, or of as many as fit into `budget_s`.

    >>> square = Method("square", "x", (2.0,), lambda x: x * x)
    >>> found = measured(Task("doctest", "square", "difference", lambda y, x: abs(y - 4.0), [square]), 0.0)
    >>> found.curves[0].points[0].error
    0.0
    """
    curves = []
    for method in task.methods:
        method.run(method.values[0])  # compiles
        points = []
        for value in method.values:
            spent: list[float] = []
            while not spent or (len(spent) < 20 and sum(spent) < budget_s):
                began = time.perf_counter()
                result = method.run(value)
                spent.append(time.perf_counter() - began)
            points.append(Point(float(value), statistics.median(spent), float(task.error(result, value))))
        curves.append(Curve(method.name, method.knob, method.naive, tuple(points)))
    return Comparison(task.model, task.task, task.error_is, tuple(curves))
