"""The grid of bundles: its coupled motion, how it shares a load and follows the foot, and its life in real time."""

import math
from itertools import pairwise

import numpy as np
import pytest
from event_rows import rows_of
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import expm

from underfoot.errors import BadValue
from underfoot.models.fibre_bundle import bundle
from underfoot.models.fibre_bundle import grid as fracture_grid
from underfoot.models.fibre_bundle.bundle import FibreBundle
from underfoot.models.fibre_bundle.grid import Contact, FibreGrid, Trace
from underfoot.models.signals.events import event_list
from underfoot.models.signals.random import stream_key

RATE = 48000.0
BUNDLE = {"scale": 2.5, "stiffness": 1.0, "mass": 1e-5, "damping": 0.003, "creep": 0.0}
GRID = {"columns": 3, "rows": 2, "width_m": 0.3, "depth_m": 0.2, "print_m": 0.06, "coupling": 1.0, "rubble": 0.02}
UNTRACED = Trace(np.empty((0, 1)), np.empty(0))


def designed(model="exact", rate=RATE, fibres=500, renewal_s=0.01, **changes):
    """Coefficients of a grid in real time: a cell that has wholly broken holds its strain."""
    of_bundle = {name: changes.get(name, value) for name, value in BUNDLE.items()}
    of_grid = {name: changes.get(name, value) for name, value in GRID.items()}
    assert not set(changes) - {*BUNDLE, *GRID}
    coefficients = fracture_grid.COEFFICIENTS.zeros(**fracture_grid.sizes(of_grid["columns"] * of_grid["rows"]))
    bundle = FibreBundle(fibres, 4.0, **of_bundle, model=model, renewal_s=renewal_s)
    FibreGrid(bundle, **of_grid).design(rate, coefficients)
    unit = 0.5 * of_bundle["stiffness"] * of_bundle["scale"] ** 2
    c = coefficients.bundle
    c.loudness, c.softness, c.holds = unit**-0.5, 0.5, 1.0
    return coefficients


def at_rest(cells=6):
    return fracture_grid.STATE.zeros(**fracture_grid.sizes(cells))


def played(coefficients, force, x_m, y_m, cells=6, cuts=(), state=None, frame=0):
    state = at_rest(cells) if state is None else state
    strain, found = np.zeros(force.size), []
    for i, j in pairwise([0, *sorted(cuts), force.size]):
        events, contact = event_list(room=j - i), Contact(force[i:j], x_m[i:j], y_m[i:j])
        fracture_grid.run(contact, stream_key("grid"), frame + i, coefficients, state, strain[i:j], events, UNTRACED)
        found.append(rows_of(events))
    return strain, np.concatenate(found), state


def response(force, x_m, y_m, **grid):
    """Of a grid of bundles of 500 at `RATE`."""
    return FibreGrid(FibreBundle(500, mass=1e-5, damping=0.003), **grid).response(force, x_m, y_m, RATE)


def footstep(peak=3500.0, frames=4000):
    """A step that rolls over the tile, and a rest."""
    force = np.concatenate((peak * np.sin(np.linspace(0.0, np.pi, frames)) ** 2, np.zeros(1000)))
    return force, np.linspace(-0.12, 0.12, force.size), np.linspace(-0.02, 0.04, force.size)


def laplacian(columns, rows):
    matrix = np.zeros((columns * rows, columns * rows))
    for cell in range(columns * rows):
        for other in range(columns * rows):
            apart = abs(cell % columns - other % columns) + abs(cell // columns - other // columns)
            matrix[cell, other] = -1.0 if apart == 1 else 0.0
    return matrix - np.diag(matrix.sum(1))


def print_shares(x_m, y_m):
    """The shares of a 3 x 2 grid on 0.3 m by 0.2 m under a Gaussian print of 0.06 m."""
    across, along = np.meshgrid([-0.1, 0.0, 0.1], [-0.05, 0.05])
    weights = np.exp(-((across - x_m) ** 2 + (along - y_m) ** 2) / (2 * 0.06**2)).ravel()
    return weights / weights.sum()


@pytest.mark.parametrize("rate", [12000.0, 48000.0])
def test_unbroken_cells_move_as_the_coupled_system_does(rate):
    frames, coupling, mass, damping = int(0.02 * rate), 2.0, 1e-5, 0.003
    shares = print_shares(-0.1, 0.05)
    force = 2000.0 * np.arange(1, frames + 1) / frames
    coefficients = designed(rate=rate, scale=1e6, coupling=coupling)
    strain, _, state = played(coefficients, force, np.full(frames, -0.1), np.full(frames, 0.05))
    system = np.zeros((14, 14))  # strains, speeds, load, its slope
    system[:6, 6:12] = np.eye(6)
    system[6:12, :6] = -(np.eye(6) + coupling * laplacian(3, 2)) / mass
    system[6:12, 6:12] = -damping / mass * np.eye(6)
    system[6:12, 12] = shares / 500.0 / mass
    system[12, 13] = 2000.0 / 0.02
    start = np.zeros(14)
    start[13] = 1.0
    exact = np.array([expm(system / rate * i) @ start for i in range(1, frames + 1)])
    error = np.linalg.norm(strain - exact[:, :6].mean(1)) / np.linalg.norm(exact[:, :6].mean(1))
    assert error < 2e-4 * (12000.0 / rate) ** 2
    np.testing.assert_allclose(state.strain[:6], exact[-1, :6], rtol=1e-2 * (12000.0 / rate) ** 2)


def test_a_standing_load_bends_the_grid_as_statics_say():
    frames = 48000
    place = np.full(frames, 0.03), np.full(frames, -0.02)
    _, _, state = played(designed(scale=1e6), np.full(frames, 900.0), *place)
    wanted = np.linalg.solve(np.eye(6) + laplacian(3, 2), 900.0 / 500.0 * print_shares(0.03, -0.02))
    np.testing.assert_allclose(state.strain[:6], wanted, rtol=1e-5)


def test_one_cell_is_the_bundle():
    force, x_m, y_m = footstep(620.0)
    coefficients = designed(columns=1, rows=1)
    strain, events, _ = played(coefficients, force, x_m, y_m, cells=1)
    one, found = bundle.Motion(*np.zeros((3, force.size)), *np.zeros((2, 0))), event_list(room=force.size)
    bundle.run(force, stream_key("grid"), 0, coefficients.bundle, bundle.STATE.zeros(), one, found)
    assert len(found) > 20
    np.testing.assert_allclose(strain, one.strain, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(events, rows_of(found), rtol=1e-9)


def test_failures_follow_the_foot():
    frames = 9600
    force = np.full(frames, 1400.0)
    x_m = np.where(np.arange(frames) < frames // 2, -0.1, 0.1)
    result = response(force, x_m, np.zeros(frames), columns=3, rows=1, coupling=0.0)
    first, second = result.failures[: frames // 2].sum(0), result.failures[frames // 2 :].sum(0)
    assert first[0] > 10 * max(first[2], 1)
    assert second[2] > 10 * max(second[0], 1)
    assert (result.energy > 0.0).sum() == (result.failures.sum(1) > 0).sum()


def test_what_a_broken_cell_carried_goes_to_its_neighbours():
    frames = 4800
    held = 1200.0 * np.minimum(np.arange(frames) / 2400.0, 1.0)
    press = {"columns": 5, "rows": 1, "print_m": 0.02}
    alone, tied = (
        response(held, np.zeros(frames), np.zeros(frames), coupling=coupling, **press).failures.sum(0)
        for coupling in (0.0, 0.3)
    )
    assert alone[2] == tied[2] == 500
    assert alone[[0, 1, 3, 4]].sum() == 0
    assert tied[[1, 3]].min() > tied[[0, 4]].max()
    assert tied[[1, 3]].min() > 20


def test_a_stiff_coupling_shares_the_load_among_all():
    force, x_m, y_m = footstep(2500.0)
    _, _, state = played(designed(coupling=500.0), force[:2000], x_m, y_m)
    assert state.strain[:6].min() > 0.98 * state.strain.max() > 0.5


@pytest.mark.parametrize("model", ["exact", "inverse"])
def test_any_split_gives_the_same_bits(model):
    coefficients, step = designed(model), footstep()
    strain, events, state = played(coefficients, *step, frame=10**7 + 5)
    assert len(events) > 30
    frames = np.floor(events[:, 0])
    assert (np.diff(frames) > 0).all()
    rng = np.random.default_rng(5)
    for cuts in (range(7, 5000, 7), range(64, 5000, 64), rng.integers(0, 5000, 300)):
        parted, found, left = played(coefficients, *step, cuts=cuts, frame=10**7 + 5)
        np.testing.assert_array_equal(parted, strain)
        np.testing.assert_array_equal(found, events)
        assert (left.worn, left.load) == (state.worn, state.load)
        for name in ("strain", "speed", "failed", "next_hazard", "share", "next_share", "breaking"):
            np.testing.assert_array_equal(getattr(left, name), getattr(state, name))


def test_after_the_renewal_time_the_ground_is_fresh():
    force, x_m, y_m = footstep()
    rest = np.zeros(9000)
    twice = [np.concatenate((values, rest, values)) for values in (force, x_m, y_m)]
    strain, events, state = played(designed(), *twice)
    slept, found, _ = played(designed(), force, x_m, y_m, frame=14000)
    np.testing.assert_allclose(strain[14000:], slept, atol=1e-9)
    again = events[events[:, 0] > 14000]
    np.testing.assert_allclose(again, found, rtol=1e-6)
    assert not np.isclose(events[0, 0] + 14000, again[0, 0], atol=1e-3)
    assert fracture_grid.tail(state, designed()) < math.inf


def test_stiff_cells_come_to_rest_while_they_wait_for_their_renewal():
    force = np.concatenate((np.full(500, 1e6), np.zeros(12_000)))
    coefficients = designed(stiffness=1e6, damping=100.0, renewal_s=1.0)
    strain, _, state = played(coefficients, force, *np.zeros((2, force.size)), cuts=range(63, 12_500, 63), frame=5)
    assert strain[498] > 1e-4
    assert not ((strain != 0.0) & (np.abs(strain) < np.finfo(float).tiny)).any()
    assert not state.strain.any()
    assert not state.speed.any()


def test_reloading_below_the_former_load_breaks_nothing():
    force, x_m, y_m = footstep()
    x_m[:], y_m[:] = 0.05, 0.0
    twice = [np.concatenate((values, factor * values)) for values, factor in ((force, 0.9), (x_m, 1), (y_m, 1))]
    _, events, _ = played(designed(renewal_s=1.0), *twice)
    assert len(events) > 30
    assert (events[:, 0] < 5000).all()


@settings(max_examples=60)
@given(data=st.data())
def test_an_unloaded_grid_comes_to_rest_within_its_bound(data):
    changes = {
        "stiffness": data.draw(st.sampled_from([1e-3, 1.0, 1e6])),
        "mass": data.draw(st.sampled_from([1e-6, 1e-5, 1e-3, 1.0])),
        "damping": data.draw(st.sampled_from([1e-4, 0.003, 1.0])),
        "coupling": data.draw(st.sampled_from([0.0, 0.3, 10.0, 1e4])),
    }
    coefficients, state = designed(renewal_s=1e-9, **changes), at_rest()
    state.strain[:6], state.speed[:6] = np.reshape(
        data.draw(st.lists(st.floats(-1.0, 1.0), min_size=12, max_size=12)), (2, 6)
    )
    bound = fracture_grid.tail(state, coefficients)
    still = np.zeros(4800)
    strain, events, _ = played(coefficients, still, still, still, state=state)
    assert np.abs(strain).max() <= bound
    assert fracture_grid.tail(state, coefficients) <= 1.5 * bound
    assert len(events) == 0


@settings(max_examples=40)
@given(data=st.data())
def test_every_finite_input_is_answered_by_finite_values(data):
    changes = {
        "scale": data.draw(st.sampled_from([1e-6, 2.5, 1e6])),
        "stiffness": data.draw(st.sampled_from([1e-6, 1.0, 1e9])),
        "mass": data.draw(st.sampled_from([0.0, 1e-3, 1e6])),
        "damping": data.draw(st.sampled_from([0.0, 1e3])),
        "print_m": data.draw(st.sampled_from([1e-4, 0.06, 1e6])),
        "coupling": data.draw(st.sampled_from([0.0, 1.0, 1e9])),
    }
    values = st.lists(st.floats(allow_nan=False, allow_infinity=False), min_size=100, max_size=100)
    force, x_m, y_m = (np.array(data.draw(values)) for _ in range(3))
    coefficients = designed(data.draw(st.sampled_from(["exact", "inverse"])), **changes)
    strain, events, _ = played(coefficients, force, x_m, y_m)
    assert np.isfinite(strain).all()
    assert np.isfinite(events).all()


@pytest.mark.parametrize(
    "changes",
    [
        {"model": "mean"},
        {"columns": 0},
        {"rows": 33},
        {"width_m": 0.0},
        {"print_m": -1.0},
        {"coupling": math.nan},
        {"rubble": 0.0},
        {"pressure": math.inf},
        {"fibres": 0},
        {"x_m": [0.0]},
        {"y_m": [0.0, math.inf]},
    ],
)
def test_a_value_outside_its_range_is_named(changes):
    given = {"force": [0.0, 1.0], "x_m": [0.0, 0.0], "y_m": [0.0, 0.0], "fibres": 10, "model": "exact", **changes}
    grid = {name: value for name, value in changes.items() if name in (*GRID, "pressure")}
    with pytest.raises(BadValue, match=next(iter(changes))):
        FibreGrid(FibreBundle(given["fibres"], model=given["model"]), **grid).response(
            given["force"], given["x_m"], given["y_m"], RATE
        )
