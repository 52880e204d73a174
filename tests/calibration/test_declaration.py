"""A calibration is declared in one file: its command, the order in the window and its procedure follow from that."""

import sys
from dataclasses import fields, make_dataclass

import pytest
from click.testing import CliRunner

from underfoot.__main__ import cli
from underfoot.calibration import procedures
from underfoot.calibration.declaration import Calibration, MeasurementSetup
from underfoot.calibration.procedure import run
from underfoot.calibration.procedures import CALIBRATIONS, discover
from underfoot.calibration.rigs.simulated_hand import SimulatedHand
from underfoot.commands.calibrate import command_of
from underfoot.commands.rigs import RIGS
from underfoot.errors import BadValue
from underfoot.floor.layout import default_floor
from underfoot.floor.profile import Profile
from underfoot.floor.profile_parts import PARTS
from underfoot.floor.simulated_tile import SimulatedTile
from underfoot.options import option, options_of

TILE = default_floor(1, 1).tiles[0]

NOISE = """
from dataclasses import dataclass

import numpy as np

from underfoot.calibration.declaration import PRESSING, Calibration
from underfoot.calibration.procedure import Page, PageProgress, Procedure, Step
from underfoot.calibration.result import Result
from underfoot.calibration.rig import PressRequest
from underfoot.options import option


@dataclass(frozen=True)
class NoiseCalibration(Calibration):
    kind = "noise"
    name = "Noise"
    title = "Noise: what an empty tile reads"
    about = "Nobody stands on the tile, and its readings are taken for a second."
    summary = "Measure the noise of an empty tile."
    rig = PRESSING
    file_options = ("table",)
    requires = "fsr"

    table: str | None = option("A table of readings.", None)
    sensor: int = option("Which sensor, from 1.", 1)

    def procedure(self, setup):
        return NoiseProcedure(self.sensor - 1)

    def from_files(self, floor, tile):
        raise AssertionError("no files here")


class NoiseProcedure(Procedure):
    def __init__(self, sensor):
        self._sensor = sensor
        super().__init__(Page("setup", "Noise", "Step off the tile."))

    def plan(self, answers):
        page = Page("rest", "Nothing on it", "Stand clear.", press=PressRequest((0.0, 0.0), 0.0, 1.0))
        return [Step(page, lambda readings: None if readings.last(1.0) else PageProgress("Stand clear."))]

    def conclude(self):
        deviation = float(np.std(self.step_data()[0].readings.last(1.0).values[:, self._sensor]))
        return Result("noise", "Noise", (("noise_counts", deviation, "counts"),), "Measured.", True)
"""


@pytest.mark.parametrize("declared", CALIBRATIONS.values(), ids=CALIBRATIONS)
def test_every_calibration_declares_what_others_read(declared):
    assert declared.kind in PARTS
    assert all((declared.name, declared.title, declared.about, declared.summary))
    assert declared.rig in RIGS
    assert declared.requires in ("", *CALIBRATIONS)
    assert set(declared.file_options) <= {one.name for one in options_of(declared)}
    found = CliRunner().invoke(cli, ["calibrate", declared.kind, "--help"])
    assert found.exit_code == 0
    assert declared.summary.split()[0] in found.output
    assert all(one.flag in found.output for one in options_of(declared))
    procedure = declared().procedure(MeasurementSetup(TILE, Profile(tile=TILE.id)))
    assert (procedure.page.key, procedure.result) == ("setup", None)


def test_each_comes_after_the_one_that_it_requires():
    kinds = list(CALIBRATIONS)
    assert kinds == ["fsr", "centroid", "response", "latency", "plate"]
    for kind, declared in CALIBRATIONS.items():
        assert not declared.requires or kinds.index(declared.requires) < kinds.index(kind)


@pytest.fixture
def noise(tmp_path, monkeypatch):
    """A calibration that was added: one file in the folder of procedures, and nothing else."""
    (tmp_path / "noise.py").write_text(NOISE)
    monkeypatch.setattr(procedures, "__path__", [*procedures.__path__, str(tmp_path)])
    found = discover()
    yield found["noise"]
    del sys.modules[f"{procedures.__name__}.noise"]
    delattr(procedures, "noise")


def test_a_calibration_is_added_by_one_file(noise):
    assert issubclass(noise, Calibration)
    assert [field.name for field in fields(noise)] == ["table", "sensor"]
    command = command_of(noise)
    assert (command.name, command.help) == ("noise", "Measure the noise of an empty tile.")
    assert {"--table", "--sensor", "--target", "--cell", "--profile", "--json"} <= {
        flag for parameter in command.params for flag in parameter.opts
    }
    hand = SimulatedHand(SimulatedTile(TILE, seed=1), seed=1)
    result = run(noise(sensor=2).procedure(MeasurementSetup(TILE, Profile(tile="t1"))), hand)
    assert 0.0 < result.figures["noise_counts"] < 100.0


def test_files_or_a_target_are_named_and_not_both(noise):
    for calibration, target, good in (
        (noise(), "simulator", True),
        (noise(table="a"), "", True),
        (noise(), "", False),
        (noise(table="a"), "simulator", False),
    ):
        if good:
            calibration.check(target)
        else:
            with pytest.raises(BadValue, match="give either --table or --target"):
                calibration.check(target)


def test_an_option_of_an_unclear_type_is_refused():
    made = make_dataclass("Made", [("one", int | str, option("What?", 0))])
    with pytest.raises(BadValue, match="one type"):
        options_of(made)
    clear = options_of(make_dataclass("Made", [("two_hz", float | None, option("What?", None))]))
    assert [(one.flag, one.type) for one in clear] == [("--two-hz", float)]
