"""What every node's kernels promise, tried one row at a time: they write what is theirs, and nothing else."""

import numpy as np
import pytest
import soundfile
from bare_row import BareRow, PlainRow

from underfoot.layouts import Layout
from underfoot.nodes import REGISTRY
from underfoot.parameters import Number
from underfoot.patch.node import Input, Output, node

EVERY = sorted(REGISTRY)
FRAMES = 640
RATE = 48_000.0


@pytest.fixture(autouse=True, scope="module")
def sound(tmp_path_factory):
    """A short sound for nodes that play one."""
    path = tmp_path_factory.mktemp("sounds") / "sound.wav"
    soundfile.write(path, np.sin(np.arange(500) * 0.05), 48_000)
    return path


@pytest.fixture
def parameters(sound):
    """Parameters that let a node do something: `parameters(type)`."""

    def given(type):
        return {name: str(sound) for name, p in REGISTRY[type].parameters.items() if p.kind == "file"}

    return given


def fed(type, frame, n, silent=()):
    """Signals and events for every input of a node; zero for those in `silent`."""
    draw = np.random.default_rng([frame, n])
    node = REGISTRY[type]
    signals = {}
    for port in node.binding.names.signals_in:
        parameter = node.parameters.get(port)
        if port in silent:
            signals[port] = np.zeros(n)
        elif isinstance(parameter, Number):
            signals[port] = np.full(n, parameter.value(0.4))
        else:
            signals[port] = np.abs(draw.normal(size=n)) * (500.0 if "force" in port else 0.1)
    times = np.sort(draw.choice(n, min(n, 3), replace=False)) + frame + 0.25
    events = {port: [(float(t), 1.0, 0.01) for t in times] for port in node.binding.names.events_in}
    return signals, events


@pytest.mark.parametrize("type", EVERY)
def test_nothing_is_written_beyond_what_a_row_has(type, parameters):
    node = REGISTRY[type]
    numbers = {name: p for name, p in node.parameters.items() if isinstance(p, Number) and p.wire != "audio"}
    for share in (None, 0.0, 1.0):
        values = {} if share is None else {name: p.value(share) for name, p in numbers.items()}
        row = BareRow(node, RATE, **parameters(type), **values)
        frame = 0
        for n in (1, 7, 64, 63, 128, 300):
            row.run(frame, n, *fed(type, frame, n))
            assert all(np.isfinite(out).all() for out in row.outputs.values())
            row.tail()
            frame += n


@pytest.mark.parametrize("type", EVERY)
def test_functions_in_plain_python_give_what_the_compiled_row_gives(type, parameters):
    compiled, plain = (row(REGISTRY[type], RATE, **parameters(type)) for row in (BareRow, PlainRow))
    frame = 0
    for n in (64, 200):
        signals, events = fed(type, frame, n)
        compiled.run(frame, n, signals, events)
        outputs, made = plain.run(frame, n, signals, events)
        for name, out in outputs.items():
            assert out.tobytes() == compiled.outputs[name].tobytes(), name
        for name, events in made.items():
            assert events.tobytes() == compiled.events[name].tobytes(), name
        frame += n


@pytest.mark.parametrize(("type", "muting"), [(t, m) for t in EVERY for m in REGISTRY[t].muted_by])
def test_what_mutes_a_node_makes_exact_zeros(type, muting, parameters):
    row = BareRow(REGISTRY[type], RATE, **parameters(type))
    for frame in range(0, 4 * FRAMES, FRAMES):
        row.run(frame, FRAMES, *fed(type, frame, FRAMES, silent=(muting,)))
        assert not any(out.any() for out in row.outputs.values())
        assert not any(events[:, 1].any() for events in row.events.values())


@pytest.mark.parametrize("type", EVERY)
def test_a_tail_bounds_all_that_still_comes(type, parameters):
    node = REGISTRY[type]
    row, frame, bounded = BareRow(node, RATE, **parameters(type)), 0, 0
    silent = [name for name in node.binding.names.signals_in if not isinstance(node.parameters.get(name), Number)]
    for part in range(6):
        for _ in range(3):
            row.run(frame, FRAMES, *fed(type, frame, FRAMES))
            frame += FRAMES
        for _ in range(5 * part):
            bound = row.tail()
            signals = {name: np.zeros(FRAMES) for name in silent}
            row.run(frame, FRAMES, signals, {})
            frame += FRAMES
            if np.isfinite(bound):
                bounded += 1
                for name, out in row.outputs.items():
                    assert np.abs(out).max(initial=0.0) <= bound * (1.0 + 1e-9) + 1e-300, name
                assert not any(len(events) for events in row.events.values())
    assert bounded or node.binding.tail is not None


@node("beyond", "Tests")
class Beyond:
    """Writes one frame too many, and one value too many of its state."""

    signal = Input()
    too_far = Number(0.0, 0.0, 100.0)
    out = Output()
    state = Layout("beyond", last=8)

    def run(signal, too_far, state, out):
        for i in range(out.size):
            out[i] = signal[i]
        out[out.size - 1 + int(too_far % 10.0)] = 0.0
        state.last[7 + int(too_far // 10.0)] = 1.0


@pytest.mark.parametrize(("too_far", "what"), [(0.0, ""), (1.0, "out"), (10.0, "state")])
def test_a_kernel_that_writes_too_far_is_found_out_by_name(too_far, what):
    row = BareRow(Beyond, too_far=too_far)
    if not what:
        row.run(0, 8)
        return
    with pytest.raises(AssertionError, match=f"{what}: written beyond its own"):
        row.run(0, 8)
