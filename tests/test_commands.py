"""The command line: what each command does with real files."""

import json
import os
import re
import shlex
import subprocess
import sys

import click
import numpy as np
import pytest
import soundfile
from free_ports import free_port

from underfoot import __version__, commands
from underfoot.__main__ import cli
from underfoot.commands.render import line_of
from underfoot.devices.transports.serial import SerialTransport
from underfoot.engine.target import simulation_of
from underfoot.floor.layout import default_floor
from underfoot.nodes import REGISTRY
from underfoot.patch import preset_files
from underfoot.patch.patch import Patch

RATE = 48_000
SINE = preset_files.patches()["stimulus-sp"]


# --- what there is ---


@pytest.mark.skipif(sys.platform != "linux", reason="threads are counted in /proc")
@pytest.mark.parametrize(("module", "given", "found"), [
    ("underfoot", {}, "None"),
    ("underfoot.__main__", {}, "1"),
    ("underfoot.__main__", {"OPENBLAS_NUM_THREADS": "2"}, "2"),
])  # fmt: skip
def test_a_program_has_one_thread_of_linear_algebra_and_a_script_what_it_likes(module, given, found):
    script = (
        f"import {module}, numpy, os; print(os.environ.get('OPENBLAS_NUM_THREADS'), *os.listdir('/proc/self/task'))"
    )
    rest = {name: value for name, value in os.environ.items() if name != "OPENBLAS_NUM_THREADS"}
    run = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True, env={**rest, **given}
    )
    number, *threads = run.stdout.split()
    assert number == found
    assert number != "1" or len(threads) == 1


def test_every_command_has_help(underfoot):
    assert "Commands:" in underfoot("--help").out
    context = click.Context(cli)
    names = cli.list_commands(context)
    assert {"bench", "calibrate", "emulate", "monitor", "nodes", "render", "tile"} <= set(names)
    for command in names:
        for option in ("--help", "-h"):
            said = underfoot(command, option)
            assert said.status == 0
            assert said.error == ""
            assert said.out.startswith(f"Usage: underfoot {command}")
            for parameter in cli.get_command(context, command).params:
                assert parameter.param_type_name == "argument" or parameter.help, f"{command}: {parameter.name}"


@pytest.mark.parametrize("option", ["cluster", "record", "sensor_rate", "sound"])
def test_an_option_of_several_commands_is_told_in_the_same_words(option):
    context = click.Context(cli)
    options = [one for name in cli.list_commands(context) for one in cli.get_command(context, name).params]
    found = [one for one in options if one.name == option]
    assert len(found) > 1
    assert len({one.make_metavar(context) for one in found}) == 1
    assert len({one.help.split(" for ")[0].split(" that ")[0] for one in found}) == 1


def test_an_option_that_is_misspelt_is_said_in_whole_sentences(underfoot):
    said = underfoot("--targte", "simulator")
    assert said.error == "underfoot: No such option '--targte'. Did you mean '--target'? See `underfoot --help`\n"
    assert said.status == 1
    assert underfoot("render").error == "underfoot: Missing argument 'PATCH...'; see `underfoot render --help`\n"


GREET = """import click

@click.command(help="Greet.")
def greet():
    print("hello")
"""


def test_a_file_in_the_folder_of_commands_is_a_command(underfoot, refused, folder, monkeypatch, request):
    (folder / "greet.py").write_text(GREET)
    (folder / "shared.py").write_text("greeting = 'hello'\n")
    monkeypatch.setattr(commands, "__path__", [*commands.__path__, str(folder)])
    request.addfinalizer(lambda: [sys.modules.pop(f"underfoot.commands.{name}", None) for name in ("greet", "shared")])
    assert re.search("  greet +Greet\\.", underfoot("--help").out)
    assert underfoot("greet").out == "hello\n"
    assert "No such command 'shared'" in refused("shared")


def test_tab_completes_what_has_a_name_and_leaves_files_to_the_shell(underfoot, monkeypatch, folder):
    monkeypatch.setenv("_UNDERFOOT_COMPLETE", "bash_complete")
    monkeypatch.setattr(SerialTransport, "suggestions", classmethod(lambda cls: {}["antenna"]))  # as a plug-in's may
    (folder / "snowed.json").touch()
    for words, completed in (
        ("mon", ["plain,monitor"]),
        ("snowed", ["file,snowed"]),  # which the window opens
        ("gravel m", ["plain,monitor"]),
        ("render grav", ["file,grav", "plain,gravel"]),
        ("render sno", ["plain,snow", "file,sno"]),  # bash takes the last: the file
        ("experiment detection-t", ["file,detection-t", "plain,detection-threshold"]),
        ("analyse trials.csv --protocol free", ["file,free", "plain,free-labels"]),
        ("scene fro", ["plain,frozen-pond"]),
        ("--scene fro", ["plain,frozen-pond"]),
        ("nodes low", ["plain,low-pass"]),
        ("monitor sim", ["file,sim", "plain,simulator"]),
        ("--target udp", ["file,udp", "plain,udp:0.0.0.0:9000"]),
        ("scene footprints --target tcp", ["plain,tcp:127.0.0.1:9001"]),
        ("calibrate forces --target tcp", ["plain,tcp:127.0.0.1:9001"]),
    ):
        monkeypatch.setenv("COMP_WORDS", f"underfoot {words}")
        monkeypatch.setenv("COMP_CWORD", str(len(words.split())))
        assert underfoot().out.split() == completed


def test_the_version_is_the_package_s(underfoot):
    assert __version__ in underfoot("--version").out


def test_it_runs_as_a_program_of_its_own(folder):
    done = subprocess.run([sys.executable, "-m", "underfoot", "render", "nope.json"], capture_output=True, text=True)
    assert (done.returncode, done.stdout) == (1, "")
    assert done.stderr == "underfoot: nope.json cannot be read: no such file\n"


def test_a_python_that_drops_the_texts_of_help_is_told_of(folder):
    done = subprocess.run([sys.executable, "-OO", "-m", "underfoot", "nodes"], capture_output=True, text=True)
    assert "for its help; start Python without -OO and PYTHONOPTIMIZE=2, which drop it\n" in done.stderr


@pytest.mark.skipif(sys.platform == "win32", reason="there is no such limit")
def test_a_system_that_allows_no_more_open_files_is_one_line(folder):
    serve = [sys.executable, "-m", "underfoot", "serve", "simulator", "--seconds", "1"]
    command = "ulimit -n 25; exec " + shlex.join([*serve, "--listen", f"127.0.0.1:{free_port()}"])
    done = subprocess.run(["sh", "-c", command], capture_output=True, text=True, check=False)
    assert done.returncode == 1
    says = "underfoot: the system allows no more open files; raise its limit (ulimit -n) and start again\n"
    assert done.stderr.endswith(says)
    assert "Traceback" not in done.stderr


# --- render ---


def test_render_writes_a_float_wav_of_one_channel_a_tile_and_says_what_it_did(underfoot, folder):
    said = underfoot("render", SINE, "-o", "out.wav", "--seconds", "0.5", "--json")
    assert (said.status, said.error) == (0, "")
    told = json.loads(said.out)
    samples, rate = soundfile.read("out.wav", dtype="float32")
    assert (rate, samples.shape, soundfile.info("out.wav").subtype) == (RATE, (RATE // 2, 4), "FLOAT")
    assert told["peak"] == np.abs(samples).max()
    assert told["rms"] == pytest.approx(np.sqrt(np.mean(samples.astype(float) ** 2)), rel=1e-9)
    assert told["seconds"] == 0.5
    assert 0.0 < told["times_real_time"] < told["program_times_real_time"]
    assert told["nodes"] == {"run": ["tile", "proportional", "gain", "sine", "out"], "asleep": [], "left_out": []}
    assert [path.name for path in folder.iterdir()] == ["out.wav"]


def test_render_gives_the_same_file_each_time_and_for_any_block(underfoot, folder):
    for name, block in (("a.wav", 1024), ("b.wav", 1024), ("c.wav", 7), ("d.wav", 65536)):
        assert (
            underfoot(
                "render", preset_files.patches()["gravel"], "-o", name, "--seconds", "0.6", "--block", block
            ).status
            == 0
        )
    files = [(folder / f"{letter}.wav").read_bytes() for letter in "abcd"]
    assert files[0] == files[1] == files[2] == files[3]
    assert soundfile.read("a.wav")[0].any()


@pytest.mark.parametrize(
    ("times", "words"), [(0.043, "0.043"), (0.96, "0.96"), (1.04, "1.0"), (9.94, "9.9"), (9.96, "10"), (1234.5, "1234")]
)
def test_render_says_in_two_figures_how_much_faster_than_real_time_it_is(times, words):
    said = line_of({"seconds": 1.0, "peak": 0.5, "rms": 0.1, "times_real_time": times})
    assert said.endswith(f" of full scale, {words} times real time")


def test_render_takes_seed_rate_and_floor(underfoot, folder):
    default_floor(1, 3).save("three.json")
    for name, options in (
        ("a", ["--seed", 1]),
        ("b", ["--seed", 2]),
        ("c", ["--rate", 44100]),
        ("d", ["--floor", "three.json"]),
    ):
        said = underfoot(
            "render", preset_files.patches()["stimulus-td"], "-o", f"{name}.wav", "--seconds", "0.5", *options
        )
        assert said.status == 0
        assert "times real time" in said.out
    assert soundfile.read("a.wav")[0].tobytes() != soundfile.read("b.wav")[0].tobytes()
    assert soundfile.info("c.wav").samplerate == 44100
    assert soundfile.info("d.wav").channels == 3


def test_render_plays_forces_from_a_file_for_as_long_as_they_last(underfoot, folder, walk):
    told = json.loads(underfoot("render", SINE, "--force", "walk.csv", "-o", "out.wav", "--json").out)
    samples, _ = soundfile.read("out.wav")
    assert told["seconds"] == pytest.approx(1.599 + 0.5, abs=1e-3)
    down = np.abs(samples) > 0.01
    for tile, start_s in ((0, 0.5), (1, 0.9)):
        sounding = np.flatnonzero(down[:, tile]) / RATE
        assert start_s < sounding[0] < start_s + 0.03
        assert start_s + 0.55 < sounding[-1] < start_s + 0.64


def test_render_on_an_empty_floor_is_silent_and_everything_sleeps(underfoot, folder):
    told = json.loads(underfoot("render", SINE, "--force", "none", "--seconds", "1", "--json").out)
    assert (told["peak"], told["rms"], told["nodes"]["run"]) == (0.0, 0.0, [])
    assert len(told["nodes"]["asleep"]) == 5
    assert list(folder.iterdir()) == []


def test_render_finds_sound_files_beside_the_patch(underfoot, folder, monkeypatch):
    (folder / "sounds").mkdir()
    soundfile.write("sounds/beep.wav", 0.5 * np.sin(np.arange(4800) * 0.1), RATE)
    patch = Patch().add("wav-player", REGISTRY, file="beep.wav").add("tile-output", REGISTRY)
    patch.connect("wav-player.out", "tile-output.acceleration", REGISTRY).save("sounds/patch.json")
    assert json.loads(underfoot("render", "sounds/patch.json", "--seconds", "0.2", "--json").out)["peak"] > 0.1


def test_render_of_several_patches_gives_the_files_of_each_alone(underfoot, folder):
    paths = [SINE, preset_files.patches()["material-ice"], preset_files.patches()["gravel"]]
    said = underfoot("render", *paths, "-o", "all", "--seconds", "0.5")
    assert said.status == 0
    lines = said.out.splitlines()
    assert [line.partition(": ")[0] for line in lines] == [path.stem for path in paths]  # presets by their names
    assert all("times real time" in line for line in lines)
    assert [line.split(":")[1] for line in said.error.splitlines()] == [f" {k} of 3" for k in (1, 2, 3)]
    for path in paths:
        assert underfoot("render", path, "-o", "one.wav", "--seconds", "0.5").status == 0
        assert (folder / "all" / f"{path.stem}.wav").read_bytes() == (folder / "one.wav").read_bytes()
    assert len(list((folder / "all").iterdir())) == 3 + 1  # and the manifest


def test_render_says_which_of_several_patches_failed_and_does_the_others(underfoot, folder):
    (folder / "bad.json").write_text("{")
    said = underfoot("render", "bad.json", SINE, "missing.json", "--seconds", "0.5", "-o", "all", "--json")
    assert said.status == 1
    told = json.loads(said.out)
    assert [one["patch"] for one in told] == ["bad.json", SINE.stem, "missing.json"]
    assert "is not JSON" in told[0]["error"]
    assert told[1]["peak"] > 0.0
    errors = said.error.splitlines()
    assert "underfoot: missing.json: cannot be read: no such file" in errors
    assert errors[-1] == "underfoot: 2 of 3 patches were not rendered"
    assert sorted(path.name for path in (folder / "all").iterdir()) == ["manifest.csv", f"{SINE.stem}.wav"]


# --- nodes ---


def test_nodes_tells_of_every_node(underfoot):
    text, data = underfoot("nodes").out, json.loads(underfoot("nodes", "--json").out)
    assert {entry["type"] for entry in data} == REGISTRY.keys()
    for type, declared in REGISTRY.items():
        assert f"{type}  ({declared.family}: {declared.label})" in text
        assert json.loads(underfoot("nodes", type, "--json").out) == [entry for entry in data if entry["type"] == type]
        entry = next(entry for entry in data if entry["type"] == type)
        assert [p["name"] for p in entry["parameters"]] == list(declared.parameters)
        assert {p["name"] for p in entry["inputs"]} == declared.input_ports.keys()


def test_presets_are_named_without_a_folder(underfoot, folder):
    """As the first steps do, in any folder."""
    done = underfoot("render", "wood", "--force", "corridor", "--seconds", "0.3", "-o", "wood.wav")
    assert done.status == 0
    assert (folder / "wood.wav").is_file()
    (folder / "wood").mkdir()  # for what is made of it, which hid the preset
    assert underfoot("render", "wood", "--force", "corridor", "--seconds", "0.1", "-o", "wood/soft.wav").status == 0
    assert "there is no patch in it" in underfoot("render", "wood/").error
    assert underfoot("tile", "tiles-2x2", "--simulation", "plywood-tile").out.startswith("30.5 x 30.5 cm")
    assert simulation_of("simulator:plywood-tile") == str(preset_files.simulations()["plywood-tile"])
    centroids = underfoot("calibrate", "places", "--presses", "none.csv", "--floor", "tiles-6x6")
    assert centroids.error.startswith("underfoot: none.csv cannot be read")  # after the floor
    refused = underfoot("render", "granite")
    assert refused.status == 1
    assert refused.error.startswith(
        "underfoot: granite cannot be read: no such file or preset; allowed: a file, or gravel,"
    )
    assert underfoot("levels", "Gravle").error.endswith("no such file or preset; did you mean gravel?\n")
