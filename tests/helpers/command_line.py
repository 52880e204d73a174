"""Fixtures for tests of the command line: running it within this process, and a walk as input.

They are available to all tests, so heavy imports wait until one is used.
"""

import re
import signal
import sys
from dataclasses import dataclass

import numpy as np
import pytest

COMPILING = re.compile(r"^underfoot: (first use|\d+ kernels?).*\n", re.MULTILINE)
"""Output of the first test that needs a kernel."""


@dataclass
class CommandResult:
    """Result of a command: its exit status and its outputs."""

    status: int
    out: str
    error: str


@pytest.fixture
def underfoot(monkeypatch, capfd):
    """Run a command line within this process."""
    from underfoot.__main__ import main

    def run(*arguments):
        monkeypatch.setattr(sys, "argv", ["underfoot", *map(str, arguments)])
        capfd.readouterr()
        with pytest.raises(SystemExit) as exit:
            main()
        out, error = capfd.readouterr()
        return CommandResult(exit.value.code, out, COMPILING.sub("", error))

    return run


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """An empty folder to work in."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def refused(underfoot, folder):
    """Run a command line that must fail with one line, and leave all files unchanged."""

    def run(*arguments):
        before = {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}
        result = underfoot(*arguments)
        assert result.status == 1
        assert result.out == ""
        assert result.error.startswith("underfoot: ")
        assert result.error.count("\n") == 1
        assert result.error.endswith("\n")
        assert before == {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}
        return result.error

    return run


@pytest.fixture
def walk(folder):
    """walk.csv in the folder, 1.6 s at 1 kHz with its floor beside it: a footstep on each of two tiles."""
    from underfoot.floor.layout import default_floor
    from underfoot.models import gait

    floor = default_floor(1, 2)
    time_s = np.arange(1600) / 1000.0
    force_n = np.zeros((len(time_s), 2, 4))
    for tile, start_s in ((0, 0.5), (1, 0.9)):
        newtons = gait.vertical_force((time_s - start_s) / 0.6, 800.0, 500.0, 780.0)
        along = 0.1 * (gait.roll((time_s - start_s) / 0.6) - 0.5)
        force_n[:, tile] = gait.corner_forces(newtons, along, 0.0, floor.tiles[tile].sensors_m)
    sensors = [f"{tile}.{sensor}" for tile in floor.ids for sensor in range(1, 5)]
    floor.save(folder / "walk.floor.json")
    table = np.column_stack([time_s, force_n.reshape(len(time_s), -1)])
    np.savetxt(folder / "walk.csv", table, "%.6f", ",", header=",".join(["time_s", *sensors]), comments="")
    return folder / "walk.csv"


@pytest.fixture
def with_hangup():
    """A closed terminal is told as ever, also where the tests run under `nohup`, which commands respect."""
    before = signal.signal(signal.SIGHUP, signal.SIG_DFL)
    yield
    signal.signal(signal.SIGHUP, before)
