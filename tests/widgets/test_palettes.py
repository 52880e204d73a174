"""The two palettes: everything that is read or seen stands out from what it is on, by the formula of WCAG 2.1."""

from itertools import combinations

import numpy as np
import pytest
from PySide6.QtCore import QRectF

from underfoot.drawing import look
from underfoot.widgets import theme
from underfoot.widgets.design.node_geometry import COST_ROOM, TITLE

TEXT_BACKGROUNDS = {
    "text": (
        "ground",
        "panel",
        "raised",
        "hover",
        "selected",
        "checked",
        "primary",
        "alarming",
        "alarming hover",
        "assuring",
        "loaded",
        *(name for name in theme.colours("dark") if name.endswith(" title")),
    ),
    "muted": ("ground", "panel", "raised", "hover"),
    "alarming text": ("alarming", "alarming hover"),
    "quiet": ("raised",),
    **dict.fromkeys(("force", "vibration", "events", "contact", "alarm"), ("ground", "panel", "raised")),
    "ground": ("force", "vibration", "events", "contact", "alarm"),
}
"""Colours of text, and their backgrounds: the contrast is at least 4.5 in every palette."""

LINE_BACKGROUNDS = {
    "faint": ("ground", "panel", "raised"),
    "measured": ("ground", "panel"),
    **dict.fromkeys(("force", "vibration", "events", "contact", "alarm"), ("ground", "panel", "raised", "hover")),
    **{name: ("ground", "panel") for name in look.COLOURS if name.startswith("corner")},
    "onset": ("ground",),
}
"""Colours of meaningful lines and controls, and their backgrounds: the contrast is at least 3. Separators (`line`, and
a plot's `grid`) are not included."""


def contrast(colour, ground):
    """The ratio of WCAG 2.1, 1 to 21, between two colours."""

    def luminance(hex):
        parts = [part / 255 for part in look.rgb(hex)]
        linear = [part / 12.92 if part <= 0.04045 else ((part + 0.055) / 1.055) ** 2.4 for part in parts]
        return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]

    high, low = sorted((luminance(colour), luminance(ground)), reverse=True)
    return (high + 0.05) / (low + 0.05)


def pairs(declared):
    return [(name, on) for name, grounds in declared.items() for on in grounds]


@pytest.mark.parametrize("name", look.PALETTES)
@pytest.mark.parametrize(("declared", "least"), [(TEXT_BACKGROUNDS, 4.5), (LINE_BACKGROUNDS, 3.0)])
def test_every_pair_stands_out(name, declared, least):
    known = theme.colours(name)
    found = {(a, b): round(contrast(known[a], known[b]), 2) for a, b in pairs(declared)}
    assert {pair: ratio for pair, ratio in found.items() if ratio < least} == {}


@pytest.mark.parametrize("name", look.PALETTES)
def test_the_number_of_a_step_stands_out_on_the_bar_of_its_foot(name):
    try:
        theme.choose_palette(name)
        bars = [theme.PALETTE[foot] for foot in ("left foot", "right foot", "a foot")]
        assert min(contrast(theme.text_on(bar), bar) for bar in bars) >= 4.5
    finally:
        theme.choose_palette("dark")


def test_the_formula_gives_what_wcag_says():
    assert contrast("#ffffff", "#000000") == pytest.approx(21.0)
    assert contrast("#777777", "#ffffff") == pytest.approx(4.48, abs=0.005)


@pytest.mark.parametrize("name", look.PALETTES)
def test_what_a_node_costs_can_be_read_in_the_strip_of_its_title(workspace, name):
    canvas = workspace.canvas
    try:
        theme.choose_palette(name)
        canvas.update_colours()
        canvas.zoom_to(2.0)
        for id, cost, state in (("hum", "1 %", ""), ("push", "1 %", ""), ("hum", "", "fault"), ("hum", "", "asleep")):
            node = canvas.patch_scene.nodes[id]
            node.set_cost(cost, state)
            canvas.centerOn(node)
            place = node.mapToScene(QRectF(node.geometry.width - COST_ROOM, 2.0, COST_ROOM - 2.0, TITLE - 4.0))
            seen = canvas.viewport().grab(canvas.mapFromScene(place).boundingRect()).toImage()
            colours = {seen.pixelColor(x, y).name() for x in range(seen.width()) for y in range(seen.height())}
            assert max(contrast(colour, seen.pixelColor(0, 0).name()) for colour in colours) >= 4.5, (id, state)
    finally:
        theme.choose_palette("dark")


ALL_COLOURS = np.eye(3)
WITHOUT = {
    "red": [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]],
    "green": [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940, 0.968881]],
}
"""Linear RGB as seen without a cone: Machado, Oliveira and Fernandes (2009), IEEE TVCG 15:1291-1298, severity 1."""


def lab(colour, seen=ALL_COLOURS):
    """CIE 1976 L*a*b* of an sRGB colour, white D65."""
    parts = np.array(look.rgb(colour)) / 255.0
    linear = np.where(parts <= 0.04045, parts / 12.92, ((parts + 0.055) / 1.055) ** 2.4)
    linear = np.clip(seen @ linear, 0.0, 1.0)
    xyz = [[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]] @ linear
    x, y, z = np.cbrt(xyz / [0.9505, 1.0, 1.089])
    return np.array([116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)])


@pytest.mark.parametrize("name", look.PALETTES)
def test_curves_over_one_another_can_be_told_apart(name):
    """Commanded, measured, the force behind them and the other slot: lines of one pixel. Teal and green are 42 apart in
    the light palette, and seemed one line."""
    known = theme.colours(name)
    shown = ("vibration", "measured", "force", "events")
    near = {(a, b): float(np.linalg.norm(lab(known[a]) - lab(known[b]))) for a, b in combinations(shown, 2)}
    assert {pair: distance for pair, distance in near.items() if distance < 45.0} == {}


@pytest.mark.parametrize("name", look.PALETTES)
@pytest.mark.parametrize("cone", WITHOUT)
@pytest.mark.parametrize(
    "shown",
    [("vibration", "measured", "force", "events"), ("force", *(f"corner {number}" for number in range(1, 5)))],
)
def test_who_sees_no_red_or_no_green_tells_curves_apart(name, cone, shown):
    """One man in twelve. Sensors 1 and 3 were 7 apart, and commanded and measured 10: each pair was one colour."""
    known, seen = theme.colours(name), np.array(WITHOUT[cone])
    near = {(a, b): np.linalg.norm(lab(known[a], seen) - lab(known[b], seen)) for a, b in combinations(shown, 2)}
    assert {pair: round(float(distance)) for pair, distance in near.items() if distance < 18.0} == {}


@pytest.mark.parametrize("name", look.PALETTES)
def test_sensors_can_be_told_apart_in_grey(name):
    """As a report is printed. Three of the light palette were within 2 of one another, and two of the dark one."""
    lightness = np.sort([lab(theme.colours(name)[colour])[0] for colour in ("force", *look.CORNERS)])
    assert np.diff(lightness).min() >= 7.0


def test_the_distance_of_colours_is_that_of_cie_1976():
    assert lab("#ffffff") == pytest.approx([100.0, 0.0, 0.0], abs=0.05)
    assert lab("#ff0000") == pytest.approx([53.2, 80.1, 67.2], abs=0.2)
