"""What all tests share: nothing that a test starts outlives it. Fixtures of several files are in `helpers/`."""

import gc
import multiprocessing
import os
import threading
from collections import Counter
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings

gc.disable()  # what is collected stays: to look for rubbish in it takes a third of the collection's time


def pytest_collection_finish(session):
    gc.freeze()
    gc.enable()


pytest_plugins = ("polling", "null_sink", "command_line", "calibrated_tile", "own_nodes")

settings.register_profile("untimed", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("untimed")

_BLOCKS = Path("/dev/shm")
_OURS = f"underfoot_{os.getpid()}_"


def _alive():
    blocks = [f"shared memory {path.name}" for path in _BLOCKS.glob(f"{_OURS}*")] if _BLOCKS.is_dir() else []
    threads = [f"thread {thread.name}" for thread in threading.enumerate()]
    return Counter([*blocks, *threads, *(f"process {child.name}" for child in multiprocessing.active_children())])


@pytest.fixture(autouse=True)
def _nothing_left_behind():
    """A process, thread or block of shared memory that a test leaves behind fails it."""
    before = _alive()
    yield
    left = _alive() - before
    assert not left, f"left behind: {', '.join(left)}"
