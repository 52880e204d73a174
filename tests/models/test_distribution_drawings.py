"""Distributions as pictures, held against draws of the nodes' own models."""

import json

import numpy as np
import pytest
from click.testing import CliRunner

from underfoot.__main__ import cli
from underfoot.models.fibre_bundle.bundle_drawings import bundle_drawings, bundle_of
from underfoot.models.stick_slip.sample_paths import paths
from underfoot.models.stick_slip.slip_drawings import block_of, slip_drawings
from underfoot.nodes import REGISTRY
from underfoot.patch import preset_files


def values(type, **given):
    return REGISTRY[type].values(given)


def test_slips_last_as_long_and_go_as_far_as_simulated_paths():
    """The share of simulated slips in each bin is the area under the drawn density there."""
    node = values("stick-slip", frequency=100.0, velocity=0.2, noise=30, damping=40, start=150)
    duration, distance, period = slip_drawings(node)
    block = block_of(node)
    drawn = paths(block, 12.0 * 2.0 * np.pi / block.w0, 4000, seed=1)
    for drawing, found in ((duration, 1e3 * drawn.duration), (distance, 1e3 * (block.x0 - drawn.position))):
        exact = drawing.series[0]
        found = found[np.isfinite(found)]
        edges = np.linspace(exact.x[0], exact.x[-1], 9)
        area = np.concatenate([[0.0], np.cumsum(0.5 * np.diff(exact.x) * (exact.y[1:] + exact.y[:-1]))])
        expected = np.diff(np.interp(edges, exact.x, area))
        counted = np.histogram(found, edges)[0] / 4000
        np.testing.assert_allclose(counted, expected, atol=0.03)
    assert [series.name for series in period.series] == ["exact", "upcrossings (thesis)"]
    assert period.x.startswith("period, ms")


def test_a_bundle_bears_what_a_large_one_bears_when_loaded_slowly():
    node = values("fibre-bundle", fibres=100_000, strength=800.0)
    load, sizes, gaps = bundle_drawings(node)
    measured, slow = load.series
    assert slow.y.max() == pytest.approx(800.0, rel=1e-3)
    inside = measured.x < 0.8 * slow.x[np.argmax(slow.y)]
    np.testing.assert_allclose(measured.y[inside], np.interp(measured.x[inside], slow.x, slow.y), atol=25.0)
    assert bundle_of(node).fibres == 100_000
    assert sizes.x_log
    assert gaps.series[0].x.min() > 0.0


@pytest.mark.parametrize("type", [name for name, one in REGISTRY.items() if one.distributions is not None])
def test_every_node_with_distributions_draws_them_at_its_defaults(type):
    found = REGISTRY[type].distributions(values(type))
    assert len(found) in (1, 3)
    assert all(drawing.series for drawing in found)
    assert all(len(drawing.title) <= 28 for drawing in found), "a line beside two others at 1280 pixels"
    assert all(np.isfinite(series.y).all() for drawing in found for series in drawing.series)


def test_the_command_prints_and_draws_and_says_which_nodes_there_are(tmp_path):
    patch = str(preset_files.patches()["material-rubber"])
    said = CliRunner().invoke(cli, ["distribution", patch, "sole", "-o", str(tmp_path / "distributions"), "--json"])
    assert said.exit_code == 0, said.output
    assert [drawing["x"] for drawing in json.loads(said.stdout)["sole"]] == [
        "duration, ms",
        "distance at 0.1 m/s, mm",
        "period, ms",
    ]
    assert len(list((tmp_path / "distributions").glob("*.svg"))) == 3
    said = CliRunner().invoke(cli, ["distribution", patch, "nose"])
    assert "node is nose; allowed: sole" in str(said.exception)
