"""A page of a report: read on a dark screen, on a light one and on paper."""

import re
from xml.etree import ElementTree

import pytest

from underfoot.drawing import Drawing, look, series
from underfoot.drawing.page import facts_table, made_by, page
from underfoot.drawing.picture import Picture
from underfoot.drawing.svg import svg

LINES = tuple(series(name, [0.0, 1.0], [k, k + 1.0], colour=name) for k, name in enumerate(look.COLOURS))
DRAWING = Drawing("All colours", "time, s", "force, N", LINES, right="right, N")


def rules_of(text, medium):
    """What a medium changes: colours by the selectors that have them."""
    inside = text.partition(f"@media {medium}")[2].partition("@media")[0]
    return dict(re.findall(r'svg \[(stroke="#\w+"|fill="#\w+"|stop-color="#\w+")\]\{[a-z-]+:(#\w+)\}', inside))


@pytest.mark.parametrize("medium", ["print", "(prefers-color-scheme:light)"])
def test_every_colour_of_a_picture_has_a_light_one(medium):
    picture = svg(DRAWING)
    rules = rules_of(page("A page", [picture]), medium)
    used = {f'{kind}="{colour}"' for kind, colour in re.findall(r'(stroke|fill)="(#\w+)"', picture)}
    assert used <= set(rules)
    light = look.palette("light")
    dark = {colour: name for name, colour in look.palette("dark").items()}
    assert all(rules[one] == light[dark[one.split('"')[1]]] for one in used)


def test_links_have_a_colour_that_both_grounds_show():
    text = page("A page", ['<a href="a.csv">a.csv</a>'])
    assert "a{color:var(--vibration)}" in text
    for name in look.PALETTES:
        assert f"--vibration:{look.palette(name)['vibration']};" in text


def test_a_report_says_who_made_it_and_when(monkeypatch):
    monkeypatch.setenv("LOGNAME", "ramp")
    assert dict(made_by())["operator"] == "ramp"
    facts = dict(made_by("R. <Ramp>"))
    assert list(facts) == ["operator", "date", "software"]
    cells = [cell.text for cell in ElementTree.fromstring(facts_table(facts.items())).iter("td")]
    assert cells[0] == "R. <Ramp>"
    assert re.fullmatch(r"\d{4}-\d\d-\d\d", cells[1])


def test_a_map_is_as_high_as_it_is_wide_and_drawn_large():
    places = series("", [-150.0, 150.0], [-150.0, 150.0], "dots")
    plan = Drawing("Places", "x, mm", "y, mm", (places,), equal=True)
    root = ElementTree.fromstring(svg(plan))
    dots = [(float(one.get("cx")), float(one.get("cy"))) for one in root.iter("{http://www.w3.org/2000/svg}circle")]
    assert dots[1][0] - dots[0][0] > 0.75 * float(root.get("width"))
    assert dots[0][1] - dots[1][1] == pytest.approx(dots[1][0] - dots[0][0], abs=0.2)
    both = ElementTree.fromstring(Picture((plan, DRAWING))._repr_svg_())
    assert float(both.get("height")) == float(root.get("height")) + 400.0


def test_a_picture_can_be_light():
    used = set(re.findall(r'"(#\w+)"', svg(DRAWING, "light")))
    assert used <= set(look.palette("light").values())
