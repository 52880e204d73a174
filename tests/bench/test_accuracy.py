"""The naive methods compute what they say, and a task is measured point by point."""

import math

import numpy as np
import pytest
from scipy import stats

from underfoot.bench import accuracy, naive
from underfoot.bench.method_comparison import Method, Task, measured
from underfoot.models.elasto_plastic import Ground
from underfoot.models.modal.impact import Hammer, ModalObject
from underfoot.models.stick_slip.oscillator import BlockOnBelt


def test_every_point_has_its_own_error_and_time():
    task = Task(
        "halves",
        "series",
        "distance from 1",
        lambda result, knob: abs(result - 1.0) + 0.0 * knob,
        [Method("sum", "terms", (1, 2, 3), lambda n: 1.0 - 0.5**n), Method("one", "", (0,), lambda _: 1.0, True)],
    )
    found = measured(task, 0.0)
    assert [point.error for point in found.curves[0].points] == [0.5, 0.25, 0.125]
    assert [curve.naive for curve in found.curves] == [False, True]
    assert all(point.seconds > 0.0 for curve in found.curves for point in curve.points)
    assert found.curves[0].points[2].knob == 3.0


@pytest.mark.parametrize("make", [accuracy.modal_banks, accuracy.tones, accuracy.strain_rates])
def test_models_are_as_exact_as_their_oracles_say(make):
    for task in make(True):
        ours = task.methods[0]
        assert not ours.naive
        assert any(method.naive for method in task.methods)
        assert task.error(ours.run(ours.values[0]), ours.values[0]) < 1e-6


def test_a_lossless_blow_on_a_free_mass_leaves_it_with_twice_the_common_speed():
    mass, by = ModalObject([1e-6], [0.0], [0.06], [1.0]), Hammer(0.02, 1.0, 1e6)
    moved = naive.struck_object(by, mass, np.array([0.0, 0.01, 0.02]), "DOP853", 1e-10)
    assert (moved[2] - moved[1]) / 0.01 == pytest.approx(2.0 * 0.02 / 0.08, rel=1e-6)


def test_a_filter_for_each_mode_rings_as_the_closed_form():
    strike = np.eye(1, 100)[0]
    n = np.arange(100)
    expected = 2.0 * np.exp(-30.0 * n / 48e3) * np.sin(2.0 * np.pi * 700.0 * n / 48e3)
    np.testing.assert_allclose(naive.filter_per_mode([700.0], [30.0], [2.0], strike, 48e3), expected, atol=1e-12)


@pytest.mark.parametrize("method", [naive.sorted_fibres, naive.scanned_fibres])
def test_bundles_break_at_their_thresholds(method):
    thresholds = np.sort(2.5 * np.random.default_rng(4).weibull(4.0, 50))
    load = np.linspace(0.0, 20.0, 20_000)
    strain = method(load, 50, 4.0, 2.5, 4)
    run_all = np.array([np.count_nonzero(thresholds >= x) for x in strain])
    near = np.abs(strain * run_all - load) <= 1e-9  # but for the frame in which a fibre breaks
    assert near.mean() > 0.99


def test_ground_slips_where_its_threshold_is_reached():
    force, moved = np.linspace(0.0, 300.0, 100_000), np.empty(100_000)
    naive.slip_by_euler(force, 1e-5, Ground().parameters(), 5e-3, moved)
    first = int(np.argmax(moved > 100.0 / 4e5))
    assert force[first] == pytest.approx(200.0, rel=1e-2)  # both springs carry half
    assert moved[-1] > force[-1] / 8e5


def test_strain_rate_of_a_step_has_its_closed_form():
    w0, out = 2.0 * math.pi * 12.5, np.empty(20_000)
    naive.strain_rate_by_euler(np.ones(20_000), 1e-5, w0, 1.0, 2.0, out)
    t = 1e-5 * np.arange(1, 20_001)
    np.testing.assert_allclose(out, t * np.exp(-w0 * t) / 2.0, atol=1e-3 / w0)


def test_pure_diffusion_passes_its_level_in_levy_s_time():
    durations = np.empty(4000)
    block = BlockOnBelt(1e-9, 0.0, 0.5, 1.0, 0.0, 0.0)
    naive.slips_by_euler_maruyama(block, 50.0, 1e-3, np.random.default_rng(2), durations)
    levy = stats.levy(scale=1.0)
    assert np.mean(durations < 5.0) == pytest.approx(levy.cdf(5.0), abs=0.04)
