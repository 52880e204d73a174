"""The stick-slip node: when it slips, what its statistics are."""

import numpy as np
import pytest

from underfoot.models.stick_slip.oscillator import BlockOnBelt
from underfoot.models.stick_slip.quantile_table import LONGEST
from underfoot.models.stick_slip.slip_distribution import SlipDistribution
from underfoot.nodes import REGISTRY, stickslip
from underfoot.patch.patch import Patch
from underfoot.patch.program import Program

RATE, BLOCK = 48_000, 4_800


def node(**parameters):
    """A node pressed by the tile's force; a wire that is not driven leaves the velocity at its value."""
    patch = Patch(seed=5).add("tile-force", REGISTRY).add("stick-slip", REGISTRY, **parameters)
    return patch.connect("tile-force.force", "stick-slip.force", REGISTRY)


def play(patch, force, tiles=("t1",)):
    """Acceleration [frames] and events of the last tile under `force` [frames]."""
    scopes = ["stick-slip.acceleration", "stick-slip.events"]
    program = Program(patch, REGISTRY, tiles, rate=RATE, block=BLOCK, scopes=scopes)
    signal, events = [], []
    for at in range(0, force.size, BLOCK):
        program.engine_signals["force_n"][:] = force[at : at + BLOCK]
        for name in ("x_m", "y_m"):
            if name in program.engine_signals:
                program.engine_signals[name][:] = 0.0
        program.run(at, BLOCK)
        signal.append(program.scope[scopes[0]][-1].copy())
        events.append(program.events(scopes[1]))
    return np.concatenate(signal), np.concatenate(events), program


def test_slips_follow_the_distribution_of_its_parameters():
    w0 = 2.0 * np.pi * 400.0
    parameters = {"frequency": 400.0, "damping": 40, "noise": 50, "start": 200, "reference": 350.0, "loudness": 3.0}
    _, events, _ = play(node(**parameters), np.full(40 * RATE, 350.0))
    slip = SlipDistribution.solve(BlockOnBelt(1.0, 0.4, 0.5, 1.0, 2.0, 0.0), LONGEST, 1e-4)
    durations = np.sort(events[:, 2]) * w0
    risen = (np.arange(durations.size) + 0.5) / durations.size
    assert durations.size > 5_000
    most = 1e-3 + 1.95 / np.sqrt(durations.size)  # the requested error, and Kolmogorov's bound at 0.1 %
    assert np.abs(np.interp(durations, slip.duration.points, slip.duration.cdf) - risen).max() < most
    assert events[:, 1].mean() == pytest.approx(3.0, rel=0.03), "at the reference force and 0.1 m/s, the loudness"


def test_it_is_silent_and_asleep_unless_pressed_and_loud_as_it_is_pressed():
    force = np.zeros(8 * BLOCK)
    force[BLOCK : 4 * BLOCK] = 350.0
    signal, events, program = play(node(), force)
    assert not signal[:BLOCK].any()
    assert not signal[4 * BLOCK :].any()
    assert BLOCK <= events[0, 0] <= events[-1, 0] < 4 * BLOCK
    assert program.awake()["stick-slip"] == 0
    louder, harder, _ = play(node(), 2.0 * force)
    assert np.allclose(louder, 2.0 * signal)
    assert np.allclose(harder[:, 1], 2.0 * events[:, 1])


def test_a_belt_that_stands_makes_no_slip():
    signal, events, _ = play(node(velocity=0.0), np.full(4 * BLOCK, 700.0))
    assert not signal.any()
    assert events.size == 0


def test_force_and_velocity_below_0_make_no_slip():
    patch = node().add("gain", REGISTRY).connect("tile-force.force", "gain.signal", REGISTRY)
    patch = patch.connect("gain.out", "stick-slip.velocity", REGISTRY)
    signal, events, _ = play(patch, np.full(4 * BLOCK, -5.0))
    assert not signal.any()
    assert events.size == 0


def test_strength_and_acceleration_go_with_the_belt_and_the_acceleration_with_its_level():
    slow, few, _ = play(node(velocity=0.05, level=0.1), np.full(4 * BLOCK, 700.0))
    fast, many, _ = play(node(velocity=0.2, level=0.3), np.full(4 * BLOCK, 700.0))
    assert np.allclose(fast, 12.0 * slow)
    assert np.allclose(many[:, 1], 4.0 * few[:, 1])


def test_twice_the_frequency_slips_twice_as_often_and_shorter():
    low, high = (play(node(frequency=hz), np.full(10 * RATE, 700.0))[1] for hz in (100.0, 200.0))
    assert len(high) == pytest.approx(2 * len(low), rel=0.1)
    assert high[:, 2].mean() == pytest.approx(0.5 * low[:, 2].mean(), rel=0.1)


def test_a_smaller_error_makes_a_larger_table():
    values = {"damping": 40, "noise": 30, "start": 150}
    sizes = [stickslip.slip_table(values | {"error": error}).size for error in ("0.03", "0.003", "0.0003")]
    assert sizes == sorted(sizes)
    assert sizes[-1] > 10 * sizes[0]
