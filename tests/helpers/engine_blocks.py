"""The engine of a live session within this process, which runs only when its blocks are requested."""

import multiprocessing
from contextlib import contextmanager

from underfoot.engine.process import Engine
from underfoot.engine.requests import Setup
from underfoot.engine.session_memory import SessionMemory
from underfoot.engine.status import Field
from underfoot.engine.target import Target
from underfoot.floor.layout import default_floor

FLOOR = default_floor()


@contextmanager
def engine_of(patch, scopes=(), **target):
    """Yield an engine, the connection to it, and the memory that it writes."""
    ours, theirs = multiprocessing.Pipe()
    memory = SessionMemory.create(len(FLOOR.tiles), 48_000, 1000.0)
    engine = Engine(theirs, Setup(Target(FLOOR, **target), patch.dumps(), scopes, None, memory.names, 0))
    memory.status.put(Field.PLAYING, 1.0)
    engine.begin()
    try:
        yield engine, ours, memory
    finally:
        for each in (engine.memory, memory, ours, theirs):
            each.close()


def blocks(engine, count):
    """Run this many blocks."""
    for _ in range(count):
        engine.runner.run()
