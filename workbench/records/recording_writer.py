"""Writing of a recording, block by block, while its session is played."""

import json
import os
import sqlite3
from collections import Counter
from contextlib import suppress
from pathlib import Path

import numpy as np

from underfoot.errors import BadFile
from underfoot.records import envelopes
from underfoot.records.recording_format import APPLICATION_ID, FRAMES, MARKS, TYPES, VERSION, Rows
from underfoot.sqlite_files import created, is_gone, numbers_of

_LOCKED_S = 60.0
"""How long a writer waits for another program that has the file locked, as the last to close it does while it merges
the log: on a slow disk, for seconds."""
_TABLES = """
create table about (key text primary key, value text not null) without rowid;
create table force (first integer primary key, count integer not null, data blob not null);
create table vibration (first integer primary key, count integer not null, tiles text not null, data blob not null);
create table commanded (first integer primary key, count integer not null, tiles text not null, data blob not null);
create table measured (first integer primary key, count integer not null, tiles text not null, data blob not null);
create table command (id integer primary key, frame integer not null, kind text not null, body text not null);
"""


class Writer:
    """Writes a recording; data is safe after `commit`.

    The file appears at `path` with all of `about`. With `resume` it may exist, and is continued.
    """

    def __init__(self, path: Path, about: dict[str, str], *, resume: bool = False) -> None:
        if not resume:
            require_free(path)
        try:
            if not os.path.exists(path) or keeps_name(path):
                with created(path, APPLICATION_ID, VERSION, _TABLES + envelopes.TABLE + MARKS, about):
                    pass  # it is never seen incomplete
            self._base = sqlite3.connect(path, isolation_level=None, timeout=_LOCKED_S)
            self._base.execute("pragma journal_mode = wal")
            self._base.execute("pragma synchronous = normal")
            self._repeated = Counter[tuple[int, str]](self._base.execute("select frame, text from mark").fetchall())
        except (sqlite3.Error, OSError) as error:
            raise BadFile(f"{path} cannot be written: {error}") from None
        self.path, self._was = path, numbers_of(path)
        self._frames = float(about.get("rate", 48_000)) / float(about.get("force_rate", 1000.0))

    def put(self, table: str, first: int, rows: Rows) -> None:
        """Add a block: the number of its first row, and its rows.

        Those of `force` are samples (stamp, arrival, corners...), the others frames [frame, tile]: `vibration` is what
        the tiles played, `commanded` what was asked of them and `measured` what they did.
        """
        if len(rows) == 0:
            return
        self._begin()
        if table == "force":
            samples = np.ascontiguousarray(rows, TYPES[table])
            self._base.execute("insert into force values (?, ?, ?)", (first, len(rows), samples.tobytes()))
            envelopes.put(self._base, table, round(rows[0, 0]), envelopes.loads(rows[:, 2:]), self._frames)
            return
        frames = np.ascontiguousarray(rows, TYPES[table])
        moving = np.flatnonzero(frames.view("<i4").any(axis=0))  # few tiles; by their bits: -0 is not nothing
        data = np.ascontiguousarray(frames[:, moving]).tobytes()
        said = json.dumps(moving.tolist())
        self._base.execute(f"insert into {table} values (?, ?, ?, ?)", (first, len(rows), said, data))
        if table != "vibration":
            envelopes.put(self._base, table, first, frames, 1.0)

    def command(self, frame: int, kind: str, body: str) -> None:
        """Add a command, and the frame at which it took effect."""
        self._begin()
        self._base.execute("insert into command (frame, kind, body) values (?, ?, ?)", (frame, kind, body))

    def set_about(self, key: str, value: str) -> None:
        """Set or replace an entry of `about`."""
        self._begin()
        self._base.execute("insert or replace into about values (?, ?)", (key, value))

    def commands(self) -> int:
        """Return the number of commands."""
        count: int = self._base.execute("select count(*) from command").fetchone()[0]
        return count

    def end(self, table: str) -> int | None:
        """Return the number after the last row of a table; None if it is empty."""
        last = self._base.execute(f"select first + count from {table} order by first desc limit 1").fetchone()
        return last[0] if last else None

    def cut(self, end: int) -> None:
        """Remove all frames from session frame `end` on, and the force samples that arrived then.

        Only the last blocks are read: in a recording of hours, to look at each would take longer than to play it.
        """
        self._begin()
        for table in FRAMES:
            self._base.execute(f"delete from {table} where first >= ?", (end,))
            last = self._last(table)
            if last is not None and last[0] + last[1] > end:
                first, count, data = last
                kept = data[: len(data) // count * (end - first)]
                said = (end - first, kept, first)
                self._base.execute(f"update {table} set count = ?, data = ? where first = ?", said)
            envelopes.remove(self._base, table, end, 1 << 62)
        self._cut_forces(end)

    def _cut_forces(self, end: int) -> None:
        """Remove the force samples that arrived from session frame `end` on: a late recorder finds many in the ring."""
        while (last := self._last("force")) is not None:
            first, count, data = last
            rows = np.frombuffer(data, TYPES["force"]).reshape(count, -1)
            kept = int(np.count_nonzero(rows[:, 1] < end))
            if kept == count:
                break
            self._base.execute("delete from force where first = ?", (first,))
            stamp = round(rows[0, 0])
            envelopes.remove(self._base, "force", stamp, stamp + 1)
            self.put("force", first, rows[:kept])

    def _last(self, table: str) -> tuple[int, int, bytes] | None:
        """Return the last block of a table: the number of its first row, its rows, and their data."""
        ask = f"select first, count, data from {table} order by first desc limit 1"
        last: tuple[int, int, bytes] | None = self._base.execute(ask).fetchone()
        return last

    def mark(self, frame: int, text: str) -> None:
        """Add a mark at a session frame; one that was in the file when it was continued may come again, and is not."""
        self._begin()
        if self._repeated[frame, text]:
            self._repeated[frame, text] -= 1
        else:
            self._base.execute("insert into mark (frame, text) values (?, ?)", (frame, text))

    @property
    def is_empty(self) -> bool:
        """Whether there is neither a frame nor a mark."""
        return self.end("vibration") is None and not self._base.execute("select 1 from mark limit 1").fetchone()

    def commit(self) -> None:
        """Commit all data so far."""
        if self._base.in_transaction:
            self._base.execute("commit")

    @property
    def is_gone(self) -> bool:
        """Whether the file was moved or removed, or another one is in its place."""
        return is_gone(self.path, self._was)

    def _begin(self) -> None:
        """Begin a transaction that writes, unless one is open.

        One that has read cannot write where somebody else has written since: it is refused at once, without waiting.
        """
        if not self._base.in_transaction:
            self._base.execute("begin immediate")

    def close(self) -> None:
        """Commit, merge the log into the file, and close. Where somebody reads the file, the last to end merges it."""
        self.commit()
        with suppress(sqlite3.OperationalError):  # it is locked while somebody reads it
            self._base.execute("pragma journal_mode = delete")
        self._base.close()

    def abandon(self) -> Path | None:
        """Close without what is not committed; return the log if it cannot be merged, as on a full disk."""
        with suppress(sqlite3.Error):
            self._base.close()
        log = Path(f"{self.path}-wal")
        return log if log.exists() else None


def require_free(path: Path) -> None:
    """Raise `BadFile` if there is a file that a recording would replace; an empty one keeps its name for it."""
    if os.path.exists(path) and not keeps_name(path):
        raise BadFile(f"{path} is there already; choose another name for the recording")


def keeps_name(path: str | Path) -> bool:
    """Return whether an empty file keeps the name of a recording that is not there yet; a pipe or a device does not."""
    return os.path.isfile(path) and not os.path.getsize(path)
