"""What the bench found, as tables for a terminal, as plain data, and as a page with a log-log picture of each task."""

import html
import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from underfoot.bench.accuracy import Comparison
from underfoot.bench.reach import TO_COMPARE, Reach
from underfoot.bench.scale import Cost
from underfoot.bench.stability import Stability
from underfoot.drawing import Drawing, Series, series
from underfoot.drawing.page import page
from underfoot.drawing.svg import svg
from underfoot.files import make_folder, write_file, written

_OURS, _NAIVE = ("vibration", "events", "contact"), ("force", "alarm")
_LEAST = 1e-17
"""An error below rounding, 0 too, is drawn as this."""


@dataclass(frozen=True)
class Bench:
    """All that one run of the bench found."""

    reaches: Sequence[Reach]
    comparisons: Sequence[Comparison]
    costs: Sequence[Cost]
    stability: Stability

    def data(self) -> dict[str, Any]:
        """As plain data, for JSON."""
        return {
            "reach": [reach.data() for reach in self.reaches],
            "accuracy": [comparison.data() for comparison in self.comparisons],
            "scale": [cost.data() for cost in self.costs],
            "stability": self.stability.data(),
        }


def text(bench: Bench) -> str:
    """All of it as tables for a terminal."""
    lines = [*_reach_lines(bench.reaches), ""]
    for comparison in bench.comparisons:
        lines += [f"{comparison.model}: {comparison.task}", f"  error: {comparison.error}"]
        for curve in comparison.curves:
            for point in curve.points:
                name = f"{curve.method}{' (naive)' if curve.naive else ''}"
                figures = f"{point.knob:<9.4g} {1e3 * point.seconds:10.4g} ms   {point.error:8.1e}"
                lines.append(f"  {name:32} {curve.knob:18} {figures}")
        lines.append("")
    for cost in bench.costs:
        lines.append(
            f"{cost.patch}: {cost.tiles} tiles, {cost.stood_on:2} stood on, block {cost.block:4}: "
            f"{cost.times_real_time:8.1f} times real time in the nodes, {100.0 * cost.share:5.1f} % of the whole floor"
        )
    return "\n".join([*lines, "", *_stability_lines(bench.stability)])


def write(bench: Bench, folder: Path) -> None:
    """Write `bench.json`, `index.html`, a picture of each task as SVG, and each failure as a patch, into `folder`."""
    make_folder(folder)
    with written(folder):
        for former in folder.glob("failure-*.json"):
            former.unlink()
    write_file(folder / "bench.json", json.dumps(bench.data(), indent=1).encode())
    pictures = []
    for k, comparison in enumerate(bench.comparisons, 1):
        pictures.append(svg(picture(comparison)))
        write_file(folder / f"{k:02}-{comparison.model}.svg", pictures[-1].encode())
    for k, failure in enumerate(bench.stability.failures, 1):
        write_file(folder / f"failure-{k:02}.json", failure.patch.dumps())
    body = ["<p>Lower and further to the left is better. Naive methods are dashed.</p>", *pictures]
    body.append(f"<pre>{html.escape(text(bench))}</pre>")
    write_file(folder / "index.html", page("Underfoot: bench", body).encode())


def picture(comparison: Comparison) -> Drawing:
    """Run time over error, both logarithmic: lower and further to the left is better."""
    drawn = tuple(_curves(comparison))
    return Drawing(f"{comparison.model}: {comparison.task}", "error", "run time, s", drawn, x_log=True, y_log=True)


def _curves(comparison: Comparison) -> Iterator[Series]:
    """A line through the points of each curve, and the points."""
    taken = [0, 0]
    for curve in comparison.curves:
        colours = _NAIVE if curve.naive else _OURS
        colour = colours[taken[curve.naive] % len(colours)]
        taken[curve.naive] += 1
        errors = np.maximum([point.error for point in curve.points], _LEAST)
        seconds = [point.seconds for point in curve.points]
        yield series(curve.method, errors, seconds, "dashed" if curve.naive else "line", colour)
        yield series("", errors, seconds, "dots", colour)


def _reach_lines(reaches: Sequence[Reach]) -> list[str]:
    missed = sum(not reach.met for reach in reaches)
    asked = sum(reach.asked != TO_COMPARE for reach in reaches)
    state = f"{missed} not met" if missed else "all met"
    lines = [f"reach: {asked} asked, {state}", f"  {'':65} {'asked':>22}  {'measured':>10}"]
    for reach in reaches:
        what = f"{reach.model}: {reach.what}"
        met = "" if reach.met else "   NOT MET"
        lines.append(f"  {what:65} {reach.asked:>22}  {reach.measured:>10.4g} {reach.unit}{met}")
    return lines


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
