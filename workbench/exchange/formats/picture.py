"""SVG: a plot of each tile's acceleration over time."""

from pathlib import Path

import numpy as np

from underfoot.clock import RATE_HZ
from underfoot.drawing import Drawing, series
from underfoot.drawing.look import COLOURS
from underfoot.drawing.svg import svg
from underfoot.exchange.format import Export, Format
from underfoot.files import write_file


def write(export: Export, path: Path) -> tuple[str, ...]:
    """Draw the waveforms."""
    write_file(path, svg(waveforms(export)).encode())
    return ("a picture of the waveform, 640 x 400",)


def waveforms(export: Export) -> Drawing:
    """Return a drawing of each tile's acceleration, m/s^2 over ms."""
    played = export.acceleration_by_tile
    colours = ["vibration", *(name for name in COLOURS if name != "vibration")]
    lines = tuple(
        series(
            tile if len(played) > 1 else "",
            np.arange(samples.size) * (1e3 / RATE_HZ),
            samples,
            colour=colours[at % len(colours)],
        )
        for at, (tile, samples) in enumerate(played.items())
    )
    return Drawing(export.patch.title or "Vibration", "time, ms", "acceleration, m/s^2", lines)


FORMAT = Format(
    "svg",
    "Picture of the waveform",
    (".svg",),
    frozenset(("title", "unit", "tiles", "waveform", "spectrum", "frequency", "range", "onsets")),
    write,
    note="for a page; nothing can read it back",
)
