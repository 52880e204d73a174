"""Batch rendering: parameter grids, on all cores or on a cluster, with a manifest of the results.

A file has the same bytes wherever it is computed: its SHA-256 is in the manifest. Files are complete or absent. The
manifest lists those that exist, even if the work was stopped or a process was killed, and why others could not be made.
"""

import csv
import hashlib
import io
import re
import threading
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from underfoot.clock import once_in
from underfoot.engine.cluster import on_cluster
from underfoot.engine.offline import RenderJob
from underfoot.engine.parameter_grid import Values
from underfoot.engine.session_replay import ReplayJob
from underfoot.engine.worker_pool import MOST_TRIES, cores, in_parallel
from underfoot.errors import BadValue, UnderfootError
from underfoot.files import write_file
from underfoot.nodes import REGISTRY
from underfoot.patch.file_paths import files_of
from underfoot.records.wav import wav_bytes

MANIFEST = "manifest.csv"
_EVERY_S = 1.0
"""Interval in seconds between writes of the manifest during rendering."""
_LONGEST_NAME = 120
"""Characters of a file name before values are replaced by a number: file systems refuse more than 255 bytes."""
_ONE_AT_A_TIME = threading.Lock()

Summary = dict[str, Any]
Job = RenderJob | ReplayJob


@dataclass(frozen=True)
class Item:
    """A file to render: the job, its patch file, and the parameter values set in the patch."""

    job: Job
    patch: str
    values: Values = field(default_factory=dict)
    output: Path | None = None


def file_names(items: Sequence[tuple[str, Values]]) -> list[str]:
    """Return a file name without suffix for each patch name and values; numbered if names would be too long.

    >>> file_names([("stone", {"impact.stiffness": 1e4}), ("stone", {"impact.stiffness": 2e4})])
    ['stone_impact.stiffness=10000', 'stone_impact.stiffness=20000']
    """
    names = [stem + "".join(f"_{name}={_text(value)}" for name, value in values.items()) for stem, values in items]
    names = [re.sub(r"[^\w.+=-]", "-", name) for name in names]
    if max(map(len, names), default=0) <= _LONGEST_NAME:
        return names
    digits = len(str(len(items)))
    return [f"{stem[:_LONGEST_NAME]}-{number:0{digits}}" for number, (stem, _) in enumerate(items, 1)]


def _text(value: object) -> str:
    return f"{value:.12g}" if isinstance(value, float) else str(value)


def rendered(items: Sequence[Item], cluster: str | None = None) -> Iterator[tuple[int, Summary | UnderfootError]]:
    """Render items on every core, or on the Dask cluster at this address, and yield them in order of completion.

    Yields each item's number and its summary or `UnderfootError`. When a summary arrives its file exists, and the
    summary has its `sha256`. Items lost with a dead process are rendered by another one.
    """
    if cluster is None:
        yield from in_parallel(_render_to_file, items, cores(), MOST_TRIES)
        return
    for item in items:
        _require_movable(item)
    for number, answer in on_cluster(_render_to_bytes, items, cluster):
        if isinstance(answer, UnderfootError):
            yield number, answer
            continue
        summary, data = answer
        output = items[number].output
        if output is not None:
            write_file(output, data)
        yield number, summary


def _render_to_bytes(item: Item) -> tuple[Summary, bytes]:
    """Render an item in a cluster worker, one at a time: the worker may have several threads."""
    with _ONE_AT_A_TIME:
        made = item.job.run()
    data = wav_bytes(made.samples, made.rate_hz)
    return made.summary() | {"rate_hz": made.rate_hz, "sha256": hashlib.sha256(data).hexdigest()}, data


def _render_to_file(item: Item) -> Summary:
    """Render an item in a worker process, straight to its file if it has one."""
    if item.output is None:
        return _render_to_bytes(item)[0]
    made = item.job.run({"": item.output})
    with item.output.open("rb") as file:
        digest = hashlib.file_digest(file, "sha256").hexdigest()
    return made.summary() | {"rate_hz": made.rate_hz, "sha256": digest}


def _require_movable(item: Item) -> None:
    """Raise `BadValue` if the job reads files of this computer as it runs: another computer lacks them."""
    if isinstance(item.job, ReplayJob):
        raise BadValue(f"{item.patch} is a recording on this computer; render it without --cluster")
    if files := list(files_of(item.job.patch, REGISTRY)):
        raise BadValue(f"{item.patch}: node {files[0][0]} plays a file of this computer; render it without --cluster")
    simulation = item.job.options.simulation
    if simulation is not None and simulation.recording:
        raise BadValue("--simulation plays a recording of this computer; render it without --cluster")


class Manifest:
    """A CSV file of the results: one row per file, in their order, with values, levels and hash, or the error.

    `files` have the patch file and the values of each, also of those that cannot be rendered.
    """

    def __init__(self, path: Path, files: Sequence[tuple[str, Values]]) -> None:
        self._path, self._files = path, files
        self._rows: dict[int, dict[str, object]] = {}
        self._is_due = once_in(_EVERY_S)
        values = dict.fromkeys(name for _, given in files for name in given)
        self._columns = ["file", "patch", *values, "seed", "seconds", "rate_hz", "peak", "rms", "sha256", "error"]

    def add(self, number: int, item: Item, summary: Mapping[str, object]) -> None:
        """Add the summary of a rendered file."""
        found = {name: summary[name] for name in ("seconds", "rate_hz", "peak", "rms", "sha256")}
        if isinstance(item.job, RenderJob):
            found["seed"] = item.job.seed
        self._add(number, found | {"file": item.output.name if item.output else ""})

    def add_error(self, number: int, error: UnderfootError) -> None:
        """Add why a file could not be made."""
        self._add(number, {"error": str(error)})

    def _add(self, number: int, found: Mapping[str, object]) -> None:
        patch, values = self._files[number]
        self._rows[number] = {"patch": patch, **{name: _text(value) for name, value in values.items()}, **found}
        if self._is_due():
            self.write()

    def write(self) -> None:
        """Write the rows so far; nothing before the first row."""
        if not self._rows:
            return
        text = io.StringIO()
        table = csv.DictWriter(text, self._columns, restval="", lineterminator="\n")
        table.writeheader()
        table.writerows(self._rows[number] for number in sorted(self._rows))
        write_file(self._path, text.getvalue().encode())
        self._is_due = once_in(_EVERY_S)  # from now on: a slow disk would have it written after each file
