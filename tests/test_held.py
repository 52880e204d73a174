"""What the program computes stays what it was: `held.json` holds it, and says on which machine and build it was made.

Every preset's two seconds of the default walker, at two of three block sizes; the steps and contacts of measured
walks; the figures and profiles of a calibration of the simulated tile. On the machine and build of the file the bytes
are held (docs/contracts.md#time promises them there); anywhere else the figures, to what another processor's vectors
may change.

`python tests/test_held.py` writes the file anew, for a change that is meant to change what is computed: its commit says
what, and by how much.
"""

import hashlib
import json
import platform
import re
import sys
from functools import cache
from importlib.metadata import version
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from llvmlite import binding

from underfoot.__main__ import cli
from underfoot.devices.simulated_floor import SimulatedFloor
from underfoot.engine.loop import LoopOptions
from underfoot.engine.render import render_source
from underfoot.floor.layout import default_floor
from underfoot.nodes import REGISTRY
from underfoot.patch import preset_files
from underfoot.patch.patch import Patch

HELD = Path(__file__).with_name("held.json")
DATA = Path(__file__).resolve().parents[1] / "../shared/data"
WALKS = ("adult/walk1", "adult/walk2", "adult/walk3", "three-steps/walk", "two-plates/walk", "floor14/floor")
SECONDS, BLOCK = 2.0, 1024
OTHERS = ((64, SECONDS), (7, 0.4))
"""Block sizes that must give the same bytes, each preset one of them in turn, and how long: 7 frames take long."""
WIZARDS = ("fsr", "centroid", "response", "latency", "plate")


def machine():
    """What the last bits depend on: processor, C library, and everything that makes or runs compiled code."""
    built = {name: version(name) for name in ("numba", "llvmlite", "numpy", "scipy")}
    return {"cpu": binding.get_host_cpu_name(), "libc": " ".join(platform.libc_ver()), **built}


@cache
def held():
    return json.loads(HELD.read_text())


def digest(data):
    return hashlib.sha256(data).hexdigest()[:24]


def render_of(name, block=BLOCK, seconds=SECONDS):
    """Samples of a preset, float32 [frame, channel]."""
    patch = Patch.load(preset_files.patches()[name], REGISTRY)
    source = SimulatedFloor(default_floor(), 48_000, patch.seed)
    return render_source(patch, source, seconds, LoopOptions(block=block)).samples


def render_figures(samples):
    return {
        "peak": float(np.abs(samples).max()),
        "rms": [float(x) for x in np.sqrt(np.mean(np.square(samples, dtype=np.float64), axis=0))],
    }


def tables_of(name, folder):
    """The text of a walk's tables of steps and of contacts."""
    steps, contacts = folder / "steps.csv", folder / "contacts.csv"
    said = CliRunner().invoke(
        cli, ["monitor", str(DATA / f"{name}.csv"), "--steps", str(steps), "--contacts", str(contacts)]
    )
    assert said.exit_code == 0, said.output
    return steps.read_text(), contacts.read_text()


def calibrated(folder):
    """The figures that each wizard prints on the simulated tile, and the profile that they make together."""
    profile, found = folder / "profile.json", {}
    for wizard in WIZARDS:
        options = ["--target", "simulator", "--profile", str(profile), "--json", "--seed", "1"]
        said = CliRunner().invoke(cli, ["calibrate", wizard, *options, *(["--quick"] if wizard == "centroid" else [])])
        assert said.exit_code == 0, said.output
        found[wizard] = json.loads(said.stdout)
    return {"figures": undated(found), "profile": undated(json.loads(profile.read_text()))}


def undated(value):
    """Without the date on which it was made, and without paths."""
    if isinstance(value, str):
        return re.sub(r"; forces calibrated [-\d]+ \w+$", "", value)
    if isinstance(value, dict):
        return {key: undated(item) for key, item in value.items() if key not in ("made", "profile", "report")}
    return [undated(item) for item in value] if isinstance(value, list) else value


def close(found, expected, where="$"):
    """Fail where two documents differ by more than rounding; say where."""
    if isinstance(expected, dict):
        assert found.keys() == expected.keys(), where
        for key, item in expected.items():
            close(found[key], item, f"{where}.{key}")
    elif isinstance(expected, list):
        assert len(found) == len(expected), where
        for i, item in enumerate(expected):
            close(found[i], item, f"{where}[{i}]")
    elif isinstance(expected, float):
        assert found == pytest.approx(expected, rel=1e-3, abs=1e-6), where
    else:
        assert found == expected, where


@pytest.mark.parametrize("name", preset_files.patches())
def test_a_preset_renders_to_the_bytes_that_are_held_at_another_block_size_too(name):
    expected = held()["renders"][name]
    samples = render_of(name)
    close(render_figures(samples), expected["figures"])
    block, seconds = OTHERS[list(preset_files.patches()).index(name) % len(OTHERS)]
    beginning = render_of(name, block, seconds)
    assert beginning.tobytes() == samples[: len(beginning)].tobytes(), f"block {block}"
    if machine() == held()["machine"]:
        assert digest(samples.tobytes()) == expected["bytes"]


@pytest.mark.skipif(not DATA.is_dir(), reason=f"the measured walks are not at {DATA}")
@pytest.mark.parametrize("name", WALKS)
def test_a_walk_gives_the_tables_that_are_held(name, tmp_path):
    assert [digest(table.encode()) for table in tables_of(name, tmp_path)] == held()["tables"][name]


def test_the_simulated_tile_is_calibrated_as_it_is_held(tmp_path):
    found = calibrated(tmp_path)
    close(found, held()["calibration"])
    if machine() == held()["machine"]:
        assert found == held()["calibration"]


def write(folder):
    renders = {}
    for name in preset_files.patches():
        samples = render_of(name)
        renders[name] = {"bytes": digest(samples.tobytes()), "figures": render_figures(samples)}
    tables = {name: [digest(table.encode()) for table in tables_of(name, folder)] for name in WALKS}
    made = {"machine": machine(), "renders": renders, "tables": tables, "calibration": calibrated(folder)}
    HELD.write_text(json.dumps(made, indent=1) + "\n")


if __name__ == "__main__":
    import tempfile

    with tempfile.TemporaryDirectory() as made:
        write(Path(made))
    sys.exit()
