"""The thesis's figures come out, with the thesis's numbers or the corrected ones of docs/models.md."""

import json
import re
from xml.etree import ElementTree

import numpy as np
import pytest
from click.testing import CliRunner

from underfoot.__main__ import cli
from underfoot.bench import figures
from underfoot.bench.figures import Compared, Figure
from underfoot.bench.figures.figure import density, slope
from underfoot.drawing import Drawing, series
from underfoot.drawing.svg import svg
from underfoot.errors import BadFile

DRAWN = Figure("9.9", "A < B", (Drawing("one", "x", "y", (series("", [0.0, 1.0], [0.0, 2.0]),)),), (), "Because.")


@pytest.fixture(scope="module")
def drawn():
    """Every figure, quickly, by its number."""
    return {figure.number: figure for figure in figures.run(quick=True)}


def ours(figure, what):
    """The first number of ours in the row that begins with `what`."""
    (row,) = (row for row in figure.compared if row.what.startswith(what))
    return float(re.search(r"-?\d+(\.\d+)?(e-?\d+)?", row.ours).group())


def test_all_figures_that_models_can_draw_are_there(drawn):
    assert list(drawn) == [
        *("3.5", "3.6", "3.7", "4.10", "6.2", "7.5", "7.6", "7.7", "7.8", "7.12", "7.13", "7.14", "7.15"),
        *("8.4", "8.5", "8.6", "8.7", "8.8", "8.9", "8.10"),
    ]
    for figure in drawn.values():
        assert figure.compared
        assert figure.why.endswith(".")
        for drawing in figure.drawings:
            assert ElementTree.fromstring(svg(drawing)).tag.endswith("svg")
            assert all(np.isfinite(one.y).any() for one in drawing.series)


def test_tactons_lie_near_250_hz(drawn):
    for what in ("centre of the notes", "centre of the impacts"):
        (row,) = (row for row in drawn["3.6"].compared if row.what.startswith(what))
        low, high = (float(number) for number in re.findall(r"\d+", row.ours))
        assert 200.0 < low <= high < 300.0
    assert "miss 250 Hz" in drawn["3.6"].why


def test_rhythms_and_stimuli_are_those_of_the_presets(drawn):
    assert ours(drawn["3.5"], "rhythms that both sets share") == 8
    assert ours(drawn["3.7"], "knocks") == 12
    levels = [row for row in drawn["6.2"].compared if row.what.startswith("measured peak and RMS")]
    assert len(levels) == 9
    for row in levels:
        thesis, found = (np.array(text.split(", "), float) for text in (row.thesis, row.ours))
        apart_db = np.abs(20.0 * np.log10(found / thesis))
        assert apart_db[0] < 1.1
        assert apart_db[1] < 1.1 or " WC" in row.what or " WD" in row.what


def test_bundles_have_the_strengths_and_slopes_of_the_thesis(drawn):
    assert ours(drawn["7.6"], "critical load, M-bar") == pytest.approx(2846.0, abs=3.0)
    critical = [row for row in drawn["7.6"].compared if row.what == "critical load, M"]
    assert float(critical[0].ours) == pytest.approx(2804.0, abs=20.0)
    for model in ("M", "M-bar"):
        (row,) = (row for row in drawn["7.7"].compared if row.what.endswith(f", {model}"))
        assert -2.3 < float(row.ours) < -1.6
    assert ours(drawn["7.5"], "terminal load") > 2800.0


def test_the_slope_of_figure_7_13_takes_stiffness_that_compounds(drawn):
    assert ours(drawn["7.13"], "slope, n_max 1000") == pytest.approx(-2.0, abs=0.4)
    assert ours(drawn["7.13"], "slope of the energies, as captioned") > -1.3
    assert ours(drawn["7.13"], "windows with energy") < 10.0


def test_friction_has_the_corrected_numbers(drawn):
    assert ours(drawn["8.5"], "n1 at the end, left") == pytest.approx(1.45, abs=0.2)
    assert ours(drawn["8.6"], "of the decoupled distribution, variance 2D/h") == pytest.approx(0.44, abs=0.01)
    assert ours(drawn["8.6"], "largest CDF difference of exact paths") < 0.02
    (printed,) = (row for row in drawn["8.6"].compared if row.what == "of the decoupled distribution, variance 2D")
    assert float(printed.ours) == pytest.approx(0.50, abs=0.01)
    assert ours(drawn["8.10"], "share of slips") == pytest.approx(1.1, abs=0.1)


def test_a_page_holds_every_drawing_and_number(tmp_path):
    figure = Figure("9.9", "A < B", DRAWN.drawings * 2, (Compared("slope", "-2", "-2.1 & less"),), "Because.")
    figures.write([figure], tmp_path / "new")
    page = (tmp_path / "new" / "index.html").read_text()
    assert page.count("<svg") == 2
    for words in ("9.9 A &lt; B", "-2.1 &amp; less", "Because."):
        assert words in page
    assert (tmp_path / "new" / "figure-9.9-2.svg").read_text() == svg(figure.drawings[1])
    (tmp_path / "file").write_text("")
    with pytest.raises(BadFile, match="file"):
        figures.write([figure], tmp_path / "file" / "page")


def test_the_command_draws_figures_and_measures_nothing_else(tmp_path, monkeypatch):
    monkeypatch.setattr(figures, "FIGURES", (lambda quick: DRAWN,))
    done = CliRunner().invoke(cli, ["bench", "--figures", str(tmp_path / "out"), "--json"])
    assert done.exit_code == 0
    assert json.loads(done.stdout) == [DRAWN.data()]
    assert (tmp_path / "out" / "index.html").exists()
    done = CliRunner().invoke(cli, ["bench", "--figures", str(tmp_path / "out"), "--quick"])
    assert "9.9  A < B" in done.stdout
    (tmp_path / "file").write_text("")
    done = CliRunner().invoke(cli, ["bench", "--figures", str(tmp_path / "file")])
    assert "is not a folder" in str(done.exception)


def test_a_density_sums_to_one_and_a_slope_is_that_of_its_law():
    draws = np.random.default_rng(2).random(200_000)
    edges = np.linspace(0.0, 1.0, 11)
    at, found = density(draws, edges)
    assert at == pytest.approx(0.5 * (edges[1:] + edges[:-1]))
    assert found.mean() == pytest.approx(1.0)
    assert density(draws, edges, of=400_000)[1].mean() == pytest.approx(0.5)
    assert slope(draws ** (-1.0 / 0.7), 1.0, 100.0) == pytest.approx(-1.7, abs=0.05)
