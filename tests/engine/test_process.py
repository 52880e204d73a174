"""The engine's process from within: what its callback does, one block after the other."""

import ctypes
import multiprocessing
import os
import subprocess
import sys
import threading
import tracemalloc
from contextlib import contextmanager
from types import SimpleNamespace

import numpy as np
import pytest
from engine_blocks import blocks, engine_of
from made_patches import hum, stepped_bank

from underfoot.clock import FADE
from underfoot.devices import outputs
from underfoot.engine import further_streams, pacing
from underfoot.engine.commands import Level, Panic, Play, Swap
from underfoot.engine.reports import CommandApplied, Notice
from underfoot.engine.rings import Reader
from underfoot.engine.safety import PANIC
from underfoot.engine.status import Field
from underfoot.errors import DeviceError


def test_ten_thousand_callbacks_allocate_nothing():
    with engine_of(stepped_bank(), ("modal-bank.out",)) as (engine, *_):
        blocks(engine, 500)
        engine.loop.applied.clear()
        tracemalloc.start()
        try:
            for _ in range(100):
                engine.pacer.fill()
            before, _ = tracemalloc.get_traced_memory()
            tracemalloc.reset_peak()
            for _ in range(10_000):
                engine.pacer.fill()
            after, peak = tracemalloc.get_traced_memory()
        finally:
            tracemalloc.stop()
    assert after - before < 64  # a counter that became a longer number
    assert peak - before < 2048  # what all tiles play in one block


def test_a_callback_writes_what_it_played_read_and_looked_at():
    with engine_of(hum(), ("tone.out",)) as (engine, _, memory):
        readers = [Reader(ring, start=0) for ring in (memory.vibration, memory.force, memory.scope)]
        blocks(engine, 100)
        (_, played), (_, forces), (_, seen) = (reader.read() for reader in readers)
        assert played.shape == seen.shape == (12_800, 4)
        np.testing.assert_array_equal(forces[:, 0], np.arange(0, 12_800, 48))
        assert (forces[:, 1] <= forces[:, 0]).all()
        assert played[1_000:].any(axis=0).all()
        assert seen.any(axis=0).all()
        assert memory.status.health().frame == 12_800


def test_a_card_with_fewer_channels_than_tiles_plays_the_first_ones(monkeypatch):
    monkeypatch.setattr(outputs, "max_channels", lambda name: 2)
    with engine_of(hum(), sound="") as (engine, _, memory):
        reader = Reader(memory.vibration)
        blocks(engine, 100)
        _, played = reader.read()
        assert engine.loop.out.shape[1] == 2
        assert played.any(axis=0).tolist() == [True, True, False, False]


class QuietCard:
    """A card's stream that asks for no block."""

    latency_s = stamped_output_latency_s = stamped_input_latency_s = 0.0
    underruns, finished = 0, False

    def start(self):
        pass

    abort = close = start


def clock_of(engine, monkeypatch, end_s):
    """Let time pass for the engine only where it waits, until `end_s`; return the time, and what lets it pass."""
    now_s = [0.0]

    def pass_time(seconds):
        now_s[0] += seconds
        if now_s[0] > end_s:
            engine.pacer.leave.set()

    monkeypatch.setattr(pacing.time, "perf_counter", lambda: now_s[0])
    monkeypatch.setattr(pacing.time, "sleep", pass_time)
    return now_s, pass_time


@pytest.mark.parametrize(("block_s", "late"), [(0.0, 0), (0.0032, 28)])
def test_a_card_that_is_found_costs_no_time_of_the_session(monkeypatch, block_s, late):
    """No block waits until PortAudio has made its list, which takes as long as its slowest server, and what opening the
    card takes is caught up: the session's clock lost both. Blocks that take longer than they last are late also then.
    A list that does not come is told: nothing plays meanwhile. The card counts as missing until it plays: otherwise it
    was looked for every 2 s again, after each list.
    """
    with engine_of(hum(), sound="no such card") as (engine, _, memory):
        run, went_on, waited = engine.runner.run, threading.Event(), []
        now_s, pass_time = clock_of(engine, monkeypatch, 9.0)
        there, missing = [{"no such card": "no such card"}], set()

        def run_block():
            run()
            missing.add(memory.status.get(Field.MISSING))
            pass_time(block_s)
            if now_s[0] > 2.0 and there:
                engine.pacer.there = there.pop()
            if now_s[0] > 8.0:
                went_on.set()

        def refuse(*_):
            pass_time(0.3)
            raise DeviceError("not there")

        monkeypatch.setattr(engine.runner, "run", run_block)
        monkeypatch.setattr(pacing, "list_anew", lambda: waited.append(went_on.wait(60.0)))
        engine.pacer.open()
        monkeypatch.setattr(pacing, "Stream", refuse)
        engine.pacer.run()
        for lister in (one for one in threading.enumerate() if one.name == "cards"):
            lister.join(60.0)  # on a busy machine it hears last that the session went on
        monkeypatch.undo()
        assert (waited, missing) == ([True], {1.0})
        hangs, answers = engine.listener.notices
        assert hangs.text == hangs.silence == "the sound card and its server do not answer; nothing plays until they do"
        assert answers.text == "the sound card and its server answer again"
        assert answers.silence == "sound device 'no such card' is not there"
        assert memory.status.get(Field.XRUNS) == pytest.approx(late, abs=1 if late else 0)
        assert late or abs(engine.loop.frame / 48_000 - 9.0) < 0.1


def test_why_a_card_that_has_come_does_not_play_is_said_once(monkeypatch):
    """One with too few channels, or taken by another program: it was tried for ever without a word."""
    with engine_of(hum(), sound="later") as (engine, *_):
        refusals = ["too few channels", "too few channels", "not there", "not there"]

        def refuse(*_):
            raise DeviceError(refusals.pop())

        def run_block():
            engine.pacer.there = {"later": "later"}
            if not refusals:
                engine.pacer.leave.set()

        clock_of(engine, monkeypatch, np.inf)
        monkeypatch.setattr(pacing, "Stream", refuse)
        monkeypatch.setattr(pacing, "list_anew", lambda: None)
        monkeypatch.setattr(pacing, "listed_name", lambda name: name)
        monkeypatch.setattr(engine.runner, "run", run_block)
        assert engine.pacer.open() == "not there"
        engine.pacer.run()
        monkeypatch.undo()
        assert list(engine.listener.notices) == [Notice("too few channels")]


def test_a_card_pauses_in_a_ramp_for_one_that_has_come(monkeypatch):
    """PortAudio makes its list anew only where nothing plays. It is made again for one that was away just then.
    Both are told, the return once all are open: a third card was said to be silent, for which a study stopped.
    """
    played, plays, lists = [], {}, []
    pause = "a sound card has come; the others pause until the cards are listed"

    class Card(QuietCard):
        def __init__(self, name, channels, rate, block, fill, *_):
            if name == "late" and len(lists) < 2:
                raise DeviceError("not there")
            self.name, self.fill, self.samples = name, fill, ctypes.c_float * (block * channels)

        def start(self):
            plays[self.name] = self

        def abort(self):
            del plays[self.name]

    class Leave(threading.Event):
        def wait(self, timeout):
            for _ in range(20):
                played.append(np.array(plays["left"].samples.from_address(plays["left"].fill())))
            if len(played) in (200, 400):
                engine.pacer.there = {"late": "late"}
                plays["left"].underruns = 2
            if len(played) > 600:
                self.set()

    sine = hum(tone={"frequency": 100.0, "harmonics": (1.0,), "amplitude": 4.0})
    with engine_of(sine, sound="left=2; late=1; right=1") as (engine, _, memory):
        clock_of(engine, monkeypatch, np.inf)
        for module in (pacing, further_streams):
            monkeypatch.setattr(module, "Stream", Card)
        monkeypatch.setattr(pacing, "list_anew", lambda: lists.append("late"))
        monkeypatch.setattr(pacing, "_LISTING_S", np.inf)  # simulated time passes until its thread has run
        engine.pacer.leave = Leave()
        engine.pacer.open()
        engine.pacer.run()
        monkeypatch.undo()
        assert memory.status.get(Field.XRUNS) == 4.0, "of the two streams that have ended"
    assert plays.keys() == {"left", "late", "right"}
    told = [notice.silence for notice in engine.listener.notices]
    assert told == [pause, "sound device 'late' is not there; silent: t3", pause, ""]
    left = np.concatenate(played)[::2]
    loudest = np.abs(left).max()
    assert loudest > 0.1
    assert not left[220 * 128 - 512 : 220 * 128].any()
    assert np.abs(np.diff(left)).max() < loudest * (2.0 * np.pi * 100.0 / 48_000 + 1.1 / FADE)


def test_output_latency_is_that_of_the_clock_or_of_the_round_trip_and_xruns_outlast_their_stream(monkeypatch):
    """Each case: a measured round trip, what the card's clock says of both directions, what was asked for; in ms."""
    cases = [
        ((0.0, 0.0, 0.0, 20.0), 20.0),
        ((0.0, 12.0, 0.0, 20.0), 12.0),
        ((30.0, 0.0, 0.0, 20.0), 15.0),
        ((30.0, 12.0, 8.0, 20.0), 17.0),  # each direction has half of the 10 ms that the clock does not know of
        ((30.0, 40.0, 0.0, 20.0), 30.0),
    ]
    cards, found = [], []

    class Card(QuietCard):
        def __init__(self, *_):
            cards.append(self)

    class Leave(threading.Event):
        def wait(self, timeout):
            card, status = cards[-1], memory.status
            found.append(1e3 * status.get(Field.STREAM_LATENCY_S))
            if len(found) <= len(cases):
                trip_s, *latencies_s = (1e-3 * ms for ms in cases[len(found) - 1][0])
                status.put(Field.ROUND_TRIP_S, trip_s)
                card.stamped_output_latency_s, card.stamped_input_latency_s, card.latency_s = latencies_s
            elif len(cards) == 1:
                card.underruns, card.finished = 3, True
            else:
                engine.pacer.fill()
                self.set()

    with engine_of(hum(), sound="card=4") as (engine, _, memory):
        monkeypatch.setattr(pacing, "Stream", Card)
        engine.pacer.leave = Leave()
        engine.pacer.open()
        engine.pacer.run()
        monkeypatch.undo()
        assert found[1 : 1 + len(cases)] == pytest.approx([latency_ms for _, latency_ms in cases])
        assert memory.status.get(Field.XRUNS) == 3.0


def test_output_ramps_up_after_the_engine_stood_still(monkeypatch):
    """The card's buffer had run out, and shakers were struck by a step."""
    with engine_of(hum()) as (engine, _, memory):
        now_s, _ = clock_of(engine, monkeypatch, np.inf)
        reader, out = Reader(memory.vibration), []
        for stood_s in (*[0.0] * 100, 0.5, 3.0, *[0.0] * 4):
            now_s[0] += stood_s
            engine.pacer.fill()
            out.append(engine.loop.out.copy())
        monkeypatch.undo()
        _, computed = reader.read()
        ramp = np.append(np.ones(128), np.clip(np.arange(640) / (FADE - 1), 0.0, 1.0))
        assert computed[-640:].any(axis=0).all()
        np.testing.assert_allclose(np.concatenate(out[-6:]), computed[-768:] * ramp[:, None], atol=1e-6)


def test_a_standstill_is_told_of_a_card_and_of_the_clock(monkeypatch):
    """As of a sink that is suspended for 2 s, or of this process: nothing was said, and what was lost not known."""
    with engine_of(hum()) as (engine, _, _):
        now_s, _ = clock_of(engine, monkeypatch, 8.0)
        for stood_s in (0.0, 2.0, 0.0):
            now_s[0] += stood_s
            engine.pacer.fill()
        run, stands_s = engine.runner.run, [3.0]

        def run_block():
            run()
            now_s[0] += stands_s.pop() if stands_s and now_s[0] > 4.0 else 0.0

        engine.runner.run = run_block
        engine.pacer.run()
        engine.pacer.leave.clear()
        engine.pacer.fill()  # as of a card that has come: before it, the clock played
        engine.pacer.run()
        monkeypatch.undo()
        told = [notice.text[:9] for notice in engine.listener.notices]
    assert told == ["for 2.0 s", "for 3.0 s"]


THREADS = {"commands", "reports", "supervisor"}


@contextmanager
def listening(engine, ours, until):
    """The engine listens meanwhile."""
    engine.listener.start()
    yield
    ours.close()
    until(lambda: not THREADS & {thread.name for thread in threading.enumerate()}, "its threads end")


def take(ours, told):
    """Add what has come by now."""
    while ours.poll():
        told.append(ours.recv())
    return True


def applied_of(told):
    return [report for report in told if isinstance(report, CommandApplied)]


def test_a_panic_goes_before_whatever_waits(until):
    with engine_of(hum()) as (engine, ours, memory):
        blocks(engine, 200)
        reader = Reader(memory.vibration)
        engine.listener.take(Swap(stepped_bank().dumps()))
        engine.listener.take(Swap(hum().dumps()))  # waits until the fade of the first is over
        blocks(engine, 1)
        frame = engine.loop.frame
        memory.status.panic = True
        engine.listener.take(Play(True))  # was sent before, and comes late
        blocks(engine, 20)
        first, played = reader.read()
        assert played[frame - first - 10].any()
        assert not played[frame + PANIC - first :].any()
        assert engine.pacer.fill() == 0
        told = []
        with listening(engine, ours, until):
            until(lambda: take(ours, told) and Panic() in [report.command for report in applied_of(told)], "it is told")
        applied = applied_of(told)
        assert [report.frame for report in applied if report.command == Panic()] == [frame]
        assert Play(True) not in [report.command for report in applied if report.frame >= frame]


_NO_KERNEL_IS_LOADED_LATE = """
import sys
sys.path[:0] = {paths!r}
from engine_blocks import blocks, engine_of
from made_patches import *
from underfoot.kernels import Kernel
from underfoot.engine.commands import *

def loaded():
    modules = [m for name, m in sys.modules.items() if name.startswith("underfoot")]
    kernels = {{id(k): k for m in modules for k in vars(m).values() if isinstance(k, Kernel)}}
    called = [kernel for kernel in kernels.values() if "compiled" in vars(kernel)]
    return {{k.__module__ + "." + k.__name__: len(k.compiled.overloads) for k in called}}

with engine_of(hum()) as (engine, *_):
    for command in (None, Swap(rough_step().dumps()), Swap(stepped_bank().dumps(), ("modal-bank.out",))):
        if command is not None:
            engine.listener.take(command)  # builds, beside the callback
        before = loaded()
        blocks(engine, 40)
        ids = [id for id in engine.loop.program.node_ids if id in ("tone", "noise", "modal-bank")]
        number = {{"tone": "amplitude", "noise": "low", "modal-bank": "pitch"}}[ids[0]]
        for command in (Play(True), Set(ids[0], number, 1.5), Strike("", "t1"), PressTile("t1", 0.0, 0.0, 400.0),
                        Tare(), Walk(True), Level(-3.0), Pulse("t1"), Panic(), Play(False)):
            engine.listener.take(command)
            blocks(engine, 5)
        after = loaded()
        print({{name: count for name, count in after.items() if count != before.get(name)}})
"""


def test_no_command_loads_or_compiles_a_kernel_in_the_callback():
    """In a process of its own, because in this one the kernels may have been loaded before."""
    script = _NO_KERNEL_IS_LOADED_LATE.format(paths=[path for path in sys.path if path])
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stdout.split() == ["{}"] * 3


def test_commands_are_taken_while_nobody_reads_what_is_reported(until):
    """A supervisor that sends more than the connection holds would wait for the engine, and the engine for it."""
    with engine_of(hum()) as (engine, ours, _), listening(engine, ours, until):
        sender = threading.Thread(target=lambda: [ours.send(Level(-20.0 - k % 7)) for k in range(8_000)])
        sender.start()

        def run():
            blocks(engine, 1)
            return not sender.is_alive()

        until(run, "all are taken")
        told = []
        until(lambda: take(ours, told) and bool(applied_of(told)), "and what was done is told")


def test_when_the_supervisor_dies_the_engine_leaves_also_while_it_builds_a_program(monkeypatch, until):
    lifeline, theirs = os.pipe()
    monkeypatch.setattr(multiprocessing, "parent_process", lambda: SimpleNamespace(sentinel=lifeline))
    built, building = threading.Event(), threading.Event()
    with engine_of(hum()) as (engine, ours, _):
        blocks(engine, 100)
        monkeypatch.setattr(engine.listener, "take", lambda command: (building.set(), built.wait()))
        engine.listener.start()
        ours.send(Swap(stepped_bank().dumps()))
        until(building.is_set, "it begins")
        os.close(theirs)
        until(engine.pacer.leave.is_set, "it leaves")
        built.set()
        ours.close()
        until(lambda: not THREADS & {thread.name for thread in threading.enumerate()}, "its threads end")
    os.close(lifeline)
