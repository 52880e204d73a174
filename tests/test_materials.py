"""Material presets under one and the same step: told apart by spectrum and by events, loud by force, else asleep; and
what a foot gets of them, as the accelerometer of a simulated tile measures it that a step loads.

Two spectra, the shares of the power in thirds of an octave, are as far apart as the part that they do not share. Events
are known by their number, the spread of their intervals and the slope of their strengths.
"""

from functools import cache
from itertools import combinations, product

import msgspec
import numpy as np
import pytest
from measured import needs_data
from measured import walk as measured_walk

from underfoot.devices.replay import Replay
from underfoot.engine.commands import Play
from underfoot.engine.levels import SECONDS, levels_of
from underfoot.engine.loop import Loop, LoopOptions
from underfoot.engine.preview import one_step
from underfoot.engine.render import render_source
from underfoot.floor.profile import NOMINAL_ACCELERATION
from underfoot.models.gait import Footfall
from underfoot.nodes import REGISTRY
from underfoot.patch import preset_files
from underfoot.patch.patch import Patch
from underfoot.patch.program import Program

RATE, BLOCK, FRAMES = 48_000, 960, 48_000
SOURCES = ("fibre-bundle", "fibre-grid", "slip", "stick-slip")
MATERIALS = {
    name.removeprefix("material-"): Patch.load(path, REGISTRY)
    for name, path in preset_files.patches().items()
    if name.startswith("material-")
}
SEEDS = range(4)
GROUNDS = ("gravel", "snow", "wood", *(f"material-{name}" for name in MATERIALS))
EARS = ("gravel", *(f"material-{name}" for name in ("leaves", "ice", "sand-dry", "gravel-fine", "twigs")))

_played: dict[tuple, tuple] = {}


def step(weight_n):
    """One footfall on a tile: force, and where it is."""
    footfall = Footfall("left", 0.1, 0.673, -0.1, -0.05, 0.4, 0.26, 1.1 * weight_n, 0.72 * weight_n, 1.08 * weight_n)
    time = np.arange(FRAMES) / RATE
    force = footfall.force_n(time)
    x, y = footfall.centre_m(time)
    x, y = np.where(force > 0.0, (x, y), 0.0)
    return {"force_n": force, "x_m": x, "y_m": y, "cut": np.zeros(FRAMES)}


def play(material, seed=1, weight_n=700.0):
    """What a tile plays under the step, in m/s^2, and its events: (frame, strength, duration) each, in order."""
    if (material, seed, weight_n) not in _played:
        patch = msgspec.structs.replace(MATERIALS[material], seed=seed)
        program = Program(patch, REGISTRY, ("t1",), rate=RATE, block=BLOCK)
        engine_signals = step(weight_n)
        sources = [f"{node.id}.events" for node in patch.nodes if node.type in SOURCES]
        out, events = np.zeros(FRAMES), []
        for at in range(0, FRAMES, BLOCK):
            for name, signal in program.engine_signals.items():
                signal[0] = engine_signals[name][at : at + BLOCK]
            program.run(at, BLOCK)
            out[at : at + BLOCK] = program.output[0]
            events += [program.events(source) for source in sources]
        table = np.concatenate(events)
        _played[material, seed, weight_n] = out, table[np.argsort(table[:, 0], kind="stable")]
    return _played[material, seed, weight_n]


def spectrum(material, seed):
    """Frequencies from 40 Hz to 10 kHz, and the share of the power at each."""
    hz = np.fft.rfftfreq(FRAMES, 1.0 / RATE)
    heard = (hz >= 40.0) & (hz <= 10_000.0)
    power = np.abs(np.fft.rfft(play(material, seed)[0])[heard]) ** 2
    return hz[heard], power / power.sum()


def bands(material):
    """The share of the power in each third of an octave, on average over the seeds."""
    edges = 40.0 * 2.0 ** (np.arange(25) / 3.0)
    spectra = [spectrum(material, seed) for seed in SEEDS]
    return np.mean([np.histogram(hz, edges, weights=power)[0] for hz, power in spectra], axis=0)


def centroid_and_width(material, seed):
    """Of the power over the logarithm of frequency, in octaves above 1 Hz."""
    hz, power = spectrum(material, seed)
    octave = np.log2(hz)
    centre = (octave * power).sum()
    return centre, np.sqrt(((octave - centre) ** 2 * power).sum())


def event_statistics(material, seed):
    """How many events (log), the spread of their intervals (log), and the slope of their strengths' upper half (log).

    The slope is Hill's estimate of the exponent of a power law.
    """
    _, events = play(material, seed)
    intervals, strengths = np.log(np.diff(events[:, 0])), np.sort(np.log(events[:, 1]))
    upper = strengths[strengths.size // 2 :] - np.median(strengths)
    return np.log(len(events)), intervals.std(), -np.log(upper.mean())


def strangers(figures):
    """Which of `figures` [material, seed, figure] lie nearer to another material's mean than to that of their own."""
    within = np.sqrt(figures.var(axis=1).mean(axis=0))
    found = []
    for i, j in np.ndindex(figures.shape[:2]):
        means = figures.mean(axis=1)
        means[i] = np.delete(figures[i], j, axis=0).mean(axis=0)
        nearest = (((figures[i, j] - means) / within) ** 2).sum(axis=1).argmin()
        if nearest != i:
            found.append((list(MATERIALS)[i], j, list(MATERIALS)[nearest]))
    return found


def test_the_materials_that_are_promised_are_there():
    assert MATERIALS.keys() == {
        *("gravel-fine", "gravel-coarse", "sand-dry", "sand-wet", "snow-fresh", "snow-packed"),
        *("ice", "wood", "leaves", "twigs", "rubber"),
    }


def test_no_two_materials_share_their_spectrum():
    shares = {material: bands(material) for material in MATERIALS}
    for a, b in combinations(shares, 2):
        common = np.minimum(shares[a], shares[b]).sum()
        assert common < 0.7, f"{a} and {b} share {common:.0%} of their spectrum"


def test_every_step_is_known_by_centroid_and_width_of_its_spectrum():
    assert not strangers(np.array([[centroid_and_width(m, seed) for seed in SEEDS] for m in MATERIALS]))


def test_every_step_is_known_by_its_events():
    assert not strangers(np.array([[event_statistics(m, seed) for seed in SEEDS] for m in MATERIALS]))


@pytest.mark.parametrize("material", MATERIALS)
def test_twice_the_weight_is_louder(material):
    light, heavy = ([play(material, seed, weight)[0] for seed in SEEDS[:2]] for weight in (500.0, 1000.0))
    assert np.std(heavy) > 1.2 * np.std(light)


@pytest.mark.parametrize("material", MATERIALS)
def test_events_come_only_while_the_foot_is_down(material):
    _, events = play(material)
    down = np.flatnonzero(step(700.0)["force_n"])
    assert len(events) >= 5
    assert down[0] <= events[0, 0]
    assert events[-1, 0] <= down[-1] + 0.02 * RATE
    assert not play(material)[0][: down[0]].any()


@pytest.mark.parametrize("material", MATERIALS)
def test_it_is_silent_and_asleep_until_somebody_comes_and_again_when_he_has_gone(material):
    patch, engine_signals = MATERIALS[material], step(700.0)
    program = Program(patch, REGISTRY, ("t1", "t2"), rate=RATE, block=BLOCK)
    for at in range(0, 4 * FRAMES, BLOCK):
        for name, signal in program.engine_signals.items():
            signal[0] = engine_signals[name][at : at + BLOCK] if at < FRAMES else 0.0
        program.run(at, BLOCK)
        assert not program.output[1].any()
        if at == 0:
            assert not any(program.awake().values())
    assert program.report()["run"]
    assert not any(program.awake().values())
    assert not program.output.any()


def test_a_brittle_floor_lies_still_under_a_foot_that_only_stands():
    program = Program(MATERIALS["ice"], REGISTRY, ("t1",), rate=RATE, block=BLOCK)
    cracks = []
    for at in range(0, 4 * FRAMES, BLOCK):
        ramp = np.minimum((at + np.arange(BLOCK)) / (0.2 * RATE), 1.0)
        for name, signal in program.engine_signals.items():
            signal[0] = 850.0 * ramp if name == "force_n" else 0.0
        program.run(at, BLOCK)
        cracks.append(len(program.events("sheet.events")))
    assert sum(cracks[: FRAMES // BLOCK]) > 0
    assert sum(cracks[2 * FRAMES // BLOCK :]) == 0


@cache
def measured_step(name, seed=None):
    """What a step on one tile makes: the card's channels, and what the accelerometer measures."""
    force_n, source = one_step(SECONDS, float(RATE))
    options = LoopOptions(plates=("accelerometer",), seed=seed)
    loop = Loop(Patch.load(preset_files.patches()[name], REGISTRY), REGISTRY, source, options)
    loop.send(Play(True), 0)
    played = loop.play_all(len(force_n))
    return played[""].T.astype(np.float64), played["accelerometer"][:, 0].astype(np.float64)


def shares(signal, edges_hz):
    """The share of the power between each two frequencies."""
    power = np.abs(np.fft.rfft(signal)) ** 2
    found = np.histogram(np.fft.rfftfreq(signal.size, 1.0 / RATE), edges_hz, weights=power)[0]
    return found / power.sum()


@pytest.mark.parametrize("name", GROUNDS)
def test_it_reaches_the_foot(name):
    found = levels_of(Patch.load(preset_files.patches()[name], REGISTRY))
    assert found.measured.share_in_band >= 0.8
    assert found.measured.level_db >= 10.0
    assert found.headroom_db > 0.5


@pytest.mark.parametrize("name", GROUNDS)
def test_it_reaches_the_foot_on_a_calibrated_tile_too(name, profile):
    found = levels_of(Patch.load(preset_files.patches()[name], REGISTRY), profile=profile)
    assert found.measured.share_in_band >= 0.8
    assert found.measured.level_db >= 10.0
    assert found.headroom_db > 0.5


@needs_data
@pytest.mark.parametrize("name", GROUNDS)
def test_real_heels_do_not_drive_it_far_beyond_full_scale(name):
    floor, forces = measured_walk("adult/walk3")  # the hardest of the measured heels
    patch, source = Patch.load(preset_files.patches()[name], REGISTRY), Replay(forces, floor, RATE)
    played = render_source(patch, source, forces.seconds, LoopOptions(measures=True))
    peaks = np.abs(played.tiles["commanded"]).max(axis=0) / NOMINAL_ACCELERATION
    assert (peaks > 0.15).all()
    assert (peaks < 1.7).all()  # as docs/levels.md has it; of more, the limiter would take half


@pytest.mark.parametrize("name", EARS)
def test_what_is_for_ears_lies_above_1_khz_and_goes_to_no_shaker(name):
    felt, heard = measured_step(name)[0]
    assert shares(heard, [1000.0, 24_000.0])[0] > 0.8
    assert shares(felt, [1000.0, 24_000.0])[0] < 0.1
    assert 0.1 < np.abs(heard).max() < 0.9


def not_told_apart(distance, mean=False):
    """Pairs of materials of which some, or on average all, seeds are no farther apart than two seeds of either."""
    of_one = {m: max(distance(m, i, m, j) for i, j in combinations(SEEDS, 2)) for m in MATERIALS}
    closer = []
    for a, b in combinations(MATERIALS, 2):
        between = [distance(a, i, b, j) for i, j in product(SEEDS, SEEDS)]
        if (np.mean(between) if mean else min(between)) <= max(of_one[a], of_one[b]):
            closer.append((a, b))
    return closer


def test_every_pair_differs_more_by_its_events_than_two_seeds_of_one_material_do():
    found = {m: np.array([event_statistics(m, seed) for seed in SEEDS]) for m in MATERIALS}
    scatter = np.sqrt(np.mean([one.var(axis=0) for one in found.values()], axis=0))
    assert not not_told_apart(lambda a, i, b, j: np.linalg.norm((found[a][i] - found[b][j]) / scatter))


def test_every_pair_differs_more_by_its_measured_spectrum_than_two_seeds_of_one_material_do():
    thirds_hz = 40.0 * 2.0 ** (np.arange(25) / 3.0)
    found = {(m, seed): shares(measured_step(f"material-{m}", seed)[1], thirds_hz) for m in MATERIALS for seed in SEEDS}
    assert not not_told_apart(lambda a, i, b, j: 1.0 - np.minimum(found[a, i], found[b, j]).sum(), mean=True)
