"""Reading of recordings, also of those whose writer was killed; `recording_format` says what is in them."""

import getpass
import json
import math
import sqlite3
from collections.abc import Iterable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from datetime import datetime
from pathlib import Path
from types import TracebackType

import msgspec
import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

from underfoot.arguments import choice, integer, is_text
from underfoot.errors import BadFile, in_one_line, require
from underfoot.files import head_of, no_file, path_of
from underfoot.floor.layout import Floor
from underfoot.floor.profile_parts import InUse
from underfoot.records.notes import HEAVIEST_N, LIGHTEST_N, NEAR_S, BodyWeight, LeftOut, Notes
from underfoot.records.recording_format import (
    APPLICATION_ID,
    BODY_WEIGHTS,
    FRAMES,
    LEFT_OUT,
    MARKS,
    SUFFIXES,
    TYPES,
    VERSION,
    Rows,
)
from underfoot.sqlite_files import is_gone, opened, require_whole, version_of

NEEDED = ("floor", "rate", "force_rate", "patch")
"""Entries of `about` that every recording has."""
FURTHEST_FRAME = 1e15
"""Largest valid session frame: 150 years at 192 kHz."""
_HEAD = b"SQLite format 3"


class Gap(Struct, frozen=True):
    """Missing frames (or samples): the first, and their number."""

    first: int
    count: int


class Mark(Struct, frozen=True):
    """A mark: a session frame, and a text that may be empty."""

    id: int
    frame: int
    text: str


class Recording:
    """A recorded session, for reading; also one whose writer was killed. Raises `BadFile` for any other file.

    `about` has the texts `patch`, `folder`, `floor`, `rate`, `force_rate`, `target`, and `channels` of the tiles as a
    JSON list, if known. For forces with contacts and steps see `underfoot.read_forces`.
    """

    def __init__(self, path: str | Path) -> None:
        self.path = path_of(path)
        if not self.path.is_file():
            raise BadFile(f"{path} cannot be read: {no_file(self.path)} (allowed: a recording)")
        with ExitStack() as unless_read:
            try:
                self._base = opened(self.path)
                unless_read.callback(self._base.close)
                self.version = version_of(self._base, path, APPLICATION_ID, VERSION, "a recording of Underfoot")
                self.about: dict[str, str] = dict(self._base.execute("select key, value from about"))
            except sqlite3.OperationalError as error:
                if "full" not in str(error) and "I/O" not in str(error):
                    raise BadFile(f"{path} is not a recording: {in_one_line(error)}") from None
                room = "what its writer left has to be put in order first, which takes some room on its disk"
                raise BadFile(f"{path} cannot be read: {error}; {room}") from None
            except (sqlite3.Error, UnicodeDecodeError, TypeError) as error:
                require_whole(self.path, APPLICATION_ID)
                if head_of(self.path, 15) != _HEAD:
                    makes = "`underfoot monitor FILE --record RECORDING` makes one of a force CSV or a C3D file"
                    raise BadFile(f"{path} is not a recording; allowed: one ({makes})") from None
                raise BadFile(f"{path} is not a recording: {in_one_line(error)}") from None
            missing = [key for key in NEEDED if not _is_said(key, self.about.get(key))]
            if missing:
                raise BadFile(f"{path} is not a whole recording: it does not say its {', '.join(missing)}")
            if not all(isinstance(text, str) for entry in self.about.items() for text in entry):
                raise BadFile(f"{path} is not a whole recording: what it says of itself is no text")
            self._floor_tiles = self._tiles_of_floor()
            self._known_gaps: dict[str, tuple[int, list[Gap]]] = {}  # by table, with the last block looked at
            unless_read.pop_all()

    def __repr__(self) -> str:
        return f"<Recording {self.path.name}: {self._floor_tiles} tiles, {self.rate_hz:g} frames/s>"

    def __enter__(self) -> "Recording":
        return self

    def __exit__(self, kind: type | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self.close()

    @contextmanager
    def at_one_moment(self) -> Iterator[None]:
        """In this block, what a recorder adds meanwhile is not there yet. Marks can be added by others."""
        if self._base.execute("pragma journal_mode").fetchone() == ("wal",):
            self._base.execute("begin")  # without a recorder's log, it would keep everybody from writing
        try:
            yield
        finally:
            self._base.rollback()

    def force_samples(self) -> NDArray[np.float64]:
        """Return all force samples, float64 [sample, column]: stamp and arrival in session frames, then corner forces
        in N."""
        return self._whole("force")[1]

    def vibration(self) -> tuple[int, NDArray[np.float32]]:
        """Return the first session frame, and the drive of the tiles, [frame, tile], of full scale; 0 in gaps."""
        return self._whole("vibration")

    def acceleration(self, table: str) -> tuple[int, NDArray[np.float32]]:
        """Return the first session frame, and the "commanded" or "measured" acceleration, [frame, tile], m/s^2; 0 in
        gaps."""
        choice("table", table, FRAMES[1:])
        return self._whole(table)

    def blocks(
        self, table: str, begin: int = -(1 << 62), end: int = 1 << 62, *, reverse: bool = False
    ) -> Iterator[tuple[int, Rows]]:
        """Yield the blocks of a table with rows between two row numbers: the number of the first row, and the rows.

        Each block is read when it is requested.
        """
        if self._lacks(table):
            return
        has_all_tiles = table == "force" or (table == "vibration" and self.version < 4)
        columns = "first, count, data" if has_all_tiles else "first, count, data, tiles"
        with self.readable(table):
            (before,) = self._base.execute(f"select max(first) from {table} where first <= ?", (begin,)).fetchone()
            low, high = begin if before is None else before, end
            where = f"{table} where first >= ? and first < ? order by first{' desc' * reverse} limit 1"
            # One by one: a query that is open while its blocks are worked on keeps others from writing a mark.
            while found := self._base.execute(f"select {columns} from {where}", (low, high)).fetchone():
                first, count, data, *tiles = found
                if not low <= first < high:
                    raise ValueError("its blocks are not in order")
                low, high = (low, first) if reverse else (first + 1, high)
                if first + count <= begin:
                    continue
                moving = json.loads(tiles[0]) if tiles else range(self._columns(table))
                kind = np.dtype(TYPES[table])
                if len(data) != count * len(moving) * kind.itemsize:
                    numbers = f"{len(data) / kind.itemsize:.10g} numbers for {count} rows of {len(moving)}"
                    raise ValueError(f"its block from row {first} on has {numbers}")
                rows = np.frombuffer(data, kind).reshape(count, len(moving))
                if tiles:
                    whole = np.zeros((count, self._floor_tiles), np.float32)
                    whole[:, moving] = rows
                    rows = whole
                elif table == "force" and not (np.abs(rows[:, :2]) <= FURTHEST_FRAME).all():  # or is not a number
                    raise ValueError("it has times that no session can have")
                yield first, rows

    def force_samples_between(self, begin: float, end: float) -> NDArray[np.float64]:
        """Return the force samples with stamps between two session frames, and read only these."""
        empty = np.zeros((0, 2 + 4 * self._floor_tiles))
        return np.concatenate([empty, *self.force_blocks_between(begin, end)])

    def force_blocks_between(self, begin: float, end: float) -> Iterator[NDArray[np.float64]]:
        """Yield the force samples with stamps between two session frames, block by block; either can be infinite."""
        first = self._first_sample_at(begin) if begin > -math.inf else -(1 << 62)
        for _, rows in self.blocks("force", first):
            is_whole = begin == -math.inf and end == math.inf
            kept = rows if is_whole else rows[(rows[:, 0] >= begin) & (rows[:, 0] < end)]
            if len(kept):
                yield kept
            if rows[-1, 0] >= end:
                break

    def frames_between(self, table: str, begin: int, end: int) -> NDArray[np.float32]:
        """Return the rows of a table of `FRAMES` between two session frames, [frame, tile]; NaN in gaps."""
        found = np.full((max(end - begin, 0), self._floor_tiles), np.nan, np.float32)
        for first, rows in self.blocks(table, begin, end):
            kept = rows[max(begin - first, 0) : end - first]
            at = max(first - begin, 0)
            found[at : at + len(kept)] = kept
        return found

    def _first_sample_at(self, frame: float) -> int:
        """Return the number of a sample at or shortly before a session frame, or else of the first one after it."""
        ends = self.ends("force")
        if ends[0] is None or ends[1] is None:
            return 0
        low, high, guess, probes = ends[0], ends[1] - 1, ends[0], 0
        period = self.rate_hz / self.force_rate_hz
        while low < high:
            guess = min(max(guess, low), high) if probes % 3 else (low + high) // 2
            first, rows = next(self.blocks("force", guess))
            if rows[0, 0] > frame:
                high = max(min(first, guess) - 1, low)  # in a gap, the block begins after the guess
            elif rows[-1, 0] < frame:
                low = min(first + len(rows), high)
            else:
                return first
            guess = first + int((frame - rows[0, 0]) / period)
            probes += 1
        return low

    @property
    def calibrations(self) -> InUse:
        """The calibrations in use when it was begun: day and digest, by tile and part of its profile.

        Empty where there were none, and in files of an earlier version. Raises `BadFile` if they cannot be read.
        """
        try:
            return msgspec.json.decode(self.about.get("calibrations", "{}"), type=InUse)
        except msgspec.DecodeError as error:
            raise BadFile(f"{self.path}: its calibrations cannot be read: {in_one_line(error)}") from None

    @property
    def rate_hz(self) -> float:
        """Session frames per second."""
        return float(self.about["rate"])

    @property
    def force_rate_hz(self) -> float:
        """Force samples per second of each sensor."""
        return float(self.about["force_rate"])

    @property
    def floor(self) -> Floor:
        """The floor that was recorded; raises `BadFile` if it is damaged."""
        return Floor.loads(self.about["floor"], str(self.path))

    @property
    def span(self) -> tuple[int, int]:
        """Return the first recorded session frame, and the one after the last; (0, 0) for an empty recording."""
        first, end = self.ends("vibration")
        for _, rows in (*self._at_ends("force"),):
            first = round(rows[0, 0]) if first is None else min(first, round(rows[0, 0]))
            end = round(rows[-1, 0]) + 1 if end is None else max(end, round(rows[-1, 0]) + 1)
        return (first or 0), (end or 0)

    @property
    def state(self) -> int:
        """A number that is another one since another program, or another `Recording`, has changed the file."""
        return int(self._base.execute("pragma data_version").fetchone()[0])

    def _at_ends(self, table: str) -> Iterator[tuple[int, Rows]]:
        """Return the first and the last block of a table."""
        for reverse in (False, True):
            for block in self.blocks(table, reverse=reverse):
                yield block
                break

    def ends(self, table: str) -> tuple[int | None, int | None]:
        """Return the number of a table's first row, and the number after its last; None if it is empty."""
        if self._lacks(table):
            return None, None
        with self.readable(table):
            ask = f"select min(first) from {table}"
            (first,) = self._base.execute(ask).fetchone()
            last = self._base.execute(f"select first + count from {table} order by first desc limit 1").fetchone()
            ends = first, last[0] if last else None
            if any(not (number is None or abs(number) <= FURTHEST_FRAME) for number in ends):
                raise ValueError(f"its rows are numbered {ends}")
        return ends

    # --- marks, notes of steps, and envelopes ---

    def marks(self) -> list[Mark]:
        """Return the marks in order of time."""
        with self.readable("mark"):
            if not self._has("mark"):
                return []
            found = self._base.execute("select id, frame, text from mark order by frame, id").fetchall()
            if any([*map(type, row)] != [int, int, str] or abs(row[1]) > FURTHEST_FRAME for row in found):
                raise ValueError("an entry is not of a number, a frame and a text")
            return [Mark(*row) for row in found]

    def add_mark(self, frame: int, text: str = "") -> Mark:
        """Add a mark at a session frame to the file; `BadFile` if it cannot be written to, `BadValue` for no frame."""
        frame = integer("frame", frame, 0, int(FURTHEST_FRAME), "0 to 1e15, in session frames")
        require(is_text(text), "text", text, "text in UTF-8")
        with self._written():
            self._base.execute(MARKS)
            done = self._base.execute("insert into mark (frame, text) values (?, ?)", (frame, text))
        return Mark(done.lastrowid or 0, frame, text)

    def remove_mark(self, id: int) -> None:
        """Remove a mark."""
        with self._written():
            self._base.execute("delete from mark where id = ?", (id,))

    def left_out(self) -> list[LeftOut]:
        """Return the steps that are left out of means, in order of time."""
        with self.readable("left_out"):
            if not self._has("left_out"):
                return []
            found = self._base.execute("select frame, tile, why, who, at from left_out order by frame, tile").fetchall()
            if any([*map(type, row)] != [int, str, str, str, str] for row in found):
                raise ValueError("an entry is not of a frame and four texts")
            return [LeftOut(*row) for row in found]

    def leave_out(self, places: Iterable[tuple[int, str]], why: str) -> None:
        """Leave out the steps that begin at these session frames on these tiles, or with "" for `why` take them in
        again; `BadFile` if the file cannot be written to."""
        require(is_text(why), "why", why, "text in UTF-8")
        why, when = " ".join(why.split()), datetime.now().isoformat(timespec="seconds")
        with self._written():
            self._base.execute(LEFT_OUT)
            for frame, tile in places:
                near = (tile, frame, NEAR_S * self.rate_hz)
                self._base.execute("delete from left_out where tile = ? and abs(frame - ?) <= ?", near)
                if why:
                    self._base.execute("insert into left_out values (?, ?, ?, ?, ?)", (frame, tile, why, _user(), when))

    def body_weights(self) -> list[BodyWeight]:
        """Return the body weights that are noted, in order of persons."""
        with self.readable("body_weight"):
            if not self._has("body_weight"):
                return []
            ask = "select person, weight_n, source, who, at from body_weight order by person"
            found = self._base.execute(ask).fetchall()
            if any([*map(type, row)] != [int, float, str, str, str] or not row[1] > 0.0 for row in found):
                raise ValueError("an entry is not of a person, a weight and three texts")
            return [BodyWeight(*row) for row in found]

    def note_body_weight(self, person: int, weight_n: float, source: str) -> None:
        """Note the body weight of a person, with 0 that of all who have no other, and how it is known; NaN removes
        it. `BadFile` if the file cannot be written to."""
        person = integer("person", person, 0, int(FURTHEST_FRAME), "0 for all, or a person's number")
        is_weight = math.isnan(weight_n) or LIGHTEST_N <= weight_n <= HEAVIEST_N
        require(is_weight, "the body weight", weight_n, f"{LIGHTEST_N:g} to {HEAVIEST_N:g}, in N")
        when = datetime.now().isoformat(timespec="seconds")
        with self._written():
            self._base.execute(BODY_WEIGHTS)
            self._base.execute("delete from body_weight where person = ?", (person,))
            if weight_n == weight_n:
                row = (person, weight_n, source, _user(), when)
                self._base.execute("insert into body_weight values (?, ?, ?, ?, ?)", row)

    def notes(self) -> Notes:
        """Return all that is noted of the steps."""
        return Notes(self.span[0], self.rate_hz, self.left_out(), self.body_weights())

    def envelope_base(self) -> sqlite3.Connection | None:
        """Return the connection for its envelopes; None for an earlier version, which has none."""
        with self.readable("envelope"):
            return self._base if self._has("envelope") else None

    @contextmanager
    def _written(self) -> Iterator[None]:
        try:
            with self._base:
                yield
        except sqlite3.Error as error:
            why = "it was moved or removed; open it where it is" if is_gone(self.path) else error
            raise BadFile(f"{self.path} cannot be written to: {why}") from None

    def commands(self) -> list[tuple[int, str, str]]:
        """Return (frame, kind, body) of every command, in order."""
        with self.readable("command"):
            found = list(self._base.execute("select frame, kind, body from command order by id"))
            for row in found:
                if [type(value) for value in row] != [int, str, str] or row[0] < 0:
                    raise ValueError(f"a command is {row!r:.60}")
            return found

    def gaps(self, table: str = "vibration") -> list[Gap]:
        """Return the gaps between the blocks of a table. Asked again, as it grows, only later blocks are looked at."""
        if self._lacks(table):
            return []
        with self.readable(table):
            last, known = self._known_gaps.get(table, (0, []))
            if not self._base.execute(f"select 1 from {table} where first = ?", (last,)).fetchone():
                last, known = -(1 << 62), []  # the first time; or the end was cut off since
            end, found, later = None, [*known], f"select first, count from {table} where first >= ? order by first"
            for first, count in self._base.execute(later, (last,)):
                if end is not None and first > end:
                    found.append(Gap(end, first - end))
                last, end = first, first + count
            self._known_gaps[table] = last, found
        return [*found]

    def close(self) -> None:
        """Close the file."""
        self._base.close()

    def _has(self, table: str) -> bool:
        """Return whether there is such a table now: another program may have made it with its first note."""
        ask = "select 1 from sqlite_master where type = 'table' and name = ?"
        return self._base.execute(ask, (table,)).fetchone() is not None

    def _lacks(self, table: str) -> bool:
        """Return whether the file's version has no such table; `BadValue` for a name that no version has."""
        choice("table", table, TYPES)
        return table in ("commanded", "measured") and self.version < 2

    def _columns(self, table: str) -> int:
        return 2 + 4 * self._floor_tiles if table == "force" else self._floor_tiles

    def _whole(self, table: str) -> tuple[int, Rows]:
        """Return all rows of a table, and the number of the first; 0 in gaps."""
        first, end = (number or 0 for number in self.ends(table))
        with self.readable(table):
            whole = np.zeros((end - first, self._columns(table)), TYPES[table])
            for at, rows in self.blocks(table, first, end):
                whole[at - first : at - first + len(rows)] = rows
        return first, whole

    def _tiles_of_floor(self) -> int:
        try:
            return len(json.loads(self.about["floor"])["tiles"])
        except (ValueError, KeyError, TypeError, RecursionError):
            raise BadFile(f"{self.path} is not a whole recording: its floor cannot be read") from None

    @contextmanager
    def readable(self, table: str) -> Iterator[None]:
        """Raise `BadFile` if the table is damaged."""
        try:
            yield
        except (sqlite3.Error, ValueError, TypeError, IndexError, OverflowError, RecursionError, MemoryError) as error:
            raise BadFile(f"{self.path}: table {table} cannot be read: {in_one_line(error)}") from None


def _user() -> str:
    """Return the name by which the user is known to the system; "" if it has none."""
    with suppress(OSError, KeyError, ImportError):  # an account without a name, as in a container
        return getpass.getuser()
    return ""


def _is_said(key: str, value: object) -> bool:
    """Return whether an entry of `about` is valid: a text, and for rates a number that queues can be made for."""
    try:
        return isinstance(value, str) and (not key.endswith("rate") or 1.0 <= float(value) < 1e9)
    except ValueError:
        return False


def is_recording(path: Path) -> bool:
    """Return whether a file is an SQLite file or has the suffix of a recording; `Recording` may still refuse it."""
    head = head_of(path, 15)
    return head is not None and (head == _HEAD or path.suffix.lower() in SUFFIXES)
