"""Summary of a recording for a list: date, length, floor, number of steps, and a small picture of its force."""

from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from underfoot.floor.layout import Floor
from underfoot.records import envelopes
from underfoot.records.recording import Recording
from underfoot.records.survey import cached_step_count

POINTS = 72
"""Values in the small picture."""


@dataclass(frozen=True)
class Summary:
    """`force_n` are the largest sums of all tiles' loads in `POINTS` equal parts of it; `steps` is None until they
    were looked for."""

    path: Path
    begun: datetime
    length_s: float
    floor: Floor
    steps: int | None
    force_n: NDArray[np.float32]


def summary_of(path: Path) -> Summary:
    """Return the summary of a recording; `BadFile` if it cannot be read. Only a small part of a long file is read."""
    with Recording(path) as recording:
        floor = recording.floor
        first, end = recording.span
        return Summary(
            path,
            _begun(recording),
            (end - first) / recording.rate_hz,
            floor,
            cached_step_count(recording),
            _force(recording, first, end, len(floor.tiles)),
        )


def _begun(recording: Recording) -> datetime:
    """Return when it was begun; for an earlier version, when its file was last written."""
    try:
        return datetime.fromisoformat(recording.about["begun"])
    except (KeyError, ValueError):
        return datetime.fromtimestamp(recording.path.stat().st_mtime)


def _force(recording: Recording, first: int, end: int, tiles: int) -> NDArray[np.float32]:
    edges = np.linspace(first, max(end, first + 1), POINTS + 1)
    base = recording.envelope_base()
    if base is not None:
        with recording.readable("envelope"):
            envelope = envelopes.read(base, "force", envelopes.COARSE, tiles + 1).column(tiles)
        low, high = envelope.between(edges)
    else:
        low = high = np.full((POINTS, 1), np.nan, np.float32)
        for k, frame in enumerate(edges[:-1].tolist()):
            rows = recording.force_samples_between(frame, frame + (edges[1] - edges[0]) / 8.0)
            if len(rows):
                high[k] = envelopes.loads(rows[:, 2:])[:, -1].max()
    rest = float(np.nanmin(low)) if np.isfinite(low).any() else 0.0
    return np.nan_to_num(high[:, 0] - rest)
