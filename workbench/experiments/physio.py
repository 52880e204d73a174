"""Force and vibration of each trial as continuous recordings of BIDS, beside the behavioural file.

BIDS 1.10: `sub-ID_task-NAME_recording-force0012_physio.tsv.gz`, without a header, and a JSON sidecar with the columns,
the rate and the start. 12 is the `entry` of the trial in the behavioural file. With two intervals, the second one's
name ends with b. Force is a recording of the person ("physio"); vibration of the tile is the stimulus ("stim"). BIDS's
motion files do not fit: they hold points of a body from tracking systems, and have no channel type for force.
"""

import gzip
import json
import string
from pathlib import Path
from typing import Any

import numpy as np

from underfoot.errors import BadFile
from underfoot.experiments.excerpts import Excerpt
from underfoot.experiments.store import SessionFile
from underfoot.experiments.study import CALIBRATIONS
from underfoot.experiments.trial_files import bids_label, bids_task
from underfoot.files import make_folder, write_file

_KINDS = {
    "force": ("force", "physio", "N", "Force at corner {} of the tile, less the tare."),
    "vibration": ("commanded", "stim", "m/s^2", "Acceleration that was commanded of the tile {}, after all limits."),
    "measured": ("measured", "stim", "m/s^2", "Acceleration of the tile {} that its accelerometer measured."),
}
"""For each kind of excerpt: its name in BIDS, its suffix there, its unit, and the meaning of a column."""
_FASTEST = 1
"""The fastest level of gzip, because recordings at audio rate are large."""


def write_physio(folder: str | Path, file: SessionFile, task: str) -> dict[int, BadFile]:
    """Write the recordings of a session's trials under a BIDS `folder`.

    Return, by entry, why recordings of damaged trials cannot be read: the others are written. `task` is the task name
    of the behavioural file. Times are in seconds of the session's clock, as its `onset_s`.
    """
    label, name = bids_label(file.counts_as), bids_task(task)
    beh = make_folder(Path(folder) / f"sub-{label}" / "beh")
    unread: dict[int, BadFile] = {}
    noted = [note for note in reversed(file.notes()) if note.text.startswith(CALIBRATIONS)]
    for number, entry in enumerate(file.entries(), 1):
        if entry.trial is None:
            continue
        used = next((note.text.removeprefix(CALIBRATIONS) for note in noted if note.entry < number), "none")
        about = {"TaskName": task, **({"Calibrations": used} if used != "none" else {})}
        try:
            excerpts = file.excerpts(number)
        except BadFile as error:
            unread[number] = error
            continue
        for excerpt in excerpts:
            if excerpt.values.size == 0:
                continue
            part = string.ascii_lowercase[excerpt.part] if excerpt.part else ""
            kind, suffix, _, _ = _KINDS[excerpt.kind]
            path = beh / f"sub-{label}_task-{name}_recording-{kind}{number:04d}{part}_{suffix}.tsv.gz"
            write_file(path, gzip.compress(_rows(excerpt), _FASTEST, mtime=0))
            sidecar = path.with_name(path.name.replace(".tsv.gz", ".json"))
            write_file(sidecar, json.dumps({**about, **_sidecar(excerpt)}, indent=1).encode() + b"\n")
    return unread


def _rows(excerpt: Excerpt) -> bytes:
    """Return tab-separated values with five digits; "n/a" for NaN."""
    flat = [f"{value:.5g}" for value in np.asarray(excerpt.values, np.float64).ravel().tolist()]
    if not np.isfinite(excerpt.values).all():
        flat = ["n/a" if text in ("nan", "inf", "-inf") else text for text in flat]
    count = len(excerpt.columns)
    return ("\n".join("\t".join(flat[k : k + count]) for k in range(0, len(flat), count)) + "\n").encode()


def _sidecar(excerpt: Excerpt) -> dict[str, Any]:
    _, suffix, unit, text = _KINDS[excerpt.kind]
    columns = {name: {"Description": text.format(name), "Units": unit} for name in excerpt.columns}
    return {
        "SamplingFrequency": excerpt.rate_hz,
        "StartTime": excerpt.first,
        "Columns": list(excerpt.columns),
        **({"PhysioType": "generic"} if suffix == "physio" else {}),
        **columns,
    }
