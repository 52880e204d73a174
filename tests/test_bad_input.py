"""Files and options that are wrong: each exits with status 1 and one line, and leaves every file as it was."""

import json
import os
import shutil
import struct
import sys
from pathlib import Path

import pytest

from underfoot.errors import BadFile, BadValue
from underfoot.experiments.stimuli import patch_path
from underfoot.floor.layout import default_floor
from underfoot.floor.profile import Profile
from underfoot.floor.tile_parameters import TileParameters
from underfoot.patch import preset_files
from underfoot.patch.program import Program

SINE = preset_files.patches()["stimulus-sp"]
TWO = default_floor(1, 2)


# --- what is wrong with a patch ---


def bad_patch(**changes):
    return json.dumps({"format": "underfoot-patch", "version": 1, **changes}).encode()


def bad_node(type="low-pass", **changes):
    return bad_patch(nodes=[{"id": "a", "type": type, **changes}])


GAINS = [{"id": id, "type": "gain"} for id in "ab"]
BAD_PATCHES = {
    "not JSON": (b"{nodes", "is not JSON"),
    "empty": (b"", "is not JSON"),
    "binary": (bytes(range(256)), "is not JSON"),
    "another program's": (b'{"lastOpened": "2011"}', "format is null"),
    "a floor": (default_floor().dumps(), "format is 'underfoot-floor'"),
    "future version": (bad_patch(version=7), "version is 7; allowed: 1 (a newer Underfoot may have written it)"),
    "unknown node": (bad_node("nope"), "nodes #1, type is 'nope'"),
    "unknown parameter": (bad_node(parameters={"nope": 1}), "nodes #1, parameters is 'nope'"),
    "out of range": (bad_node(parameters={"cutoff": -3}), "nodes #1, parameters, cutoff is -3; allowed: 1 to 20000 Hz"),
    "huge number": (bad_node(parameters={"cutoff": 1e308}), "nodes #1, parameters, cutoff is 1e+308"),
    "NaN": (bad_node(parameters={"cutoff": float("nan")}), "parameters, cutoff is nan; allowed: 1 to 20000 Hz"),
    "nodes no list": (bad_patch(nodes="gain"), "nodes is 'gain'; allowed: a list"),
    "place in words": (bad_node(at=["left", "top"]), "nodes #1, at #1 is 'left'; allowed: a number"),
    "parameters no object": (bad_node(parameters=[3]), "nodes #1, parameters is [3]; allowed: an object"),
    "wire to nowhere": (bad_patch(nodes=GAINS, wires=[["a.out", "c.signal"]]), "wires #1 is 'c.signal'"),
    "wire to no port": (bad_patch(nodes=GAINS, wires=[["a.out", "b.nope"]]), "the inputs of b: signal, gain"),
    "cycle": (bad_patch(nodes=GAINS, wires=[["a.out", "b.signal"], ["b.out", "a.signal"]]), "wires make a cycle"),
    "nested deep": (b'{"format": "underfoot-patch", "title": ' + b"[" * 100_000, "is nested deeper than"),
    "a number without end": (bad_patch(seed=0).replace(b'"seed": 0', b'"seed": ' + b"9" * 5000), "thousands of digits"),
    "nested as it ends": (bad_patch(title=0).replace(b"0", b"[" * 1000 + b"]" * 1000), "a.json"),
    "sound file missing": (
        bad_patch(
            nodes=[
                {"id": "a", "type": "wav-player", "parameters": {"file": "x.wav"}},
                {"id": "b", "type": "tile-output"},
            ],
            wires=[["a.out", "b.acceleration"]],
        ),
        "x.wav cannot be played",
    ),
}


@pytest.mark.parametrize("name", BAD_PATCHES)
def test_a_bad_patch_is_one_line_and_the_old_output_stays(refused, folder, name):
    data, message = BAD_PATCHES[name]
    (folder / "a.json").write_bytes(data)
    (folder / "out.wav").write_bytes(b"precious")
    assert message in refused("render", "a.json", "-o", "out.wav", "--seconds", "0.1")


@pytest.mark.parametrize("path", ["missing.json", ".", "missing/a.json", "x" * 300])
def test_a_patch_that_cannot_be_read(refused, path):
    assert "cannot be read" in refused("render", path, "-o", "out.wav")


def test_a_recording_that_is_none(refused, folder):
    (folder / "rec.underfoot").write_bytes(b"SQLite format 3\0" + bytes(5000))
    assert "rec.underfoot" in refused("render", "rec.underfoot", "-o", "out.wav")
    assert "--seed is given with rec.underfoot, a recording; allowed: --output, --measured" in refused(
        "render", "rec.underfoot", "-o", "out.wav", "--seed", "3"
    )
    assert "rec.underfoot" in refused("monitor", "rec.underfoot", "--steps", "steps.csv")


# --- what is wrong with forces and floors ---


def cell(text):
    """The table of forces with one cell changed, on line 12."""
    return lambda lines: [*lines[:11], lines[11].replace("0.000000", text, 1), *lines[12:]]


BAD_FORCES = {
    "empty": (lambda lines: [], "is empty"),
    "only a header": (lambda lines: lines[:1], "has 0 samples; allowed: 2 or more"),
    "missing column": (lambda lines: [line.rpartition(",")[0] for line in lines], "line 1 has no column t2.4"),
    "unknown tile": (lambda lines: [lines[0].replace("t2", "t9"), *lines[1:]], "'t9.1'; allowed: tiles of the floor"),
    "a sensor more": (lambda lines: [f"{lines[0]},t2.5", *(f"{x},0" for x in lines[1:])], "t2.1 to t2.4"),
    "tile more": (lambda lines: [f"{lines[0]},t3.1", *(f"{x},0" for x in lines[1:])], "allowed: tiles of the floor"),
    "letter": (cell("1O0"), "line 12, column t1.1 is '1O0'; allowed: a number"),
    "nan": (cell("nan"), "line 12, column t1.1 is 'nan'; allowed: a number"),
    "short line": (lambda lines: [*lines[:11], "0.0105,1", *lines[12:]], "line 12 has 2 columns; allowed: 9"),
    "time runs back": (lambda lines: [*lines, lines[5]], "a later time"),
    "binary": (lambda lines: ["\0\1\2"], "is not a force CSV: it is not UTF-8 text"),
    "prose": (lambda lines: ["Dear reader,", "no numbers here"], "line 1 has no column time_s"),
    "a sample a day": (lambda lines: [lines[0], lines[1], lines[2].replace("0.001", "86400")], "allowed:"),
}


@pytest.mark.parametrize("name", BAD_FORCES)
@pytest.mark.parametrize("command", ["render", "monitor"])
def test_a_bad_force_table_is_one_line_and_the_old_output_stays(refused, folder, name, command, walk):
    change, message = BAD_FORCES[name]
    walk.write_text("\n".join(change(walk.read_text().splitlines())))
    (folder / "old").write_text("precious")
    wanted = {
        "render": ["render", SINE, "--force", "walk.csv", "-o", "old"],
        "monitor": ["monitor", "walk.csv", "--steps", "old"],
    }
    assert message in refused(*wanted[command])


BAD_FLOORS = {
    "not JSON": (b"{", "is not JSON"),
    "empty": (b"", "is not JSON"),
    "a patch": (SINE.read_bytes(), "allowed: 'underfoot-floor'"),
    "future version": (b'{"format": "underfoot-floor", "version": 9}', "walk.floor.json, line 1: version is 9"),
    "no tiles": (b'{"format": "underfoot-floor", "version": 1, "tiles": []}', "at least one tile"),
    "tiles no list": (b'{"format": "underfoot-floor", "version": 1, "tiles": 3}', "line 1: tiles is 3"),
    "size in words": (TWO.dumps().replace(b"0.305", b'"wide"', 1), "tiles #1, size_m #1 is 'wide'; allowed: a number"),
    "three sensors": (TWO.dumps().replace(b"[\n     0.1335,\n     0.1335\n    ],", b"", 1), "exactly four points"),
    "id twice": (TWO.dumps().replace(b'"t2"', b'"t1"'), "an id that no other tile has"),
    "nested deep": (b"[" * 100_000, "nested deeper than"),
}


@pytest.mark.parametrize("name", BAD_FLOORS)
@pytest.mark.parametrize("command", ["render", "monitor"])
def test_a_bad_floor_is_one_line(refused, folder, name, command, walk):
    data, message = BAD_FLOORS[name]
    (folder / "walk.floor.json").write_bytes(data)
    wanted = {"render": ["render", SINE, "--force", "walk.csv", "-o", "out.wav"], "monitor": ["monitor", "walk.csv"]}
    assert message in refused(*wanted[command])


def test_a_floor_of_other_tiles_does_not_fit(refused, folder, walk):
    default_floor(1, 3).save("three.json")
    for command in (["render", SINE, "--force", "walk.csv"], ["monitor", "walk.csv"]):
        assert "line 1 has no column t3.1" in refused(*command, "--floor", "three.json")


def test_a_floor_that_is_not_there(refused, folder, walk):
    walk.with_suffix(".floor.json").unlink()
    assert "has no floor beside it (walk.floor.json); put one there, or give one by --floor" in refused(
        "monitor", "walk.csv"
    )
    told = refused("render", SINE, "--force", "walk.csv")
    assert "has no floor beside it" in told
    assert 'underfoot.default_floor(1, 2).save("walk.floor.json")' in told
    for table, lacks in (
        ("step,tile\n1,t1\n", "time_s among step, tile"),
        ("time_s,x_m\n0,1\n", "t1.1 among time_s, x_m"),
    ):
        (folder / "table.csv").write_text(table)  # one of steps or contacts, which no floor would help
        assert f"table.csv: line 1 has no column {lacks}; name them time_s, t1.1" in refused("monitor", "table.csv")
    assert "missing.json cannot be read" in refused("monitor", "walk.csv", "--floor", "missing.json")
    assert "missing.json cannot be read" in refused("render", SINE, "--floor", "missing.json")


@pytest.mark.parametrize("path", ["missing.csv", ".", "", "x" * 300])
def test_forces_that_are_not_there(refused, path):
    assert "cannot be read" in refused("render", SINE, "--force", path)
    assert "cannot be read" in refused("monitor", path)
    assert "--target" in refused("--target", path)
    why = "cannot be read" if len(path) < 300 else "allowed: PARAMETERS.json"
    assert why in refused("--target", f"simulator:{path or '.'}")


@pytest.mark.parametrize("name", ["missing.underfoot", "missing.json", "folder/missing"])
def test_a_file_alone_that_is_not_there_is_no_command(refused, name):
    assert f"{Path(name)} cannot be read" in refused(name)


def test_a_folder_in_place_of_a_file_is_said_to_be_one(refused, folder):
    (folder / "walks").mkdir()
    for words in (
        ("monitor", "walks"),
        ("serve", "walks"),
        ("render", SINE, "--force", "walks"),
        ("export", "walks", "-o", "a.csv"),
    ):
        assert "walks cannot be read: it is a folder" in refused(*words)


def test_a_folder_of_patches_is_not_rendered_into_a_sound_file(refused, folder):
    (folder / "mine").mkdir()
    shutil.copy(SINE, folder / "mine" / "a.json")
    told = refused("render", "mine", "-o", "a.wav")
    assert "--output a.wav is the name of a sound file; allowed for mine, which makes 1 file: a folder, as a" in told
    (folder / "taken").write_text("x")
    assert "--output taken is a file; allowed for mine" in refused("render", "mine", "-o", "taken")
    assert "; allowed for gravel wood, which makes 2 files" in refused("render", "gravel", "wood", "-o", "taken")
    assert "; allowed for 4 patches, which makes 4 files" in refused("render", *["wood", "mine"] * 2, "-o", "taken")


def test_a_walk_that_is_misspelt_is_refused_with_the_names_that_there_are(refused):
    for words in (("monitor", "coridor"), ("serve", "coridor"), ("render", SINE, "--force", "coridor")):
        assert "a C3D file with force plates, or a preset walk: corridor)" in refused(*words)
    assert "recording, or a C3D file with force plates)" in refused("render", SINE, "--force", "coridor.csv")


def test_what_serve_cannot_read_is_what_was_given(refused):
    assert "missing.csv cannot be read: no such file (TARGET is simulator" in refused("serve", "missing.csv")


# --- what is wrong with options ---

BAD_OPTIONS = [
    ("nope", "No such command 'nope'"),
    ("monitr corridor", "No such command 'monitr'. Did you mean 'monitor'? See `underfoot --help`"),
    ("calibrate force", "No such command 'force'. Did you mean 'forces'? See `underfoot calibrate --help`"),
    ("gravel", "No such command 'gravel'; `underfoot --patch gravel` opens the preset; see `underfoot --help`"),
    ("grvel", "No such command 'grvel'; `underfoot --patch gravel` opens the preset"),  # it is like serve, too
    ("convert gravel -o -", "'-' cannot be read or written; allowed: a file's name"),
    ("monitor corridor --steps -", "'-' cannot be read"),
    ("levels --profile=", "'' cannot be read"),
    ("--nope", "No such option"),
    ("--scene pond", "scene is 'pond'; allowed: footprints"),
    ("--scene footprints --set ground=mud", "ground is 'mud'; allowed: silent"),
    ("--set ground=snow", "--set is ground=snow; allowed: with --scene"),
    ("render", "Missing argument 'PATCH...'; see `underfoot render --help`"),
    ("calibrate", "Missing command; see `underfoot calibrate --help`"),
    ("monitor", "Missing argument 'SOURCE'"),
    ("cost PATCH more", "unexpected extra argument"),
    ("render PATCH PATCH --output out", "would be written twice; render them one by one"),
    ("render PATCH PATCH --output out.wav", "--output out.wav is a file; allowed for"),
    ("render PATCH --nope", "No such option"),
    ("render PATCH --output", "requires an argument"),
    ("render PATCH --seconds -1", "seconds is -1.0; allowed: above 0, up to a day"),
    ("render PATCH --seconds 0", "seconds is 0.0"),
    ("render PATCH --seconds nan", "seconds is nan"),
    ("render PATCH --seconds inf", "seconds is inf"),
    ("render PATCH --seconds 1e9", "seconds is 1000000000.0"),
    ("render PATCH --seconds long", "'long' is not a valid float"),
    ("scene frozen-pond --set depth=1", "--set is 'depth=1'; allowed: NAME=VALUE with a name of: threshold_n, "),
    ("render PATCH --block 0", "block is 0; allowed: 1 to 65536 frames"),
    ("render PATCH --block -64", "block is -64"),
    ("render PATCH --block 100000", "block is 100000"),
    ("render PATCH --block 6.4", "'6.4' is not a valid integer"),
    ("render PATCH --rate 5", "rate is 5.0; allowed: 8000 to 192000 Hz"),
    ("render PATCH --rate 0", "rate is 0.0"),
    ("render PATCH --rate nan", "rate is nan"),
    ("render PATCH --rate 44100.5", "rate is 44100.5; allowed: whole numbers"),
    ("render PATCH --set gain.gain=1,,2", "--set is 'gain.gain=1,,2'; allowed: a value before and after each comma"),
    ("plate --port /dev/null --stiffness 90", "give --footsteps, or --port with --calibration and --stiffness, or"),
    ("plate --emulate --port simulated", "--port is given with --emulate; allowed: --emulate alone"),
    ("plate --port simulated --stiffness 90 -o a.json", "--output is given with --port; allowed: --calibration, --st"),
    ("plate --footsteps a.csv --port simulated", "--port is given with --footsteps; allowed: --output, --report"),
    ("calibrate vibration --sweep a.wav --recorded b.wav --input-channel 1", "--input-channel is given with files of"),
    ("cost PATCH --curve sine --block 64", "--block is given with --curve; allowed: --outside-files, --run-code"),
    ("bench --short --times 5", "--times is given with --short; allowed: --compare, --report, --json"),
    ("bench --times 5", "--times is given with the whole bench; allowed: --quick, --compare"),
    ("bench --figures a --report b", "--report is given with --figures; allowed: --quick, --json"),
    ("bench --stress --report b", "--report is given with --stress; allowed: --times, --seconds, --seed, --json"),
    ("convert walk.wav -o a.json --seconds 1", "--seconds is given with walk.wav, which is no patch; allowed: --out"),
    ("experiment free-labels --plan P1 --report a", "--report is given with --plan; allowed: --conditions, --csv"),
    ("experiment free-labels --levels --floor a.json", "--floor is given with --levels; allowed: --conditions"),
    ("experiment free-labels --simulate 2 --session a", "--session is given with --simulate; allowed: --conditions"),
    ("experiment free-labels --pilot --truth a=1", "--truth is given with --pilot; allowed: --session, --conditions"),
    ("render PATCH --seed one", "'one' is not a valid integer"),
    ("monitor simulator --seconds nan", "--seconds is nan; allowed: above 0"),
    ("monitor simulator --seconds -1", "--seconds is -1"),
    ("monitor serial:nowhere", "serial:nowhere"),
    ("nodes nope", "there is no node 'nope'; allowed: "),
    ("nodes gain mix", "unexpected extra argument"),
]


@pytest.mark.parametrize(("line", "message"), BAD_OPTIONS, ids=[line for line, _ in BAD_OPTIONS])
def test_bad_options_are_one_line(refused, folder, line, message):
    (folder / "out.wav").write_bytes(b"precious")
    words = [str(SINE) if word == "PATCH" else word for word in line.split()]
    if words[0] == "render" and "--output" not in words:
        words += ["-o", "out.wav"]
    assert message in refused(*words)


def test_no_name_at_all_is_one_line(refused):
    assert "cannot be read" in refused("serve", "")
    assert "cannot be read" in refused("emulate", "--pty", "--force", "")


@pytest.mark.parametrize("output", ["missing/out.wav", ".", "x" * 300])
def test_an_output_that_cannot_be_written(refused, folder, output, walk):
    assert "cannot be written" in refused("render", SINE, "--seconds", "0.1", "-o", output)
    for option in ("--steps", "--contacts"):
        assert "cannot be written" in refused("monitor", "walk.csv", option, output)


def test_no_output_takes_the_place_of_an_input_or_of_another_output(refused, folder, walk):
    (folder / "patch.json").write_bytes(SINE.read_bytes())
    assert "patch.json is given twice" in refused("render", "patch.json", "--seconds", "0.1", "-o", "./patch.json")
    assert "walk.csv is given twice" in refused("monitor", "walk.csv", "--steps", "walk.csv")
    assert "out.csv is given twice" in refused("monitor", "walk.csv", "--steps", "out.csv", "--contacts", "out.csv")


def test_every_command_says_alike_where_no_file_or_folder_can_be_made(refused, folder):
    for words in (
        ("render", SINE, "-o", "new/"),  # wrote a file of this name
        ("export", "a.underfoot", "-o", "new/"),
        ("monitor", "corridor", "--steps", "new/"),
        ("convert", SINE, "-o", "new.wav/"),
        ("calibrate", "forces", "--target", "simulator", "--profile", "new/"),
    ):
        assert f"{words[-1]} names a folder; allowed: the name of a file" in refused(*words)
    person = ("experiment", "detection-threshold", "--participant", "p1", "--session", "no/a.session")
    assert "no/a.session cannot be written: there is no folder no" in refused(*person)
    (folder / "taken").write_text("x")
    for words in (
        ("convert", SINE, "-o", "taken/x"),
        ("distribution", "gravel", "-o", "taken/x"),
        ("tile", "tiles-2x2", "--report", "taken/x"),
        ("plate", "--footsteps", "a.csv", "--report", "taken/x"),
    ):
        assert "underfoot: taken is not a folder\n" in refused(*words)


def test_a_window_that_could_not_show_what_was_named_is_not_opened(refused, folder):
    (folder / "patch.json").write_bytes(b"{nodes")
    for patch, message in (("missing.json", "no such file"), ("patch.json", "is not JSON")):
        assert message in refused("--patch", patch, "--screenshot", "pictures")
    assert "patch.json is not a folder" in refused("--screenshot", "patch.json/pictures")


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="XDG_DATA_HOME is of Linux")
def test_a_window_whose_settings_have_no_place_is_not_opened(refused, folder, monkeypatch):
    (folder / "taken").write_bytes(b"")
    monkeypatch.setenv("XDG_DATA_HOME", str(folder / "taken"))
    told = refused()
    assert "taken is not a folder; the window keeps settings" in told
    assert "name another place in XDG_DATA_HOME" in told


def test_a_value_that_is_not_finite_names_its_node_and_writes_nothing(refused, folder, monkeypatch):
    monkeypatch.setattr(Program, "faults", lambda self: [("sine", "t2", 4711)])
    assert "node sine made a value that is not finite, on tile t2 at frame 4711" in refused(
        "render", SINE, "--seconds", "0.1", "-o", "out.wav"
    )


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("[" * 100_000, "nested"),
        (
            '{"format": "underfoot-profile", "version": 1, "tile": ' + "[" * 200 + "]" * 200 + "}",
            "nested deeper than 64",
        ),
        ('{"format": "underfoot-profile", "version": 1, "tile": "\\ud800"}', "half of a surrogate pair"),
        ('{"format": "underfoot-profile", "version": 1, "\\udc00": 1, "tile": "t1"}', "half of a surrogate pair"),
    ],
)
def test_documents_that_no_json_reader_would_survive_are_refused_in_one_line(text, why):
    with pytest.raises(BadFile, match=why) as refused:
        Profile.loads(text, "t1.json")
    str(refused.value).encode()


# --- what is not read without asking ---


def test_a_patch_reads_nothing_outside_its_folder_unless_it_is_let(refused, underfoot, folder):
    sound = bad_node("wav-player", parameters={"file": "/etc/passwd"})
    (folder / "a.json").write_bytes(sound)
    for command in (["render", "a.json", "-o", "out.wav"], ["cost", "a.json"]):
        assert "/etc/passwd, outside its folder; allowed: files beside the patch" in refused(*command)
    played = {"nodes": [{"id": "a", "type": "wav-player", "parameters": {"file": "/etc/passwd"}}]}
    played["nodes"].append({"id": "b", "type": "tile-output"})
    (folder / "a.json").write_bytes(bad_patch(**played, wires=[["a.out", "b.acceleration"]]))
    assert "/etc/passwd cannot be played" in refused("render", "a.json", "-o", "out.wav", "--outside-files")


def test_a_sound_file_that_is_a_pipe_is_not_waited_for(refused, folder):
    nodes = [{"id": "a", "type": "wav-player", "parameters": {"file": "pipe"}}, {"id": "b", "type": "tile-output"}]
    (folder / "a.json").write_bytes(bad_patch(nodes=nodes, wires=[["a.out", "b.acceleration"]]))
    if hasattr(os, "mkfifo"):
        os.mkfifo(folder / "pipe")
    assert "pipe cannot be played: there is no such file" in refused("render", "a.json", "-o", "out.wav")


def test_a_sound_file_that_fills_the_memory_is_not_read(refused, folder):
    nodes = [{"id": "a", "type": "wav-player", "parameters": {"file": "a.wav"}}, {"id": "b", "type": "tile-output"}]
    (folder / "a.json").write_bytes(bad_patch(nodes=nodes, wires=[["a.out", "b.acceleration"]]))
    size = (1 << 28) + 2
    form = struct.pack("<4sIHHIIHH4sI", b"fmt ", 16, 1, 1, 48_000, 48_000, 1, 8, b"data", size)
    with (folder / "a.wav").open("wb") as file:
        file.write(b"RIFF" + struct.pack("<I", size + 36) + b"WAVE" + form)
        file.truncate(44 + size)
    assert "a.wav cannot be played: it is 268435458 samples in memory; allowed: 268435456" in refused(
        "render", "a.json", "-o", "out.wav"
    )


def test_simulations_and_protocols_read_what_lies_beside_them(folder):
    inside = folder / "inside"
    inside.mkdir()
    for name in ("/etc/passwd", "../walk.csv"):
        TileParameters(recording=name).save(inside / "a.json")
        with pytest.raises(BadFile, match="allowed: a file beside this one or below"):
            TileParameters.load(inside / "a.json")
        with pytest.raises(BadValue, match="allowed: a preset's name, or a file beside the protocol or below"):
            patch_path(name, inside)


@pytest.mark.parametrize(
    "line", ["monitor simulator --seconds 1 --record NAME", "tile floor.json --report NAME",
             "experiment identification-impact --participant P1 --session NAME", "bench --short --report NAME",
             "monitor simulator --patch NAME", "--patch NAME", "levels --profile NAME"]
)  # fmt: skip
def test_a_name_that_cannot_even_be_looked_for_is_one_line(refused, folder, line):
    default_floor(1, 1).save(folder / "floor.json")
    assert "xxx" in refused(*line.replace("NAME", "x" * 300).split())
