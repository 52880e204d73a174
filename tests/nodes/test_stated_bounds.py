"""Nodes that only compute, beside NumPy, to the bound that each states as its accuracy."""

import re

import numpy as np
import pytest
import soundfile
from bare_row import BareRow
from scipy.signal import lfilter

from underfoot.nodes import REGISTRY

N, FROM = 960, 4000
TIME_S = np.arange(N) / 48_000.0
A, B, C, D = np.random.default_rng(5).normal(size=(4, N)) * 100.0
STEPS = np.array([0.2, 0.9, 0.4])

FORMULAS = {
    "gain": ({"gain": 2.5}, {"signal": A}, 2.5 * A),
    "multiply": ({}, {"a": A, "b": B}, A * B),
    "rectify": ({}, {"signal": A}, np.abs(A)),
    "mix": (
        {"level_a": 0.5, "level_b": -2.0, "level_c": 1e-3, "level_d": 10.0},
        {"a": A, "b": B, "c": C, "d": D},
        0.5 * A - 2.0 * B + 1e-3 * C + 10.0 * D,
    ),
    "scale": (
        {"low": -50.0, "high": 150.0, "out_low": 3.0, "out_high": -7.0},
        {"signal": A},
        3.0 - 10.0 * np.clip((A + 50.0) / 200.0, 0.0, 1.0),
    ),
    "map": (
        {"low": -50.0, "high": 150.0, "out_low": 3.0, "out_high": -7.0, "exponent": 2.0},
        {"signal": A},
        3.0 - 10.0 * np.clip((A + 50.0) / 200.0, 0.0, 1.0) ** 2,
    ),
    "value": ({"position": 0.3, "low": -4.0, "high": 8.0}, {}, np.full(N, -0.4)),
    "step-sequence": (
        {"values": STEPS.tolist(), "frequency": 46.875, "glide": 0.0, "low": 1.0, "high": 3.0},
        {},
        1.0 + 2.0 * STEPS[(FROM + np.arange(N)) // 1024 % STEPS.size],
    ),
    "roughness": (
        {"depth": 0.7, "frequency": 25.0},
        {"signal": A},
        A * (1.0 + 0.7 * np.sin(2.0 * np.pi * 25.0 * TIME_S)),
    ),
    "force-envelope": ({"full_force": 700.0}, {"force": np.abs(A)}, np.abs(A) / 700.0),
    "tile-force": ({}, {"force_n": np.abs(A)}, np.abs(A)),
    "tile-place": (
        {"from_x": 3.0, "from_y": -4.0},
        {"centre_x_m": A, "centre_y_m": B},
        (np.hypot(A - 3.0, B + 4.0), A, B),
    ),
    "contact": ({}, {"x_m": A, "y_m": B}, (A, B)),
    "tile-output": ({"level": 0.3}, {"acceleration": A}, 0.3 * A),
    "sound-output": ({"level": 0.3}, {"sound": A}, 0.3 * A),
}


@pytest.mark.parametrize("type", FORMULAS)
def test_a_node_computes_its_formula_to_the_bound_that_it_states(type):
    parameters, signals, expected = FORMULAS[type]
    row = BareRow(REGISTRY[type], **parameters)
    row.run(FROM, N, signals)
    bound = float(re.search(r"to (1e-\d+)", REGISTRY[type].accuracy)[1])
    assert np.abs(np.array(list(row.outputs.values())) - expected).max() <= bound * max(np.abs(expected).max(), 1.0)


def test_events_are_handed_on_as_they_came():
    row = BareRow(REGISTRY["join"])
    row.run(0, N, events={"a": [(3.25, 0.5, 0.2), (700.5, 2.0, 0.0)], "b": [(40.125, 1.5, 0.1)]})
    assert np.array(row.events["out"])[:, :3].tolist() == [[3.25, 0.5, 0.2], [40.125, 1.5, 0.1], [700.5, 2.0, 0.0]]
    row = BareRow(REGISTRY["strike"], strength=0.5)
    row.run(0, N, events={"by_hand": [(3.25, 0.5, 0.2)]})
    assert np.array(row.events["out"])[:, :3].tolist() == [[3.25, 0.25, 0.2]]
    row = BareRow(REGISTRY["rhythm"], begin="at events", notes=((0, 4, 1.0), (2, 4, 0.5)), bar=0.1)
    row.run(0, N, events={"start": [(3.25, 0.5, 0.0)]})
    assert np.array(row.events["out"])[:, :2].tolist() == [[3.25, 0.5], [403.25, 0.25]]


def test_events_wait_for_their_time_in_order_also_when_it_becomes_shorter():
    row, draw = BareRow(REGISTRY["event-delay"]), np.random.default_rng(3)
    due, made = [], []
    for frame in range(0, 200 * N, N):
        row.controls.values[0] = draw.uniform(0.0, 0.4) if frame < 150 * N else 0.0
        times = frame + np.sort(draw.choice(N, 40, replace=False)) + draw.uniform(0.0, 0.9, 40)
        events = np.column_stack([times, draw.uniform(0.1, 2.0, (40, 2))])
        row.run(frame, N, events={"strike": events.tolist()})
        due.extend(events + np.array([row.controls.values[0] * 48_000.0, 0.0, 0.0]))
        made.extend(row.events["out"][:, :3])
    due, made = np.array(sorted(due, key=lambda event: event[0])), np.array(made)
    frames, counts = np.unique(np.floor(due[:, 0]), return_counts=True)
    assert np.floor(made[:, 0]).tolist() == frames.tolist()  # those that are due in one frame are one event
    alone = frames[counts == 1]
    np.testing.assert_allclose(made[counts == 1], due[np.isin(np.floor(due[:, 0]), alone)], rtol=0.0, atol=1e-6)
    assert made[:, 1].sum() == pytest.approx(due[:, 1].sum())
    assert row.tail() == 0.0


def test_more_events_than_can_wait_are_lost_and_not_those_that_wait():
    row = BareRow(REGISTRY["event-delay"], time=1.0)
    for frame in range(0, 48_000, N):
        row.run(frame, N, events={"strike": [(float(time), 1.0, 0.0) for time in range(frame, frame + N, 8)]})
    assert row.tail() == np.inf
    made = []
    for frame in range(48_000, 96_000, N):
        row.run(frame, N)
        made.extend(row.events["out"][:, 0])
    assert made == [48_000.0 + 8.0 * k for k in range(4_000)]


def test_an_event_at_random_has_the_strength_of_its_frame():
    row, strength = BareRow(REGISTRY["poisson"], interval=0.002), np.linspace(0.1, 2.0, N)
    made = []
    for given in (np.ones(N), strength):
        row.run(FROM, N, {"strength": given})
        made.append(np.array(row.events["out"])[:, :2])
    (times, ones), (same, strengths) = made[0].T, made[1].T
    assert len(times) > 4
    assert times.tolist() == same.tolist()
    np.testing.assert_allclose(strengths, ones * strength[times.astype(int) - FROM])


def test_a_value_is_held_from_the_frame_of_its_event_and_glides_to_the_next():
    row = BareRow(REGISTRY["sample-and-hold"], glide=0.002)
    row.run(0, N, {"signal": A}, events={"trigger": [(100.25, 1.0, 0.0), (700.0, 0.5, 0.0)]})
    expected = np.interp(np.arange(N), [99, 100, 700, 796], [0.0, A[100], A[100], A[700]])
    assert np.abs(row.outputs["out"] - expected).max() <= 1e-12 * np.abs(A).max()


@pytest.mark.parametrize(("load_n", "share"), [(500.0, 1.0), (25.0, 0.25)])
def test_a_contact_has_the_speed_of_its_centroid_from_its_landing_on(load_n, share):
    """A light one takes longer to get there: where it is, is less sure."""
    force_n = np.where((np.arange(N) >= 100) & (np.arange(N) < 700), load_n, 0.0)
    x_m, y_m = (np.where(force_n > 0.0, place, 0.0) for place in (0.05 + 0.3 * TIME_S, 0.4 * TIME_S**2 - 0.1))
    row = BareRow(REGISTRY["contact-speed"], time=0.005)
    row.run(0, N, {"force_n": force_n, "x_m": x_m, "y_m": y_m, "cut": np.zeros(N)})
    kept = np.exp(-1.0 / 240.0)
    new = share * (1.0 - kept)
    stands = np.append(0.0, (force_n[1:] > 0.0) & (force_n[:-1] > 0.0))
    along, across = (lfilter([new], [1.0, new - 1.0], stands * np.diff(place, prepend=0.0)) for place in (x_m, y_m))
    expected = 48_000.0 * np.hypot(along, across)
    expected[700:] = expected[699] * kept ** np.arange(1, N - 699)
    assert np.abs(row.outputs["speed"] - expected).max() <= 1e-9
    if share == 1.0:
        assert expected[699] == pytest.approx(np.hypot(0.3, 0.8 * TIME_S[699]), rel=0.15)


def test_a_footfall_is_where_the_line_between_two_frames_crosses():
    force_n = np.clip((np.arange(N) - 100.3) * 0.7, 0.0, 700.0)
    row = BareRow(REGISTRY["footfall"], threshold=30.0, wait=0.005)
    row.run(0, N, {"force": force_n})
    crossing = 100.3 + 30.0 / 0.7
    assert row.events["onset"][0][0] == pytest.approx(crossing + 240.0, abs=1e-6)


def test_a_foot_lands_again_once_its_force_was_below_half_of_the_threshold_and_no_harder_than_ten():
    force_n = np.interp(np.arange(N), [0, 100, 300, 400, 500, 600], [0.0, 600.0, 16.0, 600.0, 14.0, 600.0])
    row = BareRow(REGISTRY["footfall"], threshold=30.0, wait=0.0005)
    row.run(0, N, {"force": force_n})
    landings = np.array(row.events["onset"])[:, :2]
    np.testing.assert_allclose(landings, [[5.0 + 24.0, 10.0], [500.0 + 16.0 / 5.86 + 24.0, 10.0]])
    assert np.array(row.events["lift_off"])[:, :2].tolist() == [[500.0, 1.0]]  # below 15 N for this frame only


@pytest.mark.parametrize(
    "same", [{"scale": 25.0}, {"stiffness": 100.0, "mass": 1e-3, "damping": 0.3}], ids=["scale", "ratios"]
)
def test_events_of_a_bundle_depend_on_no_scale_of_strains_and_on_ratios_of_its_stiffness(same):
    made = []
    for values in ({}, same):
        row = BareRow(REGISTRY["fibre-bundle"], **values)
        row.run(0, 9600, {"force": 1000.0 * np.sin(np.linspace(0.0, np.pi, 9600))})
        made.append(row.events["events"])
    assert len(made[0]) > 50
    np.testing.assert_allclose(made[1], made[0], rtol=1e-9)


ALL_ALIKE = {"columns": 2, "rows": 2, "reach": 1.0}
ONE_OF_TWO = {"columns": 2, "rows": 1, "reach": 0.005, "coupling": 0.0, "strength": 1600.0}


@pytest.mark.parametrize(
    ("type", "values"), [("fibre-bundle", {}), ("fibre-grid", ALL_ALIKE), ("fibre-grid", ONE_OF_TWO)]
)
def test_ground_breaks_at_its_strength_or_restructures_without_end(type, values):
    force_n = np.interp(np.arange(48_000), [0, 6_000, 47_999], [0.0, 600.0, 1000.0])
    place = {"x": np.full(force_n.size, 0.305 / 4), "y": np.zeros(force_n.size)}
    for model, last_n in (("exact", 800.0), ("inverse", 1000.0)):
        row = BareRow(REGISTRY[type], **{"strength": 800.0, "model": model, **values})
        row.run(0, force_n.size, {"force": force_n, **(place if type == "fibre-grid" else {})})
        assert force_n[int(row.events["events"][-1][0])] == pytest.approx(last_n, rel=0.05), model


def test_a_slip_is_as_strong_as_the_square_root_of_its_energy():
    row = BareRow(REGISTRY["slip"], gamma=4.0, least=1e-5, most=1e-3)
    row.run(0, 9600, {"force": np.linspace(0.0, 2000.0, 9600)})
    strengths = np.array(row.events["events"])[:, 1]
    assert len(strengths) > 20
    assert strengths.max() <= 1.0
    assert strengths.min() == pytest.approx(0.1, rel=0.05)  # nearly all energies are close to the least


def test_a_hammer_is_no_faster_than_its_bound_and_does_not_strike_below_the_least_speed():
    row, heard = BareRow(REGISTRY["impact"], velocity=1.0), []
    for frame, strength in ((0, 1e-13), (N, 100.0), (2 * N, 1e6)):
        row.state.values[:] = 0.0
        row.run(frame, N, events={"strike": [(float(frame), strength, 0.0)]})
        heard.append(row.outputs["acceleration"])
    assert not heard[0].any()
    assert heard[1].any()
    assert heard[1].tobytes() == heard[2].tobytes()


def test_a_file_at_the_floor_s_rate_is_played_as_it_is(tmp_path):
    sound = np.random.default_rng(2).uniform(-1.0, 1.0, N)
    soundfile.write(tmp_path / "noise.wav", sound, 48_000, subtype="DOUBLE")
    row = BareRow(REGISTRY["wav-player"], file=str(tmp_path / "noise.wav"), amplitude=2.0)
    row.run(0, N)
    assert np.abs(row.outputs["out"] - 2.0 * sound).max() <= 1e-12
    row = BareRow(REGISTRY["wav-player"], file=str(tmp_path / "noise.wav"), amplitude=2.0, mode="at events")
    row.run(0, N, events={"start": [(0.0, 0.25, 0.0)]})
    assert np.abs(row.outputs["out"] - 0.5 * sound).max() <= 1e-12


def test_every_node_states_a_bound_or_is_asked_for_an_error():
    for type, node in REGISTRY.items():
        if node.requested_error is None:
            assert re.match(r"exact", node.accuracy), type
            assert re.search(r"\b1e-\d+|\d+(\.\d+)? %", node.accuracy), f"{type} says no bound: {node.accuracy}"
        else:
            assert node.accuracy.startswith("requested"), type
            assert "error" in node.parameters, type
