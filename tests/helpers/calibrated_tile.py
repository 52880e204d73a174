"""A calibrated tile of the simulator."""

import pytest
from click.testing import CliRunner

from underfoot.__main__ import cli
from underfoot.floor.profile import Profile


@pytest.fixture(scope="session")
def profile(tmp_path_factory):
    """Profile of tile t1 of the simulator, calibrated by the wizard with nobody on the tile."""
    path = tmp_path_factory.mktemp("profiles") / "t1.json"
    options = ["--target", "simulator", "--tile", "t1", "--seed", "1", "--no-loads", "--profile", str(path)]
    said = CliRunner().invoke(cli, ["calibrate", "response", *options])
    assert said.exit_code == 0, said.output
    return Profile.load(path)
