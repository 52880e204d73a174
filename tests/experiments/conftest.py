"""A terminal in which answers are typed."""

import io
import queue
import sys
import threading
from contextlib import closing, redirect_stdout

import pytest


class Typist(io.StringIO):
    """What is printed; whoever reads it types each line once what it waits for is there."""

    def __init__(self, typed):
        super().__init__()
        self._left, self._typed = iter(typed), queue.SimpleQueue()
        self._waits, self._line = next(self._left)

    def write(self, text):
        if self._waits and self._waits in text:
            self._typed.put(f"{self._line}\n")
            self._waits, self._line = next(self._left, ("", ""))
        return super().write(text)

    def close(self):
        """Type no more."""
        self._typed.put("")
        for thread in threading.enumerate():
            if thread.name == "typed lines":  # which reads them
                thread.join()

    def typed(self):
        """The lines, as an open file gives them."""
        return iter(self._typed.get, "")


@pytest.fixture
def typing(underfoot, folder, monkeypatch):
    """Run a command that is answered by typing; without a process of its own, whose imports take a second or three."""

    def run(command, typed):
        with closing(Typist(typed)) as typist, redirect_stdout(typist):
            monkeypatch.setattr(sys, "stdin", typist.typed())
            assert underfoot(*command).status == 0
            return typist.getvalue().splitlines(keepends=True)

    return run
