"""`underfoot calibrate fsr|centroid`: files in, profile, report and figures out."""

import io
import json
import re
import signal
import sys
from pathlib import Path

import made_sensors
import numpy as np
import pytest

from underfoot.calibration.files.measurements import PAIR_HEADER, read_pairs, table
from underfoot.calibration.files.report import write_report
from underfoot.calibration.procedures.fsr import FsrProcedure
from underfoot.calibration.result import Result
from underfoot.calibration.rigs.simulated_hand import SimulatedHand
from underfoot.commands.rigs import PressingRig, ShakingRig
from underfoot.engine.shaker_rigs import SimulatedShaker
from underfoot.errors import BadFile, BadMeasurement, BadValue, DeviceError
from underfoot.floor.layout import default_floor
from underfoot.floor.profile import Profile
from underfoot.floor.simulated_tile import SimulatedTile

TILE = default_floor(1, 1).tiles[0]


@pytest.fixture
def measured(folder):
    """Tables of one tile: pairs of sensors with a straight curve, and presses read through them."""
    default_floor(1, 1).save("floor.json")
    rows = made_sensors.pairs_rows("straight, with an offset", gains=(1.0,) * 4)
    rows[:, 1] += 1.0
    Path("pairs.csv").write_bytes(table(PAIR_HEADER, rows, "t1"))
    at, load, forces = made_sensors.Robot(np.array(TILE.sensors_m), moved_m=0.008, loads=(60.0, 120.0, 180.0)).presses()
    rows = np.column_stack([at, load, 32768.0 + 60.0 * forces])
    Path("presses.csv").write_bytes(table("tile,x_m,y_m,force_n,r1,r2,r3,r4", rows, "t1"))
    return folder


def test_both_parts_go_into_one_profile_with_their_reports(underfoot, measured):
    said = underfoot("calibrate", "fsr", "--pairs", "pairs.csv", "--profile", "t1.json", "--report", "out", "--json")
    assert (said.status, said.error) == (0, "")
    figures = json.loads(said.out)
    assert figures["good"]
    assert figures["error_percent"] < 0.2
    files = ("--presses", "presses.csv", "--floor", "floor.json", "--profile", "t1.json", "--report", "out")
    said = underfoot("calibrate", "centroid", *files, "--json", "--serial", "A7", "--operator", "R. Ramp")
    assert (said.status, said.error) == (0, "")
    figures = json.loads(said.out)
    assert figures["mean_after_mm"] < 1.0 < figures["mean_before_mm"]
    profile = Profile.load("t1.json")
    assert (profile.tile, profile.serial) == ("t1", "A7")
    assert profile.centroid.reference == f"presses at known places; forces calibrated {profile.fsr.identity}"
    assert profile.force(np.full(4, 32768.0 + 60.0 * 100.0)) == pytest.approx(np.full(4, 100.0), rel=0.01)
    made = {path.name for path in (measured / "out").iterdir()}
    assert {"fsr.html", "fsr-pairs.csv", "fsr.json", "centroid.html", "centroid-presses.csv", "centroid.json"} <= made
    page = (measured / "out" / "centroid.html").read_text()
    assert page.count("<svg") >= 4
    assert profile.centroid.verdict.split(" mm")[0] in page
    assert {("tile", "t1"), ("serial number", "A7"), ("operator", "R. Ramp")} <= set(
        re.findall("<th>([^<]+)</th><td>([^<]+)</td>", page)
    )
    assert json.loads((measured / "out" / "centroid.json").read_text())["tile"] == "t1"
    assert "<title>Places of t1</title>" in page
    errors = re.findall(
        r"<td>Error(?: of sensor \d)?</td><td>[^<]+</td><th>([^<]*)", (measured / "out" / "fsr.html").read_text()
    )
    assert errors == ["% of full scale"] * 5
    again = underfoot("calibrate", "fsr", "--pairs", "out/fsr-pairs.csv", "--profile", "t1.json", "--report", "out")
    assert again.status == 0
    assert "Forces are accurate to" in again.out
    assert [earlier.kind for earlier in Profile.load("t1.json").earlier] == ["fsr"]
    compared = (measured / "out" / "fsr.html").read_text().partition("Compared with the ones before")[2]
    assert re.search("<td>Error of sensor 1</td><td>[0-9.]+ % of full scale</td><td>[0-9.]+ % of", compared)


def test_a_report_that_cannot_be_written_costs_neither_the_profile_nor_the_figures(underfoot, measured):
    (measured / "out" / "fsr.html").mkdir(parents=True)
    found = underfoot("calibrate", "fsr", "--pairs", "pairs.csv", "--profile", "t1.json", "--report", "out")
    assert found.status == 1
    assert found.error.startswith("underfoot: out/fsr.html cannot be written: ")
    assert found.out.startswith("Forces are accurate to")
    assert Profile.load("t1.json").is_calibrated


def test_a_profile_that_cannot_be_written_costs_neither_the_report_nor_the_figures(underfoot, measured, monkeypatch):
    def full(self, path):
        raise BadFile(f"{path} cannot be written: no space left on device")

    monkeypatch.setattr(Profile, "save", full)
    found = underfoot("calibrate", "fsr", "--pairs", "pairs.csv", "--profile", "t1.json", "--report", "out")
    assert (found.status, found.error) == (1, "underfoot: t1.json cannot be written: no space left on device\n")
    assert found.out.startswith("Forces are accurate to")
    assert (measured / "out" / "fsr.html").exists()


class _Interrupted:
    """Rows of a table during whose writing somebody presses Ctrl-C."""

    def __getitem__(self, _):
        raise KeyboardInterrupt


def test_an_interrupted_report_leaves_no_folder(folder):
    result = Result("fsr", "Forces", (), "good", True, raw=(("pairs", PAIR_HEADER, _Interrupted()),))
    with pytest.raises(KeyboardInterrupt):
        write_report(result, folder / "out", Profile(tile="t1"))
    assert not (folder / "out").exists()


def test_the_simulator_is_calibrated_with_no_hands(underfoot, measured):
    """Without a profile its sensors are linearised first; on hardware that is for the person to do."""
    arguments = ("calibrate", "centroid", "--floor", "floor.json", "--report")
    said = underfoot(*arguments, "report", "--target", "simulator", "--quick", "--profile", "both.json")
    assert said.status == 0
    assert "with hysteresis and creep compensated" in said.out.lower()
    assert "<td>t1, simulated</td>" in (measured / "report/centroid.html").read_text()
    kept = ("--presses", "report/centroid-presses.csv", "--profile", "both.json", "--reference-mm", "2")
    assert underfoot(*arguments, "again", *kept).status == 0
    assert json.loads((measured / "again/centroid.json").read_text()) == json.loads(
        (measured / "report/centroid.json").read_text()
    )
    profile = Profile.load("both.json")
    assert profile.is_calibrated
    assert profile.fsr.simulated is True
    assert (
        profile.centroid.reference == "presses at known places, uncertain by 2 mm (95 %)"
    )  # their newtons came with the file
    refused = underfoot("calibrate", "centroid", "--target", "udp:127.0.0.1:9999", "--profile", "none.json")
    assert (refused.status, refused.out) == (1, "")
    assert refused.error == "underfoot: places needs forces first: calibrate forces, and give its --profile\n"


@pytest.mark.parametrize("gone_at", [1, 200])
def test_a_line_that_is_gone_ends_a_calibration_by_hand_only_while_nothing_was_measured(
    underfoot, folder, monkeypatch, gone_at
):
    class Gone(SimulatedHand):
        reads = 0

        def read(self):
            self.reads += 1
            if self.reads == gone_at:
                raise DeviceError("nothing comes of tile 0: is it plugged in?")
            return super().read()

    monkeypatch.setattr(PressingRig, "open", lambda *_: Gone(SimulatedTile(TILE), rate_hz=40.0))
    options = ("--target", "serial:none", "--cell", "9.1:0.05:120", "--profile", "t1.json")
    found = underfoot("calibrate", "forces", *options)
    assert "underfoot: nothing comes of tile 0: is it plugged in?" in found.error
    assert (found.status or 0, "Forces are accurate to" in found.out) == ((1, False) if gone_at == 1 else (0, True))
    if gone_at > 1:
        assert Profile.load("t1.json").fsr.reference.startswith(
            "load cell, 0.05 N a count, 120 at rest, uncertain by 1 %"
        )


def test_what_was_measured_by_hand_is_in_the_report_also_without_a_result(underfoot, folder, monkeypatch):
    conclude, reasons = FsrProcedure.conclude, ["no sensor can be calibrated"]

    def refuse_once(procedure):
        if reasons:
            raise BadMeasurement(reasons.pop())
        return conclude(procedure)

    monkeypatch.setattr(FsrProcedure, "conclude", refuse_once)
    monkeypatch.setattr(PressingRig, "open", lambda *_: SimulatedHand(SimulatedTile(TILE), rate_hz=40.0))
    arguments = ("--cell", "9.1:0.05:120", "--report", "report", "--profile", "t1.json", "--conditions", "18 °C")
    found = underfoot("calibrate", "forces", "--target", "serial:none", *arguments)
    assert found.status == 1
    assert "underfoot: what was measured is in report\nunderfoot: no sensor can be calibrated\n" in found.error
    assert "no sensor can be calibrated" in (folder / "report" / "fsr.html").read_text()
    assert not (folder / "t1.json").exists()
    assert underfoot("calibrate", "forces", "--pairs", "report/fsr-pairs.csv", "--profile", "t1.json").status == 0
    reasons.append("no sensor can be calibrated")
    assert underfoot("calibrate", "forces", "--target", "simulator", "--report", "other").status == 1
    pages = [(folder / name / "fsr.html").read_text() for name in ("report", "other")]
    assert ["<td>t1, simulated</td>" in page for page in pages] == [False, True]
    assert ["<th>conditions</th><td>18 °C</td>" in page for page in pages] == [True, False]


def test_what_was_measured_by_hand_is_kept_in_a_new_folder_where_no_report_is_named(underfoot, folder, monkeypatch):
    ends = [KeyboardInterrupt(), BadValue("no sensor can be calibrated")]

    def refuse(procedure):
        raise ends.pop()

    monkeypatch.setattr(FsrProcedure, "conclude", refuse)
    monkeypatch.setattr(PressingRig, "open", lambda *_: SimulatedHand(SimulatedTile(TILE), rate_hz=40.0))
    for name, status in (("t1-fsr", 1), ("t1-fsr-2", 130)):
        found = underfoot("calibrate", "forces", "--target", "serial:none", "--cell", "9.1:0.05:120")
        assert found.status == status
        assert f"underfoot: what was measured is in {name}\n" in found.error
    assert set(read_pairs("t1-fsr-2/fsr-pairs.csv").sensor) == {0, 1, 2, 3}


def test_a_dead_sensor_is_left_out_in_a_terminal_as_in_the_window(underfoot, folder, monkeypatch):
    """Its page was asked for again and again, and the other three got no curve."""

    class DeadThird(SimulatedHand):
        asked = (0, 0, 0, 0)

        def press(self, press):
            super().press(press)
            self.asked = tuple(n + (press.sensor == j) for j, n in enumerate(self.asked))
            if self.asked[2] > 100 or self.asked[3] > 20:
                raise KeyboardInterrupt

        def read(self):
            readings = super().read()
            readings.values[:, 2] = 700.0
            return readings

    monkeypatch.setattr(PressingRig, "open", lambda *_: DeadThird(SimulatedTile(TILE), rate_hz=100.0))
    options = ("--target", "serial:none", "--cell", "9.1:0.05:120")
    found = underfoot("calibrate", "forces", *options)
    assert found.status == 130
    assert "does sensor 3 give no signal? Then look at its plug" in found.error
    assert "; again, or end it, and name the sensor in --without\n" in found.error
    underfoot("calibrate", "forces", *options, "--without", 3)
    assert set(read_pairs("t1-fsr-2/fsr-pairs.csv").sensor) == {0, 1, 3}
    refused = underfoot("calibrate", "forces", *options, "--without", 5)
    assert refused.error == "underfoot: --without is 5; allowed: a sensor, 1 to 4\n"


@pytest.mark.skipif(sys.platform == "win32", reason="this system has no terminals that are closed")
@pytest.mark.parametrize(("name", "status"), [("SIGTERM", 143), ("SIGHUP", 129)])
def test_what_was_measured_by_hand_is_kept_when_the_terminal_or_the_computer_is_closed(
    underfoot, folder, monkeypatch, name, status, with_hangup
):
    monkeypatch.setattr(FsrProcedure, "conclude", lambda procedure: signal.raise_signal(getattr(signal, name)))
    monkeypatch.setattr(PressingRig, "open", lambda *_: SimulatedHand(SimulatedTile(TILE), rate_hz=40.0))
    found = underfoot("calibrate", "forces", "--target", "serial:none", "--cell", "9.1:0.05:120")
    assert found.status == status
    assert (folder / "t1-fsr" / "fsr-pairs.csv").exists()


@pytest.mark.parametrize("is_terminal", [True, False])
def test_a_sound_that_failed_is_taken_again_where_somebody_can_press_a_key(underfoot, folder, monkeypatch, is_terminal):
    class Loses(SimulatedShaker):
        plays = 0

        def play(self, sound):
            self.plays += 1
            if self.plays == 3:
                raise BadMeasurement("the sound card lost samples while it played; take it again")
            return super().play(sound)

    monkeypatch.setattr(ShakingRig, "open", lambda *_: Loses(SimulatedTile(TILE)))
    monkeypatch.setattr(sys, "stdin", Terminal() if is_terminal else io.StringIO())
    monkeypatch.setattr("click.getchar", lambda: " ")
    found = underfoot("calibrate", "vibration", "--target", "sound", "--no-loads")
    assert "the sound card lost samples while it played" in found.error
    assert (found.status or 0, "A full-scale signal gives" in found.out) == ((0, True) if is_terminal else (1, False))


def test_ctrl_c_where_a_key_is_awaited_plays_nothing_more_and_keeps_the_sweeps(underfoot, folder, monkeypatch):
    """Who was to stand on the tile was shaken instead."""
    plays = []

    class Counted(SimulatedShaker):
        def play(self, sound):
            plays.append(sound.load)
            return super().play(sound)

    def interrupted():
        raise KeyboardInterrupt  # as `click.getchar` does at Ctrl-C

    monkeypatch.setattr(ShakingRig, "open", lambda *_: Counted(SimulatedTile(TILE)))
    monkeypatch.setattr(sys, "stdin", Terminal())
    keys = iter([lambda: " ", interrupted])
    monkeypatch.setattr("click.getchar", lambda: next(keys)())
    found = underfoot("calibrate", "vibration", "--target", "sound")
    assert (found.status, plays) == (130, ["none", "none"])
    assert "underfoot: what was measured is in t1-response\n" in found.error
    assert (folder / "t1-response" / "response-none.csv").exists()


class Terminal(io.StringIO):
    """A terminal."""

    def isatty(self):
        return True


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("fsr",), "give either --pairs or --target"),
        (("fsr", "--pairs", "pairs.csv", "--target", "simulator"), "give either --pairs or --target"),
        (("fsr", "--pairs", "nope.csv"), "nope.csv cannot be read: no such file"),
        (("fsr", "--pairs", "presses.csv"), "presses.csv: line 1 has no column time_s"),
        (("fsr", "--pairs", "pairs.csv", "--tile", "t2"), "pairs.csv has no tile t2; allowed: t1"),
        (("fsr", "--pairs", "pairs.csv", "--profile", "no/where.json"), "no/where.json cannot be written"),
        (("fsr", "--pairs", "pairs.csv", "--report", "pairs.csv"), "pairs.csv is not a folder"),
        (("fsr", "--pairs", "pairs.csv", "--divider-ohm", "0"), "--divider-ohm is 0; allowed: above 0"),
        (("fsr", "--target", "udp:127.0.0.1:9999"), "--cell is missing; allowed: a load cell, as 9.1:0.05:120"),
        (("fsr", "--target", "moon"), "--target is 'moon'; allowed: simulator"),
        (("fsr", "--target", "simulator:none.json"), "none.json cannot be read: no such file"),
        (("response", "--target", "simulator:pairs.csv"), "pairs.csv is not JSON"),
        (("fsr", "--target", "simulator", "--seed", "-1"), "--seed is -1; allowed: 0 or more"),
        (("centroid", "--presses", "presses.csv"), "--presses needs --floor"),
        (("centroid", "--presses", "presses.csv", "--floor", "pairs.csv"), "pairs.csv is not JSON"),
    ],
)
def test_bad_input_is_one_line_and_status_1(underfoot, measured, arguments, said):
    found = underfoot("calibrate", *arguments)
    assert (found.status, found.out) == (1, "")
    assert found.error.count("\n") == 1
    assert said in found.error


def test_commands_are_named_as_in_the_window_and_older_names_are_taken(underfoot):
    listed = underfoot("calibrate", "--help").out.partition("Commands:")[2]
    assert [line.split()[0] for line in listed.splitlines() if re.match(r"  \w", line)] == [
        "forces", "places", "vibration", "latency", "stiffness",
    ]  # fmt: skip
    for name, older in (("forces", "fsr"), ("places", "centroid"), ("vibration", "response"), ("stiffness", "plate")):
        helps = [underfoot("calibrate", word, "--help").out.partition("[OPTIONS]")[2] for word in (name, older)]
        assert helps[0] == helps[1] != ""


def test_a_profile_of_another_tile_stays_as_it_was(underfoot, measured):
    Profile(tile="t9").save("other.json")
    before = (measured / "other.json").read_bytes()
    found = underfoot("calibrate", "fsr", "--pairs", "pairs.csv", "--profile", "other.json")
    assert found.error == "underfoot: other.json is the profile of tile t9; allowed: t1\n"
    (measured / "broken.json").write_text("{")
    assert underfoot("calibrate", "fsr", "--pairs", "pairs.csv", "--profile", "broken.json").status == 1
    assert (measured / "other.json").read_bytes() == before
    assert (measured / "broken.json").read_text() == "{"


def test_dead_sensors_are_refused_with_the_file(underfoot, measured):
    rows = np.loadtxt("pairs.csv", delimiter=",", skiprows=1, usecols=(0, 2, 3, 4))
    rows[:, 2] = 700.0
    Path("dead.csv").write_bytes(table(PAIR_HEADER, rows, "t1"))
    found = underfoot("calibrate", "fsr", "--pairs", "dead.csv", "--profile", "t1.json")
    assert found.status == 1
    assert found.error.startswith(
        "underfoot: dead.csv: no sensor can be calibrated: sensor 1 is not calibrated: it is dead"
    )
    assert not (measured / "t1.json").exists()


def test_the_help_says_what_each_calibration_does_in_whole_sentences(underfoot):
    said = " ".join(underfoot("calibrate", "--help").out.split())
    assert "Measure how accurate the contact centroid is, and fit its correction." in said
    assert "..." not in said.partition("Commands:")[2]
