"""What every node must hold to, without being named here: the registry is the list."""

import math
from itertools import product

import numpy as np
import pytest
import soundfile

from underfoot.clock import SPAN
from underfoot.nodes import REGISTRY
from underfoot.parameters import Number
from underfoot.patch.driver import SLEEP_INTERVAL
from underfoot.patch.node import ENGINE_SIGNALS
from underfoot.patch.patch import Patch
from underfoot.patch.program import Program

RATE = 48_000
TILES = ("left", "right")
CENTRES_M = {"left": (0.15, 0.2), "right": (0.46, 0.2)}
LENGTH = 9_600
EVERY = sorted(REGISTRY)
SOUND = "sound.wav"


@pytest.fixture(autouse=True, scope="module")
def folder(tmp_path_factory):
    """Where nodes that play files find one: a short sound at another rate than the session's."""
    where = tmp_path_factory.mktemp("sounds")
    soundfile.write(where / SOUND, np.sin(np.arange(2000) * 0.05), 44_100)
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(where)
        yield where


def one_step(tile=0, length=LENGTH):
    """A footstep on one tile: force, and a centroid that wanders; exactly zero before and after."""
    engine_signals = {name: np.zeros((len(TILES), length)) for name in ENGINE_SIGNALS}
    down = slice(900, 6_000)
    phase = np.linspace(0.0, np.pi, 5_100)
    engine_signals["force_n"][tile, down] = 700.0 * np.sin(phase) * (1.0 - 0.3 * np.sin(phase))
    engine_signals["x_m"][tile, down] = 0.1 * np.cos(phase)
    engine_signals["y_m"][tile, down] = 0.05 * np.sin(3.0 * phase)
    return engine_signals


def alone(type, **parameters):
    """A patch in which every input of a node is fed: forces from the tile, events from footfall and hand."""
    node = REGISTRY[type]
    files = {name: SOUND for name, parameter in node.parameters.items() if parameter.kind == "file"}
    patch = Patch(seed=3).add(type, REGISTRY, **files, **parameters)
    feeds = {}
    for port in node.inputs:
        kind = "events" if port.kind == "event" else port.unit
        if kind not in feeds:
            patch, feeds[kind] = _feed(patch, kind)
        patch = patch.connect(feeds[kind], f"{type}.{port.name}", REGISTRY)
    return patch


def _feed(patch, kind):
    if kind == "events":
        for name in ("tile-force", "footfall", "strike", "join"):
            patch = patch.add(name, REGISTRY)
        new = [n.id for n in patch.nodes][-4:]
        for source, target in (
            (f"{new[0]}.force", f"{new[1]}.force"),
            (f"{new[1]}.onset", f"{new[3]}.a"),
            (f"{new[2]}.out", f"{new[3]}.b"),
        ):
            patch = patch.connect(source, target, REGISTRY)
        return patch, f"{new[3]}.out"
    patch = patch.add("tile-force", REGISTRY).add("scale", REGISTRY, high=500.0, out_high=500.0 if kind == "N" else 2.0)
    force, scale = [n.id for n in patch.nodes][-2:]
    if kind == "N":
        return patch, f"{force}.force"
    return patch.connect(f"{force}.force", f"{scale}.signal", REGISTRY), f"{scale}.out"


def run(patch, engine_signals, blocks, id, strike=True, set_at=None):
    """Every output of a node, run in blocks of the given sizes in turn: signals, then events."""
    node = REGISTRY[patch.node(id).type]
    signals = [f"{id}.{port.name}" for port in node.outputs if port.kind == "signal"]
    watched = signals or [f"{_listener(patch, id)[1]}.out"]
    if not signals:
        patch = _listener(patch, id)[0]
    program = Program(patch, REGISTRY, CENTRES_M, rate=RATE, block=max(blocks), scopes=watched)
    if strike:
        program.strike("", TILES[0], 2_000.4, 1.0)
    out = {name: np.zeros((len(TILES), LENGTH)) for name in watched}
    at = turn = 0
    while at < LENGTH:
        n = min(blocks[turn % len(blocks)], LENGTH - at)
        if set_at is not None and at < set_at[0] < at + n:
            n = set_at[0] - at
        if set_at is not None and at == set_at[0]:
            for name, value in set_at[1].items():
                program.set(id, name, value, at)
        for name, signal in program.engine_signals.items():
            signal[:, :n] = engine_signals[name][:, at : at + n]
        program.run(at, n)
        for name, signal in out.items():
            signal[:, at : at + n] = program.scope[name][:, :n]
        at, turn = at + n, turn + 1
    return out, program


def _listener(patch, id):
    """Events are made visible by a bank that they strike."""
    port = REGISTRY[patch.node(id).type].outputs[0].name
    patch = patch.add("modal-bank", REGISTRY)
    bank = patch.nodes[-1].id
    return patch.connect(f"{id}.{port}", f"{bank}.strike", REGISTRY), bank


def same(a, b):
    return all(a[name].tobytes() == b[name].tobytes() for name in a)


@pytest.mark.parametrize("type", EVERY)
def test_any_block_size_gives_the_same_bytes(type):
    patch, engine_signals = alone(type), one_step()
    whole, _ = run(patch, engine_signals, [LENGTH], type)
    assert any(np.abs(signal).max() > 0.0 for signal in whole.values()), "the node does nothing: the test is void"
    for blocks in ([64], [7], [1, 32, 33, 1000, 3]):
        assert same(whole, run(patch, engine_signals, blocks, type)[0]), blocks


@pytest.mark.parametrize("type", EVERY)
def test_moving_numbers_give_the_same_bytes_and_stay_finite(type):
    numbers = {n: p for n, p in REGISTRY[type].parameters.items() if isinstance(p, Number)}
    if not numbers:
        pytest.skip("the node has no numbers")
    moved = (3 * SPAN * 20, {name: p.value(0.3) for name, p in numbers.items()})
    patch, engine_signals = alone(type), one_step()
    whole, _ = run(patch, engine_signals, [LENGTH], type, set_at=moved)
    assert all(np.isfinite(signal).all() for signal in whole.values())
    assert same(whole, run(patch, engine_signals, [64], type, set_at=moved)[0])
    assert same(whole, run(patch, engine_signals, [7, 500], type, set_at=moved)[0])


@pytest.mark.parametrize("type", EVERY)
def test_numbers_that_wires_drive_give_the_same_bytes_and_stay_finite(type):
    patch = alone(type)
    driven = [p for p in REGISTRY[type].parameters.values() if isinstance(p, Number) and p.wire]
    for turn, parameter in enumerate(driven):
        ends = {"low": parameter.value(0.3), "high": parameter.value(0.6), "frequency": 7.0 + turn}
        patch = patch.add("lfo", REGISTRY, **ends)
        patch = patch.connect(f"{patch.nodes[-1].id}.out", f"{type}.{parameter.name}", REGISTRY)
    engine_signals = one_step()
    whole, program = run(patch, engine_signals, [LENGTH], type)
    assert not program.faults()
    assert all(np.isfinite(signal).all() for signal in whole.values())
    assert same(whole, run(patch, engine_signals, [64, 500, 7], type)[0])


@pytest.mark.parametrize("type", EVERY)
def test_other_tiles_change_nothing(type):
    patch = alone(type)
    here, _ = run(patch, one_step(0), [256], type)
    both = one_step(0)
    for name, signal in one_step(1).items():
        both[name] += signal
    together, _ = run(patch, both, [256], type)
    for name, signal in here.items():
        assert signal[0].tobytes() == together[name][0].tobytes()


@pytest.mark.parametrize("type", EVERY)
def test_nothing_in_gives_sleep(type):
    patch = alone(type)
    nothing = {name: np.zeros((len(TILES), LENGTH)) for name in ENGINE_SIGNALS}
    out, program = run(patch, nothing, [256], type, strike=False)
    if not any(np.abs(signal).max() > 0.0 for signal in out.values()):
        assert program.awake()[type] == 0


def corners(numbers):
    """Ends of up to six numbers: 16 corners of their box, in which any three of them have all their eight corners."""
    for ends in product((0, 1), repeat=min(len(numbers), 4)):
        of_all = (*ends, sum(ends[:3]) % 2, sum(ends[1:]) % 2)
        yield {name: one.high if end else one.low for (name, one), end in zip(numbers.items(), of_all, strict=False)}


@pytest.mark.parametrize("type", EVERY)
def test_corners_of_the_parameter_box_are_finite(type):
    numbers = {n: p for n, p in REGISTRY[type].parameters.items() if isinstance(p, Number)}
    for values in corners(dict(list(numbers.items())[:6])):
        out, program = run(alone(type, **values), one_step(), [480], type)
        assert all(np.isfinite(signal).all() for signal in out.values()), values
        assert not program.faults(), values


@pytest.mark.parametrize("type", EVERY)
def test_json_round_trip(type):
    patch = alone(type)
    assert Patch.loads(patch.dumps(), REGISTRY) == patch


@pytest.mark.parametrize("type", EVERY)
def test_declared_in_full(type):
    node = REGISTRY[type]
    assert node.doc
    assert node.label
    assert node.family
    asks = "error" in node.parameters
    assert node.accuracy.startswith("requested" if asks else "exact")
    for name, parameter in node.parameters.items():
        assert parameter.check(parameter.default) == parameter.default
        assert name != "id"
        if isinstance(parameter, Number):
            assert parameter.low < parameter.high
            assert parameter.scale != "log" or parameter.low > 0.0
            assert math.isclose(parameter.value(parameter.position(parameter.default)), parameter.default, abs_tol=1e-9)
            has_slider = parameter.scale != "linear" or parameter.high - parameter.low < 1e5
            if has_slider and parameter.default not in (parameter.low, parameter.high):
                assert 0.02 < parameter.position(parameter.default) < 0.98, f"{name}: too near an end to be dragged"


def test_a_row_that_slept_wakes_at_the_very_frame():
    patch, engine_signals = alone("low-pass"), one_step()
    out, program = run(patch, engine_signals, [SLEEP_INTERVAL], "low-pass", strike=False)
    first = int(np.flatnonzero(engine_signals["force_n"][0])[0])
    signal = out["low-pass.out"]
    assert signal[0, first] != 0.0
    assert not signal[0, :first].any()
    assert not signal[1].any()
    assert program.tables.ran[program.index["low-pass"]][1] == 0
