"""The variable stiffness plate over a real pseudo-terminal: every move as long as any other, none under a load."""

import hashlib
import json

import pytest
import serial

from underfoot.devices.emulation.plate import EmulatedPlate, SimulatedServo
from underfoot.devices.plate import Plate, PlateCalibration, calibration_of, plate_of
from underfoot.errors import BadFile, BadValue, DeviceError

CALIBRATION = PlateCalibration(positions=(0.0, 0.5, 1.0), stiffness_n_mm=(40.0, 90.0, 160.0))


@pytest.fixture
def emulated():
    made = EmulatedPlate()
    yield made
    made.close()


@pytest.fixture
def plate(emulated):
    made = Plate(emulated.name, CALIBRATION, move_s=0.15)
    yield made
    made.close()


@pytest.mark.parametrize("line", ["MOVE 1.5 1", "MOVE nan 1", "MOVE 0.5 nan", "MOVE 0.5 inf", "MOVE 0.5 -1", "GO"])
def test_an_order_that_is_none_is_refused_and_moves_nothing(line):
    servo = SimulatedServo()
    servo.write(f"{line}\n".encode())
    assert servo.read(servo.in_waiting).startswith(b"ERR ")
    assert (servo.is_moving, servo.moves, servo.position) == (False, [], 0.0)


def test_a_port_belongs_to_one(plate, emulated):
    with pytest.raises(DeviceError, match="another program has it"):
        Plate(emulated.name, CALIBRATION)


def test_it_goes_where_it_is_wanted_in_the_same_time_for_every_distance(plate, emulated, until):
    for stiffness in (90.0, 90.0, 160.0):
        plate.request_stiffness(stiffness)
        assert not plate.poll(is_loaded=False)
        until(lambda: plate.poll(is_loaded=False), "it is there")
    assert [(round(to, 4), seconds) for _, to, seconds in emulated.servo.moves] == [
        (0.5, 0.15),
        (0.5, 0.15),
        (1.0, 0.15),
    ]
    assert emulated.servo.position == 1.0


def test_it_waits_for_a_foot_to_leave_and_stops_where_it_is_when_one_comes(plate, emulated, until):
    plate.request_stiffness(160.0)
    for _ in range(5):
        assert not plate.poll(is_loaded=True)
    assert emulated.servo.moves == []
    plate.poll(is_loaded=False)
    until(lambda: emulated.servo.position > 0.05, "it moves")
    assert len(emulated.servo.moves) == 1
    plate.poll(is_loaded=True)
    until(lambda: not emulated.servo.is_moving, "it stops")
    held = emulated.servo.position
    assert 0.0 < held < 1.0
    until(lambda: plate.poll(is_loaded=False), "it is there")
    assert emulated.servo.position == 1.0
    assert len(emulated.servo.moves) == 2


def test_a_plate_that_never_arrives_is_lost(emulated):
    now = [0.0]
    plate = Plate(emulated.name, CALIBRATION, move_s=30.0, clock=lambda: now[0])
    plate.request_stiffness(90.0)
    plate.poll(is_loaded=False)
    now[0] = 40.0
    with pytest.raises(DeviceError, match="does not arrive"):
        plate.poll(is_loaded=False)
    plate.close()


def test_what_the_plate_refuses_is_said(emulated, until):
    plate = Plate(emulated.name, PlateCalibration(positions=(0.0, 1.0), stiffness_n_mm=(40.0, 160.0)))
    with serial.Serial(emulated.name) as line:
        line.write(b"DANCE\n")

    def refused():
        try:
            plate.poll(is_loaded=False)
        except DeviceError as error:
            return str(error)
        return ""

    assert "says: DANCE" in until(refused, "it says so")
    plate.close()


def test_a_simulated_plate_needs_neither_port_nor_file_and_never_moves_under_a_load(until):
    plate = Plate("simulated", calibration_of("simulated"), move_s=0.2)
    plate.request_stiffness(80.0)
    assert not any(plate.poll(is_loaded=True) for _ in range(5))
    assert not plate.poll(is_loaded=False)
    until(lambda: plate.poll(is_loaded=False), "it arrives")
    plate.request_stiffness(40.0)
    assert not plate.poll(is_loaded=False)
    assert not plate.poll(is_loaded=True)  # held
    until(lambda: plate.poll(is_loaded=False), "it arrives after all")
    plate.close()
    plate_of("simulated").close()


def test_calibrations_are_checked_and_go_through_a_file(tmp_path):
    CALIBRATION.save(tmp_path / "plate.json")
    assert PlateCalibration.load(tmp_path / "plate.json") == CALIBRATION
    written = json.loads((tmp_path / "plate.json").read_bytes())
    assert (written.pop("format"), written.pop("version")) == ("underfoot-plate", 1)
    as_told = json.dumps(written, separators=(",", ":")).encode()
    assert CALIBRATION.identity == f"{CALIBRATION.made} {hashlib.sha256(as_told).hexdigest()[:12]}"
    with pytest.raises(BadValue, match="stiffness is 200"):
        CALIBRATION.position(200.0)
    with pytest.raises(BadValue, match="rising"):
        PlateCalibration(positions=(0.5, 0.5), stiffness_n_mm=(40.0, 50.0))
    (tmp_path / "bad.json").write_text('{"format": "underfoot-plate", "version": 1, "positions": [0, 1]}')
    with pytest.raises(BadFile):
        PlateCalibration.load(tmp_path / "bad.json")
    with pytest.raises(BadValue, match="allowed: PORT:FILE"):
        plate_of("COM3")
    with pytest.raises(DeviceError, match="cannot be opened"):
        plate_of(f"{tmp_path / 'none'}:{tmp_path / 'plate.json'}")
