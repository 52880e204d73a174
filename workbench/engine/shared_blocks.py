"""Shared memory blocks named after the process that made them, so that orphaned ones can be identified and removed."""

import os
import re
import secrets
from contextlib import ExitStack, suppress
from multiprocessing.shared_memory import SharedMemory
from pathlib import Path

from underfoot.engine.child_process import run_tracker
from underfoot.errors import DeviceError

_BLOCKS = Path("/dev/shm")
_NAME = re.compile(r"underfoot_(\d+)_[0-9a-f]+")


def new_block(size: int) -> SharedMemory:
    """Create a block of this process, all zero; `DeviceError` if there is no room for it."""
    run_tracker()
    try:
        memory = SharedMemory(f"underfoot_{os.getpid()}_{secrets.token_hex(4)}", create=True, size=size)
        with ExitStack() as unless_reserved:
            unless_reserved.callback(memory.unlink)
            unless_reserved.callback(memory.close)
            _reserve(_BLOCKS / memory.name, size)
            unless_reserved.pop_all()
    except OSError as error:
        room = f"{str(error.strerror).lower()}; the session needs {size / 1e6:.1f} MB more"
        cure = "end other programs, or give a container more, as --shm-size=1g"
        raise DeviceError(f"no shared memory in {_BLOCKS}: {room} ({cure})") from None
    assert memory.buf is not None
    memory.buf[:] = bytes(memory.size)
    return memory


def _reserve(path: Path, size: int) -> None:
    """Take the room of a block now: where it is full, the first write would end this process with a bus error."""
    if path.exists() and hasattr(os, "posix_fallocate"):
        with path.open("r+b") as file:
            os.posix_fallocate(file.fileno(), 0, size)


def remove_orphans() -> None:
    """Remove the blocks of processes that are gone, as remain when a whole group is killed at once.

    Where blocks are not files, on systems other than Linux, the system does so itself.
    """
    for path in _BLOCKS.iterdir() if _BLOCKS.is_dir() else ():
        named = _NAME.fullmatch(path.name)
        if named and not _lives(int(named[1])):
            with suppress(OSError):
                path.unlink()


def _lives(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    except OSError:
        return True  # owned by another process
    return True
