"""The file of what a simulated tile is made of."""

import math

import numpy as np
import pytest
from msgspec import Struct
from msgspec.structs import astuple

from underfoot.arguments import ranges_of
from underfoot.errors import BadFile, BadValue
from underfoot.floor.layout import default_floor
from underfoot.floor.simulated_tile import SimulatedTile
from underfoot.floor.tile_parameters import TileParameters
from underfoot.models.tile.assembly import Foot
from underfoot.models.tile.fsr import Fsr
from underfoot.models.tile.shaker import Shaker
from underfoot.patch import preset_files

TILE = default_floor(1, 1).tiles[0]


def test_parameters_come_back_from_their_file(tmp_path):
    made = TileParameters(
        title="x", sensors=Fsr(creep=0.01), shaker=Shaker(bias=0.1), foot=Foot(mass_kg=2.0), path_m=((0, 0), (1, 0))
    )
    made.save(tmp_path / "a.json")
    assert TileParameters.load(tmp_path / "a.json") == made


@pytest.mark.parametrize("path", preset_files.simulations().values(), ids=preset_files.simulations())
def test_presets_can_be_built(path):
    parameters = TileParameters.load(path)
    assert parameters.title
    assert np.isfinite(SimulatedTile(TILE, parameters).respond(np.ones(10), 48_000.0)).all()
    assert path.read_bytes() == parameters.dumps() + b"\n"


def test_a_recording_is_looked_for_beside_the_file(tmp_path):
    TileParameters(recording="walk.csv").save(tmp_path / "a.json")
    assert TileParameters.load(tmp_path / "a.json").recording == str(tmp_path / "walk.csv")


PARTS = {TileParameters, *(type(part) for part in astuple(TileParameters()) if isinstance(part, Struct))}
NUMBERS = sorted(((part, name) for part in PARTS for name in ranges_of(part)), key=str)


@pytest.mark.parametrize(("part", "name"), NUMBERS)
def test_a_number_outside_its_range_is_refused_by_name(part, name):
    low, high = ranges_of(part)[name]
    for value in (low - 1.0, 2.0 * high, math.nan):
        with pytest.raises(BadValue, match=f"^{name} is .*; allowed: "):
            part(**{name: value})


HEAD = '{"format": "underfoot-simulation", "version": 1, '


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("{", "is not JSON"),
        ('{"format": "underfoot-floor", "version": 1}', r"\$.format is 'underfoot-floor'; allowed: 'underfoot-sim"),
        ('{"format": "underfoot-simulation", "version": 2}', r"\$.version is 2; allowed: 1 \(a newer"),
        (HEAD + '"sensors": {"spread": -1}}', r"\$.sensors.spread is -1.0; allowed: 0 to 0.9"),
        (HEAD + '"plate": {"stiffness": "soft"}}', r"\$.plate.stiffness"),
        (HEAD + '"plate": {"colour": 1}}', "unknown field `colour`"),
        (HEAD + '"walker": {"weight_n": 5}}', r"\$.walker.weight_n is 5.0; allowed: 50 to 3000"),
        (HEAD + '"suspension": {"mass_kg": 1}}', r"suspension.mass_kg is 1.0; allowed: more than"),
        (HEAD + '"shakers_m": []}', r"shakers_m is \(\)"),
    ],
)
def test_files_that_cannot_be_are_refused_in_one_line(text, message):
    with pytest.raises(BadFile, match=message) as caught:
        TileParameters.loads(text, "a.json")
    assert str(caught.value).startswith("a.json")
    assert "\n" not in str(caught.value)
