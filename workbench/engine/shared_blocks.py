"""Shared memory blocks named after the process that made them, so that orphaned ones can be identified and removed."""

import errno
import os
import re
import secrets
from contextlib import suppress
from multiprocessing.shared_memory import SharedMemory
from pathlib import Path

from underfoot.engine.child_process import run_tracker
from underfoot.errors import DeviceError

_BLOCKS = Path("/dev/shm")
_NAME = re.compile(r"underfoot_(\d+)_[0-9a-f]+")


def new_block(size: int) -> SharedMemory:
    """Create a block of this process, all zero; `DeviceError` if there is no room for it."""
    run_tracker()
    path = _BLOCKS / f"underfoot_{os.getpid()}_{secrets.token_hex(4)}"
    try:
        is_made = _reserve(path, size)
        memory = SharedMemory(path.name, create=not is_made, size=size)
    except OSError as error:
        with suppress(OSError):
            path.unlink()
        room = f"{str(error.strerror).lower()}; the session needs {size / 1e6:.1f} MB more"
        cure = "end other programs, or give a container more, as --shm-size=1g"
        if error.errno in (errno.EROFS, errno.EACCES, errno.EPERM):
            cure = "it must be writable; give a container one of its own, as --tmpfs /dev/shm"
        raise DeviceError(f"no shared memory in {_BLOCKS}: {room} ({cure})") from None
    assert memory.buf is not None
    memory.buf[:] = bytes(memory.size)
    return memory


def _reserve(path: Path, size: int) -> bool:
    """Make the file of a block with all of its room, where blocks are files, and return whether they are.

    Where there is less room, the first write would end this process with a bus error, or, beyond the largest file that
    is allowed (`ulimit -f`), Python's process that removes shared memory would write a traceback.
    """
    if not (path.parent.is_dir() and hasattr(os, "posix_fallocate")):
        return False
    file = os.open(path, os.O_RDWR | os.O_CREAT | os.O_EXCL, 0o600)
    try:
        os.posix_fallocate(file, 0, size)
    finally:
        os.close(file)
    return True


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
