"""Many renderings: a grid of values, a manifest that says what is there, and the same bytes wherever they were made."""

import csv
import hashlib
import json
import os
import signal
import subprocess
import sys
from functools import partial

import pytest
import soundfile
from process_groups import members

import underfoot as uf
from underfoot.patch import preset_files

SINE = preset_files.patches()["stimulus-sp"]
GRID = ("--set", "gain.gain=0.5,1", "--set", "out.tiles=t1,all")


def manifest(folder):
    with (folder / "manifest.csv").open(newline="") as file:
        return list(csv.DictReader(file))


def test_a_grid_has_a_file_for_every_combination_and_a_manifest(underfoot, folder):
    said = underfoot("render", SINE, "-o", "made", "--seconds", "0.3", *GRID, "--json")
    assert said.status == 0
    rows = manifest(folder / "made")
    assert [(row["gain.gain"], row["out.tiles"]) for row in rows] == [
        ("0.5", "t1"),
        ("0.5", "all"),
        ("1", "t1"),
        ("1", "all"),
    ]
    assert [row["peak"] for row in rows] == [str(report["peak"]) for report in json.loads(said.out)]
    for row in rows:
        data = (folder / "made" / row["file"]).read_bytes()
        assert hashlib.sha256(data).hexdigest() == row["sha256"]
        assert f"gain.gain={row['gain.gain']}" in row["file"]
        patch = uf.open_patch("stimulus-sp").set("gain", "gain", float(row["gain.gain"]))
        alone = uf.render(patch.set("out", "tiles", row["out.tiles"]), seconds=0.3)
        assert soundfile.read(folder / "made" / row["file"], dtype="float32")[0].tobytes() == alone.samples.tobytes()


def test_a_value_that_cannot_be_leaves_the_others_of_its_grid(underfoot, folder):
    """It refused them all, and the manifest gave its error for each."""
    said = underfoot("render", SINE, "-o", "made", "--seconds", "0.1", "--set", "gain.gain=1,1e9", *GRID[2:])
    assert said.status == 1
    assert said.error.count("gain.parameters.gain is 1000000000.0; allowed") == 1
    assert "2 of 4 patches were not rendered" in said.error
    assert [(row["gain.gain"], bool(row["file"]), bool(row["error"])) for row in manifest(folder / "made")] == [
        *[("1", True, False)] * 2,
        *[("1000000000", False, True)] * 2,
    ]


def test_one_value_is_one_file(underfoot, folder):
    assert underfoot("render", SINE, "-o", "a.wav", "--seconds", "0.3", "--set", "gain.gain=0").status == 0
    assert not soundfile.read("a.wav")[0].any()
    assert [path.name for path in folder.iterdir()] == ["a.wav"]


def test_a_folder_is_all_patches_in_it_and_what_fails_is_said(underfoot, folder):
    (folder / "patches").mkdir()
    for name in ("stimulus-sp", "stimulus-td"):
        uf.open_patch(name).save(folder / "patches" / f"{name}.json")
    (folder / "patches" / "bad.json").write_text("{")
    said = underfoot("render", "patches", "-o", "made", "--seconds", "0.1")
    assert said.status == 1
    assert said.error.count("bad.json") == 1
    rows = manifest(folder / "made")
    assert [row["file"] for row in rows] == ["", "stimulus-sp.wav", "stimulus-td.wav"]
    assert rows[0]["patch"] == os.path.join("patches", "bad.json")
    assert "is not JSON" in rows[0]["error"]
    assert [row["error"] for row in rows[1:]] == ["", ""]


@pytest.mark.parametrize(
    ("setting", "message"),
    [
        ("gain=1", "--set is 'gain=1'; allowed: NODE.PARAMETER=VALUE"),
        ("gain.gain=", "allowed: NODE.PARAMETER=VALUE"),
        ("gain.loud=1", "allowed: the parameters of gain"),
        ("nobody.gain=1", "there is no node 'nobody'"),
        ("gain.gain=1e9", "underfoot: gain.parameters.gain is 1000000000.0; allowed"),
    ],
)
def test_a_setting_that_cannot_be_is_one_line(refused, setting, message):
    assert message in refused("render", SINE, "-o", "a.wav", "--set", setting)


def test_ctrl_c_leaves_whole_files_and_a_manifest_of_them(underfoot, folder, until):
    assert underfoot("render", SINE, "--seconds", "0.01").status == 0  # kernels are there
    many = ",".join(f"{0.001 * k:g}" for k in range(400))
    command = [sys.executable, "-m", "underfoot", "render", SINE, "-o", "made", "--set", f"gain.gain={many}"]
    heard = partial(signal.signal, signal.SIGINT, signal.SIG_DFL)  # tests that run in the background may not hear it
    pipe = subprocess.PIPE
    with subprocess.Popen(command, stdout=pipe, stderr=pipe, start_new_session=True, preexec_fn=heard) as process:
        until(lambda: len(list(folder.glob("made/*.wav"))) > 3)
        os.killpg(process.pid, signal.SIGINT)
        out, error = process.communicate(timeout=300.0)
    told = [line for line in error.splitlines() if line and b" of 400: stimulus-sp " not in line]
    assert (process.returncode, out, told) == (130, b"", [])
    until(lambda: not members(process.pid))
    rows = manifest(folder / "made")
    made = {path.name for path in folder.glob("made/*.wav")}
    assert {row["file"] for row in rows} <= made
    assert len(made) - len(rows) <= len(os.sched_getaffinity(0))  # whole, but nobody had heard of them yet
    assert len(made) < 400
    for row in rows:
        assert hashlib.sha256((folder / "made" / row["file"]).read_bytes()).hexdigest() == row["sha256"]
    assert {path.suffix for path in folder.glob("made/*")} == {".wav", ".csv"}


def test_what_reads_files_of_this_computer_is_not_given_to_a_cluster(refused, folder):
    patch = uf.Patch().add("wav-player", file="beep.wav").add("tile-output")
    patch.connect("wav-player.out", "tile-output.acceleration").save(folder / "beep.json")
    cluster = ("--cluster", "tcp://127.0.0.1:9")
    told = refused("render", "beep.json", "--set", "wav-player.amplitude=1,2", *cluster)
    assert "plays a file of this computer" in told
    assert "--cluster is for several" in refused("render", SINE, "-o", "a.wav", *cluster)
    (folder / "mine").mkdir()
    for name in ("new", "mine"):
        refused("render", "beep.json", "--set", "wav-player.amplitude=1,2", "-o", name, *cluster)
    assert sorted(path.name for path in folder.iterdir()) == ["beep.json", "mine"], "an empty folder is left"
