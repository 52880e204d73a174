"""Reports of the bench: tables for a terminal, plain data, and a page with a log-log plot of each task."""

import html
import json
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from underfoot.bench.blocks import BlockCost
from underfoot.bench.compare import FORMAT, VERSION, Time
from underfoot.bench.method_comparison import Comparison
from underfoot.bench.requirements import COMPARISON_ONLY, SPEED, Requirement
from underfoot.bench.stability import Stability
from underfoot.drawing import Drawing, Series, series
from underfoot.drawing.page import page
from underfoot.drawing.svg import svg
from underfoot.files import make_folder, write_file, written

_OURS, _NAIVE = ("vibration", "events", "contact"), ("force", "alarm")
_LEAST = 1e-17
"""Value at which errors below rounding, and 0, are drawn."""


@dataclass(frozen=True)
class Bench:
    """Results of one run of the bench; a run of times alone has no comparisons and no stability.

    `load` is the load average of a minute at the start, on a machine with `cores`; None where the system has none.
    """

    requirements: Sequence[Requirement]
    costs: Sequence[BlockCost]
    comparisons: Sequence[Comparison] = ()
    stability: Stability | None = None
    load: float | None = None
    cores: int = 1

    def times(self) -> list[Time]:
        """Return every row that is a time; a speed counts as the time of one second of signal."""
        return [_time(requirement) for requirement in self.requirements if requirement.spread is not None]

    def data(self) -> dict[str, Any]:
        """Return it as plain data, for JSON: a document with which a later run is compared."""
        return {
            "format": FORMAT,
            "version": VERSION,
            "load": self.load,
            "cores": self.cores,
            "times": msgspec.to_builtins(self.times()),
            "reach": [requirement.data() for requirement in self.requirements],
            "blocks": [asdict(cost) for cost in self.costs],
            "accuracy": [asdict(comparison) for comparison in self.comparisons],
            "stability": self.stability.data() if self.stability else None,
        }


def text(bench: Bench) -> str:
    """Return all of it as tables for a terminal."""
    load = "" if bench.load is None else f"load {bench.load:.1f} on "
    lines = [f"{load}{bench.cores} cores", *_requirement_lines(bench.requirements), ""]
    lines += _block_lines(bench.costs)
    for comparison in bench.comparisons:
        lines.append("")
        lines += [f"{comparison.model}: {comparison.task}", f"  error: {comparison.error}"]
        for curve in comparison.curves:
            for point in curve.points:
                name = f"{curve.method}{' (naive)' if curve.naive else ''}"
                figures = f"{point.knob:<9.4g} {1e3 * point.seconds:10.4g} ms   {point.error:8.1e}"
                lines.append(f"  {name:32} {curve.knob:18} {figures}")
    if bench.stability:
        lines += ["", *_stability_lines(bench.stability)]
    return "\n".join(lines)


def write(bench: Bench, folder: Path) -> None:
    """Write `bench.json`, `index.html`, a plot of each task as SVG, and each failure as a patch, into `folder`."""
    make_folder(folder)
    with written(folder):
        for former in folder.glob("failure-*.json"):
            former.unlink()
    write_file(folder / "bench.json", json.dumps(bench.data(), indent=1).encode())
    pictures = []
    for k, comparison in enumerate(bench.comparisons, 1):
        pictures.append(svg(picture(comparison)))
        write_file(folder / f"{k:02}-{comparison.model}.svg", pictures[-1].encode())
    for k, failure in enumerate(bench.stability.failures if bench.stability else (), 1):
        write_file(folder / f"failure-{k:02}.json", failure.patch.dumps())
    body = ["<p>Lower and further to the left is better. Naive methods are dashed.</p>", *pictures]
    body.append(f"<pre>{html.escape(text(bench))}</pre>")
    write_file(folder / "index.html", page("Underfoot: bench", body).encode())


def picture(comparison: Comparison) -> Drawing:
    """Plot run time over error, both logarithmic: lower and further left is better."""
    drawn = tuple(_curves(comparison))
    return Drawing(f"{comparison.model}: {comparison.task}", "error", "run time, s", drawn, x_log=True, y_log=True)


def _curves(comparison: Comparison) -> Iterator[Series]:
    """Yield a line through the points of each curve, and the points."""
    taken = [0, 0]
    for curve in comparison.curves:
        colours = _NAIVE if curve.naive else _OURS
        colour = colours[taken[curve.naive] % len(colours)]
        taken[curve.naive] += 1
        errors = np.maximum([point.error for point in curve.points], _LEAST)
        seconds = [point.seconds for point in curve.points]
        yield series(curve.method, errors, seconds, "dashed" if curve.naive else "line", colour)
        yield series("", errors, seconds, "dots", colour)


def _requirement_lines(requirements: Sequence[Requirement]) -> list[str]:
    missed = sum(not requirement.is_met for requirement in requirements)
    with_limits = sum(requirement.limits != COMPARISON_ONLY for requirement in requirements)
    state = f"{missed} not met" if missed else "all met"
    lines = [
        f"requirements: {with_limits} with limits, {state}; times beside how slow the processor was, and their spread"
    ]
    lines.append(f"  {'':65} {'required':>22}  {'measured':>10}")
    for requirement in requirements:
        beside = (
            ""
            if requirement.spread is None
            else f"  (x {requirement.slowness:.2f}, {100.0 * requirement.spread:.0f} %)"
        )
        what, met = f"{requirement.model}: {requirement.what}", "" if requirement.is_met else "   NOT MET"
        lines.append(
            f"  {what:65} {requirement.limits:>22}  {requirement.measured:>10.4g} {requirement.unit}{beside}{met}"
        )
    return lines


def _block_lines(costs: Sequence[BlockCost]) -> list[str]:
    lines = [f"  {'':65} {'times real time':>16} {'of a foot on each':>18} {'its nodes alone':>16}"]
    for cost in costs:
        what = f"{cost.patch}: {cost.tiles} tiles, block {cost.block}, a foot on {cost.stood_on}"
        what += ", simulated plates" if cost.simulated else ""
        share, nodes = f"{100.0 * cost.share:.1f} %", cost.program_times_real_time
        lines.append(f"  {what:65} {cost.times_real_time:16.1f} {share:>18} {nodes:16.1f}")
    return ["whole blocks, from samples of the sensors to float32 for the card", *lines] if costs else []


def _time(requirement: Requirement) -> Time:
    row, spread = f"{requirement.model}: {requirement.what}", requirement.spread or 0.0
    if requirement.unit == SPEED:
        return Time(row, 1e3 / requirement.measured, "ms a second of sound", requirement.slowness, spread)
    return Time(row, requirement.measured, requirement.unit, requirement.slowness, spread)


def _stability_lines(stability: Stability) -> list[str]:
    lines = [
        f"stability: {stability.nodes} nodes at {stability.points} points, {stability.patches} random patches, "
        f"{stability.simulated_s:.0f} s simulated: {len(stability.failures) or 'no'} failures"
    ]
    if stability.cut_short:
        few = ", ".join(f"{type} {points}" for type, points in stability.cut_short.items())
        lines.append(f"  time was up before all points were tried: {few}")
    for failure in stability.failures:
        lines += ["", failure.line()]
    return lines
