"""What all tests share: nothing that a test starts outlives it. Fixtures of several files are in `helpers/`."""

import multiprocessing
import os
import threading
from collections import Counter
from multiprocessing import shared_memory
from pathlib import Path

import pytest

pytest_plugins = ("polling", "null_sink", "command_line", "calibrated_tile")

_BLOCKS = Path("/dev/shm")
_OURS = f"uf{os.getpid()}x"


@pytest.fixture(autouse=True, scope="session")
def _named_shared_memory():
    """Blocks of this process bear its number, so that those of others are not taken for ours."""
    number = iter(range(1 << 30))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(shared_memory, "_make_filename", lambda: f"/{_OURS}{next(number)}")
        yield


def _alive():
    blocks = [f"shared memory {path.name}" for path in _BLOCKS.glob(f"{_OURS}*")] if _BLOCKS.is_dir() else []
    threads = [f"thread {thread.name}" for thread in threading.enumerate()]
    return Counter([*blocks, *threads, *(f"process {child.name}" for child in multiprocessing.active_children())])


@pytest.fixture(autouse=True)
def _nothing_left_behind(_named_shared_memory):
    """A process, thread or block of shared memory that a test leaves behind fails it."""
    before = _alive()
    yield
    left = _alive() - before
    assert not left, f"left behind: {', '.join(left)}"
