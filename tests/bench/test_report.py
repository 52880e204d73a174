"""Tables, figures and pictures of what the bench found."""

import json
from xml.etree import ElementTree

import pytest

from underfoot.bench import report
from underfoot.bench.blocks import BlockCost
from underfoot.bench.method_comparison import Comparison, Curve, Point
from underfoot.bench.report import Bench
from underfoot.bench.requirements import Requirement
from underfoot.bench.stability import Failure, Stability
from underfoot.drawing.svg import svg
from underfoot.errors import BadFile
from underfoot.patch.patch import Patch

CURVES = (
    Curve("ours", "steps", False, (Point(1.0, 1e-3, 1e-4), Point(2.0, 2e-3, 0.0))),
    Curve("a < b", "step, s", True, (Point(0.1, 0.5, 0.1),)),
)
COMPARISON = Comparison("impact", "a blow & more", "relative", CURVES)
REACHES = [
    Requirement("tones", "error", 5e-16, high=1e-12),
    Requirement("floors", "gravel", 31.0, "times real time", low=40.0),
    Requirement("bundles", "strength", 2766.5, "", 2764.0, 2768.0),
]
SVG = "{http://www.w3.org/2000/svg}"


@pytest.fixture
def bench():
    stable = Stability(3, 40, 5, 20.0, {"impact": 7}, [Failure("gain makes a mess", Patch(title="broken"), 8000)])
    cost = BlockCost("gravel", 36, 2, 64, 123.4, 345.6, 0.056, 1.1, 0.03)
    return Bench(REACHES, [cost], [COMPARISON], stable, 1.5, 2)


def test_the_picture_places_points_by_their_logarithms():
    root = ElementTree.fromstring(svg(report.picture(COMPARISON)))
    dots = [(float(dot.get("cx")), float(dot.get("cy"))) for dot in root.iter(f"{SVG}circle")]
    assert len(dots) == 3
    (x_good, y_quick), (x_best, y_slower), (x_bad, y_slow) = dots
    assert x_best < x_good < x_bad
    assert y_quick < y_slow + 1000.0
    assert y_slow < y_slower < y_quick
    assert (x_bad - x_good) / (x_good - x_best) == pytest.approx(3.0 / 13.0, rel=0.01)
    assert (y_quick - y_slower) / (y_slower - y_slow) == pytest.approx(0.30103 / 2.39794, rel=0.02)
    assert "a < b" in [label.text for label in root.iter(f"{SVG}text")]
    dashes = [line.get("stroke-dasharray") for line in root.iter(f"{SVG}polyline")]
    assert sum(dash is not None for dash in dashes) == 2  # the naive curve, here and in the legend


def test_the_table_says_everything(bench):
    table = report.text(bench)
    for words in ("a blow & more", "a < b (naive)", "123.4 ", "345.6", "5.6 %", "1 failures", "impact 7"):
        assert words in table
    assert bench.stability.failures[0].patch.dumps().decode() in table


def test_requirements_are_said_to_be_met_or_not(bench):
    table = report.text(bench).splitlines()
    assert table[0] == "load 1.5 on 2 cores"
    assert table[1].startswith("requirements: 3 with limits, 1 not met")
    (missed,) = (line for line in table if line.endswith("NOT MET"))
    for words in ("floors: gravel", "at least 40", "31 times real time"):
        assert words in missed
    rows = bench.data()["reach"]
    assert [row["met"] for row in rows] == [True, False, True]
    assert rows[0] == {
        "model": "tones", "what": "error", "measured": 5e-16, "unit": "",
        "low": None, "high": 1e-12, "slowness": 1.0, "spread": None, "asked": "at most 1e-12", "met": True,
    }  # fmt: skip
    assert rows[2]["asked"] == "2764 to 2768"
    assert not Requirement("any", "figure", float("nan"), high=1.0).is_met


def test_a_report_is_a_page_with_its_pictures_figures_and_failures(bench, tmp_path):
    folder = tmp_path / "a" / "report"
    report.write(bench, folder)
    (folder / "failure-02.json").write_text("of an earlier run")
    report.write(bench, folder)
    assert {file.name for file in folder.iterdir()} == {"bench.json", "index.html", "01-impact.svg", "failure-01.json"}
    data = json.loads((folder / "bench.json").read_text())
    assert data == json.loads(json.dumps(bench.data()))
    assert data["accuracy"][0]["curves"][1]["points"][0] == {"knob": 0.1, "seconds": 0.5, "error": 0.1}
    assert Patch.loads((folder / "failure-01.json").read_bytes(), {}).title == "broken"
    page = (folder / "index.html").read_text()
    assert (folder / "01-impact.svg").read_text() in page
    assert "a blow &amp; more" in page


def test_a_folder_that_cannot_be_written_is_named(bench, tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(BadFile, match="file"):
        report.write(bench, tmp_path / "file" / "report")
