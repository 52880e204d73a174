"""Drawings as tables: the numbers of a plot, for other programs."""

import numpy as np

from underfoot.drawing import Drawing


def csv(drawing: Drawing) -> str:
    """Return every point drawn, one per line, with its series or its own label and, for arrows, the end, for bands how
    far they reach to each side; then every level of a heat map, at the centre of its cell.

    >>> from underfoot.drawing import series
    >>> print(csv(Drawing("Creep", "time, s", "force, N", (series("held", [1, 10], [40, 41]),))), end="")
    series,"time, s","force, N"
    held,1,40
    held,10,41
    """
    has_arrows = any(series.to is not None for series in drawing.series)
    has_bands = any(series.spread is not None for series in drawing.series)
    further = [*(["to_x", "to_y"] if has_arrows else []), *(["plus_minus"] if has_bands else [])]
    lines = [",".join(["series", _quoted(drawing.x), _quoted(drawing.y), *further])]
    for series in drawing.series:
        known = {} if series.to is None else {"to_x": series.to[:, 0], "to_y": series.to[:, 1]}
        known |= {} if series.spread is None else {"plus_minus": series.spread}
        name = _quoted(series.name or (drawing.right if series.right else drawing.y).partition(",")[0])
        columns = [series.x, series.y, *map(known.get, further)]
        cells = [[""] * len(series.x) if one is None else [f"{v:.9g}" for v in one.tolist()] for one in columns]
        if drawing.x_names:
            cells[0] = [_quoted(drawing.x_names[round(at) - 1]) for at in series.x.tolist()]
        names = map(_quoted, series.labels) if series.labels else [name] * len(series.x)
        lines += [",".join([label, *row]) for label, *row in zip(names, *cells, strict=True)]
    heat = drawing.heat
    if heat is not None:
        rows, columns = heat.levels.shape
        across = _middles(heat.x, columns, log=drawing.x_log)
        up = _middles(heat.y, rows, log=drawing.y_log)
        lines.append(f"{_quoted(drawing.x)},{_quoted(drawing.y)},level of 255")
        lines += [
            f"{x:.9g},{y:.9g},{level}"
            for y, row in zip(up, heat.levels.tolist(), strict=True)
            for x, level in zip(across, row, strict=True)
        ]
    return "\n".join(lines) + "\n"


def _middles(ends: tuple[float, float], count: int, *, log: bool) -> list[float]:
    share = (np.arange(count) + 0.5) / count
    low, high = ends
    return [float(low * (high / low) ** s if log else low + (high - low) * s) for s in share]


def _quoted(text: str) -> str:
    return f'"{text.replace(chr(34), chr(34) * 2)}"' if any(sign in text for sign in ',"\n') else text
