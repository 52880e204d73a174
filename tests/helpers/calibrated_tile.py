"""A calibrated tile of the simulator."""

import os

import pytest
from click.testing import CliRunner
from filelock import FileLock

from underfoot.__main__ import cli
from underfoot.floor.profile import Profile


@pytest.fixture(scope="session")
def profile(tmp_path_factory):
    """Profile of tile t1 of the simulator, calibrated by the wizard with nobody on the tile.

    All processes of a run of the tests share it: the first one that asks for it makes it.
    """
    own = tmp_path_factory.getbasetemp()
    path = (own.parent if "PYTEST_XDIST_WORKER" in os.environ else own) / "calibrated-t1.json"
    with FileLock(path.with_suffix(".lock")):
        if not path.exists():
            options = ["--target", "simulator", "--tile", "t1", "--seed", "1", "--no-loads", "--profile", str(path)]
            said = CliRunner().invoke(cli, ["calibrate", "response", *options])
            assert said.exit_code == 0, said.output
    return Profile.load(path)
