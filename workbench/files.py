"""Reading and writing whole files: beside and moved into place, so that the old one stays until the new is whole."""

import os
import tempfile
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
    path = Path(path)
    try:
        handle, beside = tempfile.mkstemp(prefix=f".{path.name}.", dir=path.parent)
        try:
            with os.fdopen(handle, "wb") as file:
                file.write(data)
                file.flush()
                os.fsync(file.fileno())
            Path(beside).chmod(0o644)
            Path(beside).replace(path)
        except BaseException:
            Path(beside).unlink(missing_ok=True)
            raise
    except OSError as error:
        raise BadFile(f"{path} cannot be written: {(error.strerror or str(error)).lower()}") from None
