"""The engine's process from within: what its callback does, one block after the other."""

import multiprocessing
import subprocess
import sys
import tracemalloc
from contextlib import contextmanager

import numpy as np
from made_patches import hum, stepped_bank

from underfoot.engine import process
from underfoot.engine.messages import Done, Panic, Play, Swap
from underfoot.engine.process import Engine, Setup
from underfoot.engine.rings import Reader, Ring
from underfoot.engine.safety import PANIC
from underfoot.engine.status import Status
from underfoot.engine.target import Target
from underfoot.floor.layout import default_floor

FLOOR = default_floor()


@contextmanager
def engine_of(patch, scopes=(), **target):
    """An engine that runs only when its blocks are asked for, with the rings that it writes."""
    ours, theirs = multiprocessing.Pipe()
    rings = Ring.create(4, 65_536), Ring.create(18, 4_096, "float64"), Ring.create(4, 65_536)
    status = Status.create()
    shared = [status.name, *(ring.where for ring in rings)]
    engine = Engine(theirs, Setup(Target(FLOOR, **target), patch.dumps(), scopes, "", *shared, 0, True, 0.0))
    try:
        yield engine, ours, rings, status
    finally:
        for each in (engine._vibration, engine._force, engine._scope, engine._status, *rings, status, ours, theirs):
            each.close()


def blocks(engine, count):
    for _ in range(count):
        engine._block()


def test_ten_thousand_callbacks_allocate_nothing():
    with engine_of(stepped_bank(), ("modal-bank.out",)) as (engine, *_):
        blocks(engine, 500)
        engine._loop.done.clear()
        tracemalloc.start()
        try:
            blocks(engine, 100)
            before, _ = tracemalloc.get_traced_memory()
            tracemalloc.reset_peak()
            blocks(engine, 10_000)
            after, peak = tracemalloc.get_traced_memory()
        finally:
            tracemalloc.stop()
    assert after - before < 64  # a counter that became a longer number
    assert peak - before < 2048  # what all tiles play in one block


def test_a_callback_writes_what_it_played_read_and_looked_at():
    with engine_of(hum(), ("tone.out",)) as (engine, _, rings, status):
        readers = [Reader(ring, start=0) for ring in rings]
        blocks(engine, 100)
        (_, played), (_, forces), (_, seen) = (reader.read() for reader in readers)
        assert played.shape == seen.shape == (12_800, 4)
        np.testing.assert_array_equal(forces[:, 0], np.arange(0, 12_800, 48))
        assert (forces[:, 1] <= forces[:, 0]).all()
        assert played[1_000:].any(axis=0).all()
        assert seen.any(axis=0).all()
        assert status.health().frame == 12_800


def test_a_card_with_fewer_channels_than_tiles_plays_the_first_ones(monkeypatch):
    monkeypatch.setattr(process, "max_channels", lambda name: 2)
    with engine_of(hum(), sound="") as (engine, _, rings, _):
        reader = Reader(rings[0])
        blocks(engine, 100)
        _, played = reader.read()
        assert engine._loop.out.shape[1] == 2
        assert played.any(axis=0).tolist() == [True, True, False, False]


def test_a_panic_goes_before_whatever_waits():
    with engine_of(hum()) as (engine, ours, rings, status):
        blocks(engine, 200)
        reader = Reader(rings[0])
        engine._take(Swap(stepped_bank().dumps()))
        engine._take(Swap(hum().dumps()))  # waits until the fade of the first is over
        blocks(engine, 1)
        frame = engine._loop.frame
        status.panic = True
        engine._take(Play(True))  # was sent before, and comes late
        blocks(engine, 20)
        first, played = reader.read()
        assert played[frame - first - 10].any()
        assert not played[frame + PANIC - first :].any()
        assert engine._fill() == 0
        engine._report()
        told = list(iter(lambda: ours.recv() if ours.poll() else None, None))
        assert [done.frame for done in told if isinstance(done, Done) and done.command == Panic()] == [frame]
        assert Play(True) not in [done.command for done in told if done.frame >= frame]


_NO_KERNEL_IS_LOADED_LATE = """
import sys
sys.path[:0] = {paths!r}
from made_patches import *
from numba.core.dispatcher import Dispatcher
from test_process import blocks, engine_of, hum
from underfoot.engine.messages import *

def loaded():
    modules = [m for name, m in sys.modules.items() if name.startswith("underfoot")]
    kernels = {{id(k): k for m in modules for k in vars(m).values() if isinstance(k, Dispatcher)}}
    return {{k.__module__ + "." + k.__name__: len(k.overloads) for k in kernels.values()}}

with engine_of(hum()) as (engine, *_):
    for command in (None, Swap(rough_step().dumps()), Swap(stepped_bank().dumps(), ("modal-bank.out",))):
        if command is not None:
            engine._take(command)  # builds, beside the callback
        before = loaded()
        blocks(engine, 40)
        ids = [id for id in engine._loop.program.node_ids if id in ("tone", "noise", "modal-bank")]
        number = {{"tone": "amplitude", "noise": "low", "modal-bank": "pitch"}}[ids[0]]
        for command in (Play(True), Set(ids[0], number, 1.5), Strike("", "t1"), Press("t1", 0.0, 0.0, 400.0), Tare(),
                        Walk(True), Level(-3.0), Pulse("t1"), Panic(), Play(False)):
            engine._take(command)
            blocks(engine, 5)
        after = loaded()
        print({{name: count for name, count in after.items() if count != before[name]}})
"""


def test_no_command_loads_or_compiles_a_kernel_in_the_callback():
    """In a process of its own, because in this one the kernels may have been loaded before."""
    script = _NO_KERNEL_IS_LOADED_LATE.format(paths=[path for path in sys.path if path])
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stdout.split() == ["{}"] * 3
