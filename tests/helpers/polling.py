"""Waiting for events in other threads and processes."""

import threading

import pytest


class Poll:
    """Polls until a condition holds; fails after `seconds`."""

    def __init__(self, seconds=60.0):
        self.seconds = seconds
        self._pause = threading.Event()

    def __call__(self, holds, what="", seconds=None, every=0.005):
        for _ in range(round((seconds or self.seconds) / every)):
            value = holds()
            if value:
                return value
            self._pause.wait(every)
        raise AssertionError(f"in vain: {what or holds}")


@pytest.fixture(scope="session")
def until():
    """Return `until(holds)`, which waits until a function returns a true value, and returns it."""
    return Poll()
