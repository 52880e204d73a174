"""Figures of the thesis reproduced, its numbers beside ours, with an explanation of differences.

`FIGURES` is the list: each function takes whether to be quick, and returns a `Figure`.
"""

import html
from collections.abc import Callable, Sequence
from pathlib import Path

from underfoot.bench.figures import fracture, friction, grains, signals, tiles
from underfoot.bench.figures.figure import Compared, Figure
from underfoot.drawing.page import page
from underfoot.drawing.svg import svg
from underfoot.files import make_folder, write_file

__all__ = ["FIGURES", "Compared", "Figure", "run", "text", "write"]

FIGURES: tuple[Callable[[bool], Figure], ...] = (
    signals.rhythms,
    signals.waveforms,
    signals.example,
    tiles.modes,
    signals.feedback,
    fracture.responses,
    fracture.strengths,
    fracture.intervals,
    fracture.energies,
    grains.stiffening,
    grains.fluctuations,
    grains.under_a_foot,
    fracture.played,
    friction.trajectories,
    friction.upcrossings,
    friction.durations,
    friction.regimes,
    friction.periods,
    friction.resonance,
    friction.distances,
)
"""In the order of the thesis."""


def run(quick: bool = False, progress: Callable[[str], None] = lambda line: None) -> list[Figure]:
    """Draw every figure. Quick: fewer simulations each."""
    found = []
    for make in FIGURES:
        found.append(make(quick))
        progress(f"figure {found[-1].number}: {found[-1].title}")
    return found


def text(figures: Sequence[Figure]) -> str:
    """Return the thesis's numbers beside ours, as a table for a terminal."""
    lines = []
    for figure in figures:
        lines.append(f"{figure.number}  {figure.title}")
        lines += [f"  {row.what:55} {row.thesis:>45}   {row.ours}" for row in figure.compared]
        lines += [f"  {figure.why}", ""] if figure.why else [""]
    return "\n".join(lines)


def write(figures: Sequence[Figure], folder: Path) -> None:
    """Write each drawing as SVG, and `index.html` with all of them and the numbers, into `folder`."""
    make_folder(folder)
    body = []
    for figure in figures:
        body.append(f"<h2>{figure.number} {html.escape(figure.title)}</h2>")
        body.append(_table(figure))
        body.append(f"<p>{html.escape(figure.why)}</p>")
        for k, drawing in enumerate(figure.drawings, 1):
            picture = svg(drawing)
            write_file(folder / f"figure-{figure.number}-{k}.svg", picture.encode())
            body.append(picture)
    write_file(folder / "index.html", page("Figures of the thesis", body).encode())


def _table(figure: Figure) -> str:
    rows = (
        f"<tr><td>{html.escape(row.what)}</td><td>{html.escape(row.thesis)}</td><td>{html.escape(row.ours)}</td></tr>"
        for row in figure.compared
    )
    return f"<table><tr><th></th><th>thesis</th><th>here</th></tr>{''.join(rows)}</table>"
