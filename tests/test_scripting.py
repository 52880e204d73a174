"""The names that scripts use: docs/scripting.md runs by the letter, in as few lines as it says."""

import ast
import pickle
import re
import shlex
import subprocess
import sys
import xml.etree.ElementTree as xml
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest
import soundfile
from long_recording import write_recording

import underfoot as uf
from underfoot.devices.simulated_floor import SimulatedFloor
from underfoot.engine.render import render_source
from underfoot.records.tables import Table

ROOT = Path(__file__).resolve().parents[1]
PAGE = (ROOT / "docs" / "scripting.md").read_text()
SCRIPTS = re.findall(r"^```python\n(.*?)^```", PAGE, re.MULTILINE | re.DOTALL)
LINES = re.findall(r"^    underfoot (.+)$", PAGE, re.MULTILINE)
MOST_LINES = 5


def run(script):
    """The names that a script leaves behind."""
    found = {}
    exec(script, found)
    return found


@pytest.mark.parametrize("place", range(5))
def test_five_things_take_five_lines(place):
    lines = [line for line in SCRIPTS[place].splitlines() if line.strip()]
    assert len(lines) <= MOST_LINES


def test_fifty_impacts_become_fifty_sound_files(folder):
    run(SCRIPTS[0])
    written = sorted(folder.glob("*.wav"))
    assert len(written) == 50
    peaks = [np.abs(soundfile.read(path)[0]).max() for path in written]
    assert min(peaks) > 0.0
    assert len(set(peaks)) == 50


def test_a_csv_becomes_steps_and_centroids(folder, walk):
    run(SCRIPTS[2])
    header, *steps = (folder / "steps.csv").read_text().splitlines()
    assert header.startswith("step,tile,side,start_s,contact_ms,peak1_n")
    assert [line.split(",")[1] for line in steps] == ["t1", "t2"]
    table = np.genfromtxt(folder / "centroids.csv", delimiter=",", names=True, dtype=None, encoding="utf-8")
    assert set(table["contact"]) == {1, 2}
    assert table["force_n"].max() == pytest.approx(800.0, abs=1.0)


def test_the_walk_of_the_page_is_the_csv_that_it_reads_next(folder):
    walked = run(SCRIPTS[1])["forces"]
    assert walked.force_n.shape == (10_000, 8, 4)
    run(SCRIPTS[2])
    assert len((folder / "steps.csv").read_text().splitlines()) - 1 == walked.steps().rows > 10


def test_a_walker_presses_with_its_weight():
    force_n = uf.walk(10.0, uf.default_floor(6, 6)).force_n
    # The ground gives a walker's weight back on average: here the usual 700 N.
    assert force_n[2000:].sum(axis=(1, 2)).mean() == pytest.approx(700.0, rel=0.02)


def test_a_patch_becomes_the_array_that_the_engine_would_play():
    samples = run(SCRIPTS[3])["samples"]
    patch = uf.open_patch("gravel")
    expected = render_source(patch, SimulatedFloor(uf.default_floor(), 48_000.0, patch.seed), 2.0)
    assert samples.tobytes() == expected.samples.tobytes()


def test_a_distribution_is_plotted(folder):
    slips = run(SCRIPTS[4])["slips"]
    picture = xml.parse(folder / "durations.svg").getroot()
    assert picture.tag.endswith("svg")
    assert "duration, s" in "".join(picture.itertext())
    median = slips.duration.quantile(0.5)
    assert np.interp(median, slips.duration.points, slips.duration.cdf) == pytest.approx(0.5)


@pytest.mark.parametrize("script", SCRIPTS[5:-2])
def test_the_rest_of_the_page_runs(script, folder, capsys):
    run(script)
    assert "inputs of tile-output" in capsys.readouterr().out


def test_a_script_plays_live_and_finds_its_marks_in_the_recording(folder):
    run(SCRIPTS[-2])["main"]()
    with uf.Recording("live.underfoot") as recording:
        marks = recording.marks()
        changes = [frame for frame, kind, _ in recording.commands() if kind == "Set"]
        assert recording.rate_hz == 48_000.0
        assert recording.floor == uf.default_floor()
        assert recording.span[1] >= 3 * 48_000  # the script waits for a second three times, by session frames
        assert recording.span[1] > marks[-1].frame
    assert [mark.text for mark in marks] == ["stiffness 10000", "stiffness 1e+06"]
    assert all(change <= mark.frame for change, mark in zip(changes, marks, strict=True))


def test_a_script_runs_a_study_without_the_window(folder, underfoot):
    run(SCRIPTS[-1])["main"]()
    assert re.findall(r"^ +(TD|WC) +rating +50 +1$", underfoot("analyse", "P1.session").out, re.M) == ["TD", "WC"]


@pytest.mark.parametrize(("line", "files"), list(zip(LINES, (2, 6), strict=True)))
def test_the_command_lines_of_the_page_run_in_an_empty_folder(line, files, underfoot, folder):
    underfoot(*shlex.split(line), "--seconds", "0.1")
    (manifest,) = folder.glob("*/manifest.csv")
    assert len(manifest.read_text().splitlines()) == 1 + files == 1 + len(list(folder.glob("*/*.wav")))


def test_the_script_of_the_readme_needs_nothing_that_is_not_installed(folder, monkeypatch):
    monkeypatch.setitem(sys.modules, "pandas", None)
    run(re.search(r"^```python\n(import underfoot.*?)^```", (ROOT / "README.md").read_text(), re.M | re.S)[1])
    assert {path.name for path in folder.iterdir()} == {"knock.wav", "steps.csv"}


def test_the_names_of_the_page_are_the_names_that_there_are():
    named = {name for row in re.findall(r"^\| `([^|]*)\|", PAGE, re.MULTILINE) for name in re.findall(r"\w+", row)}
    assert set(uf.__all__) - {"__version__"} <= named
    assert set(uf.__all__) <= set(dir(uf))
    imports = [one for one in ast.walk(ast.parse(Path(uf.__file__).read_text())) if isinstance(one, ast.ImportFrom)]
    for_editors = {one.name: imported.module for imported in imports for one in imported.names if one.asname}
    assert {"__version__", *for_editors} == set(uf.__all__)
    for name, module in for_editors.items():
        assert getattr(uf, name) is getattr(import_module(module), name)
    with pytest.raises(AttributeError, match="no attribute 'rendr'"):
        uf.rendr  # noqa: B018


def slips():
    """The slips of the page's last example."""
    return run(SCRIPTS[4])["slips"]


SENSORS_M = uf.default_floor().tiles[0].sensors_m


@pytest.mark.parametrize(("make", "said"), [
    (lambda patch: uf.render("gravel"), """patch is 'gravel'; allowed: a Patch, such as open_patch("gravel")"""),
    (lambda patch: uf.render(patch, "w"), """forces is 'w'; allowed: Forces, such as read_forces("walk.csv")"""),
    (lambda patch: uf.render(patch, uf.Forces([], np.zeros((0, 1, 4)), 1000.0, uf.default_floor(1, 1))),
     "forces is <Forces: 0 samples of 1 tile at 1000 Hz, 0 s>; allowed: one sample or more"),
    (lambda patch: uf.render(patch, floor=4), "floor is 4; allowed: a Floor, such as default_floor(1, 8)"),
    (lambda patch: uf.render(patch, uf.walk(1.0), floor=uf.default_floor(1, 8)),
     "floor is <Floor '1 x 8 tiles': 8 tiles>; allowed: none with forces, which have their own"),
    (lambda patch: uf.render(patch, plates="foot"), "plates is 'foot'; allowed: a tuple of accelerometer, foot"),
    (lambda patch: uf.render(patch, np.zeros((9, 9))),
     "forces is array([[0., 0., 0., 0., 0., 0., 0., 0., 0.], [0., 0., 0....); "
     """allowed: Forces, such as read_forces("walk.csv")"""),
    (lambda patch: uf.render(patch, seconds="1"), "seconds is '1'; allowed: above 0, up to a day"),
    (lambda patch: uf.render(patch, rate_hz="48000"), "rate_hz is '48000'; allowed: 8000 to 192000 Hz"),
    (lambda patch: uf.render(patch, rate_hz=48), "rate_hz is 48; allowed: 8000 to 192000 Hz"),
    (lambda patch: uf.render(patch, seed=1.5), "seed is 1.5; allowed: a whole number, -2^63 to 2^63 - 1"),
    (lambda patch: uf.walk(2.0, people=1.5), "people is 1.5; allowed: a whole number, 1 to 8"),
    (lambda patch: uf.walk(2.0, people=np.ones(2)), "people is array([1., 1.]); allowed: a whole number, 1 to 8"),
    (lambda patch: uf.walk(2.0, path=np.zeros(2)),
     "path is array([0., 0.]); allowed: straight, turn, in-place, random, crossing"),
    (lambda patch: uf.default_floor("1", 2), "rows is '1'; allowed: a whole number, 1 to 32"),
    (lambda patch: patch.remove("knock"), """ids is 'knock'; allowed: a list of ids, such as ["tone"]"""),
    (lambda patch: patch.disconnect(("knock.out", "out.level")),
     """wires is ('knock.out', 'out.level'); allowed: a list, such as [("tone.out", "gain.signal")]"""),
    (lambda patch: patch.remove(["knok"]), "there is no 'knok'; allowed: either, hand, knock, out, rhythm, step, tile"),
    (lambda patch: uf.Patch().mark([3], "muted", on=True), "there is no 3; allowed: none, the patch is empty"),
    (lambda patch: patch.part(["knok"]), "there is no 'knok'; allowed: either, hand, knock, out, rhythm, step, tile"),
    (lambda patch: patch.move({"knok": (0.0, 0.0)}),
     "there is no 'knok'; allowed: either, hand, knock, out, rhythm, step, tile"),
    (lambda patch: uf.Patch().disconnect([("knock.out", "out.level")]),
     "there is no wire ('knock.out', 'out.level'); allowed: none"),
    (lambda patch: patch.remove(3), """ids is 3; allowed: a list of ids, such as ["tone"]"""),
    (lambda patch: patch.part(3), """ids is 3; allowed: a list of ids, such as ["tone"]"""),
    (lambda patch: patch.disconnect(3), """wires is 3; allowed: a list, such as [("tone.out", "gain.signal")]"""),
    (lambda patch: patch.connect(1, 2), 'source is 1; allowed: a node and a port, as "node.port"'),
    (lambda patch: patch.connect("knock.force", 2), 'target is 2; allowed: a node and a port, as "node.port"'),
    (lambda patch: uf.Patch().add("gain", at=3), "nodes[0].at is 3; allowed: two numbers, each -1e+06 to 1e+06"),
    (lambda patch: patch.move(3), """places is 3; allowed: places by their ids, such as {"tone": (0.0, 100.0)}"""),
    (lambda patch: patch.move({"knock": 3}), "knock.at is 3; allowed: two numbers"),
    (lambda patch: patch.name("knock", 4), "the name of knock is 4; allowed: one line of at most 80 characters"),
    (lambda patch: patch.paste(3), """other is 3; allowed: a Patch, such as open_patch("gravel")"""),
    (lambda patch: patch.paste(patch, by=3), "by is 3; allowed: two numbers"),
    (lambda patch: patch.add("tone", 80.0),
     "registry is 80.0; allowed: a registry of node types; a parameter is given by its name, as frequency=80.0"),
    (lambda patch: patch.disconnect([["knock.out", "out.level"]]),
     """wires is [['knock.out', 'out.level']]; allowed: a list, such as [("tone.out", "gain.signal")]"""),
    (lambda patch: patch.save(3), "path is 3; allowed: text or a Path"),
    (lambda patch: uf.open_patch(None), "path is None; allowed: text or a Path"),
    (lambda patch: uf.Patch.load(3), "path is 3; allowed: text or a Path"),
    (lambda patch: uf.Patch.loads(3), "patch is 3; allowed: text, as of a file"),
    (lambda patch: uf.Floor.load(b"floor.json"), "path is b'floor.json'; allowed: text or a Path"),
    (lambda patch: uf.Profile.load(3), "path is 3; allowed: text or a Path"),
    (lambda patch: uf.read_forces(3), "path is 3; allowed: text or a Path"),
    (lambda patch: uf.Recording(3), "path is 3; allowed: text or a Path"),
    (lambda patch: uf.walk(0.1).plot().save(3), "path is 3; allowed: text or a Path"),
    (lambda patch: uf.walk(1.0).steps().save(3), "path is 3; allowed: text or a Path"),
    (lambda patch: uf.Patch(seed="one"), "seed is 'one'; allowed: a whole number"),
    (lambda patch: uf.Patch(title=3), "title is 3; allowed: text"),
    (lambda patch: uf.Patch(title="\udce9"), "title is '\\udce9'; allowed: text in UTF-8"),
    (lambda patch: uf.Patch().add("wav-player", file="\udce9.wav"),  # a file's name that is not UTF-8
     "nodes[0].parameters.file is '\\udce9.wav'; allowed: text of at most 1000 characters in UTF-8"),
    (lambda patch: uf.Patch(nodes=3), "nodes is 3; allowed: a list"),
    (lambda patch: uf.Patch(wires=[("tone.out", None)]), "wires[0][1] is None; allowed: text"),
    (lambda patch: uf.Patch(wires=patch.wires).save("a.json"),  # which could not be opened again
     "wires[0] is 'tile.force'; allowed: nodes of this patch (none)"),
    (lambda patch: uf.Patch(error_scale=np.zeros(2)), "error_scale is [0.0, 0.0]; allowed: a number"),
    (lambda patch: uf.Floor(TWO.tiles, 3), "title is 3; allowed: text in UTF-8"),
    (lambda patch: uf.Floor(TWO.tiles, "\ud800"), "title is '\\ud800'; allowed: text in UTF-8"),
    (lambda patch: TWO.save("\ud800"), "path is '\\ud800'; allowed: a name that a file can have"),
    (lambda patch: uf.Floor.load("a\0b"), "path is 'a\\x00b'; allowed: a name that a file can have"),
    (lambda patch: uf.Table("presses", {"tile": ["\ud800"]}).save("a.csv"),
     "a.csv cannot be written: '\\ud800\\n' is no text in UTF-8"),
    (lambda patch: uf.Profile(tile="t1", fsr=3), "fsr is 3; allowed: an object | null"),
    (lambda patch: uf.FibreBundle(20, compound=3), "compound is 3; allowed: True or False"),
    (lambda patch: uf.FibreBundle(20, model=np.zeros(2)),
     "model is array([0., 0.]); allowed: exact, mean, inverse, inverse_mean"),
    (lambda patch: patch.mark(["knock"], ["muted"], on=True), "mark is ['muted']; allowed: muted, bypassed, soloed"),
    (lambda patch: uf.walk("10"), "seconds is '10'; allowed: above 0, up to 600 s"),
    (lambda patch: uf.walk(2.0, seed="a"), "seed is 'a'; allowed: a whole number, -2^63 to 2^63 - 1"),
    (lambda patch: uf.SlipDistribution.solve(3, 20.0), "block is 3; allowed: a BlockOnBelt"),
    (lambda patch: slips().duration.quantile([0.1, 0.9]), "probability is [0.1, 0.9]; allowed: a number, 0 to 1"),
    (lambda patch: slips().distance.quantile(50.0), "probability is 50.0; allowed: a number, 0 to 1"),
    (lambda patch: uf.Profile(tile="t1").force("much"),
     "readings is 'much'; allowed: numbers with a last axis of 4, one for each sensor"),
    (lambda patch: uf.Profile(tile="t1").position(1j * np.ones(4)),
     "forces is array([0.+1.j, 0.+1.j, 0.+1.j, 0.+1.j]); allowed: numbers with a last axis of 4, one for each sensor"),
    (lambda patch: slips().duration.cdf_at("1 s"), "values is '1 s'; allowed: numbers"),
    (lambda patch: TWO.tiles[0].to_floor(3), "the shape of points_m is (); allowed: numbers in metres, shape (..., 2)"),
    (lambda patch: TWO.tile_at("t1"), "points_m is 't1'; allowed: numbers in metres, shape (..., 2)"),
    (lambda patch: uf.render(patch, plates=None), "plates is None; allowed: a tuple of accelerometer, foot"),
    (lambda patch: uf.render(patch, folder=3), "folder is 3; allowed: text or a Path"),
    (lambda patch: uf.read_forces("corridor", 3), "floor is 3; allowed: text or a Path"),
    (lambda patch: uf.render(patch, seconds=0.01).save(3), "path is 3; allowed: text or a Path"),
    (lambda patch: uf.Table("presses", {"a": SENSORS_M})[["a"]], "presses have no column ['a']; allowed: a"),
    (lambda patch: uf.Table("presses", {"a": [1, 2], "b": [1]}),
     "the length of columns is {'a': 2, 'b': 1}; allowed: one length of all"),
    (lambda patch: uf.Table("presses", {"a": [[1], [1, 2]]}),
     """columns is {'a': [[1], [1, 2]]}; allowed: arrays by name, such as {"force_n": force_n}"""),
    (lambda patch: uf.Table("presses", {3: [1]}),
     """columns is {3: [1]}; allowed: arrays by name, such as {"force_n": force_n}"""),
    (lambda patch: uf.Table("presses", 3),
     """columns is 3; allowed: arrays by name, such as {"force_n": force_n}"""),
    (lambda patch: uf.Picture([3]), "drawings[0] is 3; allowed: an object"),
    (lambda patch: uf.render(patch, plates=[np.zeros(2)]),
     "plates is [array([0., 0.])]; allowed: a tuple of accelerometer, foot"),
    (lambda patch: uf.Floor(3), "tiles is 3; allowed: at least one tile, in a list"),
    (lambda patch: uf.Tile(1, (0.3, 0.3), (0.0, 0.0)), "id is 1; allowed: letters, digits, - and _"),
    (lambda patch: uf.Tile("a", (0.3, 0.3), (0.0, 0.0), "9", SENSORS_M), "rotation_deg is '9'; allowed: -3600 to 3600"),
    (lambda patch: uf.Tile("a", (0.3, 0.3), (0.0, 0.0), 90.0, 0.1), "sensors_m is 0.1; allowed: exactly four points"),
    (lambda patch: uf.Tile("a", np.eye(2), (0.0, 0.0)),
     "size_m is array([[1., 0.], [0., 1.]]); allowed: two lengths in metres"),
    (lambda patch: uf.Profile(tile=3), "tile is 3; allowed: letters, digits, - and _"),
    (lambda patch: uf.walk(2.0, 4), "floor is 4; allowed: a Floor, such as default_floor(1, 8)"),
])  # fmt: skip
def test_an_argument_of_another_kind_is_said_with_what_to_give(make, said, folder):
    with pytest.raises(uf.UnderfootError) as error:
        make(uf.open_patch("tacton-impact"))
    assert str(error.value) == said


TIME_S, FORCE_N, TWO = np.arange(100) / 1000.0, np.zeros((100, 2, 4)), uf.default_floor(1, 2)


@pytest.mark.parametrize(("make", "said"), [
    (lambda: uf.Forces(TIME_S, FORCE_N, 1000.0, None), "floor is None; allowed: a Floor, such as default_floor(1, 8)"),
    (lambda: uf.Forces(TIME_S, FORCE_N.reshape(100, 8), 1000.0, TWO), "(100, 8); allowed: (100, 2, 4)"),
    (lambda: uf.Forces(TIME_S[:9], FORCE_N, 1000.0, TWO), "(100, 2, 4); allowed: (9, 2, 4), as of the floor"),
    (lambda: uf.Forces(0.0, FORCE_N, 1000.0, TWO), "the shape of time_s is (); allowed: (n,)"),
    (lambda: uf.Forces(TIME_S[::-1], FORCE_N, 1000.0, TWO), "allowed: ascending seconds"),
    (lambda: uf.Forces(TIME_S, "forces", 1000.0, TWO), "force_n is 'forces'; allowed: numbers, (n,) and"),
    (lambda: uf.Forces(1e3 * TIME_S, FORCE_N, 1000.0, TWO), "rate_hz is 1000.0; allowed: 1, by time_s in seconds"),
    (lambda: uf.Forces(TIME_S, FORCE_N, 1.0, TWO), "rate_hz is 1.0; allowed: 20 to 100000 Hz"),
])  # fmt: skip
def test_arrays_that_are_no_forces_are_said_at_once(make, said):
    """Times in milliseconds, say, would come out as a walk without steps."""
    with pytest.raises(uf.UnderfootError) as error:
        make()
    assert said in str(error.value)
    assert "\n" not in str(error.value)


def test_forces_are_made_of_lists_and_of_whole_numbers():
    walked = uf.walk(2.0, TWO, path="straight")
    force_n = walked.force_n.round().astype(int)
    listed = uf.Forces(walked.time_s.tolist(), force_n.tolist(), 1000, TWO)
    np.testing.assert_array_equal(listed.force_n, force_n)
    assert listed.steps().rows == walked.steps().rows > 0


def test_values_from_arrays_are_values():
    patch = uf.open_patch("tacton-impact")
    for value in (np.float32(2e5), np.int64(200_000), np.linspace(1e5, 2e5, 3)[2]):
        assert patch.set("knock", "stiffness", value) == patch.set("knock", "stiffness", 2e5)
    assert uf.Patch().add("tone", frequency=np.int32(80)) == uf.Patch().add("tone", frequency=80)
    assert uf.Patch(seed=np.arange(4)[3], tags=["a"]) == uf.Patch(seed=3, tags=("a",))
    modes = np.column_stack((100.0 * np.arange(1, 4), np.full(3, 20.0), np.ones(3), np.ones(3)))
    assert patch.set("knock", "modes", modes) == patch.set("knock", "modes", modes.tolist())


@pytest.mark.parametrize("name", ["knock.mp3", "knock.flac"])
def test_a_sound_file_of_another_format_is_not_a_wav_by_that_name(name, folder, refused):
    made = uf.render(uf.Patch().add("tile-output"), seconds=0.1)
    with pytest.raises(uf.UnderfootError, match=r"sound files are WAV; allowed: a name that ends in \.wav"):
        made.save(name)
    assert "sound files are WAV" in refused("render", "gravel", "--seconds", "0.1", "-o", name)
    assert not list(folder.iterdir())


def test_what_is_named_as_a_folder_is_saved_to_no_file_of_that_name(folder):
    forces = uf.walk(0.2)
    for made in (uf.Patch(), forces, forces.contacts(), uf.default_floor(), uf.Profile(tile="t1")):
        with pytest.raises(uf.UnderfootError, match=r"^new/ names a folder; allowed: the name of a file$"):
            made.save("new/")
    assert not list(folder.iterdir())


@pytest.mark.parametrize("name", ["walk.xlsx", "walk.parquet"])
def test_a_table_of_another_format_is_not_csv_by_that_name(name, folder, refused):
    forces = uf.walk(1.0)
    for save in (forces.save, forces.steps().save, forces.contacts().save):
        with pytest.raises(uf.UnderfootError, match=r"tables are CSV; allowed: a name that ends in \.csv"):
            save(name)
    assert "tables are CSV" in refused("monitor", "corridor", "--steps", name)
    assert not list(folder.iterdir())


def test_what_holds_arrays_is_equal_to_itself_alone():
    forces = uf.walk(0.5)
    for make in (lambda: uf.walk(0.5), forces.contacts, forces.plot, lambda: uf.render(uf.open_patch("wood"), forces)):
        one = make()
        assert one == one
        assert one != make()
        assert one in {one}


@pytest.mark.parametrize("make", [
    lambda: uf.open_patch("gravel"),
    lambda: uf.default_floor(),
    lambda: uf.Profile(tile="t1"),
    lambda: uf.read_forces("corridor"),
    lambda: uf.read_forces("corridor").steps(),
    lambda: uf.render(uf.open_patch("gravel"), seconds=0.1),
    lambda: uf.FibreBundle(20).response(np.linspace(0.0, 20.0, 100), 1000.0),
])  # fmt: skip
def test_what_a_notebook_shows_is_short_and_what_it_gives_to_other_processes_arrives(make):
    made = make()
    text = repr(made)
    assert len(text) < 300
    assert "\n" not in text
    assert repr(pickle.loads(pickle.dumps(made))) == text


def test_tables_are_data_frames_where_pandas_is_there():
    pandas = pytest.importorskip("pandas")
    contacts = uf.read_forces("corridor").contacts()
    frame = contacts.to_dataframe()
    assert isinstance(frame, pandas.DataFrame)
    assert list(frame.columns) == list(contacts)
    np.testing.assert_array_equal(frame["force_n"], contacts["force_n"])
    assert uf.read_forces("corridor").to_dataframe().shape == (1000, 33)


def test_a_column_that_is_not_there_is_said():
    table = Table("presses", {"tile": np.array(["t1"])})
    assert "force_n" not in table
    with pytest.raises(uf.UnderfootError, match="presses have no column 'force_n'; allowed: tile"):
        table["force_n"]
    assert table.get("force_n") is None
    assert table.get("tile", 0) is table["tile"]


def test_a_table_without_rows_has_columns_of_the_same_kinds():
    """Tables of several files are joined: in pandas, true and false with numbers are neither."""
    walked = uf.walk(1.5)
    silent = uf.Forces(walked.time_s, np.zeros_like(walked.force_n), walked.rate_hz, walked.floor)
    for full, empty in ((walked.steps(), silent.steps()), (walked.contacts(), silent.contacts())):
        assert (full.rows > 0, empty.rows) == (True, 0)
        assert [column.dtype.kind for column in empty.values()] == [column.dtype.kind for column in full.values()]


def test_forces_come_back_from_the_file_they_were_saved_to(tmp_path):
    forces = uf.walk(1.5, uf.default_floor(1, 2))
    forces.save(tmp_path / "walk.csv")
    back = uf.read_forces(tmp_path / "walk.csv")
    assert back.floor == forces.floor
    np.testing.assert_allclose(back.time_s, forces.time_s, atol=1e-6)
    np.testing.assert_allclose(back.force_n, forces.force_n, atol=5.1e-4)


@pytest.mark.parametrize(("name", "message"), [("gravle", "there is no patch 'gravle'"), ("a.json", "cannot be read")])
def test_a_patch_that_is_not_there(name, message):
    with pytest.raises(uf.UnderfootError, match=message):
        uf.open_patch(name)


UNGUARDED = "from underfoot.engine.worker_pool import in_parallel\nprint(list(in_parallel(abs, [-1, -2], 2)))\n"


def test_a_script_without_a_guard_ends_with_one_line(tmp_path):
    (tmp_path / "script.py").write_text(UNGUARDED)
    done = subprocess.run([sys.executable, "script.py"], cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 1
    assert done.stdout == ""
    assert done.stderr.count("\n") == 1
    assert 'put what it does into `if __name__ == "__main__":`' in done.stderr


def test_a_script_with_a_guard_has_its_processes(tmp_path):
    guarded = UNGUARDED.replace("print", 'if __name__ == "__main__":\n    print')
    (tmp_path / "script.py").write_text(guarded)
    done = subprocess.run([sys.executable, "script.py"], cwd=tmp_path, capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")
    assert sorted(eval(done.stdout)) == [(0, 1), (1, 2)]


def test_forces_with_lost_samples_are_saved_as_they_are_read(folder):
    walked = uf.walk(2.0, uf.default_floor(1, 2))
    force_n = walked.force_n.copy()
    force_n[::50, 0] = np.nan
    uf.Forces(walked.time_s, force_n, walked.rate_hz, walked.floor).save("lossy.csv")
    found = uf.read_forces("lossy.csv")
    assert len(found) == len(walked) - 40
    assert np.abs(found.force_n - force_n[np.isfinite(force_n).all(axis=(1, 2))]).max() < 6e-4


def test_a_recording_says_which_tables_it_has(folder):
    path = write_recording(folder / "walk.underfoot", 0.2, uf.default_floor(1, 1))
    with uf.Recording(path) as recording, pytest.raises(uf.UnderfootError) as error:
        recording.acceleration("asked")
    assert str(error.value) == "table is 'asked'; allowed: commanded, measured"


def test_a_mark_without_a_frame_is_not_written_to_a_recording(folder):
    """SQLite would keep it: afterwards no program could place the mark."""
    path = write_recording(folder / "walk.underfoot", 0.2, uf.default_floor(1, 1))
    with uf.Recording(path) as recording:
        refused = (("start",), "frame is 'start'; allowed: a whole number"), ((3, None), "text is None")
        for mark, said in (*refused, ((3, "\ud800"), "allowed: text in UTF-8")):
            with pytest.raises(uf.UnderfootError, match=said):
                recording.add_mark(*mark)
        assert recording.add_mark(np.int64(3), "turn") == recording.marks()[0]
        assert len(recording.marks()) == 1
