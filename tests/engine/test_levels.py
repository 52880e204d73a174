"""Levels of patches on a tile that is stood on; a tile whose equaliser was learned plays flat."""

import json
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from scipy.signal import csd, welch

from underfoot.__main__ import cli
from underfoot.devices.replay import Replay
from underfoot.devices.simulated_floor import SimulatedFloor
from underfoot.engine.commands import equalisers_of
from underfoot.engine.levels import headroom_db, levels_of
from underfoot.engine.loop import LoopOptions
from underfoot.engine.preview import DRIVE, previewed
from underfoot.engine.render import render_source
from underfoot.floor.forces import ForceSeries
from underfoot.floor.layout import default_floor
from underfoot.floor.profile import Profile
from underfoot.nodes import REGISTRY
from underfoot.patch import preset_files
from underfoot.patch.patch import Patch


def noise():
    """White noise at 1 m/s^2 RMS on every tile."""
    patch = Patch().add("noise", REGISTRY).add("tile-output", REGISTRY)
    return patch.connect("noise.out", "tile-output.acceleration", REGISTRY)


def worst_db(commanded, measured):
    """How far any line from 60 to 700 Hz, 3 Hz apart, is from 0 dB: SciPy's transfer function of what was recorded."""
    frequencies_hz, power = welch(commanded, 48_000.0, nperseg=16_384)
    both = csd(commanded, measured, 48_000.0, nperseg=16_384)[1]
    inside = (frequencies_hz >= 60.0) & (frequencies_hz <= 700.0)
    return float(np.abs(20.0 * np.log10(np.abs(both) / power))[inside].max())


def test_a_calibrated_tile_does_what_it_is_told_from_60_to_700_hz_and_another_does_not(profile):
    found = {}
    for name, profiles in (("calibrated", {"t1": profile}), ("not", {})):
        floor = default_floor(1, 1)
        options = LoopOptions(plates=("accelerometer",), equalisers=equalisers_of(profiles))
        tiles = render_source(noise(), SimulatedFloor(floor, walking=False), 8.0, options).tiles
        found[name] = worst_db(tiles["commanded"][:, 0], tiles["accelerometer"][:, 0])
    assert found["calibrated"] < 1.0
    assert found["not"] > 5.0


def test_a_tile_calibrated_while_stood_on_does_what_it_is_told_while_it_is_stood_on(tmp_path, profile):
    """White noise for 8 s under somebody who stands still in the middle, as the force signals say it."""
    path = tmp_path / "t1.json"
    options = ["--target", "simulator", "--tile", "t1", "--seed", "1", "--no-loads", "--load", "standing"]
    said = CliRunner().invoke(cli, ["calibrate", "response", *options, "--profile", str(path)])
    assert said.exit_code == 0, said.output
    stood = np.full((8000, 1, 4), 175.0)
    found = {}
    for name, learned in (("standing", Profile.load(path)), ("nobody", profile)):
        source = Replay(ForceSeries(np.arange(8000) / 1000.0, stood, 1000.0), default_floor(1, 1), 48_000.0)
        loop_options = LoopOptions(plates=("accelerometer",), equalisers=equalisers_of({"t1": learned}))
        tiles = render_source(noise(), source, 8.0, loop_options).tiles
        after = slice(48_000, None)
        found[name] = worst_db(tiles["commanded"][after, 0], tiles["accelerometer"][after, 0])
    assert found["standing"] < 1.0
    assert found["nobody"] > 4.0


def test_levels_of_a_stimulus_are_its_own_and_those_of_its_tile(profile):
    patch = Patch.load(preset_files.patches()["stimulus-td"], REGISTRY)
    plain, driven = levels_of(patch), levels_of(patch, profile=profile)
    assert plain.commanded == driven.commanded
    assert plain.measured.peak_m_s2 / plain.commanded.peak_m_s2 > 1.1
    assert driven.measured.peak_m_s2 / driven.commanded.peak_m_s2 == pytest.approx(1.0, abs=0.1)
    assert plain.headroom_db > 0.0


def test_a_preview_has_the_headroom_of_the_table_through_the_tile_s_own_equaliser_at_its_place(profile):
    patch = Patch.load(preset_files.patches()["stimulus-td"], REGISTRY)
    sink = next(node.id for node in patch.nodes if node.type == "tile-output")
    patch = patch.add("tile-place", REGISTRY).connect("tile-place.distance", f"{sink}.level", REGISTRY)
    for of_tile in (None, profile):
        equalisers = equalisers_of({"t1": of_tile}) if of_tile else ()
        signals = previewed(patch, (), default_floor().tiles[0], 1.2, 48_000.0, measures=True, equalisers=equalisers)[1]
        found = headroom_db(float(np.abs(signals[DRIVE]).max()))
        assert found == pytest.approx(levels_of(patch, profile=of_tile).headroom_db, abs=0.01)


def test_silence_has_no_level():
    found = levels_of(Patch().add("tile-output", REGISTRY))
    assert found.measured.level_db is None
    assert found.measured.share_in_band == 0.0


def test_the_command_prints_a_line_a_patch_and_all_figures_as_json():
    said = CliRunner().invoke(cli, ["levels", str(preset_files.patches()["wood"])])
    assert said.exit_code == 0, said.output
    assert said.stdout.splitlines()[1].startswith("wood")
    assert "peak: median of the largest values of loud 10 ms" in said.stdout  # not the largest value, which a WAV has
    said = CliRunner().invoke(cli, ["levels", "--json", str(preset_files.patches()["wood"])])
    assert json.loads(said.stdout)["wood"]["measured"]["level_db"] > 10.0


def test_a_profile_without_vibration_says_that_it_changes_nothing(tmp_path):
    profile, wood = tmp_path / "t1.json", str(preset_files.patches()["wood"])
    Profile(tile="t1").save(profile)
    said = CliRunner().invoke(cli, ["levels", "--profile", str(profile), wood])
    assert said.stderr == f"underfoot: {profile} has no part of vibration: the levels are those without it\n"
    assert said.stdout == CliRunner().invoke(cli, ["levels", wood]).stdout


def test_patches_of_one_name_in_two_folders_have_a_line_each(tmp_path):
    """The second took the first's place."""
    paths = [str(tmp_path / "a" / "hum.json"), str(tmp_path / "b" / "hum.json")]
    for path in paths:
        Path(path).parent.mkdir()
        Patch().add("tile-output", REGISTRY).save(path)
    said = CliRunner().invoke(cli, ["levels", "--json", *paths])
    assert list(json.loads(said.stdout)) == paths
    assert said.stderr.splitlines() == [f"underfoot: {k} of 2: {path}" for k, path in enumerate(paths, 1)]


@pytest.mark.parametrize(("names", "place"), [(("material-leaves", "stimulus-td", "tacton-it1"), 0), (("gravel",), 1)])
def test_the_document_has_every_preset_and_its_levels(names, place, profile):
    tables = (Path(__file__).resolve().parents[2] / "docs/levels.md").read_text().split("```")[1::2]
    rows = {line.split()[0]: line.split()[1:5] for line in tables[place].splitlines()[2:]}
    assert list(rows) == list(preset_files.patches())
    for name in names:
        found = levels_of(Patch.load(preset_files.patches()[name], REGISTRY), profile=profile if place else None)
        levels = (level for one in (found.commanded, found.measured) for level in (one.peak_m_s2, one.rms_m_s2))
        assert [float(text) for text in rows[name]] == pytest.approx(list(levels), abs=0.02)
