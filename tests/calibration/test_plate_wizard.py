"""The plate's wizard: the simulator's stiffness comes out, on any plate; what is wrong is refused at once."""

import json
from dataclasses import replace

import numpy as np
import pytest

from underfoot.calibration.files.plate_profiles import read_plate_profiles
from underfoot.calibration.procedure import run, step
from underfoot.calibration.procedures.plate import PlateProcedure
from underfoot.calibration.rigs.plate import PlateRig, SimulatedFootsteps, simulated_plate_rig
from underfoot.devices.emulation.plate import EmulatedPlate, SimulatedServo
from underfoot.devices.plate import PlateCalibration, PlateServo
from underfoot.errors import BadMeasurement, BadValue
from underfoot.floor.layout import default_floor
from underfoot.floor.profile import Profile
from underfoot.floor.simulated_tile import SimulatedTile

TILE = default_floor(1, 1).tiles[0]


def truth(position):
    """The simulated plate of the thesis: 40 to 160 N/mm, even in the logarithm."""
    return 40.0 * 4.0**position


def rig(port="simulated", seed=1):
    return simulated_plate_rig(SimulatedTile(TILE, seed=seed), port, seed)


class Feet(SimulatedFootsteps):
    """Feet on a plate that does not give, that are too light, or whose sensors are silent."""

    def __init__(self, **changes):
        super().__init__(SimulatedTile(TILE, seed=1), 1)
        self.changes = changes

    def read(self):
        readings = super().read()
        changed = {name: change and change(getattr(readings, name)) for name, change in self.changes.items()}
        return replace(readings, **changed)


def plate_of_feet(feet):
    return PlateRig(feet, PlateServo("simulated", clock=feet.now))


def to_the_footsteps(procedure, rig, answers=None):
    while "footstep" not in procedure.page.key:
        step(procedure, rig, answers)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_the_stiffness_of_the_simulated_plate_comes_out_within_a_per_cent(seed):
    result = run(PlateProcedure(TILE), rig(seed=seed))
    part = result.apply(Profile(tile=TILE.id)).plate
    with pytest.raises(BadValue, match="the measured tile is 't1'; allowed: other, whose profile this is"):
        result.apply(Profile(tile="other"))
    assert part.positions == (0.0, 0.25, 0.5, 0.75, 1.0)
    np.testing.assert_allclose(part.stiffness_n_mm, [truth(at) for at in part.positions], rtol=0.01)
    assert 0.3 < part.error < 1.5
    assert result.good
    assert result.figures["footsteps"] == 60


def test_the_tile_can_measure_the_force_once_it_is_calibrated():
    asks = {"force": "tile", "footsteps": 3, "positions": (0.0, 1.0)}
    with pytest.raises(BadMeasurement, match="t1 gives no force: its forces are not calibrated"):
        run(PlateProcedure(TILE, Profile(tile=TILE.id)), rig(), asks)
    from underfoot.calibration.procedures.fsr import FsrProcedure
    from underfoot.calibration.rigs.simulated_hand import SimulatedHand

    hand = SimulatedHand(SimulatedTile(TILE, seed=1), seed=1, rate_hz=250.0)
    known = run(FsrProcedure(TILE), hand, {"loadings": 2, "hold_s": 2.0}).apply(Profile(tile=TILE.id))
    sensors = "load cell, 0.05 N a count, 120 at rest", "displacement, 0.001 mm a count, 0 at rest"
    found = run(PlateProcedure(TILE, known, sensors), rig(), asks).apply(known).plate
    np.testing.assert_allclose(found.stiffness_n_mm, [40.0, 160.0], rtol=0.1)
    assert found.reference == f"the forces of t1, calibrated {known.fsr.identity}; {sensors[1]}"


def test_a_plate_on_a_serial_line_is_moved_and_measured():
    emulated = EmulatedPlate()
    feet = SimulatedFootsteps(SimulatedTile(TILE, seed=1), 1, in_real_time=True)
    moved = PlateRig(feet, PlateServo(emulated.name, move_s=0.05))
    try:
        result = run(PlateProcedure(TILE), moved, {"footsteps": 6, "positions": (0.2, 0.6, 0.9)})
        assert [(round(to, 4), seconds) for _, to, seconds in emulated.servo.moves] == [
            (0.2, 0.05),
            (0.6, 0.05),
            (0.9, 0.05),
        ]
    finally:
        moved.close()
        emulated.close()
    found = result.apply(Profile(tile=TILE.id)).plate.stiffness_n_mm
    np.testing.assert_allclose(found, [truth(0.2), truth(0.6), truth(0.9)], rtol=0.02)


def test_the_plate_waits_while_somebody_stands_on_it():
    feet = Feet(force_n=lambda force: force + 700.0)
    waiting = plate_of_feet(feet)
    procedure = PlateProcedure(TILE)
    procedure.answer({})
    for _ in range(30):
        step(procedure, waiting)
    assert procedure.page.press.position is None
    assert procedure.progress.hint == "Step off: the plate waits for it."
    feet.changes.clear()
    to_the_footsteps(procedure, waiting)


class ServoOnACable(SimulatedServo):
    """A servo whose cable may be off: what is written to it then is lost."""

    is_plugged = True

    def write(self, data):
        if self.is_plugged:
            super().write(data)


def test_a_servo_that_does_not_arrive_is_said_and_sent_again(monkeypatch):
    feet = SimulatedFootsteps(SimulatedTile(TILE, seed=1), 1)
    monkeypatch.setattr("underfoot.devices.plate.SimulatedServo", ServoOnACable)
    monkeypatch.setattr(ServoOnACable, "is_plugged", False)
    servo = PlateServo("simulated", clock=feet.now)
    lost, procedure = PlateRig(feet, servo), PlateProcedure(TILE)
    procedure.answer({})
    with pytest.raises(BadMeasurement, match="does not arrive; is it plugged in, and free to move"):
        to_the_footsteps(procedure, lost)
    monkeypatch.setattr(ServoOnACable, "is_plugged", True)
    to_the_footsteps(procedure, lost)


def test_a_footstep_that_says_nothing_is_refused_and_those_before_stay():
    feet = Feet()
    stepped, procedure = plate_of_feet(feet), PlateProcedure(TILE)
    procedure.answer({})
    while procedure.page.key != "position1-footstep3":
        step(procedure, stepped)
    for changes, words in (
        ({"displacement_mm": np.zeros_like}, r"samples over 0\.00 mm"),
        ({"force_n": lambda force: 0.1 * force}, r"the footstep reached \d+ N; allowed: 150 N or more"),
        ({"displacement_mm": np.negative}, "less force the deeper it goes"),
    ):
        feet.changes.clear()
        feet.changes.update(changes)
        with pytest.raises(BadMeasurement, match=words):
            run(procedure, stepped)
        assert procedure.page.key == "position1-footstep3"
        (name, header, rows) = procedure.without_conclusion("the plate broke").raw[0]
        assert (name, header.split(",")[1], np.unique(rows[:, 1]).tolist()) == ("footsteps", "footstep", [1.0, 2.0])
    feet.changes.clear()
    assert run(procedure, stepped).figures["footsteps"] == 60


def test_sensors_that_are_silent_are_named():
    for name, words in (("force_n", "No force arrives"), ("displacement_mm", "No displacement arrives")):
        feet = Feet()
        silent, procedure = plate_of_feet(feet), PlateProcedure(TILE)
        procedure.answer({})
        to_the_footsteps(procedure, silent)
        feet.changes[name] = None
        step(procedure, silent)
        assert procedure.progress.hint.startswith(words)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_plate_whose_servo_only_says_that_it_moved_is_refused_at_its_second_position(seed):
    feet = SimulatedFootsteps(SimulatedTile(TILE, seed=seed), seed)
    press = feet.press
    feet.press = lambda asked: press(asked and replace(asked, position=0.5))
    procedure = PlateProcedure(TILE)
    procedure.answer({"positions": (0.0, 1.0)})
    words = r"stiffness (falls|hardly rises,) from .* N/mm between positions 0 and 1; .*(again|first footstep there)"
    with pytest.raises(BadMeasurement, match=words):
        run(procedure, plate_of_feet(feet))


def test_too_few_positions_or_footsteps_are_refused():
    procedure = PlateProcedure(TILE)
    for answers, error, words in (
        ({"footsteps": 2}, BadValue, "footsteps is 2; allowed"),
        ({"positions": (0.5,)}, BadValue, "allowed: a list of 2 to 20 numbers"),
        ({"positions": (0.5, 0.2)}, BadMeasurement, r"positions out of order: 0\.5 0\.2"),
    ):
        with pytest.raises(error, match=words):
            procedure.answer(answers)
        assert procedure.page.key == "setup"


def test_back_discards_one_footstep():
    procedure, stepped = PlateProcedure(TILE), rig()
    procedure.answer({})
    while procedure.page.key != "position1-footstep3":
        step(procedure, stepped)
    procedure.back()
    assert procedure.page.key == "position1-footstep2"
    assert len(procedure.step_data()) == 2


def test_after_back_to_another_position_the_servo_moves_there_before_a_footstep():
    procedure, stepped, few = PlateProcedure(TILE), rig(), {"footsteps": 3, "positions": (0.0, 1.0)}
    procedure.answer(few)
    while procedure.page.key != "position2-footstep1":
        step(procedure, stepped)
    while procedure.page.key != "position1-footstep3":
        procedure.back()
    step(procedure, stepped)
    assert procedure.page.press.position == 0.0
    assert procedure.page.instruction.startswith("Step off the plate")
    found = run(procedure, stepped, few)
    np.testing.assert_allclose(found.apply(Profile(tile=TILE.id)).plate.stiffness_n_mm, [40.0, 160.0], rtol=0.02)


def test_the_command_measures_on_the_simulator_and_reads_its_own_table(underfoot, tmp_path):
    profile = tmp_path / "t1.json"
    shared = ("--profile", profile, "--report", tmp_path / "r", "--json")
    said = underfoot("calibrate", "plate", "--target", "simulator", "--each", "3", *shared)
    assert said.status == 0, said.error
    figures = json.loads(said.out)
    kept = PlateCalibration.load(tmp_path / "t1.plate.json")
    assert kept.position(80.0) == pytest.approx(0.5, abs=0.03)
    assert kept.stiffness_n_mm == Profile.load(profile).plate.stiffness_n_mm
    table = tmp_path / "r" / "plate-footsteps.csv"
    assert len(read_plate_profiles(table)) == 15
    again = underfoot("calibrate", "plate", "--footsteps", table, "--json")
    assert json.loads(again.out)["stiffness_at_0.500_n_per_mm"] == pytest.approx(figures["stiffness_at_0.500_n_per_mm"])
    assert underfoot("plate", "--footsteps", table).status == 0


def test_what_the_command_cannot_use_is_one_line(underfoot):
    for options, words in (
        (("--target", "simulator", "--displacement", "9.2:1:0"), "are for hardware"),
        (("--target", "udp:5005"), "--displacement is missing"),
        (("--target", "simulator", "--plate", "/nowhere"), "at /nowhere cannot be opened: there is no such port"),
        ((), "give either --footsteps or --target"),
        (("--target", "simulator", "--each", "1"), "footsteps is 1; allowed"),
    ):
        said = underfoot("calibrate", "plate", *options)
        assert said.status != 0
        assert words in said.error
        assert "Traceback" not in said.error


@pytest.mark.parametrize("between", [";", "\t"])
def test_a_table_of_footsteps_may_have_decimal_commas(tmp_path, between):
    path = tmp_path / "footsteps.csv"
    lines = [["position", "footstep", "force_n", "displacement_mm"], ["0,5", "1", "600,5", "0,25"]]
    path.write_text("".join(between.join(cells) + "\n" for cells in lines))
    ((key, (force_n, displacement_mm)),) = read_plate_profiles(path).items()
    assert (key, force_n.tolist(), displacement_mm.tolist()) == ((0.5, "1"), [600.5], [0.25])
