"""Waiting for events in other threads and processes."""

import threading
import time

import pytest

EVERY_S = 1.0 / 60.0
"""How often is looked, unless something else is said: as often as the window polls its session."""


class Poll:
    """Polls until a condition holds; fails after `seconds` by the clock."""

    def __init__(self, seconds=120.0):
        self.seconds = seconds
        self._pause = threading.Event()

    def __call__(self, holds, what="", seconds=None, every=EVERY_S, seen=str):
        """Return what `holds()` returns once it is true; a failure tells `what`, and what `seen()` returns."""
        end = time.perf_counter() + (seconds or self.seconds)
        while True:
            value = holds()
            if value:
                return value
            if time.perf_counter() > end:
                raise AssertionError(f"in vain: {what or holds}{seen() and f'; {seen()}'}")
            self._pause.wait(every)


@pytest.fixture(scope="session")
def until():
    """Return `until(holds)`, which waits until a function returns a true value, and returns it."""
    return Poll()
