"""Reading and writing whole files: beside and moved into place, so that the old one stays until the new is whole."""

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from underfoot.errors import BadFile


def read_file(path: str | Path) -> bytes:
    """The bytes of a file; `BadFile` with the system's word where it cannot be read."""
    try:
        return Path(path).read_bytes()
    except OSError as error:
        raise BadFile(f"{path} cannot be read: {(error.strerror or str(error)).lower()}") from None


def write_file(path: str | Path, data: bytes) -> None:
    """Write `data` beside `path` and move it into place: the old file stays until the new one is whole."""
    with replaced(path) as beside, bad_file(path), beside.open("wb") as file:
        file.write(data)
        file.flush()
        os.fsync(file.fileno())


@contextmanager
def replaced(path: str | Path) -> Iterator[Path]:
    """An empty file beside `path` to write to. It takes the place of `path` where the block ends well, and is removed
    where it does not. `BadFile` where no file can be made there.

    >>> with tempfile.TemporaryDirectory() as folder:
    ...     with replaced(Path(folder, "notes.txt")) as beside:
    ...         characters = beside.write_text("whole")
    ...     print([path.name for path in Path(folder).iterdir()])
    ['notes.txt']
    """
    path = Path(path)
    with bad_file(path):
        handle, name = tempfile.mkstemp(prefix=f".{path.name}.", dir=path.parent)
        os.close(handle)
    beside = Path(name)
    try:
        yield beside
        with bad_file(path):
            beside.chmod(0o644)
            beside.replace(path)
    except BaseException:
        beside.unlink(missing_ok=True)
        raise


@contextmanager
def bad_file(path: str | Path) -> Iterator[None]:
    """Turn an `OSError` of the block into a `BadFile` that names `path`."""
    try:
        yield
    except OSError as error:
        raise BadFile(f"{path} cannot be written: {(error.strerror or str(error)).lower()}") from None
