"""What lies in presets/: every patch plays as it should on the default walker, and every floor is a floor."""

import tomllib
from functools import cache
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest
from scipy.signal import lfilter

from underfoot.devices.simulated_floor import SimulatedFloor
from underfoot.engine.commands import Play
from underfoot.engine.loop import Loop, LoopOptions
from underfoot.engine.render import render_source
from underfoot.engine.safety import DC_HZ
from underfoot.floor.layout import Floor, default_floor
from underfoot.nodes import REGISTRY
from underfoot.parameters import Number
from underfoot.patch import preset_files
from underfoot.patch.patch import Patch
from underfoot.patch.program import Program

ROOT = Path(__file__).resolve().parents[1]
RATE = 48_000
PATCHES = preset_files.patches()
LOUD = [name for name in PATCHES if not name.startswith("stimulus-")]
"""Those that are as loud as a tile plays well; how loud the thesis's stimuli are is said by table 6.1."""
UNLIMITED = [name for name in PATCHES if name not in ("stimulus-wc", "stimulus-wp", "stimulus-wd")]
"""All but white noise at 18 m/s^2, whose rare peaks reach full scale under a heavier foot."""
SOUNDING = [name for name in PATCHES if name != "stimulus-x"]
PITCH, MOST_WIDE, ONE_ROW, ROW = 8, 224, 80, 20
"""Of the canvas: its grid, and how large a drawn node may be (width; height without ports, and for each port)."""


def load(name):
    return Patch.load(PATCHES[name], REGISTRY)


def play(patch, seconds, block=1024, walking=True):
    source = SimulatedFloor(default_floor(), RATE, patch.seed, walking)
    return render_source(patch, source, seconds, LoopOptions(block=block))


@cache
def played(name):
    """Five seconds of the default walker, float64 [tile, frame]."""
    return play(load(name), 5.0).samples.T.astype(np.float64)[: len(default_floor().tiles)]


@cache
def power(name):
    """Frequencies and the power at each, of all tiles together."""
    signal = played(name)
    return np.fft.rfftfreq(signal.shape[1], 1.0 / RATE), (np.abs(np.fft.rfft(signal)) ** 2).sum(axis=0)


def share(name, low_hz, high_hz):
    """How much of the power lies between two frequencies."""
    hz, spectrum = power(name)
    return spectrum[(hz >= low_hz) & (hz <= high_hz)].sum() / spectrum.sum()


def flatness(name, low_hz, high_hz):
    """Geometric over arithmetic mean of the power in bands of 4 Hz: towards 1 for noise, towards 0 for lines."""
    hz, spectrum = power(name)
    edges = np.arange(low_hz, high_hz, 4.0)
    bands = np.array([spectrum[(hz >= a) & (hz < a + 4.0)].sum() for a in edges])
    return np.exp(np.log(bands).mean()) / bands.mean()


def grain(name):
    """Kurtosis of the loud stretches of 50 ms: 3 for a noise, more the fewer and sharper the events are."""
    stretches = played(name).reshape(-1, RATE // 20)
    square = (stretches**2).mean(axis=1)
    loud = square > 0.05 * square.max()
    return np.median((stretches[loud] ** 4).mean(axis=1) / square[loud] ** 2)


def test_the_presets_that_are_promised_are_there():
    assert {"gravel", "snow", "wood", "tacton-waveshaped", "tacton-impact"} <= PATCHES.keys()
    assert {"tiles-2x2", "tiles-6x6"} <= preset_files.floors().keys()


@pytest.mark.parametrize("name", PATCHES)
def test_a_patch_says_what_it_is_and_is_written_as_the_window_writes_it(name):
    patch = load(name)
    assert patch.title
    assert patch.comment.endswith(".")
    assert PATCHES[name].read_bytes() == patch.dumps()


def test_the_numbers_of_patches_lie_where_a_slider_can_be_dragged():
    for node in (node for name in PATCHES for node in load(name).nodes):
        for key, parameter in REGISTRY[node.type].parameters.items():
            value = node.parameters.get(key, parameter.default)
            if isinstance(parameter, Number) and value not in (parameter.low, parameter.high):
                assert 0.01 < parameter.position(value) < 0.99, f"{node.type} {key}"


@pytest.mark.parametrize("name", PATCHES)
def test_a_patch_is_laid_out_from_left_to_right_and_nothing_overlaps(name):
    patch = load(name)
    boxes = {}
    for node in patch.nodes:
        type = REGISTRY[node.type]
        wired = sum(end.startswith(f"{node.id}.") for _, end in patch.wires)
        height = ONE_ROW + ROW * max(len(type.inputs) + wired, len(type.outputs), 1)
        boxes[node.id] = (*node.at, node.at[0] + MOST_WIDE, node.at[1] + height)
        assert node.at[0] % PITCH == node.at[1] % PITCH == 0.0
    for (a, p), (b, q) in combinations(boxes.items(), 2):
        apart = p[2] <= q[0] or q[2] <= p[0] or p[3] <= q[1] or q[3] <= p[1]
        assert apart, f"{a} and {b} overlap"
    for source, target in patch.wires:
        assert boxes[source.partition(".")[0]][2] <= boxes[target.partition(".")[0]][0], f"{source} -> {target}"


@pytest.mark.parametrize("name", LOUD)
def test_a_patch_sounds_at_a_sensible_level(name):
    signal = played(name)
    assert 0.15 < np.abs(signal).max() < 0.8
    assert (np.abs(signal).max(axis=1) > 0.1).all(), "a tile that is walked on is all but silent"


@pytest.mark.parametrize("name", UNLIMITED)
def test_the_limiter_leaves_a_patch_alone(name):
    source, block = SimulatedFloor(default_floor(), RATE, load(name).seed), 960
    loop = Loop(load(name), REGISTRY, source, LoopOptions(block=block))
    loop.send(Play(True), 0)
    meant, heard, heard_by_ear = np.zeros((4, 2 * RATE)), np.zeros((4, 2 * RATE)), 0.0
    for at in range(0, 2 * RATE, block):
        loop.run(block)
        meant[:, at : at + block] = loop.program.output[:, :block]
        heard[:, at : at + block] = loop.out[:block, :4].T
        heard_by_ear = max(heard_by_ear, np.abs(loop.out[:block, 4:]).max(initial=0.0))
    keep = np.exp(-2.0 * np.pi * DC_HZ / RATE)
    np.testing.assert_allclose(heard, lfilter([1.0, -1.0], [1.0, -keep], meant / 20.0), atol=1e-6)
    assert heard_by_ear < 0.9


@pytest.mark.parametrize("name", SOUNDING)
def test_on_an_empty_floor_everything_sleeps(name):
    patch = load(name)
    rendered = play(patch, 2.0, walking=False)
    assert rendered.run == []
    assert rendered.left_out == []
    assert sorted(rendered.asleep) == sorted(node.id for node in patch.nodes)
    assert not rendered.samples.any()


@pytest.mark.parametrize("name", SOUNDING)
def test_everything_falls_asleep_again_after_a_step(name):
    program = Program(load(name), REGISTRY, ("t1",), rate=RATE, block=4800)
    for at in range(0, 8 * RATE, 4800):
        for signal in program.engine_signals.values():
            signal[:] = 0.0
        if at == 4800:
            program.engine_signals["force_n"][0] = 700.0 * np.sin(np.linspace(0.0, np.pi, 4800)) ** 2
        program.run(at, 4800)
        assert at != 4800 or any(program.awake().values())
    assert not any(program.awake().values())


def test_gravel_is_bright_and_irregular():
    assert share("gravel", 200.0, 1500.0) > 0.75
    assert grain("gravel") > 8.0


def test_snow_is_dense_and_muffled():
    assert share("snow", 90.0, 420.0) > 0.8
    assert grain("snow") < 5.0


def test_wood_rings_in_few_modes():
    assert flatness("wood", 100.0, 400.0) < 0.5 * min(flatness("snow", 100.0, 400.0), flatness("gravel", 100.0, 400.0))


def test_materials_are_told_apart_by_their_spectra():
    edges = np.arange(50.0, 1500.0, 10.0)
    bands = {name: np.array([share(name, hz, hz + 10.0) for hz in edges]) for name in ("gravel", "snow", "wood")}
    for a, b in combinations(bands, 2):
        common = np.minimum(bands[a], bands[b]).sum()
        assert common < 0.6, f"{a} and {b} share {common:.0%} of their spectra"


@pytest.mark.parametrize(("name", "side"), [("tiles-2x2", 2), ("tiles-6x6", 6)])
def test_floors_are_the_default_tiles(name, side):
    assert Floor.load(preset_files.floors()[name]) == default_floor(side, side)


def test_the_wheel_carries_all_packages_presets_and_firmware():
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["setuptools"]
    expected = set()
    for package, folder in settings["package-dir"].items():
        modules = {path.parent.relative_to(ROOT / folder) for path in (ROOT / folder).rglob("*.py")}
        expected |= {".".join((package, *parts.parts)) for parts in modules}
        for glob in settings["package-data"].get(package, ()):
            assert any((ROOT / folder).glob(glob)), f"{glob} of {package} is not there"
    assert set(settings["packages"]) == expected


@pytest.mark.parametrize(
    ("words", "key"), [("sine constant", "SC"), ("white proportional", "WP"), ("textured dynamic", "TD")]
)
def test_the_thesis_stimuli_are_found_by_noise_and_envelope_and_their_names_fit_a_row(words, key):
    found = [preset.title for preset in preset_files.ranked(preset_files.all_presets(), words)]
    assert found[:2] == [f"Stimulus {key}, A = 1.0", f"Stimulus {key}, A = 0.5"]
