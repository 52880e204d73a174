"""MAT: a recording for MATLAB and Octave, in the format of MATLAB 5."""

from pathlib import Path
from typing import Any

import numpy as np

from underfoot.errors import BadFile
from underfoot.files import replaced, written
from underfoot.floor.footsteps import Step
from underfoot.records.exports import ExportFormat, ExportSource
from underfoot.records.exports.hdf5 import step_columns

MOST_BYTES = (1 << 31) - 1
"""Of one variable."""


def _write(export: ExportSource, path: Path) -> None:
    from scipy.io import savemat

    forces, source = export.forces, export.vibration
    tiles = len(forces.floor.tiles)
    needed = max(32 * tiles * export.length_s * forces.rate_hz, 4 * tiles * (export.end - export.first))
    if needed > MOST_BYTES:
        raise BadFile(
            f"{path} would need {needed / 1e9:.1f} GB for one variable; allowed: 2.1 GB; export a stretch, or as .h5"
        )
    pieces = list(export.pieces("Reading forces"))
    steps: list[Step] = []
    rows = []
    for found in export.found("Looking for steps and contacts"):
        steps += found.steps
        rows.append(found.rows)
    names = ("time_s", "contact", "x_m", "y_m", "force_n", "on_tile")
    marks = export.marks()
    content: dict[str, Any] = {
        "tiles": np.array(forces.floor.ids, object),
        "rate_hz": forces.rate,
        "force_rate_hz": forces.rate_hz,
        "from_s": export.from_s,
        "floor_json": export.recording.about["floor"],
        "patch_json": export.recording.about["patch"],
        "time_s": np.concatenate([time_s for time_s, _ in pieces] or [np.zeros(0)])[:, None],
        "corners_n": np.concatenate([force_n for _, force_n in pieces] or [np.zeros((0, tiles, 4))]),
        f"{source}{'' if source == 'vibration' else '_m_s2'}": np.concatenate(
            list(export.frames(source, f"Reading {source}"))
        ),
        "contacts": {name: np.concatenate([getattr(row, name) for row in rows]) for name in names},
        "steps": {name: np.array(v, object) if isinstance(v, list) else v for name, v in step_columns(steps).items()},
        "marks": {"time_s": np.array([at for at, _ in marks]), "text": np.array([text for _, text in marks], object)},
    }
    export.report_progress("Writing", 0.9)
    with replaced(path) as part, written(path):
        savemat(str(part), content, appendmat=False, do_compression=True)


FORMAT = ExportFormat(
    ".mat",
    "MAT (MATLAB 5): forces, one kind of vibration, contacts, steps and marks, with floor and patch as JSON",
    "commands and gaps; more than 2 GB a variable",
    _write,
)
