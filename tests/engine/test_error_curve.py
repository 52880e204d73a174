"""Run time over error of a node: points are measured, kept under what was measured, and drawn with where it stands."""

import json

import numpy as np
import pytest
from click.testing import CliRunner
from msgspec.structs import replace
from scipy.integrate import solve_ivp

from underfoot.__main__ import cli
from underfoot.engine.commands import Set
from underfoot.engine.error_curve import error_curve
from underfoot.engine.patch_edits import moved_numbers
from underfoot.errors import BadValue
from underfoot.models.modal import strike_error
from underfoot.nodes import REGISTRY
from underfoot.patch.effective import effective_patch
from underfoot.patch.patch import Patch

IMPACT = REGISTRY["impact"]
HARD = {"stiffness": 1e11, "exponent": 1.8, "mass": 0.02, "velocity": 1.0, "modes": [[300.0, 20.0, 1.0, 1.0]]}


def test_a_smaller_error_that_is_asked_is_found_and_takes_no_less():
    *_, curve = error_curve(IMPACT, HARD)
    assert [point.asked for point in curve.points] == pytest.approx(np.geomspace(0.1, 1e-7, 7).tolist())
    assert all(point.found <= point.asked for point in curve.points)
    assert curve.points[-1].found < 1e-3 * curve.points[0].found
    assert all(point.ms > 0.0 for point in (*curve.points, curve.here))
    assert (curve.here.asked, curve.left) == (1e-3, 0)


def test_the_error_that_is_found_is_the_one_beside_scipy():
    """The displacement of one mode under one blow, by a tight solver: hammer, mode, Hunt and Crossley's contact."""
    values = {**IMPACT.values(HARD), "damping": 0.0, "error": 0.05, "stiffness": 1e6, "exponent": 1.0}
    struck = strike_error.timed_work(values, shows=True)().displacement
    pole = complex(-20.0, 2.0 * np.pi * 300.0)

    def motion(_, y):
        hammer, speed, x, v = y
        force = max(hammer - x, 0.0) * values["stiffness"]
        return speed, -force / values["mass"], v, force - 40.0 * v - abs(pole) ** 2 * x

    at = np.arange(480) / 48_000.0
    exact = solve_ivp(motion, (0.0, at[-1]), [0.0, 1.0, 0.0, 0.0], "DOP853", at, rtol=1e-11, atol=1e-14).y[2]
    apart = np.linalg.norm(struck[:480] - exact) / np.linalg.norm(exact)
    assert strike_error.measured_error(values) == pytest.approx(apart, rel=0.3, abs=1e-7)


def test_points_are_kept_until_a_value_changes():
    *_, curve = error_curve(IMPACT, HARD)
    *_, again = error_curve(IMPACT, HARD)
    assert again == curve  # measured again, no time would be the same to the last bit
    first = next(error_curve(IMPACT, {**HARD, "mass": 0.0213 + np.random.default_rng().uniform(0.0, 1e-6)}))
    assert (first.points, first.left) == ((), 7)
    assert first.here.ms != curve.here.ms


def test_the_command_prints_the_curve_of_a_node_as_its_patch_has_it_built(tmp_path):
    path = tmp_path / "knock.json"
    Patch(error_scale=10.0).add("impact", **HARD).save(path)
    said = CliRunner().invoke(cli, ["cost", str(path), "--curve", "impact"])
    assert said.exit_code == 0, said.output
    assert said.stdout.startswith("impact stands here: requested 0.01, found ")
    assert len(said.stdout.splitlines()) == 9
    data = json.loads(CliRunner().invoke(cli, ["cost", str(path), "--curve", "impact", "--json"]).stdout)
    assert (data["here"]["asked"], len(data["points"])) == (0.01, 7)
    Patch().add("impact").add("gain").save(path)
    said = CliRunner().invoke(cli, ["cost", str(path), "--curve", "gain"])
    assert str(said.exception) == "--curve is gain, which is exact: to 1e-12; allowed: impact"


def test_a_node_that_is_exact_says_so_instead():
    with pytest.raises(BadValue, match=r"allowed: one with a requested error\. It is exact"):
        next(error_curve(REGISTRY["gain"], {}))


def test_every_asked_error_is_scaled_by_the_patch_and_kept_in_its_range():
    patch = Patch().add("impact", error=1e-4).add("stick-slip", error="0.003").add("gain")

    def asked(scale):
        heard = effective_patch(
            Patch.loads(patch.dumps().replace(b'"seed"', b'"error_scale": %g, "seed"' % scale)), REGISTRY
        )
        return heard.node("impact").parameters["error"], heard.node("stick-slip").parameters["error"]

    assert asked(10.0) == (pytest.approx(1e-3), "0.03")
    assert asked(0.5) == (pytest.approx(5e-5), "0.001")
    assert asked(100.0) == (pytest.approx(1e-2), "0.03")
    assert asked(0.01) == (pytest.approx(1e-6), "0.0003")
    assert asked(1.0) == (1e-4, "0.003")


def test_a_factor_of_one_is_not_in_the_file_and_others_come_back():
    assert b"error_scale" not in Patch().add("impact").dumps()
    faster = Patch(error_scale=4.0).add("impact")
    assert Patch.loads(faster.dumps()) == faster
    with pytest.raises(BadValue, match=r"error_scale is 1000\.0; allowed: 0\.01 to 100"):
        Patch(error_scale=1000.0).check()


def test_where_no_error_costs_more_than_another_it_is_said():
    *_, curve = error_curve(IMPACT, {})
    assert len({point.found for point in curve.points}) == 1, "a soft blow takes one sub-step a frame"
    assert curve.description().endswith("all errors that can be requested take the same time")
    low, high = curve.drawing().x_range
    assert low < curve.here.found < high


def test_another_factor_moves_a_number_and_makes_a_new_program_for_a_table():
    knock = Patch().add("impact", error=1e-4)
    assert moved_numbers(knock, replace(knock, error_scale=10.0), REGISTRY) == [
        Set("impact", "error", pytest.approx(1e-3))
    ]
    squeak = Patch().add("stick-slip")
    assert moved_numbers(squeak, replace(squeak, error_scale=10.0), REGISTRY) is None
    assert moved_numbers(squeak, replace(squeak, error_scale=2.0), REGISTRY) == [], "the same table keeps it"
