"""The search over modulus and thickness: each plate that fits does, by the closed forms, and the page and command."""

import json
from functools import cache

import numpy as np
import pytest
from click.testing import CliRunner

from underfoot.__main__ import cli
from underfoot.errors import BadValue
from underfoot.floor.layout import default_floor
from underfoot.floor.plate_search import PlateSearch, drawing, search, table, why_none
from underfoot.floor.tile_parameters import TileParameters
from underfoot.patch import preset_files

TILE = default_floor(1, 1).tiles[0]


@cache
def found_of(**asked):
    return search(TILE, TileParameters(), PlateSearch(**asked))


def test_what_fits_fits_by_the_closed_forms():
    """Hinged square plate: 0.01160 F a^2 / D at its middle, and pi / a^2 sqrt(D / m) for its first mode."""
    found = found_of(stiffness="solid", density_kg_m3=600.0, modulus_pa=(1e9, 50e9), most_kg=2.0)
    rigidity = found.modulus_pa[None, :] * found.thickness_m[:, None] ** 3 / (12.0 * (1.0 - 0.33**2))
    side = TILE.size_m[0]
    first_hz = np.pi / side**2 * np.sqrt(rigidity / (600.0 * found.thickness_m[:, None]))
    np.testing.assert_allclose(found.first_hz, first_hz, rtol=1e-9)
    np.testing.assert_allclose(found.deflection_m, 0.0116 * 1000.0 * side**2 / rigidity, rtol=2e-3)
    np.testing.assert_allclose(found.mass_kg[:, 0], 600.0 * found.thickness_m * side**2, rtol=1e-9)
    asked = found.spec
    within = (found.mass_kg <= asked.most_kg) & (found.deflection_m <= asked.most_deflection_m)
    assert (found.fits == (within & (first_hz >= asked.least_hz))).all()
    assert 0.0 < found.fits.mean() < 1.0
    masses = [one.mass_kg for one in found.best]
    assert masses == sorted(masses)


def test_the_thesiss_panel_fits_what_the_thesis_asks_but_its_own_stiffness_does_not():
    panel = {"modulus_pa": (67e9, 69e9), "thickness_m": (0.025, 0.026), "most_kg": 0.55}
    assert found_of(**panel).best
    below = found_of(**panel, stiffness="thesis")
    assert not below.best  # 860 Hz are below 1 kHz, and it is a fifth as stiff
    assert why_none(below) == "no plate fits: none meets the asked deflection nor the asked first mode"
    assert "none meets" in table(below)


def test_the_antiresonance_of_the_thesiss_tile_stands_beside_its_plate():
    best = found_of(modulus_pa=(67.9e9, 68.1e9), thickness_m=(0.0253, 0.0255)).best[0]
    assert best.antiresonance_hz == pytest.approx(779.0, abs=8.0)


def test_what_cannot_be_asked_is_refused_in_the_units_it_was_given_in():
    with pytest.raises(BadValue, match=r"modulus is 5 to 1 GPa; allowed: .* 0.001 to 1000 GPa"):
        PlateSearch(modulus_pa=(5e9, 1e9))
    with pytest.raises(BadValue, match=r"sag at most is -1 mm; allowed: above 0, up to 1e\+09 mm"):
        PlateSearch(most_deflection_m=-1e-3)


def test_the_command_prints_a_table_and_draws(tmp_path):
    floor = str(preset_files.floors()["tiles-2x2"])
    done = CliRunner().invoke(cli, ["tile", floor, "--search", "--report", str(tmp_path)], catch_exceptions=False)
    assert "dip of tile, Hz" in done.output
    assert {path.name for path in tmp_path.iterdir()} == {"index.html", "plates.json", "plates-1.svg"}
    options = ["--modulus", "60:80", "--stiffness", "solid", "--density", "2700", "--most-sag", "0.1"]
    done = CliRunner().invoke(cli, ["tile", floor, "--search", *options, "--json"], catch_exceptions=False)
    asked = json.loads(done.output)[0]["asked"]
    assert asked["modulus_pa"] == [60e9, 80e9]
    assert (asked["density_kg_m3"], asked["most_deflection_m"]) == (2700.0, pytest.approx(1e-4))
    with pytest.raises(BadValue, match="--load is given without --search"):
        CliRunner().invoke(cli, ["tile", floor, "--load", "800"], catch_exceptions=False)


def test_the_help_of_the_command_tells_what_a_search_usually_asks():
    usual = PlateSearch()
    spans = [
        f"{low:g}:{high:g} by default"
        for low, high in (np.divide(usual.modulus_pa, 1e9), np.divide(usual.thickness_m, 1e-3))
    ]
    told = " ".join(CliRunner().invoke(cli, ["tile", "--help"]).output.split())
    numbers = (usual.most_kg, usual.most_deflection_m / 1e-3, usual.least_hz)
    assert all(text in told for text in (*spans, f"{usual.load_n:g} by default", *(f"default {x:g}." for x in numbers)))


def test_the_picture_has_an_edge_for_each_condition():
    names = [line.name for line in drawing(found_of()).series]
    assert names == ["mass 0.6 kg", "sag 0.2 mm", "first mode 1000 Hz", "lightest"]


def test_the_table_and_the_picture_are_in_gigapascals_and_millimetres():
    """A panel whose numbers are known: 68 GPa and 2.54 cm weigh 0.49 kg a tile (section 4.3.2)."""
    found = found_of(modulus_pa=(67.9e9, 68.1e9), thickness_m=(0.0253, 0.0255))
    head, share, _, *rows = table(found).splitlines()
    cells = [float(cell) for cell in rows[0].split()]
    side = TILE.size_m[0]
    assert head.startswith(f"plates of {100.0 * side:g} x {100.0 * side:g} cm, ")
    assert share == "100 % of the grid fit"
    assert cells[:3] == pytest.approx([68.0, 25.4, 0.49], rel=0.02)
    assert cells[3] == pytest.approx(1e3 * 0.0116 * 1000.0 * side**2 / 17768.0, rel=0.03)
    assert drawing(found).x_range[0] == pytest.approx(67.9)
    assert drawing(found).y_range[0] == pytest.approx(25.3)
