"""A participant's session on disk: one SQLite file, which stores each answer durably as soon as it is given.

The file contains the protocol with its patches, so that it can be read without other files. It has an entry for each
answered page, in order, the force and vibration of each trial, and notes. An entry and its excerpts are one
transaction, flushed to disk. After a crash at any time the file can be opened, and the study continues at the next
page.
"""

import os
import sqlite3
import zlib
from collections.abc import Iterable, Iterator, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import ExitStack, closing, contextmanager, suppress
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from tempfile import TemporaryDirectory
from types import MappingProxyType
from typing import TYPE_CHECKING

import msgspec

from underfoot.errors import BadFile, in_one_line
from underfoot.experiments.excerpts import Excerpt, Packed, packed, unpacked
from underfoot.experiments.languages import is_own, path_of_language
from underfoot.experiments.protocol import Protocol
from underfoot.experiments.stimuli import copy_files_of_settings, patch_path, path_beside
from underfoot.experiments.study import Entry, Study, method_of, require_id
from underfoot.files import make_folder, no_file, uri_of, write_file
from underfoot.patch import preset_files
from underfoot.patch.file_paths import text_with_files_kept
from underfoot.patch.node import installed_nodes
from underfoot.sqlite_files import created, is_gone, numbers_of, opened, require_whole, version_of

if TYPE_CHECKING:
    from filelock import BaseFileLock

APPLICATION_ID = 0x55464558  # "UFEX"
VERSION = 1
_TABLES = """
create table about (key text primary key, value text not null) without rowid;
create table patch (name text primary key, body blob not null) without rowid;
create table entry (number integer primary key, at text not null, body text not null);
create table stretch (
    entry integer not null, part integer not null, kind text not null, first real not null, rate_hz real not null,
    columns text not null, scale real not null, shape text not null, data blob not null,
    primary key (entry, part, kind)
) without rowid;
create table note (id integer primary key, at text not null, entry integer not null, body text not null);
"""


@dataclass(frozen=True)
class Note:
    """A note of the experimenter, with its time and the number of entries before it."""

    at: str
    entry: int
    text: str


def _way_to(folder: Path | None, beside: Path) -> dict[str, str]:
    """Return the protocol's folder as seen from the session's, if both lie in one folder of the disk."""
    if folder is None:
        return {}
    there, here = os.path.realpath(folder), os.path.realpath(beside)
    try:
        common = os.path.commonpath([there, here])
    except ValueError:  # another drive
        return {}
    return {} if os.path.dirname(common) == common else {"folder": Path(os.path.relpath(there, here)).as_posix()}


class SessionFile:
    """A session file that can be continued. `create` makes a new file and `open` opens an existing one; call `close` at
    the end.

    Reading changes nothing. The first write, or `hold` before it, keeps other programs from writing.
    """

    def __init__(self, path: Path, base: sqlite3.Connection) -> None:
        self.path, self._base, self._was = path, base, numbers_of(path)
        self._packer = ThreadPoolExecutor(1, "packing")
        self._begun: list[tuple[Excerpt, Future[Packed]]] = []
        self._waiting: list[tuple[str, Entry, list[Packed]]] = []
        """Writes that the disk has refused, with their times, to be written before anything else."""
        self._felt = 0
        """The number of the entry of a trial that was felt, until its answer replaces it; 0 if there is none."""
        self._felt_written: Future[None] | None = None
        self._unpacked: TemporaryDirectory[str] | None = None
        self._held: BaseFileLock | None = None

    @staticmethod
    def create(path: str | Path, protocol: Protocol, participant: str, folder: Path | None = None) -> "SessionFile":
        """Return a new session file, which is held, for a checked protocol, whose patches are in `folder`.

        The file may be shared, so no folder of this computer is kept. Raises `BadFile` if the file exists, and
        `BadValue` if a package that a method needs is not installed.
        """
        path = Path(path)
        require_id(participant)
        for stage in protocol.order_of(participant):  # raises now for an id without a number that orders need
            if stage.method is not None:
                method_of(protocol, stage, participant)  # raises now, not at the first trial, if a package is missing
        if os.path.exists(path):
            raise BadFile(f"{path} is there already; go on with it, or choose another name for the session")
        known = {
            **_way_to(folder, path.parent),
            "protocol": protocol.dumps().decode(),
            "participant": participant,
            "begun": time_of_day(),
        }
        try:
            with created(path, APPLICATION_ID, VERSION, _TABLES, known, is_new=True) as base:
                base.executemany("insert into patch values (?, ?)", _patches(protocol, folder).items())
        except sqlite3.Error as error:
            raise BadFile(f"{path} cannot be written: {error}") from None
        file = SessionFile.open(path)
        try:
            file.hold()  # or else another window has found it already, and goes on with it
        except BadFile:
            file.close()
            raise
        return file

    @staticmethod
    def open(path: str | Path) -> "SessionFile":
        """Open an existing file, also after its writer was killed; raise `BadFile` if it is not a session."""
        path = Path(path)
        if not path.is_file():
            raise BadFile(f"{path} cannot be read: {no_file(path)}")
        with ExitStack() as unless_opened:
            try:
                base = opened(path, isolation_level=None, check_same_thread=False)
                unless_opened.callback(base.close)
                version_of(base, path, APPLICATION_ID, VERSION, "a session of a study")
            except (sqlite3.Error, UnicodeDecodeError) as error:
                require_whole(path, APPLICATION_ID)
                raise BadFile(f"{path} is not a session of a study: {in_one_line(error)}") from None
            unless_opened.pop_all()
        return SessionFile(path, base)

    # --- reading ---

    @property
    def about(self) -> dict[str, str]:
        """Metadata of the session: `protocol`, `participant`, `begun`, `software` and others."""
        with self._readable("about"):
            known = dict(self._base.execute("select key, value from about order by key"))
        missing = [key for key in ("protocol", "participant") if not isinstance(known.get(key), str)]
        if missing:
            raise BadFile(f"{self.path} is not a whole session: it does not say its {', '.join(missing)}")
        return known

    @property
    def participant(self) -> str:
        """The participant's id."""
        return self.about["participant"]

    @property
    def counts_as(self) -> str:
        """The id that its trials have in tables: the participant's, or the one that it was corrected to."""
        return self.about.get("corrected_id", self.participant)

    @property
    def label(self) -> str:
        """The id in tables and, where the file has another name, that: P7 (P1.session)."""
        return self.counts_as if self.counts_as == self.path.stem else f"{self.counts_as} ({self.path.name})"

    @property
    def left_out(self) -> str:
        """Why the experimenter has left the session out of the analysis; "" if it counts."""
        return self.about.get("left_out", "")

    @property
    def folder(self) -> Path:
        """The folder of the protocol's files when the session was begun; where that is gone, the session's own."""
        begun = Path(os.path.realpath(self.path.parent / self.about.get("folder", "")))
        return begun if begun.is_dir() else self.path.parent

    def patches(self) -> dict[str, bytes]:
        """Return the protocol's patches, and its own language, as they were at the start of the session, by name."""
        with self._readable("patch"):
            rows = self._base.execute("select name, body from patch order by name")
            return {name: bytes(memoryview(body)) for name, body in rows}

    def stored_protocol(self) -> Protocol:
        """Return the protocol at the start of the session, for the analysis; its patches are not checked."""
        return Protocol.unchecked(self.about["protocol"], f"{self.path}, protocol")

    def entries(self) -> list[Entry]:
        """Return all answered pages, in order."""
        self._await_felt()
        found = []
        with self._readable("entry"):
            for number, body in self._base.execute("select number, body from entry order by number"):
                try:
                    found.append(msgspec.json.decode(body, type=Entry))
                except (msgspec.DecodeError, RecursionError) as error:
                    raise BadFile(f"{self.path}: entry {number} cannot be read: {error}") from None
        return found

    def is_of(self, protocol: Protocol, folder: Path | None) -> bool:
        """Return whether the session was begun with this protocol, and with the patches that are in `folder`."""
        return self._has_text_of(protocol) and self._has_patches_of(folder)

    def as_begun(self, beside: Path | None = None) -> tuple[Protocol, Path | None]:
        """Return the protocol that the session was begun with, and the folder of its patches.

        The folder is `beside`, by default the one where the session was begun, if its patches are unchanged. Otherwise
        it is a temporary one, until `close`, without the files of nodes that were beside them. Presets are those of
        this version.
        """
        folder = beside = beside or self.folder
        if not self._has_patches_of(beside):
            if self._unpacked is None:
                self._unpacked = TemporaryDirectory(prefix="underfoot-")
            root = beside.absolute()
            folder = self._unpacked.name / root.relative_to(root.anchor)  # so that ../ stays within
            language = self.stored_protocol().language
            for name, body in self._own_patches().items():
                path = path_beside(name, folder)
                make_folder(path.parent)
                there = path_beside(name, beside).absolute().parent  # its sound files are still there
                moved = body if name == language else text_with_files_kept(body, name, installed_nodes(), there, None)
                write_file(path, moved)
        source = f"{self.path}, protocol"
        protocol = Protocol.loads(self.about["protocol"], source, folder, of_session=True)
        if folder != beside:
            copy_files_of_settings(protocol.stimuli, beside, folder)
        return protocol, folder

    def study(self, protocol: Protocol) -> Study:
        """Return the study in its current state; raise `BadFile` if the session belongs to another protocol."""
        if not self._has_text_of(protocol):
            raise self.begun_otherwise()
        return Study(protocol, self.participant, self.entries())

    def begun_otherwise(self) -> BadFile:
        """Return the error of continuing the session with another protocol."""
        return BadFile(
            f"{self.path} was begun with another protocol, or an earlier form of it; go on with that one "
            f"(underfoot experiment {self.path}), or begin a new session"
        )

    def _has_text_of(self, protocol: Protocol) -> bool:
        return protocol.dumps().decode() == self.about["protocol"]

    def _own_patches(self) -> dict[str, bytes]:
        """Return the patches that are no presets."""
        presets = preset_files.patches()
        return {name: body for name, body in self.patches().items() if name not in presets}

    def _has_patches_of(self, folder: Path | None) -> bool:
        """Return whether the patches that are no presets are unchanged in `folder`."""
        for name, body in self._own_patches().items():
            path = path_beside(name, folder or Path())
            if not path.is_file() or path.read_bytes() != body:
                return False
        return True

    def notes(self) -> list[Note]:
        """Return the experimenter's notes, in order."""
        with self._readable("note"):
            return [Note(*row) for row in self._base.execute("select at, entry, body from note order by id")]

    def excerpts(self, number: int) -> list[Excerpt]:
        """Return the excerpts of entry `number`, which counts from 1."""
        found = []
        with self._readable("stretch"):
            rows = self._base.execute(
                "select part, kind, first, rate_hz, columns, scale, shape, data from stretch where entry = ? "
                "order by part, kind",
                (number,),
            )
            found += [unpacked(row) for row in rows]
        return found

    # --- writing ---

    def hold(self) -> None:
        """Let nobody else go on with the session until `close`; raise `BadFile` if somebody does, or it is read-only.

        Two writers would store each their own answers to the same pages, of which no study can go on.
        """
        if self._held is not None:
            return
        from filelock import FileLock, Timeout  # 50 ms, and not needed to read

        try:
            self._base.execute("pragma journal_mode = wal")
            self._base.execute("pragma wal_autocheckpoint = 0")  # `add` runs checkpoints in a thread
            self._base.execute("pragma synchronous = full")  # answers survive a power cut
            lock = FileLock(f"{os.path.realpath(self.path)}-lock", 0, thread_local=False)  # a link is the same session
            lock.acquire()
        except Timeout:
            raise BadFile(f"{self.path} is gone on with in another window or terminal; end it there first") from None
        except (sqlite3.Error, OSError) as error:
            raise BadFile(f"{self.path} cannot be written: {in_one_line(error)}") from None
        self._held = lock

    def begin_packing(self, excerpts: Iterable[Excerpt]) -> None:
        """Begin to compress excerpts in a thread, before `add` needs them.

        Ten seconds of four tiles take half a second, during which the participant answers.
        """
        self._begun += [(excerpt, self._packer.submit(packed, excerpt)) for excerpt in excerpts]

    def add(self, entry: Entry, excerpts: Iterable[Excerpt] = ()) -> int:
        """Store an entry with its excerpts durably, and return its number, from 1.

        If the disk refuses the write, raises `BadFile` and keeps the entry; the next `add`, or `write_waiting`, writes
        it.
        """
        rows = [self._packed_one(excerpt) for excerpt in excerpts]
        self._begun = []
        self._waiting.append((time_of_day(), entry, rows))
        self.write_waiting()
        return self._last

    def write_waiting(self) -> None:
        """Write the entries that the disk has refused, in order; raise `BadFile` if it still refuses them."""
        self._await_felt()
        while self._waiting:
            at, entry, rows = self._waiting[0]
            with self._transaction():
                number = self._put(at, entry)
                self._base.executemany(
                    "insert into stretch values (?, ?, ?, ?, ?, ?, ?, ?, ?)",
                    [(number, *row) for row in rows],
                )
            self._felt = 0
            del self._waiting[0]
            self._packer.submit(_fold, self.path)

    def keep_felt(self, entry: Entry) -> None:
        """Store a trial that is being felt, as `Study.unanswered` has it, until `add` replaces it by what came of it.

        So a session that is killed before the answer has it, and says so when it goes on. A thread writes it: what is
        felt, and the answer, are timed meanwhile, and a slow disk takes half a second. The answer, which the disk then
        refuses as well, tells if it could not be written.
        """
        self._await_felt()
        if not self._waiting:  # what the disk has refused comes first
            self._felt_written = self._packer.submit(self._write_felt, time_of_day(), entry)

    def _write_felt(self, at: str, entry: Entry) -> None:
        with self._transaction():
            number = self._put(at, entry)
        self._felt = number

    def _await_felt(self) -> None:
        """Wait for what a thread writes."""
        if self._felt_written is not None:
            with suppress(BadFile):
                self._felt_written.result()
            self._felt_written = None

    @property
    def has_felt(self) -> bool:
        """Whether a trial was felt, and neither answered nor spoiled since."""
        self._await_felt()
        return self._felt > 0 and not self._waiting

    def forget_felt(self) -> None:
        """Remove the entry of a trial that was felt, which comes once more after one that is repeated before it."""
        if self.has_felt:
            with self._transaction():
                self._base.execute("delete from entry where number = ?", (self._felt,))
            self._felt = 0

    def _put(self, at: str, entry: Entry) -> int:
        """Write an entry behind the last one, or in place of that of a trial that was felt; return its number."""
        number = self._felt or self._last + 1
        row = (number, at, msgspec.json.encode(entry).decode())
        self._base.execute("insert or replace into entry values (?, ?, ?)", row)
        return number

    @property
    def _last(self) -> int:
        """The number of the last entry that stays."""
        (last,) = self._base.execute("select coalesce(max(number), 0) from entry").fetchone()
        return int(last) - (self._felt > 0)

    def _packed_one(self, excerpt: Excerpt) -> Packed:
        begun = next((future for one, future in self._begun if one is excerpt), None)
        return begun.result() if begun is not None else packed(excerpt)

    def replace_last(self, entry: Entry) -> None:
        """Replace the last entry by the same one, spoiled afterwards, and note it; its excerpts are kept."""
        self.write_waiting()
        with self._transaction():
            row = (msgspec.json.encode(entry).decode(),)
            self._base.execute("update entry set body = ? where number = (select max(number) from entry)", row)
            self._put_note(f"answer of {entry.stage} taken back: {entry.spoiled}")

    def leave_out(self, why: str) -> None:
        """Leave the session out of the analysis for a reason, or take it in again for none; a note keeps when."""
        why = " ".join(why.split())
        text = f"left out of the analysis: {why}" if why else "taken into the analysis again"
        self.add_note(text, {"left_out": why})

    def correct_id(self, id: str) -> None:
        """Let its trials have another id in tables, as where it was begun with a wrong one; a note keeps when.

        `participant`, by which its orders were drawn, stays.
        """
        require_id(id)
        self.add_note(f"id corrected to {id}; begun as {self.participant}", {"corrected_id": id})

    def set_up(self, now: Mapping[str, str]) -> None:
        """Keep in `about` what the session is made with from now on, such as its target; a note has what changed."""
        known = self.about
        before = {key: known[key] for key, text in now.items() if known.get(key, text) != text}
        changed = "; ".join(f"{key} {now[key] or 'none'} (before: {was or 'none'})" for key, was in before.items())
        self._keep([f"went on with another set-up: {changed}"] if changed else [], now)

    def add_note(self, text: str, about: Mapping[str, str] = MappingProxyType({})) -> None:
        """Store a note of the experimenter, and with it what it changes of `about`."""
        self._keep([text], about)

    def _keep(self, notes: Iterable[str], about: Mapping[str, str]) -> None:
        self._await_felt()
        with self._transaction():
            for text in notes:
                self._put_note(text)
            self._base.executemany("insert or replace into about values (?, ?)", about.items())

    def _put_note(self, text: str) -> None:
        row = (time_of_day(), self._last, text)
        self._base.execute("insert into note (at, entry, body) values (?, ?, ?)", row)

    def close(self) -> None:
        """Write the log (WAL) back to the file, and close it."""
        self._await_felt()
        self._packer.shutdown(cancel_futures=True)
        if self._held is not None:
            with suppress(sqlite3.Error):  # another process reads the file: the log stays beside it
                self._base.execute("pragma journal_mode = delete")
        self._base.close()
        if self._held is not None:
            with suppress(OSError):  # Windows removes it with the next line
                os.unlink(self._held.lock_file)
            self._held.release()
            self._held = None  # the next one's is not to be removed
        if self._unpacked is not None:
            self._unpacked.cleanup()

    @contextmanager
    def _readable(self, table: str) -> Iterator[None]:
        """Raise an error of one line if a table is damaged."""
        damage = ValueError, TypeError, KeyError, OverflowError, RecursionError
        try:
            yield
        except (sqlite3.Error, zlib.error, msgspec.DecodeError, *damage) as error:
            raise BadFile(f"{self.path}: table {table} cannot be read: {in_one_line(error)}") from None

    @contextmanager
    def _transaction(self) -> Iterator[None]:
        """Store what is written in a block completely or not at all; raise `BadFile` if the disk refuses it."""
        self.hold()
        if is_gone(self.path, self._was):  # what is open would be written, and be lost or lie in the trash
            raise BadFile(f"{self.path} is not there any more, or is another file; put it back where it was, and go on")
        try:
            self._base.execute("begin immediate")
            with self._base:  # which commits, or takes all back unless a full disk has done that
                yield
        except sqlite3.Error as error:
            raise BadFile(f"{self.path} cannot be written: {error}") from None


def _fold(path: Path) -> None:
    """Write the log (WAL) back to the file, unless another process reads it; the answers are safe in either case."""
    there = f"{uri_of(path.absolute())}?mode=rw"  # one that was moved is not made anew
    with suppress(sqlite3.Error), closing(sqlite3.connect(there, uri=True)) as base:
        base.execute("pragma wal_checkpoint(passive)")


def _patches(protocol: Protocol, folder: Path | None) -> dict[str, bytes]:
    names = {stimulus.patch for stimulus in protocol.stimuli.values() if stimulus.patch}
    paths = {name: patch_path(name, folder) for name in sorted(names)}
    if is_own(protocol.language):
        paths[protocol.language] = path_of_language(protocol.language, folder)
    return {name: path.read_bytes() for name, path in paths.items()}


def time_of_day() -> str:
    """Return the time of day in the format of the file."""
    return datetime.now().astimezone().isoformat(timespec="milliseconds")
