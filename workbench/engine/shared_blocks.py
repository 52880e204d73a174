"""Blocks of shared memory that bear the number of the process that made them: nobody's can be told, and removed."""

import os
import re
import secrets
from contextlib import suppress
from multiprocessing.shared_memory import SharedMemory
from pathlib import Path

_BLOCKS = Path("/dev/shm")
_NAME = re.compile(r"underfoot_(\d+)_[0-9a-f]+")


def new_block(size: int) -> SharedMemory:
    """A new block of this process, all zero."""
    memory = SharedMemory(f"underfoot_{os.getpid()}_{secrets.token_hex(4)}", create=True, size=size)
    assert memory.buf is not None
    memory.buf[:] = bytes(memory.size)
    return memory


def remove_orphans() -> None:
    """Remove the blocks of processes that are gone: a whole group that was killed at once leaves them.

    Where blocks are no files, as on other systems than Linux, the system itself does so.
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
        return True  # somebody else's
    return True
