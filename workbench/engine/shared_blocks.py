"""Shared memory blocks named after the process that made them, so that orphaned ones can be identified and removed."""

import os
import re
import secrets
from contextlib import suppress
from multiprocessing.shared_memory import SharedMemory
from pathlib import Path

_BLOCKS = Path("/dev/shm")
_NAME = re.compile(r"underfoot_(\d+)_[0-9a-f]+")


def new_block(size: int) -> SharedMemory:
    """Create a block of this process, all zero."""
    memory = SharedMemory(f"underfoot_{os.getpid()}_{secrets.token_hex(4)}", create=True, size=size)
    assert memory.buf is not None
    memory.buf[:] = bytes(memory.size)
    return memory


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
