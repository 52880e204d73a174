"""A new name for a recording's file, which is never taken from another file, nor given while somebody writes to it."""

import re
import sqlite3
import time
from contextlib import closing, suppress
from pathlib import Path

from underfoot.errors import BadFile, BadValue
from underfoot.files import OF_DEVICE, put_where_none_is, reason_of, uri_of
from underfoot.records.recording import Recording
from underfoot.records.survey import cached_files

MOST_BYTES = 200
"""Of a name: file systems allow 255, and the files beside a recording have longer names."""
PATIENCE_S = 2.0
"""How long to wait for somebody who reads the recording just now, such as the list of recordings."""
_ASK_S = 0.05
_BESIDE = ("-wal", "-journal")
"""Ends of the files in which SQLite keeps what is not in the recording's own file yet."""


def rename_recording(path: Path, name: str) -> Path:
    """Give a recording another name in its folder, and return its path; what was found in it stays known.

    `name` is without the suffix. Raises `BadValue` if it is not a file name, `BadFile` if a file has that name, if the
    recording is being written, or if the system refuses.
    """
    name = name.strip().removesuffix(path.suffix)
    if not is_file_name(name):
        raise BadValue(
            f"{name!r} is not a file name; allowed: up to {MOST_BYTES} letters and other signs, but not"
            r' / \ : * ? " < > |, and no dot at the beginning'
        )
    target = path.with_name(f"{name}{path.suffix}")
    if target == path:
        return path
    kept = _settled(path)
    _move(path, target)
    with suppress(BadFile, OSError), closing(Recording(target)) as recording:
        for old, new in zip(kept, cached_files(recording), strict=True):
            with suppress(FileNotFoundError):
                old.replace(new)
    return target


def is_file_name(name: str) -> bool:
    r"""Return whether a name without suffix can be a file's on every system.

    >>> [is_file_name(name) for name in ("Monday, 2nd walk", "a/b", "what?", ".hidden", "", "nul")]
    [True, False, False, False, False, False]
    """
    is_clean = name.isprintable() and not re.search(r'[/\\:*?"<>|]', name) and not name.startswith(".")
    return bool(name) and is_clean and not OF_DEVICE.fullmatch(name) and len(name.encode()) <= MOST_BYTES


def _settled(path: Path) -> tuple[Path, ...]:
    """Put what a killed writer left beside a recording into its file; return its files in the cache.

    `BadFile` if a program is writing the recording: its next data would be in a file beside the old name.
    """
    cached: tuple[Path, ...] = ()
    with suppress(BadFile), closing(Recording(path)) as recording:
        cached = cached_files(recording)
    if use := use_of(path, "renamed"):
        raise BadFile(use)
    if any(Path(f"{path}{end}").exists() for end in _BESIDE):
        raise BadFile(f"{path} cannot be renamed: a part of it is in a file beside it; open it once, then rename it")
    return cached


def use_of(path: Path, how: str) -> str:
    """Put what a killed writer left beside a recording into its file; return "" once no program writes or reads it.

    If one does for `PATIENCE_S`, return that the recording cannot be renamed or deleted, as `how` says.
    """
    given_up_s = time.perf_counter() + PATIENCE_S
    while _is_in_use(path):
        if time.perf_counter() > given_up_s:
            return f"{path} cannot be {how}: it is being recorded or read; wait until that is done"
        time.sleep(_ASK_S)  # SQLite does not wait for the log's other users by itself
    return ""


def _is_in_use(path: Path) -> bool:
    """Merge the log of a recording into its file; return whether another program has the log open."""
    try:
        where = f"{uri_of(path.resolve())}?mode=rw"
        with closing(sqlite3.connect(where, uri=True, timeout=0.0, isolation_level=None)) as base:
            base.execute("pragma journal_mode = delete")
            base.execute("begin exclusive")
    except sqlite3.Error as error:
        return "locked" in str(error)  # any other file can be renamed, whatever is in it
    return False


def _move(path: Path, target: Path) -> None:
    """Rename a file; `BadFile` if there is one of the new name, also if it appears only now."""
    try:
        if target.exists() and not target.samefile(path):  # it is the same where letter case makes no difference
            raise FileExistsError
        if target.exists() or path.is_symlink():
            path.rename(target)
        else:
            put_where_none_is(path, target)
    except FileExistsError:
        raise BadFile(f"{target.name} is there already; choose another name") from None
    except OSError as error:
        raise BadFile(f"{path} cannot be renamed: {reason_of(error)}") from None
