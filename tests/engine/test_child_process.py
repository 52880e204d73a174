"""The processes of a session, as the process that started them sees them."""

import os
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
