"""Small pictures of several nodes' responses to one step, from one rendering for all of them."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from underfoot.drawing.thinning import extremes
from underfoot.engine.preview import previewed
from underfoot.errors import UnderfootError
from underfoot.floor.layout import Tile
from underfoot.nodes import REGISTRY
from underfoot.patch.patch import Patch

STRETCHES = 256
"""Most stretches into which a small picture divides its time."""

Outline = NDArray[np.floating]


def outlines(
    patch: Patch, nodes: tuple[str, ...], tile: Tile, seconds: float, rate_hz: float, folder: Path | None = None
) -> tuple[dict[str, Outline], dict[str, Outline]]:
    """Return the signals and the events of nodes, by "node.port", as in `Outlines`; `seconds` as for `previewed`.

    Nodes that cannot be computed together are computed one by one, and those that cannot alone are left out.
    """
    types = {node.id: REGISTRY[node.type] for node in patch.nodes}
    scopes = tuple(f"{node}.{port.name}" for node in nodes if node in types for port in types[node].outputs)
    try:
        force_n, signals, events = previewed(patch, scopes, tile, seconds, rate_hz, folder)
    except UnderfootError:
        if len(nodes) == 1:
            return {}, {}
        alone = [outlines(patch, (node,), tile, seconds, rate_hz, folder) for node in nodes]
        return {k: v for one, _ in alone for k, v in one.items()}, {k: v for _, one in alone for k, v in one.items()}
    return (
        {name: outline(values) for name, values in signals.items()},
        {name: strongest_events(rows, len(force_n)) for name, rows in events.items()},
    )


def outline(values: Outline) -> Outline:
    """Return minimum and maximum of each of at most 256 consecutive stretches of one frame or more, in turn.

    >>> outline(np.sin(np.linspace(0.0, 6.283, 10_000))).shape
    (512,)
    """
    frames = np.arange(len(values), dtype=np.float64)
    return extremes(frames, values[:, None], max(len(values) / STRETCHES, 1.0))[1][:, 0]


def strongest_events(events: NDArray[np.float64], frames: int) -> NDArray[np.float64]:
    """Return the strongest event of each stretch, as (share of `frames`, strength), from rows of (frame, strength,
    duration).

    >>> strongest_events(np.array([[0.0, 1.0, 0.0], [250.0, 3.0, 0.0], [250.0, 4.0, 0.0]]), 1000)
    array([[0.  , 1.  ],
           [0.25, 4.  ]])
    """
    share, strength = events[:, 0] / max(frames, 1), events[:, 1]
    stretch = np.floor(share * STRETCHES)
    order = np.lexsort((strength, stretch))
    last = np.flatnonzero(np.diff(stretch[order], append=np.inf))
    return np.column_stack([share, strength])[order[last]]
