"""The processes of a session, as the process that started them sees them."""

import os
import signal
import sys
from threading import Thread

import pytest

from underfoot.engine.child_process import ChildProcess


@pytest.mark.skipif(sys.platform == "win32", reason="there are no named pipes")
def test_whoever_sends_to_a_busy_process_does_not_wait_for_it(until, tmp_path):
    """The window stood still while the compiler compiled, from the fourth edit of a patch of 100 nodes on."""
    gate = tmp_path / "gate"
    os.mkfifo(gate)
    child = ChildProcess("busy", "busy_child", str(gate))
    sender = Thread(target=lambda: [child.send(message) for message in [bytes(100_000)] * 50 + [None]])
    sender.start()
    try:
        until(lambda: not sender.is_alive(), "all is sent", seconds=30.0)
        gate.write_bytes(b"go on")
        assert until(child.receive) == [50]
    finally:
        child.kill()
        sender.join()
        child.end(0.0)


def test_ctrl_c_does_not_reach_a_process_that_only_imports_yet(until, tmp_path, monkeypatch):
    """It wrote a traceback to the terminal in the first seconds of a session."""
    monkeypatch.setenv("UNDERFOOT_CACHE", str(tmp_path / "cache"))  # so that it is spawned, as everywhere but in tests
    gate = tmp_path / "gate"
    gate.write_bytes(b"go on")
    child = ChildProcess("busy", "busy_child", str(gate))

    def answer():  # the first of these reaches it before it is Python
        has_ended = not child.is_alive
        if not has_ended:
            os.kill(child.pid, signal.SIGINT)
        return child.receive() or has_ended

    try:
        child.send(None)
        assert until(answer) == [0]
    finally:
        child.end(60.0)
