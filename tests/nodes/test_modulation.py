"""Modulation: what moves parameters, against closed forms, NumPy and SciPy."""

import msgspec
import numpy as np
import pytest
from scipy import signal, stats

from underfoot.nodes import REGISTRY
from underfoot.patch.patch import Patch
from underfoot.patch.program import Program

RATE, TILES = 48_000, ("t1", "t2")
TIME = np.arange(RATE) / RATE


def played(patch, scope, frames=RATE, start=0, force=None, strikes=(), seed=None):
    """What comes out on each tile, [tile, frame]; strikes are session frames, on the first tile."""
    patch = patch if seed is None else msgspec.structs.replace(patch, seed=seed)
    program = Program(patch, REGISTRY, TILES, block=960, scopes=[scope])
    for frame in strikes:
        program.strike("", TILES[0], frame, 1.0)
    out = np.zeros((len(TILES), frames))
    for at in range(0, frames, 960):
        if force is not None:
            program.engine_signals["force_n"][0, :960] = force[at : at + 960]
        program.run(start + at, 960)
        out[:, at : at + 960] = program.scope[scope]
    return out


def alone(type, **parameters):
    return Patch().add(type, REGISTRY, **parameters)


WAVES = {
    "sine": np.sin,
    "triangle": lambda turn: signal.sawtooth(turn + 0.5 * np.pi, 0.5),
    "saw": signal.sawtooth,
    "square": lambda turn: signal.square(turn + 1e-9),
}


@pytest.mark.parametrize("shape", WAVES)
def test_an_lfo_is_the_wave_that_scipy_draws_but_for_the_width_of_its_edges(shape):
    heard = played(alone("lfo", shape=shape, frequency=3.0, low=100.0, high=300.0), "lfo.out")[0]
    expected = 200.0 + 100.0 * WAVES[shape](2.0 * np.pi * 3.0 * TIME)
    apart = np.abs(heard - expected)
    assert np.count_nonzero(apart > 0.7) <= 6 * 49  # two edges of 1 ms in each of three periods
    if shape in ("sine", "triangle"):
        assert apart.max() < 1e-9
    assert np.abs(np.diff(heard)).max() <= 200.0 / 48 * 1.01


def test_an_lfo_keeps_time_with_the_session_wherever_it_begins():
    patch = alone("lfo", frequency=3.0, phase=0.25)
    late = played(patch, "lfo.out", 960, start=31 * 960)[0]
    assert np.allclose(late, 0.5 + 0.5 * np.cos(2.0 * np.pi * 3.0 * (np.arange(960) + 31 * 960) / RATE), atol=1e-9)


def test_an_lfo_begins_again_at_the_time_of_an_event_between_two_frames():
    patch = alone("lfo", frequency=50.0).add("strike", REGISTRY).connect("strike.out", "lfo.restart", REGISTRY)
    heard = played(patch, "lfo.out", strikes=[9_600.9])[0]
    expected = 0.5 + 0.5 * np.sin(2.0 * np.pi * 50.0 * (TIME - 9_600.9 / RATE))
    np.testing.assert_allclose(heard[9_650:], expected[9_650:], rtol=0.0, atol=1e-9)  # its step takes 1 ms


def test_steps_count_from_the_time_of_an_event_between_two_frames():
    patch = alone("step-sequence", values=[0.0, 1.0], frequency=50.0, glide=0.01).add("strike", REGISTRY)
    patch = patch.connect("strike.out", "step-sequence.advance", REGISTRY)
    heard = played(patch, "step-sequence.out", strikes=[9_600.9])[0]
    way = np.interp((np.arange(9_700, RATE) - 9_600.9) % 1920, [0, 480, 960, 1440], [1.0, 0.0, 0.0, 1.0])
    np.testing.assert_allclose(heard[9_700 + 480 :], way[480:], rtol=0.0, atol=1e-9)


def test_an_event_sends_an_lfo_back_to_its_beginning_without_a_step():
    patch = (
        alone("lfo", frequency=2.0, shape="saw").add("strike", REGISTRY).connect("strike.out", "lfo.restart", REGISTRY)
    )
    heard = played(patch, "lfo.out", strikes=[9_600])[0]
    assert np.abs(np.diff(heard)).max() < 1.1 / 48
    later = np.arange(10_000, 30_000)
    assert np.allclose(heard[later], (later - 9_600) * 2.0 / RATE / 0.998, atol=1e-9)


def test_an_edge_under_way_where_an_lfo_restarts_does_not_take_it_beyond_its_ends():
    patch = alone("lfo", shape="square", frequency=10.0, phase=0.505).add("strike", REGISTRY)
    patch = patch.connect("strike.out", "lfo.restart", REGISTRY)
    heard = played(patch, "lfo.out", 4_800, strikes=[1_000.4])[0]  # from 0, in the middle of an edge down
    assert heard.min() == 0.0


def test_a_random_walk_is_normal_and_forgets_as_its_time_constant_says():
    heard = np.concatenate(
        [played(alone("random-walk", time=0.1), "random-walk.out", 4 * RATE, seed=seed) for seed in range(25)]
    )
    grid = heard[:, ::4_800]  # a time constant apart
    assert stats.kstest(grid[:, ::4].ravel(), "norm").pvalue > 1e-3
    at = heard[:, ::320]
    for lag in (0, 3, 15, 45):
        product = np.mean(at[:, : at.shape[1] - 45] * at[:, lag : at.shape[1] - 45 + lag])
        assert product == pytest.approx(np.exp(-lag * 320 / RATE / 0.1), abs=0.06)
    assert abs(np.mean(heard[0] * heard[1])) < 0.5  # tiles wander apart


def test_steps_of_a_random_walk_are_what_its_exact_discretisation_leaves_over():
    keys = [played(alone("random-walk", time=0.05), "random-walk.out", 9_600, seed=seed)[0, ::32] for seed in range(40)]
    decay = np.exp(-32 / RATE / 0.05)
    left = np.concatenate([walk[1:] - decay * walk[:-1] for walk in keys]) / np.sqrt(1.0 - decay**2)
    assert stats.kstest(left, "norm").pvalue > 1e-3
    assert abs(np.corrcoef(left[1:], left[:-1])[0, 1]) < 0.03


def test_a_random_walk_that_is_heard_late_is_the_same_walk():
    patch = alone("random-walk", time=2.0, centre=5.0, deviation=0.5)
    whole, late = played(patch, "random-walk.out"), played(patch, "random-walk.out", 9_600, start=28_800)
    assert late.tobytes() == whole[:, 28_800:38_400].tobytes()


def test_steps_come_at_their_frequency_and_glide():
    values = [0.0, 1.0, 0.25]
    patch = alone("step-sequence", values=values, frequency=10.0, glide=0.02, low=-1.0, high=3.0)
    heard = played(patch, "step-sequence.out")[0]
    corners = [(0.0, 0.0)]
    for step in range(1, 11):
        corners += [(0.1 * step, values[(step - 1) % 3]), (0.1 * step + 0.02, values[step % 3])]
    expected = -1.0 + 4.0 * np.interp(TIME, *np.array(corners).T)
    assert np.abs(heard - expected).max() < 1e-6


def test_steps_come_at_events():
    patch = alone("step-sequence", values=[0.2, 0.7], pace="at events", glide=0.0).add("strike", REGISTRY)
    heard = played(
        patch.connect("strike.out", "step-sequence.advance", REGISTRY), "step-sequence.out", strikes=[100, 500]
    )
    assert heard[0, [99, 100, 499, 500, 2_000]].tolist() == [0.2, 0.7, 0.7, 0.2, 0.2]
    assert (heard[1] == 0.2).all()


def test_a_stance_curve_goes_from_0_to_100_percent_of_the_contact():
    curve = [[0.0, 0.2], [30.0, 1.0], [100.0, 0.4]]
    patch = alone("stance-curve", curve=curve, duration=0.5, low=10.0, high=20.0).add("tile-force", REGISTRY)
    force = np.zeros(RATE)
    force[4_800:36_000] = 500.0  # longer than was expected
    heard = played(patch.connect("tile-force.force", "stance-curve.force", REGISTRY), "stance-curve.out", force=force)
    share = (np.arange(RATE) - 4_799) / (0.5 * RATE)
    expected = 10.0 + 10.0 * np.interp(share, [0.0, 0.3, 1.0], [0.2, 1.0, 0.4])
    assert np.allclose(heard[0, :36_000], expected[:36_000], atol=1e-9)
    assert np.allclose(heard[0, 36_240:], 12.0)
    assert np.abs(np.diff(heard[0])).max() == pytest.approx(10.0 / 240.0), "it goes back by its range in 5 ms"
    assert (heard[1] == 12.0).all()


def test_a_map_bends_a_range_into_another():
    patch = alone("map", low=100.0, high=500.0, out_low=900.0, out_high=100.0, exponent=2.0).add("tile-force", REGISTRY)
    force = np.linspace(0.0, 700.0, RATE)
    heard = played(patch.connect("tile-force.force", "map.signal", REGISTRY), "map.out", force=force)[0]
    assert np.allclose(heard, 900.0 - 800.0 * np.clip((force - 100.0) / 400.0, 0.0, 1.0) ** 2.0, atol=1e-9)


def test_a_sample_is_held_from_event_to_event():
    patch = alone("sample-and-hold", glide=0.0).add("strike", REGISTRY).add("tile-force", REGISTRY)
    patch = patch.connect("strike.out", "sample-and-hold.trigger", REGISTRY)
    force = np.arange(1.0, RATE + 1.0)
    heard = played(
        patch.connect("tile-force.force", "sample-and-hold.signal", REGISTRY), "sample-and-hold.out", force=force,
        strikes=[100, 500],
    )[0]  # fmt: skip
    assert heard[[99, 100, 499, 500, 40_000]].tolist() == [0.0, 101.0, 101.0, 501.0, 501.0]


def test_a_delay_without_feedback_or_damping_hands_a_control_signal_on_unchanged():
    patch = alone("lfo", frequency=5.0, low=100.0, high=200.0).add(
        "delay", REGISTRY, time=0.1, feedback=0.0, damping=0.0
    )
    patch = patch.connect("lfo.out", "delay.signal", REGISTRY)
    late, now = (played(patch, scope)[0] for scope in ("delay.out", "lfo.out"))
    assert np.allclose(late[4_800:], now[:-4_800], atol=1e-9)
    assert not late[:4_800].any()


def test_a_driven_parameter_is_where_the_wire_says_in_its_own_unit():
    base = Patch(seed=2).add("noise", REGISTRY, amplitude=1.0).add("low-pass", REGISTRY, cutoff=300.0)
    base = base.connect("noise.out", "low-pass.signal", REGISTRY)
    driven = base.set("low-pass", "cutoff", 5_000.0, REGISTRY).add("value", REGISTRY, low=200.0, high=400.0)
    driven = driven.connect("value.out", "low-pass.cutoff", REGISTRY)
    assert played(base, "low-pass.out")[0].tobytes() == played(driven, "low-pass.out")[0].tobytes()


def test_a_sleeping_map_wakes_when_its_range_is_moved():
    patch = alone("map").add("tile-force", REGISTRY).connect("tile-force.force", "map.signal", REGISTRY)
    program = Program(patch, REGISTRY, TILES, block=960, scopes=["map.out"])
    program.run(0, 960)
    assert program.awake()["map"] == 0
    program.set("map", "out_low", 5.0, 960)
    program.run(960, 960)
    assert program.scope["map.out"][0, -1] == 5.0
