"""Opening of SQLite files, also of those whose writer was killed, on disks and shares that may be read only."""

import os
import sqlite3
from collections.abc import Iterator, Mapping
from contextlib import closing, contextmanager, suppress
from pathlib import Path
from typing import Any

from underfoot.errors import BadFile
from underfoot.files import replaced, uri_of


def opened(path: Path, **options: Any) -> sqlite3.Connection:  # noqa: ANN401 - of sqlite3.connect
    """Open a file for reading, and for writing where that is allowed.

    Reading what a writer left in its log takes a file beside it; where the disk has no room for one, memory does, and
    nobody else can read it meanwhile. Where nothing can be written, nothing can be locked either, nor need it be.
    """
    where = uri_of(path.resolve())
    with suppress(sqlite3.OperationalError):
        asked = ("pragma application_id", "select count(*) from sqlite_master")
        return _connected(f"{where}?mode=rw", asked, options)
    log, is_protected = Path(f"{path}-wal"), not os.access(path, os.W_OK)
    if not (log.exists() and log.stat().st_size) and (is_protected or not os.access(path.parent, os.W_OK)):
        # There is no log, and there can be none. A file that was moved just now is protected, too: it must not be made.
        return _connected(f"{where}?mode=ro&immutable=1", (), options)
    how = "mode=ro&vfs=unix-none" if is_protected and os.name == "posix" else "mode=rw"
    return _connected(f"{where}?{how}", ("pragma locking_mode = exclusive",), options)


def version_of(base: sqlite3.Connection, path: str | Path, application_id: int, newest: int, what: str) -> int:
    """Return the version of an open file; `BadFile` if it is not `what`, or newer than a version."""
    (application,) = base.execute("pragma application_id").fetchone()
    (version,) = base.execute("pragma user_version").fetchone()
    if application != application_id:
        raise BadFile(f"{path} is not {what}")
    if version > newest:
        raise BadFile(f"{path}: version is {version}; allowed: up to {newest}, a newer Underfoot wrote it")
    return int(version)


@contextmanager
def created(
    path: Path, application_id: int, version: int, tables: str, about: Mapping[str, str], *, is_new: bool = False
) -> Iterator[sqlite3.Connection]:
    """Make a file with these tables and entries beside `path`; it is moved there at the end of the block.

    What `is_new` replaces no file that is there by then; `BadFile` refuses it.
    """
    with replaced(path, is_new=is_new) as part, closing(sqlite3.connect(part, isolation_level=None)) as base:
        base.executescript(f"pragma application_id = {application_id}; pragma user_version = {version}; {tables}")
        base.executemany("insert into about values (?, ?)", about.items())
        yield base


def numbers_of(path: Path) -> tuple[int, int] | None:
    """Return device and inode of a file, which another one in its place has not; None where there are none."""
    with suppress(OSError):
        found = os.stat(path)
        return (found.st_dev, found.st_ino) if found.st_ino else None
    return None


def is_gone(path: Path, was: tuple[int, int] | None = None) -> bool:
    """Return whether a file was moved or removed, or, if its numbers are given, another one is in its place.

    SQLite goes on without a word, in a file that nobody finds. Programs that keep folders alike replace files so.
    """
    try:
        os.stat(path)
    except OSError as error:  # others may pass, as those of a network
        return isinstance(error, FileNotFoundError)
    now = numbers_of(path)
    return None not in (was, now) and now != was


def require_whole(path: Path, application_id: int) -> None:
    """Raise `BadFile` for a file of this application of which the end is missing, as if it was copied in part.

    The file's first page tells how many pages there are (sqlite.org/fileformat.html, 1.3).
    """
    with path.open("rb") as file:
        head = file.read(100)
    if len(head) < 100 or head[:16] != b"SQLite format 3\0" or int.from_bytes(head[68:72], "big") != application_id:
        return
    page = int.from_bytes(head[16:18], "big")
    whole = (page if page > 1 else 65536) * int.from_bytes(head[28:32], "big")
    share = 1.0 - path.stat().st_size / max(whole, 1)
    if share > 0.0:
        raise BadFile(f"{path} is cut off: {max(100.0 * share, 1.0):.0f} % of it are missing; copy it again")


def _connected(where: str, asked: tuple[str, ...], options: dict[str, Any]) -> sqlite3.Connection:
    """Return a connection that works; close one that does not.

    No file of ours has a view or a trigger. In one of somebody else's they would be run: a view in place of a table can
    have rows without end, and a trigger can delete what is recorded when a mark is added.
    """
    base = sqlite3.connect(where, uri=True, **options)
    try:
        for question in asked:
            base.execute(question).fetchone()
        (programs,) = base.execute("select count(*) from sqlite_master where type in ('view', 'trigger')").fetchone()
        if programs:
            raise sqlite3.DatabaseError("it has views or triggers, which are programs, and not run")
    except BaseException:
        base.close()
        raise
    return base
