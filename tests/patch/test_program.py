"""A patch that runs: what is built, what sleeps, how controls move, and what a swap keeps."""

import math

import msgspec
import numpy as np
import pytest
from scipy.signal import lfilter

from underfoot.clock import FADE, RAMP, SPAN
from underfoot.devices.simulated_floor import SimulatedFloor
from underfoot.engine.commands import Play, Swap
from underfoot.engine.loop import Loop, LoopOptions
from underfoot.engine.safety import DC_HZ
from underfoot.errors import BadValue
from underfoot.floor.layout import default_floor
from underfoot.layouts import Layout
from underfoot.models.signals.events import emit
from underfoot.nodes import REGISTRY
from underfoot.parameters import Count, Number
from underfoot.patch.driver import SLEEP_INTERVAL
from underfoot.patch.node import Input, Output, node
from underfoot.patch.patch import Patch, PlacedNode
from underfoot.patch.program import Program

RATE = 48_000
TWO = ("left", "right")
LENGTH = 4800


@node("probe", "Tests")
class Probe:
    """Shows its controls: one that is read once a span, and one that is read once a frame."""

    whole = Count(1, 0, 9)
    slow = Number(0.0, -1000.0, 1000.0, wire="span")
    fast = Number(0.0, -1000.0, 1000.0, wire="audio")
    slow_now = Output()
    fast_now = Output()

    def run(slow, fast, slow_now, fast_now):
        for i in range(slow_now.size):
            slow_now[i] = slow
            fast_now[i] = fast[i]

    def tail():
        return math.inf


@node("total", "Tests")
class Total:
    """The sum of all frames so far; it rests 1000 frames after the last that was not zero."""

    signal = Input()
    out = Output()
    state = Layout("total", "sum", "left")

    def run(signal, state, out):
        for i in range(out.size):
            state.sum += signal[i]
            state.left = 1000.0 if signal[i] != 0.0 else max(state.left - 1.0, 0.0)
            out[i] = state.sum

    def tail(state):
        return state.left


@node("inverse", "Tests")
class Inverse:
    """What is missing to 500 N, and 1 over that: not finite at 500 N."""

    force = Input("N")
    missing = Output()
    out = Output("m/s^2")

    def run(force, missing, out):
        for i in range(out.size):
            missing[i] = 500.0 - force[i]
            out[i] = 1.0 / missing[i]


@node("beat", "Tests")
class Beat:
    """An event at each thousandth frame and a quarter, while the signal is not zero."""

    signal = Input()
    out = Output(kind="event")
    muted_by = ("signal",)

    def run(signal, frame, out):
        for i in range(signal.size):
            if (frame + i) % 1000 == 0 and signal[i] != 0.0:
                emit(out, frame + i + 0.25, 1.0)


TYPES = {**REGISTRY, "probe": Probe, "total": Total, "inverse": Inverse, "beat": Beat}


def patch_of(nodes, *wires, seed=0):
    """A patch of {id: type} or {id: (type, parameters)}, and of wires "from.port to.port"."""
    placed = []
    for id, what in nodes.items():
        type, parameters = (what, {}) if isinstance(what, str) else what
        placed.append(PlacedNode(id, type, parameters=parameters))
    return Patch(nodes=tuple(placed), wires=tuple(tuple(wire.split()) for wire in wires), seed=seed).check(TYPES)


def program_of(patch, *scopes, tiles=TWO, block=256, **more):
    return Program(patch, TYPES, tiles, rate=RATE, block=block, scopes=scopes, **more)


def run(program, length=LENGTH, force=None, blocks=None, begin=0, doing=None):
    """Run frames `begin` to `length` and give the output and every scope, [row, frame] from frame 0 on.

    `force` is [row, frame]; `doing` is {frame: what to do before it}, or to do instead of going on with the program.
    """
    rows = len(program.tiles)
    got = {name: np.zeros((rows, length)) for name in ("output", *program.scope_names)}
    at, turn, doing = begin, 0, dict(doing or {})
    blocks = blocks or [program.block]
    while at < length:
        if at in doing:
            program = doing.pop(at)(program) or program
        n = min(blocks[turn % len(blocks)], length - at, *(frame - at for frame in doing))
        if force is not None and "force_n" in program.engine_signals:
            program.engine_signals["force_n"][:, :n] = force[:, at : at + n]
        program.run(at, n)
        got["output"][:, at : at + n] = program.output[:, :n]
        for name in program.scope_names:
            got[name][:, at : at + n] = program.scope[name][:, :n]
        at, turn = at + n, turn + 1
    return got


def step_on(row, begin, end, newtons=1.0):
    """A constant force on one tile, exactly zero elsewhere."""
    force = np.zeros((2, LENGTH))
    force[row, begin:end] = newtons
    return force


PROBE = patch_of({"probe": "probe"})
SUM = patch_of({"tile": "tile-force", "total": "total"}, "tile.force total.signal")
TONE = patch_of({"tone": ("tone", {"amplitude": 4.0}), "out": "tile-output"}, "tone.out out.acceleration")
NOISE = patch_of({"noise": "noise", "out": "tile-output"}, "noise.out out.acceleration", seed=5)


# --- what is built ---


def test_what_no_output_needs_is_left_out_until_somebody_looks_at_it():
    patch = patch_of(
        {"noise": "noise", "out": "tile-output", "dead": "gain", "deader": "low-pass", "lonely": "tone"},
        "noise.out out.acceleration",
        "noise.out dead.signal",
        "dead.out deader.signal",
    )
    program = program_of(patch)
    assert program.node_ids == ("noise", "out")
    assert program.left_out == ("dead", "deader", "lonely")
    looked = program_of(patch, "dead.out")
    assert set(looked.node_ids) == {"noise", "out", "dead"}
    assert run(program)["output"].tobytes() == run(looked)["output"].tobytes()


def test_a_patch_without_an_output_is_silent_and_costs_nothing():
    program = program_of(patch_of({"noise": "noise"}))
    assert program.node_ids == ()
    assert not run(program)["output"].any()


@pytest.mark.parametrize("scope", ["nobody.out", "total", "total.signal", ""])
def test_a_scope_that_is_no_output_is_refused(scope):
    with pytest.raises(BadValue, match=r"scope is .*; allowed: tile\.force, total\.out"):
        program_of(SUM, scope)


def test_outputs_on_one_tile_add():
    both = patch_of(
        {"tone": ("tone", {"amplitude": 4.0}), "out": "tile-output", "more": ("tile-output", {"level": 0.5})},
        "tone.out out.acceleration",
        "tone.out more.acceleration",
    )
    np.testing.assert_allclose(run(program_of(both))["output"], 1.5 * run(program_of(TONE))["output"], rtol=1e-15)


# --- sleep ---


def test_a_row_wakes_at_the_very_frame_and_sleeps_when_nothing_remains():
    program = program_of(SUM, "total.out")
    force = step_on(1, 333, 433)
    out = run(program, force=force)["total.out"]
    expected = np.cumsum(force[1])
    asleep = next(f for f in range(433, LENGTH) if out[1, f] == 0.0)
    np.testing.assert_array_equal(out[1, :asleep], expected[:asleep])
    assert 1433 <= asleep <= 1433 + 2 * SLEEP_INTERVAL
    assert not out[1, asleep:].any()
    assert not out[0].any()
    assert program.awake() == {"tile": 0, "total": 0}


def test_what_slept_begins_from_rest():
    force = step_on(0, 100, 200) + step_on(0, 3000, 3010)
    out = run(program_of(SUM, "total.out"), force=force)["total.out"]
    assert out[0, 3009] == 10.0


def test_what_ran_and_what_slept_throughout_is_told():
    patch = patch_of(
        {"tile": "tile-force", "total": "total", "hand": "strike", "bank": "modal-bank", "spare": "gain"},
        "tile.force total.signal",
        "hand.out bank.strike",
    )
    program = program_of(patch, "total.out", "bank.out")
    run(program, force=step_on(0, 100, 200))
    assert program.report() == {"run": ["tile", "total"], "asleep": ["hand", "bank"], "left_out": ["spare"]}


def test_awake_counts_tiles():
    program = program_of(SUM, "total.out")
    run(program, 512, force=step_on(0, 100, LENGTH))
    assert program.awake() == {"tile": 1, "total": 1}


def test_a_source_sleeps_while_its_envelope_is_silent():
    patch = patch_of(
        {"tile": "tile-force", "tone": "tone", "times": "multiply", "out": "tile-output"},
        "tile.force times.b",
        "tone.out times.a",
        "times.out out.acceleration",
    )
    program = program_of(patch)
    force = step_on(0, 1000, 2000)
    out = run(program, force=force)["output"]
    assert program.awake()["tone"] == 0
    assert np.abs(out[0, 1000:2000]).max() > 0.1
    assert not out[0, :1000].any()
    assert not out[0, 2000:].any()
    assert not out[1].any()


# --- controls ---


def moved(begin, end, start):
    """Frame by frame, a control that is sent from `begin` to `end` at frame `start`."""
    return begin + (end - begin) * np.clip((np.arange(LENGTH) - start) / RAMP, 0.0, 1.0)


def by_span(signal):
    """What somebody who looks once a span sees."""
    return np.repeat(signal[::SPAN], SPAN)


@pytest.mark.parametrize("blocks", [[256], [7], [64, 1, 33]])
def test_a_number_moves_in_240_frames_from_its_command_on(blocks):
    start = 30 * SPAN

    def send(program):
        program.set("probe", "slow", 12.0, start)
        program.set("probe", "fast", -6.0, start)

    got = run(program_of(PROBE, "probe.slow_now", "probe.fast_now"), blocks=blocks, doing={start: send})
    for row in range(2):
        np.testing.assert_allclose(got["probe.fast_now"][row], moved(0.0, -6.0, start), atol=1e-15)
        np.testing.assert_allclose(got["probe.slow_now"][row], by_span(moved(0.0, 12.0, start)), atol=1e-15)


def test_a_number_that_is_sent_elsewhere_on_its_way_turns_without_a_jump():
    first, second = 30 * SPAN, 33 * SPAN
    program = program_of(PROBE, "probe.slow_now", "probe.fast_now")
    got = run(
        program,
        doing={
            first: lambda p: p.set("probe", "fast", 10.0, first),
            second: lambda p: p.set("probe", "fast", -10.0, second),
        },
    )
    now = got["probe.fast_now"][0]
    assert now[second] == pytest.approx(10.0 * 96 / RAMP)
    np.testing.assert_allclose(now[second:], moved(now[second], -10.0, second)[second:], atol=1e-14)


def test_a_wire_is_read_once_a_span_or_once_a_frame_as_the_parameter_says():
    patch = patch_of({"tile": "tile-force", "probe": "probe"}, "tile.force probe.slow", "tile.force probe.fast")
    force = np.random.default_rng(1).uniform(-900.0, 900.0, (2, LENGTH))
    for blocks in ([256], [7], [1, 100, 31]):
        got = run(program_of(patch, "probe.slow_now", "probe.fast_now"), force=force, blocks=blocks)
        for row in range(2):
            np.testing.assert_array_equal(got["probe.fast_now"][row], force[row])
            np.testing.assert_array_equal(got["probe.slow_now"][row], by_span(force[row]))


def test_a_wire_cannot_drive_a_number_out_of_its_range():
    patch = patch_of({"tile": "tile-force", "probe": "probe"}, "tile.force probe.slow")
    force = step_on(0, 0, LENGTH, 1e9) + step_on(1, 0, LENGTH, -1e9)
    got = run(program_of(patch, "probe.slow_now"), force=force)
    assert got["probe.slow_now"][:, -1].tolist() == [1000.0, -1000.0]


def test_setting_what_is_not_there_or_not_allowed():
    program = program_of(NOISE)
    program.set("nobody", "gain", 1.0, 0)  # a node that was left out may be edited all the same
    for name, value in (("nope", 1.0), ("amplitude", -1.0), ("amplitude", float("nan")), ("amplitude", "1")):
        with pytest.raises(BadValue):
            program.set("noise", name, value, 0)
    with pytest.raises(BadValue):
        program_of(PROBE, "probe.slow_now").set("probe", "whole", 3, 0)


# --- rows ---


@pytest.mark.parametrize(("tiles", "sounding"), [("left", [0]), ("right", [1]), ("left+right", [0, 1]), ("other", [])])
def test_a_node_is_for_the_tiles_it_names(tiles, sounding):
    patch = patch_of({"noise": "noise", "out": ("tile-output", {"tiles": tiles})}, "noise.out out.acceleration")
    program = program_of(patch)
    out = run(program)["output"]
    assert [row for row in range(2) if out[row].any()] == sounding
    assert [row for row in range(2) if program.tables.ran[program.node_ids.index("out"), row]] == sounding
    assert program.awake()["out"] == len(sounding)


def test_draws_depend_on_seed_node_and_tile_and_on_nothing_else():
    both = run(program_of(NOISE))["output"]
    alone = run(program_of(NOISE, tiles=("right",)))["output"]
    turned = run(program_of(NOISE, tiles=("right", "left")), blocks=[7])["output"]
    assert both[1].tobytes() == alone[0].tobytes() == turned[0].tobytes()
    assert both[0].tobytes() == turned[1].tobytes()
    renamed = patch_of({"other": "noise", "out": "tile-output"}, "other.out out.acceleration", seed=5)
    reseeded = msgspec.structs.replace(NOISE, seed=6)
    different = [*both, *(run(program_of(patch))["output"][0] for patch in (renamed, reseeded))]
    for i, a in enumerate(different):
        for b in different[:i]:
            assert abs(np.corrcoef(a, b)[0, 1]) < 0.1


def test_a_sleep_in_between_does_not_change_the_draws():
    patch = patch_of(
        {"tile": "tile-force", "events": "poisson", "bank": ("modal-bank", {"modes": [[300.0, 5000.0, 1.0]]})},
        "tile.force events.strength",
        "events.out bank.strike",
    )
    awake = run(program_of(patch, "bank.out"), force=step_on(0, 0, LENGTH))["bank.out"][0]
    late = run(program_of(patch, "bank.out"), force=step_on(0, 2400, LENGTH))["bank.out"][0]
    assert not late[:2400].any()
    np.testing.assert_allclose(late[3400:], awake[3400:], atol=1e-6)


# --- events ---


def test_strikes_reach_what_can_be_struck_at_their_time():
    patch = patch_of(
        {"hand": "strike", "other": "strike", "bank": "modal-bank", "more": "modal-bank"},
        "hand.out bank.strike",
        "other.out more.strike",
    )
    program = program_of(patch, "bank.out", "more.out")
    program.strike("hand", "right", 700.5, 1.0)
    program.strike("", "left", 300.0, 1.0)
    with pytest.raises(BadValue, match="tile is 'nowhere'; allowed: left, right"):
        program.strike("hand", "nowhere", 0.0, 1.0)
    got = run(program)
    first = {scope: [int(np.flatnonzero(row)[0]) if row.any() else None for row in got[scope]] for scope in got}
    assert first["bank.out"] == [301, 701]  # sin 0 at the event's own frame
    assert first["more.out"] == [301, None]


def test_events_are_read_in_the_block_they_happen_in():
    patch = patch_of({"tile": "tile-force", "beat": "beat"}, "tile.force beat.signal")
    program = program_of(patch, "beat.out", tiles=("right",), block=600)
    found = []
    for at in range(0, LENGTH, 600):
        program.engine_signals["force_n"][:] = 1.0
        program.run(at, 600)
        found += program.events("beat.out")[:, 0].tolist()
    assert found == [1000.0 * i + 0.25 for i in range(5)]


# --- faults ---


@pytest.mark.parametrize("blocks", [[256], [64], [7]])
def test_a_value_that_is_not_finite_names_its_node_and_is_silenced(blocks):
    nodes = {"tile": "tile-force", "bad": "inverse", "worse": "inverse", "pass": "low-pass", "out": "tile-output"}
    wires = ("tile.force bad.force", "tile.force worse.force", "bad.out pass.signal", "worse.out out.level")
    patch = patch_of(nodes, *wires, "pass.out out.acceleration")
    program = program_of(patch)
    force = step_on(0, 100, 2000, 300.0) + step_on(1, 100, LENGTH, 200.0)
    force[0, 700] = 500.0
    out = run(program, force=force, blocks=blocks)["output"]
    assert program.faults() == [("bad", "left", 700), ("worse", "left", 700)], "each of several"
    assert program.faults() == []
    assert np.isfinite(out).all()
    well = run(program_of(patch), force=step_on(1, 100, LENGTH, 200.0), blocks=blocks)["output"]
    assert out[1].tobytes() == well[1].tobytes()
    assert np.abs(out[0, 1200:2000]).min() > 0.0, "it plays on afterwards"
    run(program, force=force, blocks=blocks)
    assert program.faults() == [], "a node is named once: in an installation it filled the log"
    program.set("pass", "cutoff", 500.0, 704)
    force[0, [800, 1500]] = 500.0
    run(program, 960, force=force, blocks=blocks, begin=704)
    assert program.faults() == [], "nor while the number that may have mended it is on its way"
    run(program, force=force, blocks=blocks, begin=960)
    assert program.faults() == [("bad", "left", 1500), ("worse", "left", 1500)], "but where it has not"


def test_a_value_that_goes_nowhere_does_no_harm():
    nodes = {"tile": "tile-force", "bad": "inverse", "out": "tile-output"}
    program = program_of(patch_of(nodes, "tile.force bad.force", "bad.missing out.acceleration"))
    assert (run(program, force=np.full((2, LENGTH), 500.0))["output"] == 0.0).all()
    assert program.faults() == []


# --- swaps ---


def taking_over(patch, at, *scopes):
    """What puts the program of a patch in the place of another, at frame `at`."""

    def swap(old):
        new = program_of(patch, *scopes)
        new.take_over(old, at)
        return new

    return swap


@pytest.mark.parametrize("patch", [TONE, NOISE], ids=["tone", "noise"])
def test_a_program_that_takes_over_plays_on_to_the_bit(patch):
    through, at = run(program_of(patch))["output"], 50 * SPAN
    got = run(program_of(patch), blocks=[100], doing={at: taking_over(patch, at)})["output"]
    assert got.tobytes() == through.tobytes()


def test_a_number_that_a_swap_changes_moves_in_a_ramp():
    at, scopes = 50 * SPAN, ("probe.slow_now", "probe.fast_now")
    changed = PROBE.set("probe", "fast", 9.0, TYPES).set("probe", "slow", 5.0, TYPES)
    got = run(program_of(PROBE, *scopes), doing={at: taking_over(changed, at, *scopes)})
    np.testing.assert_allclose(got["probe.fast_now"][0], moved(0.0, 9.0, at), atol=1e-15)
    np.testing.assert_allclose(got["probe.slow_now"][0], by_span(moved(0.0, 5.0, at)), atol=1e-15)


def test_a_swap_within_a_ramp_goes_on_from_where_the_number_is():
    start, at = 30 * SPAN, 33 * SPAN
    swap = taking_over(PROBE.set("probe", "fast", 10.0, TYPES), at, "probe.fast_now")
    doing = {start: lambda p: p.set("probe", "fast", 10.0, start), at: swap}
    now = run(program_of(PROBE, "probe.fast_now"), doing=doing)["probe.fast_now"][0]
    assert now[at] == pytest.approx(4.0)
    assert np.abs(np.diff(now)).max() <= 10.0 / RAMP + 1e-12
    assert now[at + RAMP] == 10.0


def test_a_node_of_another_type_or_structure_begins_anew():
    old = program_of(SUM, "total.out")
    run(old, 512, force=step_on(0, 0, LENGTH))
    other = patch_of({"tile": "tile-force", "total": "gain"}, "tile.force total.signal")
    new = program_of(other, "total.out")
    new.take_over(old, 512)
    assert run(new, force=step_on(0, 0, LENGTH), begin=512)["total.out"][0, 512] == 1.0
    elsewhere = program_of(SUM, "total.out", tiles=("left", "middle"))
    elsewhere.take_over(old, 512)
    assert run(elsewhere, force=step_on(0, 0, LENGTH), begin=512)["total.out"][0, 512] == 1.0


def loop_of(patch, blocks, swap=None, length=9600):
    """What a loop plays of a patch on one tile, [frame], and with `swap` of another from that frame on."""
    source = SimulatedFloor(default_floor(1, 1), walking=False)
    loop = Loop(patch, TYPES, source, LoopOptions(block=max(blocks)))
    loop.send(Play(True), 0)
    if swap is not None:
        loop.send(Swap(swap[1].dumps()), swap[0])
    played, at, turn = np.zeros(length), 0, 0
    while at < length:
        n = min(blocks[turn % len(blocks)], length - at)
        loop.run(n)
        played[at : at + n] = loop.out[:n, 0]
        at, turn = at + n, turn + 1
    return played


def test_the_fade_of_a_swap_sums_to_one():
    through = loop_of(TONE, [256])
    for blocks in ([256], [7, 300]):
        assert loop_of(TONE, blocks, (4800, TONE)).tobytes() == through.tobytes()


def test_a_swap_to_silence_fades_in_480_frames():
    silent = TONE.disconnect(TONE.wires)
    meant = run(program_of(TONE, tiles=("t1",)), 9600)["output"][0] / 20.0
    meant *= 1.0 - np.clip((np.arange(9600) - 4800) / FADE, 0.0, 1.0)
    keep = np.exp(-2.0 * np.pi * DC_HZ / RATE)
    expected = lfilter([1.0, -1.0], [1.0, -keep], meant)
    for blocks in ([256], [7, 300]):
        np.testing.assert_allclose(loop_of(TONE, blocks, (4800, silent))[FADE:], expected[FADE:], atol=1e-6)
