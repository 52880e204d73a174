"""Patches written in formats of other programs: against the formats' own rules, and against what the patch plays."""

import json
import os
import re
import zipfile
from pathlib import Path

import numpy as np
import pytest
import soundfile
from format_rules import RULES
from msgspec.structs import replace

from underfoot.errors import BadFile, BadValue
from underfoot.exchange.format import Export
from underfoot.exchange.formats import FORMATS, WRITTEN
from underfoot.exchange.losses import KEPT, features, losses
from underfoot.exchange.patches import Channel, patch_of
from underfoot.exchange.voices import Voice, analysed, banded, envelope_error_db
from underfoot.floor.layout import default_floor
from underfoot.nodes import REGISTRY
from underfoot.parameters import FilePath, Tiles
from underfoot.patch import preset_files
from underfoot.patch.groups import Group, Note
from underfoot.patch.patch import MARKS, Patch, PlacedNode
from underfoot.patch.program import Program
from underfoot.records.forces import Forces

RATE = 48_000
PRESETS = ("stimulus-sp", "gravel", "tacton-ws1", "tacton-impact")
PAGE = Path(__file__).parents[2] / "docs" / "exchange.md"
WORST_DB = {"haptic": 2.5, "ahap": 2.5, "hjif": 4.5}


@pytest.fixture(scope="module")
def exports():
    """Each preset as it plays on one step, rendered once."""
    return {name: Export(Patch.load(preset_files.patches()[name], REGISTRY)) for name in PRESETS}


# --- every format that is written ---


@pytest.mark.parametrize("preset", PRESETS)
@pytest.mark.parametrize("name", RULES)
def test_a_written_file_keeps_the_rules_of_its_format_and_the_envelope(exports, tmp_path, name, preset):
    path = tmp_path / f"a{FORMATS[name].suffix}"
    told = FORMATS[name].write(exports[preset], path)
    document = json.loads(path.read_text())
    RULES[name](document)
    error_db = float(told[0].partition("within ")[2].split()[0])
    assert error_db < WORST_DB[name]
    row = next(line for line in PAGE.read_text(encoding="utf-8").splitlines() if line.startswith(f"| {preset} "))
    of_page = dict(zip(RULES, re.findall(r"[\d.]+(?= dB)", row), strict=True))
    assert error_db == pytest.approx(float(of_page[name]), abs=0.11)  # the last digit may be another elsewhere
    assert "Infinity" not in path.read_text()
    assert "NaN" not in path.read_text()


def test_a_long_rough_vibration_is_thinned_no_further_than_a_short_one(tmp_path):
    patch = Patch().add("noise", REGISTRY).add("tile-output", REGISTRY)
    export = Export(patch.connect("noise.out", "tile-output.acceleration", REGISTRY), seconds=6.0)
    FORMATS["haptic"].write(export, tmp_path / "a.haptic")
    points = json.loads((tmp_path / "a.haptic").read_text())["signals"]["continuous"]["envelopes"]["amplitude"]
    time_s, amplitude, _ = analysed(export.loudest[1], RATE).T
    written = np.interp(time_s, [point["time"] for point in points], [point["amplitude"] for point in points])
    np.testing.assert_allclose(written, amplitude / amplitude.max(), rtol=0.0, atol=0.0101)


@pytest.mark.parametrize("name", RULES)
def test_what_was_written_is_read_again_with_its_title_and_level(exports, tmp_path, name):
    export = exports["stimulus-sp"]
    path = tmp_path / f"a{FORMATS[name].suffix}"
    FORMATS[name].write(export, path)
    imported = FORMATS[name].read(path)
    assert imported.losses == ()
    assert imported.patch.title == export.patch.title
    loudest = max(
        row[1] for node in imported.patch.nodes if node.type == "breakpoints" for row in node.parameters["points"]
    )
    amplitude = analysed(export.loudest[1], RATE)[:, 1].max()
    assert loudest == pytest.approx(amplitude, rel=0.02)


def test_ahap_has_a_transient_for_each_tap_where_it_is_and_as_strong(tmp_path):
    taps = Patch().add("tile-force", REGISTRY).add("footfall", REGISTRY).add("rhythm", REGISTRY)
    taps = taps.add("modal-bank", REGISTRY, modes=[[150.0, 200.0, 1.0]]).add("tile-output", REGISTRY)
    for wire in (
        ("tile-force.force", "footfall.force"),
        ("footfall.onset", "rhythm.start"),
        ("rhythm.out", "modal-bank.strike"),
        ("modal-bank.out", "tile-output.acceleration"),
    ):
        taps = taps.connect(*wire, REGISTRY)
    export, path = Export(taps), tmp_path / "taps.ahap"
    told = FORMATS["ahap"].write(export, path)
    document = json.loads(path.read_text())
    RULES["ahap"](document)
    times = [
        e["Event"]["Time"] for e in document["Pattern"] if e.get("Event", {}).get("EventType") == "HapticTransient"
    ]
    envelope = analysed(export.loudest[1], RATE)
    assert len(times) == 12
    assert "short impacts as transients: 12" in told[-1]
    bursts = FORMATS["ahap"].read(path).patch.node("breakpoints1").parameters["points"]
    for time in times:
        near = envelope[np.abs(envelope[:, 0] - time - 0.006) < 0.006]
        strongest = max(near, key=lambda row: row[1])
        _, burst, frequency_hz = max((row for row in bursts if abs(row[0] - time) < 0.004), key=lambda row: row[1])
        assert burst == pytest.approx(strongest[1], rel=0.05)
        assert frequency_hz == pytest.approx(strongest[2], abs=5.0)


@pytest.mark.parametrize(
    ("heights", "transients"),
    [
        ({0: 0, 4: 1, 14: 0}, 1),
        ({0: 0, 4: 0.5, 14: 0, 24: 0, 28: 1, 38: 0}, 1),  # the louder one is behind the 22 ms of the first
        ({0: 0, 4: 0.5, 14: 0, 18: 0, 22: 1, 32: 0}, 0),
        ({0: 0, 14: 1, 20: 0}, 0),  # it rises too slowly
        ({0: 0, 4: 1, 10: 0, 16: 0.8, 20: 0}, 0),  # it rises again
        ({0: 0, 4: 1, 44: 0}, 0),  # it is too long
    ],
)
def test_ahap_has_transients_for_taps_that_are_short_alone_and_rise_once(tmp_path, heights, transients):
    points = np.array([(0.1 + at_ms / 1000.0, height, 200.0) for at_ms, height in heights.items()])
    FORMATS["ahap"].write(Export(patch_of([Channel([Voice(points)])], "tap", 1.0), seconds=0.3), tmp_path / "tap.ahap")
    assert (tmp_path / "tap.ahap").read_text().count("HapticTransient") == transients


def test_hjif_of_a_floor_has_a_channel_a_tile_that_comes_back_to_it(tmp_path):
    patch = Patch.load(preset_files.patches()["stimulus-sp"], REGISTRY)
    path = tmp_path / "floor.hjif"
    FORMATS["hjif"].write(Export(patch, floor=default_floor(1, 2), seconds=2.5), path)
    document = json.loads(path.read_text())
    RULES["hjif"](document)
    channels = document["perceptions"][0]["channels"]
    assert [channel["description"] for channel in channels] == list(default_floor(1, 2).ids)
    outputs = [node for node in FORMATS["hjif"].read(path).patch.nodes if node.type == "tile-output"]
    assert {node.parameters["tiles"] for node in outputs} == set(default_floor(1, 2).ids)


def test_hjif_of_a_large_floor_has_the_tiles_that_move_most(tmp_path):
    patch = Patch.load(preset_files.patches()["stimulus-sp"], REGISTRY)
    path, floor = tmp_path / "floor.hjif", default_floor(16, 8)
    load_n = np.full((128, 4), 100.0)
    load_n[[5, 77]] = 0.0
    pressed = np.arange(70)[:, None, None] > 10
    Forces(0.001 * np.arange(70), pressed * load_n, 1000.0, floor).save(tmp_path / "pressed.csv")
    export = Export(patch, seconds=0.07, force=str(tmp_path / "pressed.csv"), floor=floor)
    told = FORMATS["hjif"].write(export, path)
    document = json.loads(path.read_text())
    RULES["hjif"](document)
    channels = document["perceptions"][0]["channels"]
    assert [channel["description"] for channel in channels] == [tile for tile in floor.ids if tile != floor.ids[77]]
    assert told[-1] == f"not written: {floor.ids[77]}; a file has at most 127 channels"
    assert (len(told), f"tile {floor.ids[5]}," in " ".join(told)) == (127, False)  # of a silent tile nothing is said


def test_wav_is_what_render_writes(tmp_path, underfoot, walk):
    underfoot("render", preset_files.patches()["gravel"], "--force", walk, "-o", tmp_path / "render.wav")
    said = underfoot("convert", preset_files.patches()["gravel"], "--force", walk, "-o", tmp_path / "a.wav")
    assert said.status == 0
    assert (tmp_path / "a.wav").read_bytes() == (tmp_path / "render.wav").read_bytes()
    underfoot("convert", preset_files.patches()["gravel"], "--force", walk, "--tile", "t2", "-o", tmp_path / "t2.wav")
    one, rate_hz = soundfile.read(tmp_path / "t2.wav", always_2d=True)
    whole, _ = soundfile.read(tmp_path / "a.wav", always_2d=True)
    assert rate_hz == RATE
    np.testing.assert_array_equal(one[:, 0], whole[:, 1])


def test_csv_has_the_acceleration_of_each_tile(exports, tmp_path):
    export = exports["stimulus-sp"]
    FORMATS["csv"].write(export, tmp_path / "a.csv")
    head, *_ = (tmp_path / "a.csv").read_text().splitlines()
    assert head == "time_s,t1_m_s2"
    table = np.loadtxt(tmp_path / "a.csv", delimiter=",", skiprows=1)
    np.testing.assert_allclose(table[:, 1], export.acceleration_by_tile["t1"], rtol=1e-6, atol=1e-9)


def test_svg_is_a_picture_with_its_axes(exports, tmp_path):
    FORMATS["svg"].write(exports["gravel"], tmp_path / "a.svg")
    assert "acceleration, m/s" in (tmp_path / "a.svg").read_text()
    lost = losses(exports["gravel"].patch, FORMATS["svg"].carries)
    assert not any("oscillation" in line or "frequencies" in line for line in lost)  # it is drawn sample by sample


def test_a_shared_folder_opens_elsewhere_with_its_sound_floor_and_profiles(tmp_path):
    (tmp_path / "sounds").mkdir()
    soundfile.write(tmp_path / "sounds" / "a.wav", np.ones(100) * 0.5, RATE)
    patch = Patch(title="Bell").add("wav-player", REGISTRY, file="sounds/a.wav").add("tile-output", REGISTRY)
    patch = patch.add("wav-player", REGISTRY, file=str(tmp_path / "sounds" / "a.wav"))
    patch = patch.connect("wav-player.out", "tile-output.acceleration", REGISTRY)
    export = Export(patch, tmp_path, floor=default_floor())
    FORMATS["share"].write(export, tmp_path / "shared")
    (tmp_path / "sounds" / "a.wav").unlink()
    (tmp_path / "shared").rename(tmp_path / "moved")
    moved = Patch.load(tmp_path / "moved" / "patch.json", REGISTRY)
    assert {node.parameters.get("file", "files/a.wav") for node in moved.nodes} == {"files/a.wav"}
    Program(moved, REGISTRY, ("t1",), rate=RATE, block=64, folder=tmp_path / "moved")
    assert default_floor().loads((tmp_path / "moved" / "floor.json").read_bytes()) == default_floor()
    assert "patch.json" in (tmp_path / "moved" / "README.txt").read_text()


def test_where_nothing_moves_in_place_of_a_folder_and_case_makes_no_difference_a_patch_is_shared(tmp_path, monkeypatch):
    """As on Windows, whose dialogs make an empty folder and give it; two sounds would be one file."""
    move = os.replace

    def moved(path, target):
        if os.path.isdir(target):
            raise PermissionError(13, "Access is denied")
        move(path, target)

    patch = Patch()
    for name, level in (("a.wav", 0.5), ("A.wav", 0.25)):
        (tmp_path / name[:1]).mkdir()
        soundfile.write(tmp_path / name[:1] / name, np.ones(100) * level, RATE)
        patch = patch.add("wav-player", REGISTRY, file=f"{name[:1]}/{name}")
    (tmp_path / "shared").mkdir()
    monkeypatch.setattr(os, "replace", moved)
    FORMATS["share"].write(Export(patch, tmp_path), tmp_path / "shared")
    assert sorted(path.name.lower() for path in (tmp_path / "shared" / "files").iterdir()) == ["a-1.wav", "a.wav"]


def test_a_shared_zip_has_the_same_bytes_each_time_and_a_folder_is_never_written_over(tmp_path):
    patch = Patch.load(preset_files.patches()["gravel"], REGISTRY)
    for name in ("a.zip", "b.zip"):
        FORMATS["share"].write(Export(patch), tmp_path / name)
    with zipfile.ZipFile(tmp_path / "a.zip") as file:
        assert file.namelist() == ["a/patch.json", "a/README.txt"]
        assert Patch.loads(file.read("a/patch.json"), REGISTRY) == patch
    assert (tmp_path / "a.zip").read_bytes().replace(b"a/", b"b/") == (tmp_path / "b.zip").read_bytes()
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "mine.txt").write_text("mine")
    with pytest.raises(BadFile, match="is there already"):
        FORMATS["share"].write(Export(patch), tmp_path / "full")


def test_a_patch_that_plays_nothing_is_said(tmp_path):
    with pytest.raises(BadValue, match="plays nothing"):
        FORMATS["haptic"].write(Export(Patch()), tmp_path / "a.haptic")
    with pytest.raises(BadValue, match="--tile is 'x'; allowed: t1"):
        FORMATS["wav"].write(Export(Patch(), tile="x"), tmp_path / "a.wav")


# --- the analysis ---


@pytest.mark.parametrize("hertz", [45.0, 120.0, 400.0])
def test_amplitude_and_frequency_of_a_swept_sine_that_swells(hertz):
    time_s = np.arange(RATE) / RATE
    amplitude, frequency = 1.0 + np.sin(2.0 * np.pi * time_s), hertz * (1.0 + 0.2 * time_s)
    found = analysed(amplitude * np.sin(2.0 * np.pi * hertz * (time_s + 0.1 * time_s**2)), RATE)[150:-150]
    np.testing.assert_allclose(found[:, 1], np.interp(found[:, 0], time_s, amplitude), atol=0.02)
    loud = found[:, 1] > 0.5
    np.testing.assert_allclose(found[loud, 2], np.interp(found[loud, 0], time_s, frequency), rtol=0.02)


def test_bands_add_up_to_the_whole():
    noise = np.random.default_rng(1).normal(size=9600)
    np.testing.assert_allclose(np.sum(banded(noise, RATE, (0.0, 100.0, 700.0, 1e9)), axis=0), noise, atol=1e-9)


def test_an_envelope_at_half_is_six_decibels_off():
    sine = np.sin(2.0 * np.pi * 100.0 * np.arange(RATE) / RATE)
    assert envelope_error_db(sine, 0.5 * sine, RATE) == pytest.approx(6.02, abs=0.01)
    assert envelope_error_db(sine, np.roll(sine, 77), RATE) < 0.1


# --- what is lost ---


@pytest.mark.parametrize("type", sorted(REGISTRY))
def test_the_list_of_losses_names_every_parameter_of_every_node_that_a_format_does_not_carry(type):
    patch = Patch(title="T", comment="C", seed=3).add(type, REGISTRY)
    node = REGISTRY[type]
    for name, parameter in node.parameters.items():
        if isinstance(parameter, FilePath | Tiles):
            patch = patch.set(type, name, "t1", REGISTRY)
    has = features(patch)
    for format in WRITTEN:
        lines = losses(patch, format.carries)
        assert len(lines) == len(has.keys() - format.carries)
        every = "\n".join(lines)
        for name in has.keys() - format.carries:
            assert KEPT[name] in every
        if "parameters" not in format.carries:
            named = f"{type} ({', '.join(node.parameters)})" if node.parameters else type
            assert named in every
            assert "()" not in every
    assert ("force" in has) == bool(node.engine_signals)
    assert ("sound" in has) == (type == "sound-output")
    assert ("tiles" in has) == any(isinstance(p, Tiles) for p in node.parameters.values())
    assert ("files" in has) == (type == "wav-player")
    assert ("hand" in has) == (type == "strike")


def test_of_many_nodes_that_lose_the_same_the_first_are_named():
    patch = Patch()
    for _ in range(60):
        patch = patch.add("strike", REGISTRY)
    (line,) = losses(patch, KEPT.keys() - {"hand"})
    assert line.startswith("strikes by hand: strike, strike1, ")
    assert line.endswith(", strike7, and 52 more")


SOUNDING = ("format", "version", "nodes", "wires", "error_scale")
"""Fields of a patch that are in what is rendered, or lost with its nodes and wires."""
SOUNDING_OF_NODES = ("id", "type", "at", "parameters", *MARKS)
MORE = {
    "title": "T", "comment": "C", "seed": 3, "author": "A", "tags": ("t",), "label": "Knock",
    "notes": (Note("note", "N"),), "groups": (Group("group", ("tone",)),),
}  # fmt: skip


@pytest.mark.parametrize(
    "field",
    sorted({*Patch.__struct_fields__, *PlacedNode.__struct_fields__} - {*SOUNDING, *SOUNDING_OF_NODES}),
)
def test_whatever_else_a_patch_has_is_in_the_list_of_losses_and_shared_in_full(field, tmp_path):
    plain = Patch().add("tone", REGISTRY).add("tile-output", REGISTRY)
    plain = plain.connect("tone.out", "tile-output.acceleration", REGISTRY)
    more = plain.name("tone", MORE[field]) if field == "label" else replace(plain, **{field: MORE[field]})
    for format in WRITTEN:
        gone = set(losses(more, format.carries)) - set(losses(plain, format.carries))
        assert len(gone) == (format.carries != KEPT.keys() and field not in format.carries), format.name
    FORMATS["share"].write(Export(more), tmp_path / "a.zip")
    with zipfile.ZipFile(tmp_path / "a.zip") as file:
        assert Patch.loads(file.read("a/patch.json"), REGISTRY) == more


def test_a_click_is_written_by_the_rules_of_each_format(tmp_path):
    soundfile.write(tmp_path / "click.wav", [1.0, 0.5, -0.3], RATE)
    patch = Patch().add("wav-player", REGISTRY, file="click.wav").add("tile-output", REGISTRY)
    patch = patch.connect("wav-player.out", "tile-output.acceleration", REGISTRY)
    for name, check in RULES.items():
        FORMATS[name].write(Export(patch, folder=tmp_path, seconds=5e-4), tmp_path / name)
        check(json.loads((tmp_path / name).read_text()))


def test_what_lies_above_the_range_is_left_out_of_bands_and_else_at_its_end_and_the_list_says_which(tmp_path):
    patch = Patch().add("tone", REGISTRY, frequency=2000.0, harmonics=[1.0]).add("tile-output", REGISTRY)
    export = Export(patch.connect("tone.out", "tile-output.acceleration", REGISTRY), seconds=0.3)
    for name in RULES:
        (told,) = FORMATS[name].write(export, tmp_path / name)
        is_left_out = float(told.partition("within ")[2].split()[0]) > 20.0
        lines = losses(patch, FORMATS[name].carries)
        assert is_left_out == (KEPT["range"] in lines) == (KEPT["frequency"] not in lines) == (name == "hjif")


def test_chance_is_what_draws_at_random():
    drawn = {type for type in REGISTRY if "chance" in features(Patch().add(type, REGISTRY))}
    assert {"noise", "texture", "poisson", "stick-slip", "fibre-bundle"} <= drawn
    assert not drawn & {"tone", "impact", "low-pass", "rhythm", "breakpoints"}


def test_formats_carry_only_what_there_is():
    for format in WRITTEN:
        assert format.carries <= KEPT.keys()
    assert FORMATS["share"].carries == KEPT.keys()
