"""Reading and atomic writing of files: written beside the old file, then moved into place."""

import errno
import os
import re
import secrets
import stat
import time
from collections.abc import Iterator
from contextlib import closing, contextmanager, suppress
from pathlib import Path, PurePath
from urllib.parse import quote

from platformdirs import user_cache_dir

from underfoot.errors import BadFile, require, shown
from underfoot.version import __version__

_LEFT_S = 3600.0
_PAUSES_S = (0.01, 0.02, 0.04, 0.08, 0.16)
OF_DEVICE = re.compile(r"(con|prn|aux|nul|com[0-9]|lpt[0-9])(\..*)?", re.IGNORECASE)
"""Names that Windows takes for devices, whatever their suffix."""
LARGEST = 64 << 20
"""Bytes of the largest document."""
_DEVICE = "it is a device, and no file"
_OF_DATABASE, _LEAST_DATABASE = b"SQLite format 3\0", 512
"""How a file of SQLite begins, and the bytes of its smallest page."""


def names_file(text: str) -> bool:
    """Return whether a word names a file: it has a suffix, or is there. Else it may be the name of a preset.

    >>> names_file("mine.json"), names_file("gravel")
    (True, False)
    """
    return bool(os.path.splitext(text)[1]) or os.path.exists(text)


def path_of(path: str | os.PathLike[str], name: str = "path") -> Path:
    """Return the path of a file given as text or as a path; `BadValue`, by this name, for anything else.

    >>> path_of("walk.csv").suffix
    '.csv'
    >>> path_of(3)
    Traceback (most recent call last):
    underfoot.errors.BadValue: path is 3; allowed: text or a Path
    """
    require(isinstance(path, str | os.PathLike), name, path, "text or a Path")
    try:
        is_name = b"\0" not in os.fsencode(path)
    except UnicodeEncodeError:
        is_name = False
    require(is_name, name, path, "a name that a file can have")
    return Path(path)


def stem_of(title: str, otherwise: str) -> str:
    """Return the name of a file, without its suffix, that is made of a title; `otherwise` if it has no plain letters.

    At most 80 letters: file systems refuse more than 255 bytes.

    >>> stem_of("Ice, thin!", "study"), stem_of("氷", "study"), len(stem_of("ice " * 100, "study"))
    ('ice-thin', 'study', 79)
    >>> stem_of("Aux", "preset")
    'aux-preset'
    """
    stem = re.sub(r"[^a-z0-9]+", "-", title.lower())[:80].strip("-") or otherwise
    return f"{stem}-{otherwise}" if OF_DEVICE.fullmatch(stem) else stem


def read_file(path: str | Path, largest: int = LARGEST) -> bytes:
    """Return the bytes of a document; `BadFile` as from `read_large_file`, and for more than `largest` bytes."""
    with _read(path):
        size = _size_of(path)
        if size > largest:
            raise BadFile(f"{path} has {size} bytes; allowed: at most {largest}")
        return path_of(path).read_bytes()


def read_large_file(path: str | Path) -> bytes:
    """Return the bytes of a table, a sound or a session, of any size.

    `BadFile` with the system's message if it cannot be read. A pipe or a device is not opened: it may have nothing to
    read for ever, or no end.
    """
    with _read(path):
        _size_of(path)
        return path_of(path).read_bytes()


def require_readable(path: str | Path) -> None:
    """Raise `BadFile` as `read_file` does, for a file that another library reads.

    >>> require_readable(".")
    Traceback (most recent call last):
    underfoot.errors.BadFile: . cannot be read: it is a folder
    """
    with _read(path):
        _size_of(path)
        path_of(path).open("rb").close()


def head_of(path: str | Path, count: int) -> bytes | None:
    """Return the first bytes of a file, by which its kind is told; None if it cannot be read, or is no file.

    >>> head_of(".", 15)
    """
    if os.path.isfile(path):  # a pipe would be waited for
        with suppress(OSError):
            if _is_database(path):
                return _OF_DATABASE[:count]
            with open(path, "rb") as file:
                return file.read(count)
    return None


def uri_of(path: PurePath) -> str:
    """Return the address of an absolute path, to which SQLite's options are added.

    A share of Windows, as which a drive of the network resolves, is no authority of it: SQLite refuses those.

    >>> from pathlib import PurePosixPath, PureWindowsPath
    >>> uri_of(PurePosixPath("/tmp/a?b.uf")), uri_of(PureWindowsPath("C:/a b.uf"))
    ('file:///tmp/a%3Fb.uf', 'file:///C:/a%20b.uf')
    >>> uri_of(PureWindowsPath("//server/share/a.uf"))
    'file:////server/share/a.uf'
    """
    text = path.as_posix()
    return f"file://{'' if text.startswith('/') else '/'}{quote(os.fsencode(text), '/:')}"


def _is_database(path: str | Path) -> bool:
    """Return whether SQLite takes a file for one of its own.

    Whoever else opens and closes one drops the locks of all connections that this process has to it, also of other
    threads, so that another program takes it for unused, and puts its log away (sqlite.org/howtocorrupt.html, 2.2).
    """
    import sqlite3  # here, as few who import this module need it

    if os.path.getsize(path) < _LEAST_DATABASE:  # SQLite would make one of an empty file
        return False
    with suppress(sqlite3.Error):
        where = f"{uri_of(Path(path).resolve())}?mode=ro&immutable=1"
        with closing(sqlite3.connect(where, uri=True)) as base:
            base.execute("pragma application_id").fetchone()
        return True
    return False


def _size_of(path: str | Path) -> int:
    found = os.stat(path_of(path))
    if not stat.S_ISREG(found.st_mode):
        raise BadFile(f"{path} cannot be read: {no_file(path)}")
    return found.st_size


@contextmanager
def _read(path: str | Path) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        raise BadFile(f"{path} cannot be read: {reason_of(error)}") from None


def write_file(path: str | Path, *data: bytes | memoryview) -> None:
    """Write the parts of `data` to a file beside `path` and move it into place; the old file stays until then.

    `BadFile` with the system's message if it cannot be written.
    """
    with replaced(path) as part, written(path), part.open("wb") as file:
        for one in data:
            file.write(one)


def remove_file(path: str | Path) -> None:
    """Remove a file that nobody needs; one on a drive that is away, or that another program has, stays.

    >>> remove_file("no folder/a.txt")
    """
    with suppress(OSError):
        path_of(path).unlink()


@contextmanager
def replaced(path: str | Path, *, is_new: bool = False) -> Iterator[Path]:
    """Yield an empty file beside `path` to be written, and let it replace `path` at the end of the block; what `is_new`
    replaces nothing, and is refused.

    If the block raises, the file is removed and `path` is unchanged. Behind a link, the file that it names is replaced.
    Permissions are those of the old file, or of any new one. Raise `BadFile` if the file cannot be created or moved;
    exceptions of the block itself pass through (see `written`). What a killed process left of this file is removed.

    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     with replaced(Path(folder, "a.txt")) as part:
    ...         _ = part.write_text("whole")
    ...     Path(folder, "a.txt").read_text()
    'whole'
    """
    require_replaceable(path)
    target = Path(os.path.realpath(path_of(path)))
    part = target.with_name(f".{target.name}.{secrets.token_hex(4)}")
    with written(path):
        part.touch(exist_ok=False)
    try:
        _remove_left(target, part.stat().st_mtime)
        yield part
        with written(path):
            with part.open("r+b") as file:
                os.fsync(file.fileno())
            if target.exists():
                part.chmod(stat.S_IMODE(target.stat().st_mode))
            (put_where_none_is if is_new else _put_in_place)(part, target)
    finally:
        part.unlink(missing_ok=True)


def put_where_none_is(path: Path, target: Path) -> None:
    """Rename a file; raise `FileExistsError` if there is one of the new name, also if it appears only now."""
    try:
        os.link(path, target)  # in contrast to a rename, this never replaces a file
    except FileExistsError:
        raise
    except OSError:  # a file system without links, such as a memory stick's
        if target.exists():
            raise FileExistsError(errno.EEXIST, os.strerror(errno.EEXIST)) from None
        path.rename(target)
    else:
        path.unlink()


def _put_in_place(part: Path, target: Path) -> None:
    """Let a file replace another one; Windows refuses for the moments in which a program reads that, as a backup."""
    for pause_s in _PAUSES_S:
        with suppress(PermissionError):
            part.replace(target)
            return
        time.sleep(pause_s)
    part.replace(target)


def _remove_left(target: Path, now_s: float) -> None:
    """Remove the parts of a file whose writers were killed: those that nothing was written to for an hour.

    `now_s` is by the clock of the disk, which may be another machine's.
    """
    of_it = re.compile(rf"\.{re.escape(target.name)}\.[0-9a-f]{{8}}")
    with suppress(OSError):  # somebody else's, or removed meanwhile
        for name in filter(of_it.fullmatch, os.listdir(target.parent)):
            part = target.with_name(name)
            if now_s - part.stat().st_mtime > _LEFT_S:
                part.unlink()


def no_file(path: str | Path) -> str:
    """Return in words why there is no file to read at `path`.

    >>> no_file("."), no_file("walk9.csv")
    ('it is a folder', 'no such file')
    """
    if os.path.isdir(path):
        return "it is a folder"
    return _DEVICE if os.path.exists(path) else "no such file"


def require_file_name(name: str) -> None:
    """Raise `BadFile` for an output that is named as a folder is: `Path` drops the mark, and a file would be written.

    >>> require_file_name("new/")
    Traceback (most recent call last):
    underfoot.errors.BadFile: new/ names a folder; allowed: the name of a file
    """
    if name.endswith((os.sep, os.altsep or os.sep)):
        raise BadFile(f"{name} names a folder; allowed: the name of a file")


def require_replaceable(path: str | Path) -> None:
    """Raise `BadFile` for what must not become a file: a folder, a device, or a file protected against writing."""
    require_file_name(str(path))
    if os.path.exists(path_of(path)):
        with written(path):
            if os.path.isdir(path):
                raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR))
            if not os.path.isfile(path):
                raise OSError(errno.EINVAL, _DEVICE)
            if not os.access(path, os.W_OK):
                raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))


@contextmanager
def written(path: str | Path) -> Iterator[None]:
    """Convert an operating-system error in a block that writes `path`, a file or folder, to `BadFile`; so, too, a text
    that is not UTF-8.

    >>> with written("report"):
    ...     raise PermissionError(13, "Permission denied")
    Traceback (most recent call last):
    underfoot.errors.BadFile: report cannot be written: permission denied
    """
    try:
        yield
    except OSError as error:
        reason = "no such folder" if isinstance(error, FileNotFoundError) else reason_of(error)
        raise BadFile(f"{path} cannot be written: {reason}") from None
    except UnicodeEncodeError as error:
        raise BadFile(f"{path} cannot be written: {shown(error.object)} is no text in UTF-8") from None


def make_folder(path: str | Path) -> Path:
    """Make a folder with its parents, if missing; `BadFile` if that fails."""
    with written(path):
        Path(path).mkdir(parents=True, exist_ok=True)
    return Path(path)


def is_within(path: str | Path, folder: str | Path) -> bool:
    """Return whether a file lies in or below a folder, also after following links.

    If it does not by its name, links are not followed: for a network share, that alone would contact another machine.

    >>> is_within("a/b.wav", "a"), is_within("a/../b.wav", "a"), is_within("/etc/passwd", "a")
    (True, False, False)
    """
    path, folder = Path(os.path.abspath(path)), Path(os.path.abspath(folder))
    try:
        return path.is_relative_to(folder) and path.resolve().is_relative_to(folder.resolve())
    except (OSError, ValueError, RuntimeError):
        return False


def reason_of(error: OSError) -> str:
    """Return the system's reason in words, and those of `no_file` where there is none."""
    known = {errno.ENOENT: "no such file", errno.EISDIR: "it is a folder"}
    return known.get(error.errno or 0) or (error.strerror or str(error)).lower()


def cache_folder() -> Path:
    """Return the cache folder of this version: `UNDERFOOT_CACHE`, or the user's cache folder.

    >>> cache_folder().name == __version__
    True
    """
    return Path(os.environ.get("UNDERFOOT_CACHE") or user_cache_dir("underfoot")) / __version__


def cache_refusal() -> str:
    """Return that compiled kernels cannot be kept, with what to do; "" if they can. The first one makes the folder."""
    folder = cache_folder()
    if os.access(folder, os.W_OK):
        return ""
    kept = f"kernels cannot be kept in {folder}, so each time they are compiled"
    return f"{kept}; name another folder in UNDERFOOT_CACHE"
