"""What all tests share: nothing that a test starts outlives it. Fixtures of several files are in `helpers/`."""

import gc
import math
import multiprocessing
import os
import threading
from collections import Counter
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings

gc.disable()  # collected between tests, in the main thread: Qt crashes where another one deletes a widget


def pytest_collection_finish(session):
    gc.freeze()


pytest_plugins = ("polling", "null_sink", "command_line", "calibrated_tile", "own_nodes")

settings.register_profile("untimed", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("untimed")

_TESTS_PER_FULL_COLLECTION = 200
_BLOCKS = Path("/dev/shm")
_OURS = f"underfoot_{os.getpid()}_"


def _alive():
    blocks = [f"shared memory {path.name}" for path in _BLOCKS.glob(f"{_OURS}*")] if _BLOCKS.is_dir() else []
    threads = [f"thread {thread.name}" for thread in threading.enumerate()]
    return Counter([*blocks, *threads, *(f"process {child.name}" for child in multiprocessing.active_children())])


@pytest.fixture(scope="session", autouse=True)
def _nothing_stands_by():
    """Sessions start no second engine, and no compiler before one is asked for: each takes a second to load.

    Where an engine or a compiler dies, `Live.complete` starts both beforehand; after a death they start anyway.
    """
    from underfoot.engine import session

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(session, "STANDBY_AFTER_S", math.inf)
        yield


@pytest.fixture(autouse=True)
def _nothing_left_behind():
    """A process, thread or block of shared memory that a test leaves behind fails it."""
    before = _alive()
    yield
    gc.collect(2 if gc.get_count()[2] > _TESTS_PER_FULL_COLLECTION else 1)
    left = _alive() - before
    assert not left, f"left behind: {', '.join(left)}"
