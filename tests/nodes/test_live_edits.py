"""An edit while a node sounds: no step in its output that neither the signal before nor the one after has.

A number goes by `Set`, in its ramp; all else goes by `Swap`, which fades the new program in over the old one. Every
parameter of every node is edited, and each edit is heard: one that changes nothing would show nothing.
"""

from collections.abc import Mapping
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
import pytest
import soundfile
from msgspec.structs import replace

from underfoot.clock import FADE, RAMP, SPAN
from underfoot.engine.patch_edits import moved_numbers
from underfoot.engine.program_fade import ProgramFader
from underfoot.nodes import REGISTRY
from underfoot.parameters import Choice, Count, FilePath, Number, Numbers, Rows, Tiles
from underfoot.patch.node import ENGINE_SIGNALS
from underfoot.patch.patch import Patch
from underfoot.patch.program import Program

RATE, BLOCK, FRAMES, EDIT = 48_000, 480, 9_600, 4_800
SOUND, OTHER_SOUND = "hum.wav", "lower.wav"
OTHER_TILE = "t2"

DRAWN = ("fibre-bundle", "fibre-grid", "slip", "stick-slip")
"""Nodes whose events are drawn: the largest step that is their own is that of several seeds."""
SEED, SEEDS = 3, 4


class Setting(NamedTuple):
    """In what an edit is heard that is not where a foot stands and all else is at its default."""

    values: Mapping[str, object] = MappingProxyType({})
    walks: bool = False
    """Steps of 37 ms, with 13 ms between them in which nobody stands there."""
    starts: bool = True
    """Whether blows at random go to its input of events."""
    of_events: bool = False
    """It acts on the strength of events alone: what is listened to is a bank that they ring."""


_QUICK, _RENEWED = {"frequency": 50.0}, {"renewal": 0.01}
_GROUND = {
    **dict.fromkeys(("stiffening", "restructurings"), Setting({"model": "inverse"}, walks=True)),
    "renewal": Setting({**_RENEWED, "strength": 300.0}, walks=True),
    **dict.fromkeys(("loudness", "softness"), Setting(_RENEWED, walks=True, of_events=True)),
}
SETTINGS = {
    "attack-decay": {"attack": Setting({"duration": 0.02, "decay": 0.005})},
    "delay": {"feedback": Setting({"time": 0.01})},
    "fibre-bundle": _GROUND,
    "fibre-grid": _GROUND,
    "footfall": dict.fromkeys(("threshold", "wait", "reference"), Setting(walks=True)),
    "impact": {"error": Setting({"stiffness": 1e11})},
    "rhythm": {
        "bar": Setting({"bar": 0.1}),
        "repeats": Setting({"bar": 0.1, "repeats": 1}, starts=False),
        "begin": Setting({"bar": 0.1}, starts=False),
    },
    "slip": dict.fromkeys(("threshold", "spread", "gamma", "least", "most", "renewal"), Setting(_RENEWED, walks=True)),
    "step-sequence": dict.fromkeys(("frequency", "glide", "low"), Setting(_QUICK)),
    "stick-slip": {"loudness": Setting(of_events=True)},
}
ANSWERS = {
    ("fibre-bundle", "energy"): ("strength", "scale"),
}
"""Outputs that answer to these numbers: ground that is made weaker under a load breaks, and that energy is set free."""


@pytest.fixture(autouse=True, scope="module")
def folder(tmp_path_factory):
    """Where nodes that play files find one."""
    where = tmp_path_factory.mktemp("sounds")
    for name, frequency_hz in ((SOUND, 100.0), (OTHER_SOUND, 70.0)):
        soundfile.write(where / name, 0.5 * np.sin(np.arange(RATE) * 2.0 * np.pi * frequency_hz / RATE), RATE)
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(where)
        yield where


def setting_of(type, name):
    return SETTINGS.get(type, {}).get(name, Setting())


def sounding(type, setting):
    """A patch in which the node sounds: a foot that stands, a tone, blows at random; and what is listened to.

    Events are made audible by a bank that they ring.
    """
    node = REGISTRY[type]
    files = {name: SOUND for name, parameter in node.parameters.items() if parameter.kind == "file"}
    patch, scopes, feeds = Patch(seed=SEED).add(type, REGISTRY, **files, **setting.values), [], {}
    for port in node.inputs:
        kind = port.kind if port.kind == "event" else port.unit
        if kind == "event" and not setting.starts:
            continue
        if kind not in feeds:
            feeder, out, values = {
                "event": ("poisson", "out", {"interval": 0.03}),
                "N": ("tile-force", "force", {}),
                "m": ("contact", "x", {}),
            }.get(kind, ("tone", "out", {"harmonics": [1.0], "frequency": 60.0, "amplitude": 1.0}))
            patch = patch.add(feeder, REGISTRY, **values)
            feeds[kind] = f"{patch.nodes[-1].id}.{out}"
        patch = patch.connect(feeds[kind], f"{type}.{port.name}", REGISTRY)
    for port in node.outputs:
        if port.kind == "signal":
            if not setting.of_events:
                scopes.append(f"{type}.{port.name}")
        elif type not in DRAWN or setting.of_events:
            patch = patch.add("modal-bank", REGISTRY)
            bank = patch.nodes[-1].id
            patch = patch.connect(f"{type}.{port.name}", f"{bank}.strike", REGISTRY)
            scopes.append(f"{bank}.out")
    return patch, scopes


def engine_signals(at, walks=False):
    """What the engine brings in the block at `at`."""
    share = np.arange(at, at + BLOCK) / FRAMES
    force_n = 600.0 * np.sqrt(np.sin(np.pi * share)) + 1.0
    if walks:
        of_a_step = np.arange(at, at + BLOCK) % 2400 / 1800
        force_n = 800.0 * np.sin(np.pi * np.minimum(of_a_step, 1.0)).clip(0.0) * (of_a_step < 1.0)
    y_m = 0.1 * np.sin(3.0 * share)
    brought = {"force_n": force_n, "x_m": 0.1 * np.cos(3.0 * share), "y_m": y_m, "cut": np.zeros(BLOCK)}
    return np.array([brought[name][None] for name in ENGINE_SIGNALS])


def build(patch, scopes):
    program = Program(patch, REGISTRY, ("t1",), rate=RATE, block=BLOCK, scopes=scopes)
    program.signals = np.zeros((len(ENGINE_SIGNALS), 1, BLOCK)), np.zeros(1, np.uint8)
    for frame in range(0, FRAMES, 600):
        program.strike("", "t1", frame + 0.5, 1.0)
    return program


def played(patch, scopes, walks, edited=None):
    """The scopes' frames; with `edited`, of that patch from `EDIT` on, as the engine would get there."""
    fader, out = ProgramFader(build(patch, scopes)), {scope: np.zeros(FRAMES) for scope in scopes}
    for at in range(0, FRAMES, BLOCK):
        fader.update(at)
        if edited is not None and at == EDIT:
            for move in moved_numbers(patch, edited, REGISTRY):
                fader.set(move.node, move.name, move.value, at)
        fader.current.signals[0][:] = engine_signals(at, walks)
        fader.run(at, BLOCK)
        for scope, frames in out.items():
            frames[at : at + BLOCK] = fader.current.scope[scope][0]
    return out


def largest_step(frames):
    return np.abs(np.diff(frames[EDIT - RAMP :])).max()


def largest(frames):
    return np.abs(frames).max()


def numbers(type):
    return [p for p in REGISTRY[type].parameters.values() if isinstance(p, Number) and p.is_ramped]


def beside(parameter, share):
    """Another value: this share of the control's way to the side that has more room; or the number's own tenth."""
    if parameter.high >= 1e5 and parameter.scale == "linear":
        return parameter.default + max(abs(parameter.default), 1.0) * share
    at = parameter.position(parameter.default)
    value = parameter.value(at + share if at < 0.5 else at - share)
    return min(max(value, parameter.low), parameter.high)


def seeds(type):
    """The seed of `sounding`, and further ones where events are drawn."""
    return range(SEED, SEED + (SEEDS if type in DRAWN else 1))


def played_alone(type, patch, scopes, walks):
    """The patch as nobody edits it, for each seed."""
    return [played(replace(patch, seed=seed), scopes, walks) for seed in seeds(type)]


def own(runs, scope):
    """The largest step, and the largest value, of these."""
    return tuple(max(measure(run[scope]) for run in runs) for measure in (largest_step, largest))


@pytest.mark.parametrize("type", [type for type in sorted(REGISTRY) if numbers(type)])
def test_a_number_that_is_moved_steps_no_more_than_the_signals_before_and_after(type):
    """A tenth of the control's way may add what the whole swing adds in half a ramp; three tenths, in half a span."""
    known = {}
    for parameter in numbers(type):
        setting = setting_of(type, parameter.name)
        patch, scopes = sounding(type, setting)
        key = repr(setting)
        before = known[key] = known.get(key) or played_alone(type, patch, scopes, setting.walks)
        for share, frames in ((0.1, RAMP / 2), (0.3, SPAN / 2)):
            edited = patch.set(type, parameter.name, beside(parameter, share), REGISTRY)
            after = played_alone(type, edited, scopes, setting.walks)
            moved = played(patch, scopes, setting.walks, edited)
            words = f"{parameter.name} by {share}"
            assert share < 0.3 or any(np.any(moved[scope] != before[0][scope]) for scope in scopes), words
            for scope in scopes:
                if parameter.name in ANSWERS.get(tuple(scope.split(".")), ()):
                    continue
                step, swing = map(max, own(before, scope), own(after, scope))
                assert largest_step(moved[scope]) <= 1.05 * step + swing / frames, f"{words}: {scope}"


def another(parameter):
    """Another value of a parameter that does not move."""
    if isinstance(parameter, Choice):
        return parameter.options[-1] if parameter.default != parameter.options[-1] else parameter.options[0]
    if isinstance(parameter, Count):
        return min(max(parameter.low, 2 * parameter.default), parameter.high)
    if isinstance(parameter, Tiles):
        return OTHER_TILE
    if isinstance(parameter, FilePath):
        return OTHER_SOUND
    if isinstance(parameter, Numbers | Rows):
        return parameter.default[1:]
    return parameter.value(0.4)


FADED = [
    (type, parameter)
    for type in sorted(REGISTRY)
    for parameter in REGISTRY[type].parameters.values()
    if not isinstance(parameter, Number) or parameter.fades
]


def heard(programs, walks):
    """The first tile's output: of one program, or of one that is faded over to another from `EDIT` on."""
    fader, out = ProgramFader(programs[0]), []
    for at in range(0, FRAMES, BLOCK):
        fader.update(at)
        if at == EDIT and len(programs) > 1:
            fader.crossfade(programs[1], at)
        for program in programs:
            program.signals[0][:] = engine_signals(at, walks)
        fader.run(at, BLOCK)
        out.append(fader.current.output[0].copy())
    return np.concatenate(out)


@pytest.mark.parametrize(("type", "parameter"), FADED, ids=[f"{type}.{p.name}" for type, p in FADED])
def test_what_cannot_be_moved_is_faded_over(type, parameter):
    setting = setting_of(type, parameter.name)
    patch, scopes = sounding(type, setting)
    assert moved_numbers(patch, patch.set(type, parameter.name, another(parameter), REGISTRY), REGISTRY) is None
    patch = patch.add("gain", REGISTRY).add("tile-output", REGISTRY)
    patch = patch.connect(scopes[0], f"{patch.nodes[-2].id}.signal", REGISTRY)
    patch = patch.connect(f"{patch.nodes[-2].id}.out", f"{patch.nodes[-1].id}.acceleration", REGISTRY)
    edited = patch.set(type, parameter.name, another(parameter), REGISTRY)
    walks = setting.walks
    alone = [heard([build(replace(one, seed=seed), [])], walks) for one in (patch, edited) for seed in seeds(type)]
    both = heard([build(one, []) for one in (patch, edited)], walks)
    assert np.any(both != alone[0]), "the edit is not heard"
    own = max(np.abs(np.diff(one)).max() for one in alone)
    swing = max(np.abs(one).max() for one in alone)
    assert largest_step(both) <= 1.05 * own + 2.0 * swing / FADE
