"""Damaged files of every kind: each must be read, or refused quickly in one line, with no file left open."""

import gc
import os
import tempfile
import time
import traceback
import warnings
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import inf
from pathlib import Path

import numpy as np

from underfoot.bench.stress.corruption import corrupt_bytes, corrupt_database
from underfoot.bench.stress.outcome import Effort, Outcome, Progress
from underfoot.bench.stress.valid_files import KINDS, Kind, read_error
from underfoot.engine.worker_pool import cores, in_parallel
from underfoot.errors import UnderfootError

TIMES = 300
LONGEST_S = 2.0
"""Processor time that a file may take."""
SHARE = 200
"""Files of one kind that a process tries at a stretch."""
_REPORTS = 20


def run(effort: Effort, progress: Progress) -> Iterator[Outcome]:
    """Yield a line for each kind of file; a file that fails is reported with its fault.

    With more than `SHARE` files, all cores take shares of the kinds in turn, so that every kind is tried equally often
    by the end of `seconds`. A share that is not finished by then does not count.
    """
    times = effort.count(TIMES)
    shares = [
        _Share(name, min(SHARE, times - at), (effort.seed, at // SHARE))
        for at in range(0, times, SHARE)
        for name in KINDS
    ]
    end = inf if effort.seconds is None else time.perf_counter() + effort.seconds
    results = _on_all_cores(shares, end) if times > SHARE else ((one.name, _damage_and_read(one)) for one in shares)
    found: dict[str, list[_DamageResult]] = {name: [] for name in KINDS}
    report_every = max(len(shares) // _REPORTS, 1)
    for done, (name, result) in enumerate(results, start=1):
        found[name].append(result)
        for line in result.lines:
            progress(f"stress: damaged {name}: {line}")
        if done % report_every == 0:
            progress(f"stress: damaged files, {done} of {len(shares)} shares")
    for name in KINDS:
        yield _outcome(name, found[name])


@dataclass(frozen=True)
class _Share:
    """The files that a process tests in one go."""

    name: str
    times: int
    seed: tuple[int, int]


@dataclass(frozen=True)
class _DamageResult:
    """The result of a share: the number of files refused and failed, and the faults."""

    times: int
    refused: int
    wrong: int
    longest_s: float
    left: int
    lines: tuple[str, ...]


def _on_all_cores(shares: Sequence[_Share], end: float) -> Iterator[tuple[str, _DamageResult]]:
    """Yield the kind and result of each share finished before `end`; a process that dies counts as one failed file."""
    for number, found in in_parallel(_damage_and_read, shares, cores(), is_stopped=lambda: time.perf_counter() > end):
        share = shares[number]
        if isinstance(found, UnderfootError):
            found = _DamageResult(1, 0, 1, 0.0, 0, (f"{found} (share {share.seed})",))
        yield share.name, found


def _outcome(name: str, found: Sequence[_DamageResult]) -> Outcome:
    if not found:
        return Outcome(name, 0, "no share was done in time; give more --seconds", passed=False)
    times, refused, wrong, left = (
        sum(getattr(one, of) for one in found) for of in ("times", "refused", "wrong", "left")
    )
    longest_s = max(one.longest_s for one in found)
    text = f"{refused} refused in one line, {times - refused - wrong} read, {wrong} otherwise; "
    text += f"{longest_s:.2f} s at most, {left} handles left"
    return Outcome(name, times, text, wrong == 0 and left <= 0)


def _damage_and_read(share: _Share) -> _DamageResult:
    """Damage a valid file repeatedly, with random draws from the share's seed, and read the results."""
    kind, rng = KINDS[share.name], np.random.default_rng(share.seed)
    with tempfile.TemporaryDirectory() as folder:
        whole, all_data = Path(folder, "whole"), []
        for write in (kind.write, *kind.further):
            write(whole)
            text = read_error(kind, whole)
            if text is not None:
                return _DamageResult(1, 0, 1, 0.0, 0, (f"a whole file is refused: {text}",))
            all_data.append(whole.read_bytes())
        before, path = open_file_count(), Path(folder, "damaged")
        refused, wrong, longest_s = 0, 0, 0.0
        lines: dict[str, str] = {}
        for number in range(share.times):
            data = all_data[int(rng.integers(len(all_data)))] if kind.further and rng.random() < 0.5 else all_data[0]
            path.write_bytes(_damaged(kind, data, path, rng))
            said, fault, spent_s = _read(kind, path)
            refused += said is not None and not fault
            wrong += bool(fault)
            longest_s = max(longest_s, spent_s)
            if fault:
                lines.setdefault(fault, f"{fault} (file {number} of seed {share.seed})")
            for beside in path.parent.glob(f"{path.name}*"):
                beside.unlink()
        gc.collect()
        return _DamageResult(share.times, refused, wrong, longest_s, open_file_count() - before, tuple(lines.values()))


def _read(kind: Kind, path: Path) -> tuple[str | None, str, float]:
    """Return the error that refuses a file (None if accepted), its fault ("" if none), and the processor time in
    seconds.
    """
    began, said = time.process_time(), None
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            said = read_error(kind, path)
    except Exception as error:  # the point of this test: any other exception is a fault
        where = traceback.extract_tb(error.__traceback__)[-1]
        fault = f"{type(error).__name__} in {Path(where.filename).name}, line {where.lineno}: {str(error)[:80]!r}"
    else:
        fault = _message_fault(said)
    spent_s = time.process_time() - began
    if spent_s > LONGEST_S:
        fault = fault or f"took {spent_s:.1f} s"
    return said, fault, spent_s


def _damaged(kind: Kind, data: bytes, path: Path, rng: np.random.Generator) -> bytes:
    """Return damaged data: a third byte by byte, the others by the format's own damage."""
    if rng.random() < 0.33:
        return corrupt_bytes(data, rng)
    if kind.damage is not None:
        return kind.damage(data, rng)
    path.write_bytes(data)
    corrupt_database(path, rng)
    return path.read_bytes()


def _message_fault(said: str | None) -> str:
    """Return the fault of an error message: more than one line, or unprintable characters; "" if none."""
    if said is None:
        return ""
    try:
        said.encode()
    except UnicodeEncodeError:
        return f"says what cannot be printed: {ascii(said)[:80]}"
    return f"says more than a line: {said[:80]!r}" if len(said.splitlines()) > 1 else ""


def open_file_count() -> int:
    """Return the number of files this process has open; 0 if the system does not report it."""
    folder = Path("/proc/self/fd")
    return len(os.listdir(folder)) if folder.is_dir() else 0
