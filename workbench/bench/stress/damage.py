"""Damaged files of every kind: read, or refused in one line, soon, and with nothing left open."""

import gc
import os
import tempfile
import time
import traceback
import warnings
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from underfoot.bench.stress.damaged import of_bytes, of_database
from underfoot.bench.stress.tried import Scale, Tell, Tried
from underfoot.bench.stress.whole_files import KINDS, Kind, refusal

TIMES = 300
LONGEST_S = 2.0
"""Processor time that a file may take."""
_KEPT = "damaged"


def run(scale: Scale, tell: Tell) -> Iterator[Tried]:
    """A line for each kind; a file that goes wrong is told with how it goes wrong."""
    for name, kind in KINDS.items():
        tell(f"stress: damaged files, {name}")
        with tempfile.TemporaryDirectory() as folder:
            yield _tried(name, kind, Path(folder), scale, tell)


def _tried(name: str, kind: Kind, folder: Path, scale: Scale, tell: Tell) -> Tried:
    draw = np.random.default_rng(scale.seed)
    whole = folder / "whole"
    kind.write(whole)
    text = refusal(kind, whole)
    if text is not None:
        return Tried(name, 1, f"a whole file is refused: {text}", False)
    times, refused, longest_s, wrong, lines = scale.count(TIMES), 0, 0.0, 0, set()
    data, before = whole.read_bytes(), handles()
    for number in range(times):
        path = folder / _KEPT
        path.write_bytes(_damaged(kind, data, path, draw))
        began = time.process_time()
        fault = ""
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                said = refusal(kind, path)
        except Exception as error:  # the point of the row: nothing but a refusal may come
            where = traceback.extract_tb(error.__traceback__)[-1]
            fault = f"{type(error).__name__} in {Path(where.filename).name}, line {where.lineno}: {str(error)[:80]!r}"
        else:
            refused += said is not None
            fault = _fault_of(said)
        spent_s = time.process_time() - began
        longest_s = max(longest_s, spent_s)
        if spent_s > LONGEST_S:
            fault = fault or f"took {spent_s:.1f} s"
        if fault:
            wrong += 1
            if fault not in lines:
                lines.add(fault)
                tell(f"stress: damaged {name}, file {number} of seed {scale.seed}: {fault}")
        for beside in folder.glob(f"{_KEPT}*"):
            beside.unlink()
    gc.collect()
    left = handles() - before
    found = f"{refused} refused in one line, {times - refused - wrong} read, {wrong} otherwise; "
    found += f"{longest_s:.2f} s at most, {left} handles left"
    return Tried(name, times, found, wrong == 0 and left <= 0)


def _damaged(kind: Kind, data: bytes, path: Path, draw: np.random.Generator) -> bytes:
    """A third are damaged byte by byte, the others as their form allows."""
    if draw.random() < 0.33:
        return of_bytes(data, draw)
    if kind.damage is not None:
        return kind.damage(data, draw)
    path.write_bytes(data)
    of_database(path, draw)
    return path.read_bytes()


def _fault_of(said: str | None) -> str:
    """What is wrong with a refusal: more than a line, or what no terminal can print."""
    if said is None:
        return ""
    try:
        said.encode()
    except UnicodeEncodeError:
        return f"says what cannot be printed: {ascii(said)[:80]}"
    return f"says more than a line: {said[:80]!r}" if len(said.splitlines()) > 1 else ""


def handles() -> int:
    """How many files this process has open; 0 where the system does not tell."""
    folder = Path("/proc/self/fd")
    return len(os.listdir(folder)) if folder.is_dir() else 0
