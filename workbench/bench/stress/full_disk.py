"""A disk that is full during a write: one error line, the old file complete, and the program continues."""

import subprocess
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import numpy as np

from underfoot.bench.stress.outcome import Effort, Outcome, Progress
from underfoot.bench.stress.valid_files import FLOOR, default_answers, tone
from underfoot.engine.reports import Notice, Started
from underfoot.engine.session import Session
from underfoot.engine.target import Target
from underfoot.errors import BadFile
from underfoot.experiments.excerpts import Excerpt
from underfoot.experiments.protocol import Protocol
from underfoot.experiments.store import SessionFile
from underfoot.experiments.study import Study
from underfoot.files import write_file
from underfoot.nodes import REGISTRY
from underfoot.patch import preset_files
from underfoot.records.recording import Recording
from underfoot.records.wav import write_wav

_MB = 1 << 20
_ROOM = 16 * _MB
_START_S = 300.0


def run(effort: Effort, progress: Progress) -> Iterator[Outcome]:
    """Yield a line for each kind of writer."""
    with tempfile.TemporaryDirectory() as folder, small_disk(Path(folder)) as how:
        progress(f"stress: full disk, {how}")
        for name, trial in TRIALS.items():
            found, good = trial(Path(folder))
            yield Outcome(f"{name}, {how}", 1, found, good)
        found, good = _recording(Path(folder))
        yield Outcome(f"session recorded, {how}", 1, found, good)


@contextmanager
def small_disk(folder: Path) -> Iterator[str]:
    """Limit the files in a folder to 16 MB; yield the method in words.

    The method is a RAM disk if mounting is permitted, else this process's limit on file sizes.
    """
    command = ["mount", "-t", "tmpfs", "-o", f"size={_ROOM}", "none", str(folder)]
    try:
        mounted = subprocess.run(command, capture_output=True).returncode == 0
    except OSError:
        mounted = False
    if mounted:
        try:
            yield "a disk of 16 MB"
        finally:
            subprocess.run(["umount", "-l", str(folder)], capture_output=True)
        return
    import resource

    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (_ROOM, before[1]))
    try:
        yield "files of at most 16 MB"
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


def _refused(write: Callable[[], object]) -> str:
    """Return the error line with which a write is refused, "" if it succeeds."""
    try:
        write()
    except BadFile as error:
        return str(error) if "\n" not in str(error) else ""
    return ""


@contextmanager
def _filled(folder: Path) -> Iterator[None]:
    """Fill the disk completely within the block."""
    filler = folder / "filler"
    with suppress(OSError), filler.open("wb", 0) as file:
        for _ in range(2 * _ROOM // 4096):
            file.write(bytes(4096))
    try:
        yield
    finally:
        filler.unlink()


def _patch(folder: Path) -> tuple[str, bool]:
    """Test a patch that exceeds the free space, saved over an existing one."""
    path = folder / "patch.json"
    tone().save(path)
    old = path.read_bytes()
    with _filled(folder):
        said = _refused(lambda: write_file(path, bytes(2 * _ROOM)))
        whole, beside = path.read_bytes() == old, len(list(folder.iterdir()))
    tone(120.0).save(path)
    return f"{_without(said, folder)}; the old file is whole", bool(said) and whole and beside == 2


def _sound(folder: Path) -> tuple[str, bool]:
    """Test a sound of twice the free space, written over an existing one."""
    path = folder / "sound.wav"
    path.write_bytes(b"precious")
    said = _refused(lambda: write_wav(path, np.zeros((2 * _ROOM // 4, 1), np.float32), 48_000.0))
    whole = path.read_bytes() == b"precious" and {one.name for one in folder.iterdir()} == {"patch.json", "sound.wav"}
    return f"{_without(said, folder)}; the old file is whole", bool(said) and whole


def _study(folder: Path) -> tuple[str, bool]:
    """Test answers with large excerpts until the disk is full; the session must continue after space is freed."""
    protocol = Protocol.load(preset_files.protocols()["identification-impact"])
    path = folder / "p1.session"
    file = SessionFile.create(path, protocol, "P1", preset_files.protocols()["identification-impact"].parent)
    study, kept, said = Study(protocol, "P1"), 0, ""
    rng = np.random.default_rng(1)
    try:
        while not said and kept < 400:
            entry = study.answer(default_answers(study.page))
            noise = Excerpt("vibration", 0, 0.0, 48_000.0, ("t1", "t2"), rng.normal(size=(48_000, 2)))
            said = _refused(lambda entry=entry, noise=noise: file.add(entry, [noise]))  # type: ignore[misc]
            kept += not said
        there = len(file.entries()) == kept
        for other in ("patch.json", "sound.wav"):
            (folder / other).unlink(missing_ok=True)
    finally:
        file.close()
    again = SessionFile.open(path)
    whole = len(again.entries()) == kept and len(again.excerpts(kept)) == 1
    again.close()
    path.unlink()
    return f"{_without(said, folder)}; all {kept} answers before are in it", bool(said) and there and whole


TRIALS = {"patch saved": _patch, "sound rendered": _sound, "study answered": _study}
"""What is written until the disk is full, in this order; each returns what was found, and whether it is good."""


def _recording(folder: Path) -> tuple[str, bool]:
    """Test a session that records until the disk is full; it must continue to play."""
    path = folder / "session.underfoot"
    session = Session(Target(FLOOR, block=128), tone(), REGISTRY)
    said: list[str] = []
    started, end = False, time.perf_counter() + _START_S
    try:
        session.record(path)
        session.start()
        while time.perf_counter() < end and not (said and started):
            for report in session.poll():
                started = started or isinstance(report, Started)
                said += [report.text] if isinstance(report, Notice) and path.name in report.text else []
            time.sleep(0.01)
        frame = session.health.frame
        time.sleep(1.0)
        session.poll()
        goes_on = session.health.frame > frame + 4800
    finally:
        session.close()
    with Recording(path) as recording:
        kept_s = len(recording.vibration()[1]) / 48_000.0
    found = f"{_without(said[0] if said else '', folder)}; it plays on, and {kept_s:.1f} s can be read there"
    return found, len(said) == 1 and "\n" not in said[0] and goes_on and kept_s > 0.5


def _without(said: str, folder: Path) -> str:
    """Return a message without the folder's name, which differs between runs."""
    return said.replace(f"{folder}/", "") or "no line"
