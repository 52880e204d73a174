"""What the bench found, as a table for a terminal, as plain data, and as a page with a log-log picture of each task."""

import html
import json
import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from workbench.bench.accuracy import Comparison, Curve
from workbench.bench.scale import Cost
from workbench.bench.stability import Stability
from workbench.errors import BadFile

_WIDTH, _HEIGHT = 640, 400
_LEFT, _RIGHT, _TOP, _BOTTOM = 76, 24, 40, 52
_OURS, _NAIVE = ("#3fc1c9", "#b693f2", "#7ed491"), ("#f0a63c", "#ff6259")
_GROUND, _LINE, _TEXT, _MUTED = "#12151a", "#2c3540", "#dfe5ec", "#8d99a8"
_LEAST = 1e-17
"""An error below rounding, 0 too, is drawn and written as this."""


@dataclass(frozen=True)
class Bench:
    """All that one run of the bench found."""

    comparisons: Sequence[Comparison]
    costs: Sequence[Cost]
    stability: Stability

    def data(self) -> dict[str, Any]:
        """As plain data, for JSON."""
        return {
            "accuracy": [comparison.data() for comparison in self.comparisons],
            "scale": [cost.data() for cost in self.costs],
            "stability": self.stability.data(),
        }


def text(bench: Bench) -> str:
    """All of it as tables for a terminal."""
    lines = []
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
            f"{cost.times_real_time:8.1f} times real time, {100.0 * cost.share:5.1f} % of the whole floor"
        )
    return "\n".join([*lines, "", *_stability_lines(bench.stability)])


def write(bench: Bench, folder: Path) -> None:
    """Write `bench.json`, `index.html`, a picture of each task as SVG, and each failure as a patch, into `folder`."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for former in folder.glob("failure-*.json"):
            former.unlink()
        (folder / "bench.json").write_text(json.dumps(bench.data(), indent=1))
        pictures = []
        for k, comparison in enumerate(bench.comparisons, 1):
            pictures.append(picture(comparison))
            (folder / f"{k:02}-{comparison.model}.svg").write_text(pictures[-1])
        for k, failure in enumerate(bench.stability.failures, 1):
            (folder / f"failure-{k:02}.json").write_bytes(failure.patch.dumps())
        (folder / "index.html").write_text(_page(text(bench), pictures))
    except OSError as error:
        raise BadFile(f"{folder} cannot be written: {error.strerror}") from None


def picture(comparison: Comparison) -> str:
    """Run time over error, both logarithmic, as an SVG: lower and further to the left is better."""
    points = [point for curve in comparison.curves for point in curve.points]
    across = _decades([max(point.error, _LEAST) for point in points])
    up = _decades([point.seconds for point in points])
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {_WIDTH} {_HEIGHT}" width="{_WIDTH}" height="{_HEIGHT}"'
        f' font-family="sans-serif" font-size="12" fill="{_TEXT}">',
        f'<rect width="{_WIDTH}" height="{_HEIGHT}" fill="{_GROUND}"/>',
        _label(_LEFT, 22, f"{comparison.model}: {comparison.task}", size=14),
        _label((_LEFT + _WIDTH - _RIGHT) / 2, _HEIGHT - 12, "error", anchor="middle", fill=_MUTED),
        f'<g transform="translate(16 {(_TOP + _HEIGHT - _BOTTOM) / 2}) rotate(-90)">'
        f"{_label(0, 0, 'run time, s', anchor='middle', fill=_MUTED)}</g>",
    ]
    for decade in _ticks(*across):
        x = _x(10.0**decade, across)
        parts.append(_stroke([(x, _TOP), (x, _HEIGHT - _BOTTOM)], _LINE))
        parts.append(_label(x, _HEIGHT - _BOTTOM + 18, f"1e{decade}", anchor="middle", fill=_MUTED))
    for decade in _ticks(*up):
        y = _y(10.0**decade, up)
        parts.append(_stroke([(_LEFT, y), (_WIDTH - _RIGHT, y)], _LINE))
        parts.append(_label(_LEFT - 8, y + 4, f"1e{decade}", anchor="end", fill=_MUTED))
    taken = [0, 0]
    for k, curve in enumerate(comparison.curves):
        colours = _NAIVE if curve.naive else _OURS
        colour = colours[taken[curve.naive] % len(colours)]
        taken[curve.naive] += 1
        parts.append(_drawn(curve, across, up, colour))
        y = _TOP + 16 + 16 * k
        parts.append(_stroke([(_WIDTH - 204, y - 4), (_WIDTH - 184, y - 4)], colour, 2, curve.naive))
        parts.append(_label(_WIDTH - 178, y, curve.method))
    return "\n".join([*parts, "</svg>\n"])


def _drawn(curve: Curve, across: tuple[int, int], up: tuple[int, int], colour: str) -> str:
    at = [(_x(point.error, across), _y(point.seconds, up)) for point in curve.points]
    dots = [
        f'<circle cx="{x:.1f}" cy="{y:.1f}" r="3.5" fill="{colour}"><title>{html.escape(curve.knob)} {point.knob:g}: '
        f"{point.seconds:.3g} s, {point.error:.2g}</title></circle>"
        for (x, y), point in zip(at, curve.points, strict=True)
    ]
    return "\n".join([_stroke(at, colour, 2, curve.naive), *dots])


def _x(error: float, decades: tuple[int, int]) -> float:
    share = (math.log10(max(error, _LEAST)) - decades[0]) / (decades[1] - decades[0])
    return _LEFT + share * (_WIDTH - _LEFT - _RIGHT)


def _y(seconds: float, decades: tuple[int, int]) -> float:
    share = (math.log10(seconds) - decades[0]) / (decades[1] - decades[0])
    return _HEIGHT - _BOTTOM - share * (_HEIGHT - _TOP - _BOTTOM)


def _decades(values: Sequence[float]) -> tuple[int, int]:
    low = math.floor(math.log10(min(values)))
    return low, max(low + 1, math.ceil(math.log10(max(values))))


def _ticks(first: int, last: int) -> range:
    return range(first, last + 1, 1 + (last - first) // 9)


def _stroke(points: Sequence[tuple[float, float]], colour: str, width: int = 1, dashed: bool = False) -> str:
    path = " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
    dash = ' stroke-dasharray="6 4"' if dashed else ""
    return f'<polyline points="{path}" fill="none" stroke="{colour}" stroke-width="{width}"{dash}/>'


def _label(x: float, y: float, words: str, *, anchor: str = "start", size: int = 12, fill: str = _TEXT) -> str:
    return (
        f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}" font-size="{size}" fill="{fill}">'
        f"{html.escape(words)}</text>"
    )


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


def _page(tables: str, pictures: Sequence[str]) -> str:
    return "\n".join(
        [
            '<!doctype html><html lang="en"><meta charset="utf-8"><title>Underfoot: bench</title>',
            f"<style>body{{background:{_GROUND};color:{_TEXT};font-family:sans-serif;margin:24px}}"
            "svg{margin:8px}</style>",
            "<h1>Run time against error, scale and stability</h1>",
            "<p>Lower and further to the left is better. Naive methods are dashed.</p>",
            *pictures,
            f"<pre>{html.escape(tables)}</pre></html>\n",
        ]
    )
