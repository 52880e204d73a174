"""What the Calibrate workspace does with results: profiles, reports, and the tile shown on the floor."""

import math
import re
import threading
from datetime import date

import msgspec
import pytest
from calibrate_driver import LEFT, CalibrateDriver
from calibrate_samples import MIDDLE, UNCERTAIN, Weighing
from PySide6.QtCore import QCoreApplication, QEvent, Qt
from PySide6.QtGui import QGuiApplication
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QFileDialog, QLineEdit, QMessageBox
from windows import LONG_MS, choose_file, dialog_of

from underfoot.calibration.files.plate_profiles import plate_file
from underfoot.calibration.result import Inconclusive, Result
from underfoot.engine.target import Target
from underfoot.errors import BadMeasurement, DeviceError
from underfoot.floor.layout import default_floor
from underfoot.floor.plate_search import PlateSearch
from underfoot.floor.profile import Latency, PlateStiffness, Profile, Response
from underfoot.widgets.calibrate.profiles import Profiles

# --- profiles ---


def test_an_earlier_part_is_compared_and_restored(driver):
    first, second = (
        Response(made=f"2026-01-0{day}", error=float(day), error_unit="dB", figures={"level_db": 10.0 * day},
                 frequencies_hz=(50.0, 100.0), magnitude=(1.0, day))
        for day in (1, 2)
    )  # fmt: skip
    Profile(tile="t1").with_part(first).with_part(second).save(driver.file())
    driver.workspace.profiles.follow(default_floor())
    choice, overview = driver.workspace.choice, driver.workspace.overview
    driver.wait(lambda: choice.history.count() == 1)
    assert choice.history.item(0).text() == "2026-01-01 · errs by 1 dB"
    assert not choice.restore.isEnabled()
    place = choice.history.visualItemRect(choice.history.item(0)).center()
    driver.qtbot.mouseClick(choice.history.viewport(), LEFT, pos=place)
    assert [overview.table.item(1, column).text() for column in range(3)] == ["Level", "20 dB", "10 dB"]
    driver.wait(lambda: overview.drawings.plots and len(overview.drawings.plots[0].drawing.series) == 2)
    slow_disk = threading.Event()
    driver.workspace.profiles.do(lambda: str(slow_disk.wait(LONG_MS / 1e3)))
    driver.click(choice.restore)
    driver.qtbot.mouseClick(choice.restore, LEFT)
    driver.click(choice.cards["fsr"])
    slow_disk.set()
    driver.wait(lambda: driver.written)
    assert [kind for _, kind, _ in driver.written] == ["response"]  # whatever is shown by now
    driver.workspace.profiles.close()
    assert Profile.load(driver.file()).response.made == "2026-01-01"
    assert Profile.load(driver.file()).earlier[0].response.made == "2026-01-02"


def test_an_earlier_part_is_that_of_the_list_also_where_another_window_changed_the_profile(driver):
    """The part was told by its index alone, and another one, of another kind even, came into use."""
    lags = [Latency(made=f"2026-01-0{day}", round_trip_ms=10.0 * day) for day in (1, 2)]
    rings = [Response(made=f"2026-01-0{day}", frequencies_hz=(50.0,), magnitude=(1.0,)) for day in (3, 4)]
    profile = Profile(tile="t1")
    for part in (*lags, *rings):
        profile = profile.with_part(part)
    profile.save(driver.file())
    profiles = driver.workspace.profiles
    profiles.follow(default_floor())
    driver.wait(lambda: len(profiles.of("t1").earlier) == 2)
    choice = driver.workspace.choice
    assert choice.cards["response"].toolTip().endswith(rings[1].identity)
    assert choice.history.item(0).toolTip() == rings[0].identity
    profile.restored(0).save(driver.file())  # by another window
    profiles.restore("t1", 1)
    driver.wait(lambda: driver.written)
    now = Profile.load(driver.file())
    assert (now.response, now.latency) == (rings[0], lags[0])
    driver.file().unlink()
    profiles.restore("t1", 0)
    driver.wait(lambda: any("was changed elsewhere and lacks it; look at the list" in line for line in driver.said))
    driver.wait(lambda: not profiles.of("t1").earlier)


def test_a_serial_number_is_typed_before_and_after_a_calibration(driver, qtbot):
    choice, warned = driver.workspace.choice, []
    driver.workspace.warnings_changed.connect(warned.append)
    driver.click(choice.serial)
    qtbot.keyClicks(choice.serial, "A7\r")
    driver.wait(lambda: driver.written)
    assert Profile.load(driver.file()) == Profile(tile="t1", serial="A7")
    assert not any(warned)
    assert not choice.flags.isVisible()
    profile = Profile.load(driver.file()).with_part(Latency(made=str(date.today()), round_trip_ms=10.0))
    profile.save(driver.file())  # by another window
    driver.click(choice.serial)
    qtbot.keyClicks(choice.serial, "A8")
    qtbot.keyClick(choice.serial, Qt.Key.Key_Escape)
    assert choice.serial.text() == "A7"
    qtbot.keyClicks(choice.serial, "A9")
    qtbot.keyClick(choice.serial, Qt.Key.Key_Tab)
    driver.wait(lambda: len(driver.written) == 2)
    assert Profile.load(driver.file()) == msgspec.structs.replace(profile, serial="A9")
    choice.map.setFocus()
    qtbot.keyClick(choice.map, Qt.Key.Key_Right)
    assert (driver.workspace.tile.id, choice.serial.text()) == ("t2", "")


def test_what_is_noted_of_instruments_and_temperature_goes_with_results_and_is_kept(driver, qtbot):
    driver.click(driver.workspace.choice.conditions)
    qtbot.keyClicks(driver.workspace.choice.conditions, "cell no. 88, 21 degrees\r")
    driver.begin()
    driver.go("result")
    driver.click(driver.wizard.saving)
    driver.wait(lambda: driver.written)
    assert Profile.load(driver.file()).response.conditions == "cell no. 88, 21 degrees"
    assert driver.settings.conditions == "cell no. 88, 21 degrees"


def test_conditions_that_are_still_so_are_noted_anew_by_return(driver, qtbot):
    """An instrument stays for months: the day of its first note could be taken away by typing something else only."""
    driver.settings.conditions_on = "2024-05-01"
    driver.click(driver.workspace.choice.conditions)
    qtbot.keyClick(driver.workspace.choice.conditions, Qt.Key.Key_Return)
    assert driver.settings.conditions_on == date.today().isoformat()


def test_a_measurement_without_a_result_says_its_conditions_and_the_tile_s_serial_number(driver, tmp_path):
    driver.click(driver.workspace.choice.serial)
    driver.qtbot.keyClicks(driver.workspace.choice.serial, "A9\r")
    driver.wait(lambda: driver.written)
    driver.settings.conditions, driver.settings.conditions_on = "21 degrees", "2024-05-01"
    driver.workspace.write_report(Result("response", "Vibration of t1", (), "the plug came out", good=False), tmp_path)
    driver.wait(lambda: any("The report is in" in line for line in driver.said))
    page = (tmp_path / "response.html").read_text()
    noted = "21 degrees (noted on 2024-05-01)"
    assert re.findall("<th>(?:serial number|conditions)</th><td>(.*?)</td>", page) == ["A9", noted]


def test_a_simulated_tile_that_has_changed_since_its_last_calibration_is_told(driver):
    before = Response(
        made="2026-01-01", simulated=True, acceleration_per_unit=2.5, figures=dict.fromkeys(UNCERTAIN, 1.0),
        frequencies_hz=(50.0, 100.0), magnitude=(1.0, 1.0),
    )  # fmt: skip
    Profile(tile="t1").with_part(before).save(driver.file())
    driver.workspace.profiles.follow(default_floor())
    driver.wait(lambda: driver.workspace.profiles.of("t1").response is not None)
    driver.begin()
    driver.go("result")
    assert "% more than on 2026-01-01" in driver.wizard.result.warnings.text()


def test_a_profile_that_is_too_old_is_flagged(driver):
    old = Response(
        made="2020-01-01", frequencies_hz=(50.0,), magnitude=(1.0,), error=2.0, error_allowed=1.0, error_unit="dB",
        good=False,
    )  # fmt: skip
    Profile(tile="t2").with_part(old).save(driver.file("t2"))
    with driver.qtbot.waitSignal(driver.workspace.warnings_changed, check_params_cb=bool) as flagged:
        driver.workspace.profiles.follow(default_floor())
    lines = flagged.args[0]
    assert len(lines) == 2
    assert "days ago" in lines[0]
    assert lines[1] == "Vibration of t2: errs by 2 dB; 1 allowed"
    driver.workspace.choice.map.choose_tile("t2")
    assert "days ago" in driver.workspace.choice.flags.text()


def test_a_profile_that_cannot_be_read_is_said(driver):
    driver.file().write_text("{")
    driver.workspace.profiles.follow(default_floor())
    driver.wait(lambda: any("t1.json" in line for line in driver.said))


@pytest.mark.parametrize("other", ["t2", "kitchen"])
def test_a_profile_of_another_tile_is_flagged_and_takes_no_part_of_this_one(driver, tmp_path, other):
    Profile(tile=other).with_part(Latency(made="2026-11-01", round_trip_ms=3.0)).save(driver.file("t1"))
    driver.workspace.profiles.follow(default_floor())
    driver.wait(lambda: f"Profile of {other} is used on t1." in driver.workspace.choice.flags.text())
    driver.begin()
    driver.go("result")
    page = tmp_path / "report" / "response.html"
    _choose_folder(driver, page.parent)
    driver.wait(lambda: any(str(page) in line for line in driver.said))
    assert "<td>t1, simulated</td>" in page.read_text()
    driver.click(driver.wizard.saving)
    driver.wait(lambda: f"is the profile of tile {other}; allowed: t1" in driver.wizard.refusal.text())
    assert Profile.load(driver.file("t1")).response is None
    driver.file("t1").rename(driver.file("kept"))
    driver.click(driver.wizard.saving)
    driver.wait(lambda: driver.written)
    assert Profile.load(driver.file("t1")).tile == "t1"


def test_hardware_is_told_of_what_was_measured_on_simulated_tiles_of_its_layout(driver):
    """They share a profile, and only the report told them apart."""
    driver.begin()
    driver.go("result")
    driver.wizard.saving.click()
    driver.wait(lambda: driver.workspace.profiles.by_tile)
    flags = driver.workspace.choice.flags
    assert "simulated" not in flags.text()
    driver.workspace.set_target(Target(default_floor(), "udp", "127.0.0.1:9000"))
    driver.wait(lambda: "Vibration of t1: measured on a simulated tile; measure this one." in flags.text())


def test_floors_keep_their_profiles_apart(driver):
    before = driver.workspace.profiles.folder
    driver.workspace.set_target(Target(default_floor(2, 3)))
    assert driver.workspace.profiles.folder != before
    assert driver.workspace.profiles.folder.parent == before.parent


def test_a_folder_of_profiles_that_cannot_be_read_is_said(qtbot, tmp_path):
    """An error in the profiles' thread; the floor was uncalibrated, in silence."""
    profiles, said, loaded = Profiles(tmp_path / ("x" * 300)), [], []
    profiles.notified.connect(said.append)
    profiles.follow(default_floor(1, 1))
    profiles.changed.connect(lambda: loaded.append(profiles.by_tile))
    qtbot.waitUntil(lambda: bool(loaded))
    profiles.close()
    assert said[0].startswith("profiles cannot be looked for: ")
    assert "t1.json" in said[1]


# --- the report ---


def _choose_folder(driver, folder):
    choose_file(driver.workspace, folder, lambda: driver.click(driver.wizard.reporting))
    QCoreApplication.sendPostedEvents(None, QEvent.Type.DeferredDelete)


def test_profiles_that_a_renamed_floor_left_behind_are_named(driver):
    floor = default_floor()
    Profile(tile="t1").save(driver.file())
    had = driver.workspace.profiles.folder
    driver.workspace.set_target(Target(msgspec.structs.replace(floor, title="Lab")))
    driver.wait(lambda: driver.said)
    (line,) = driver.said
    assert line.startswith(f"Lab has no profiles; {had} has some of the same tiles: if it was renamed, rename")
    had.rename(had.parent / line.rpartition(" ")[2])
    driver.workspace.set_target(Target(floor))
    driver.workspace.set_target(Target(msgspec.structs.replace(floor, title="Lab")))
    driver.wait(lambda: driver.workspace.profiles.by_tile)


def test_the_report_is_a_page_in_a_folder_with_pictures_and_raw_data(driver, tmp_path):
    driver.begin()
    driver.go("result")
    folder = tmp_path / "report"
    _choose_folder(driver, folder)
    driver.wait(lambda: any(str(folder / "response.html") in line for line in driver.said))
    page = (folder / "response.html").read_text()
    result = driver.wizard.snapshot.result
    assert page.count("<svg") == len(result.drawings) == 1
    assert "<td>t1, simulated</td>" in page
    assert "It rings true." in page
    assert 'href="response-bell.csv"' in page
    rows = (folder / "response-bell.csv").read_text().splitlines()
    assert rows[0].endswith("frequency_hz,level")
    assert len(rows) == 3
    assert driver.files() == []
    assert driver.wizard.saving.isEnabled()


def test_the_next_report_is_suggested_beside_the_last_one(driver, tmp_path):
    """It was suggested within the last one's folder, one deeper each time. A folder that is there is entered."""
    driver.settings.folder = str(tmp_path)
    driver.begin()
    driver.go("result")
    for suffix in ("", "-2"):
        driver.click(driver.wizard.reporting)
        dialog = dialog_of(driver.workspace, QFileDialog)
        folder = tmp_path / f"response-t1-{date.today().isoformat()}{suffix}"
        assert dialog.selectedFiles() == [str(folder)]
        dialog.accept()
        driver.wait(lambda folder=folder: any(str(folder / "response.html") in line for line in driver.said))
        QCoreApplication.sendPostedEvents(None, QEvent.Type.DeferredDelete)


def test_what_was_measured_can_be_reported_also_without_a_result(driver, tmp_path, monkeypatch):
    def refuse(procedure, recorded):
        raise BadMeasurement("it rings of nothing")

    monkeypatch.setattr(Weighing, "take_recording", refuse)
    driver.begin()
    driver.go("bell")
    assert not driver.wizard.reporting.isVisible()
    driver.click(driver.wizard.going)
    driver.wait(driver.wizard.refusal.isVisible)
    assert driver.wizard.refusal.text() == "it rings of nothing"
    assert not driver.wizard.saving.isVisible()
    folder = tmp_path / "report"
    _choose_folder(driver, folder)
    driver.wait(lambda: any(str(folder / "response.html") in line for line in driver.said))
    assert (folder / "response-loads.csv").read_text().splitlines()[1:3] == ["100", "100"]
    driver.click(driver.wizard.backing)
    driver.wait(lambda: driver.page == "note")
    assert not driver.wizard.reporting.isVisible()


def test_what_was_measured_by_hand_can_be_reported_before_it_is_left(qtbot, tmp_path):
    """Leaving lost it all, and only a page that was refused had a report."""
    driver = CalibrateDriver(qtbot, tmp_path, kind="serial")
    driver.click(driver.workspace.overview.begin)
    driver.workspace.begin_released()
    for page in ("setup", "weigh"):
        driver.wait(lambda page=page: driver.page == page)
        driver.made[0][1].hand_n = 90.0
        driver.click(driver.wizard.going)
    driver.wait(lambda: driver.page == "note")
    driver.click(driver.wizard.leaving)
    question = dialog_of(driver.workspace, QMessageBox)
    assert question.text().endswith("To keep the raw data, stay, and click Report…")
    driver.qtbot.mouseClick(question.button(QMessageBox.StandardButton.Cancel), LEFT)
    folder = tmp_path / "report"
    _choose_folder(driver, folder)
    driver.wait(lambda: any(str(folder / "response.html") in line for line in driver.said))
    assert "the calibration was not finished" in (folder / "response.html").read_text()
    assert (folder / "response-loads.csv").exists()


def test_a_last_page_by_hand_that_led_to_no_result_waits_for_a_click(qtbot, tmp_path, monkeypatch):
    """It was measured again and again, and all was computed each time."""
    concluded = []

    def refuse(procedure, readings):
        concluded.append(readings)
        raise Inconclusive(f"refused {len(concluded)}")

    monkeypatch.setattr(Weighing, "feed", refuse)
    driver = CalibrateDriver(qtbot, tmp_path, kind="serial")
    driver.click(driver.workspace.overview.begin)
    driver.workspace.begin_released()
    driver.wait(lambda: driver.page == "setup")
    driver.click(driver.wizard.going)
    driver.wait(lambda: driver.wizard.refusal.text() == "refused 1")
    scale = driver.made[0][1]
    reads = scale.reads
    driver.wait(lambda: scale.reads > reads + 3)
    assert (len(concluded), driver.wizard.going.text()) == (1, "Read")
    driver.click(driver.wizard.going)
    driver.wait(lambda: driver.wizard.refusal.text() == "refused 2")


def test_a_line_that_is_back_is_not_called_silent_while_its_page_is_read(qtbot, tmp_path, monkeypatch):
    monkeypatch.setattr(Weighing, "feed", lambda *_: None)  # the page goes on
    driver = CalibrateDriver(qtbot, tmp_path, kind="serial")
    driver.click(driver.workspace.overview.begin)
    driver.workspace.begin_released()
    driver.wait(lambda: driver.page == "setup")
    driver.go("tare")
    scale = driver.made[0][1]
    scale.failure = DeviceError("nothing comes of tile 0")
    driver.wait(lambda: driver.wizard.refusal.text() == "nothing comes of tile 0")
    scale.failure = None
    driver.wait(lambda: driver.wizard.refusal.text() == "")
    assert driver.page == "tare"


def test_a_report_that_cannot_be_written_is_one_line_and_the_result_stays(driver, tmp_path):
    driver.begin()
    driver.go("result")
    folder = tmp_path / "report"
    folder.write_text("no folder")
    _choose_folder(driver, folder)
    driver.wait(lambda: driver.said)
    assert len(driver.said) == 1
    assert str(folder) in driver.said[0]
    assert "cannot be written" in driver.said[0]
    assert "\n" not in driver.said[0]
    assert driver.page == "result"
    driver.click(driver.wizard.saving)
    driver.wait(lambda: driver.written)


def test_a_result_that_cannot_be_saved_stays_and_can_be_saved_later(driver):
    driver.begin()
    driver.go("result")
    driver.file().mkdir()
    driver.click(driver.wizard.saving)
    driver.wait(driver.wizard.refusal.isVisible)
    assert driver.wizard.refusal.text().startswith("Nothing is saved: ")
    assert driver.said == [driver.wizard.refusal.text()]
    assert driver.page == "result"
    assert not driver.written
    driver.file().rmdir()
    driver.click(driver.wizard.saving)
    driver.wait(lambda: driver.written)
    assert not driver.wizard.refusal.isVisible()
    assert Profile.load(driver.file()).response is not None
    assert not driver.wizard.saving.isEnabled()


def test_a_profile_is_saved_although_the_own_file_of_its_plate_cannot_be_written(driver):
    plate = PlateStiffness(made="2026-11-01", positions=(0.0, 1.0), stiffness_n_mm=(20.0, 60.0))
    own_file = plate_file(driver.file())
    own_file.mkdir()
    result = Result("plate", "Plate", (), "Stiff.", True, part=plate)
    driver.workspace.profiles.save("t1", result)
    driver.wait(lambda: driver.said)
    assert driver.said[0].startswith(f"The profile of t1 is saved: {driver.file()}; but not the plate's own file")
    assert str(own_file) in driver.said[0]
    assert driver.workspace.profiles.of("t1").plate == Profile.load(driver.file()).plate == plate


def test_a_folder_of_profiles_that_cannot_be_made_is_said_in_words(driver):
    driver.begin()
    driver.go("result")
    driver.workspace.profiles.folder.parent.mkdir(parents=True, exist_ok=True)
    driver.workspace.profiles.folder.write_text("a file where the folder is to be")
    driver.click(driver.wizard.saving)
    driver.wait(driver.wizard.refusal.isVisible)
    assert driver.wizard.refusal.text().startswith(f"Nothing is saved: {driver.workspace.profiles.folder} cannot be")
    assert "Errno" not in driver.wizard.refusal.text()


# --- on the floor ---


def test_the_projection_is_true_to_scale_and_closes_by_escape(driver):
    driver.begin()
    driver.go("weigh")
    driver.click(driver.wizard.projecting)
    view = driver.workspace.projection
    driver.wait(view.isActiveWindow)
    screen = view.screen()
    assert view.px_per_m == pytest.approx(1e3 * screen.geometry().width() / screen.physicalSize().width())
    apart = view.place((0.1, 0.0)) - view.place((-0.1, 0.0))
    assert apart.x() == pytest.approx(0.2 * view.px_per_m)
    assert view.page.press.at_m == MIDDLE
    before = view.place((0.0, 0.0))
    QTest.keyClick(view, Qt.Key.Key_Plus)
    QTest.keyClick(view, Qt.Key.Key_Up)
    QTest.keyClick(view, Qt.Key.Key_Right, Qt.KeyboardModifier.ControlModifier)
    assert driver.settings.projector_scale == pytest.approx(1.01)
    assert driver.settings.projector_at == pytest.approx((0.001, 0.005))
    assert view.place((0.0, 0.0)).y() < before.y()
    QTest.keyClick(view, Qt.Key.Key_Comma)
    assert driver.settings.projector_turn == 1.0
    along = view.place((0.1, 0.0)) - view.place((0.0, 0.0))
    assert math.degrees(math.atan2(-along.y(), along.x())) == pytest.approx(1.0)
    QTest.keyClick(view, Qt.Key.Key_Return)
    driver.wait(lambda: driver.wizard.snapshot.page.questions == () or driver.page != "weigh")
    QTest.keyClick(view, Qt.Key.Key_Escape)
    assert driver.workspace.projection is None
    driver.wait(driver.workspace.isActiveWindow)
    assert driver.wizard.isVisible()


# --- plates ---


def test_plates_are_sought_as_one_types_and_the_report_is_written(driver, tmp_path):
    workspace = driver.workspace
    driver.click(workspace.choice.plates)
    page = workspace.plates
    assert page.isVisible()
    assert page.table.rowCount() == len(page.found.best) > 0
    assert page.found.spec == PlateSearch()
    driver.click(page.table.viewport())
    QTest.keyClick(page.table, Qt.Key.Key_C, Qt.KeyboardModifier.ControlModifier)
    copied = QGuiApplication.clipboard().text().split("\n")
    assert [line.count("\t") + 1 for line in copied] == [page.table.columnCount()] * (1 + page.table.rowCount())
    field = page.editors["most_mass"].findChild(QLineEdit)
    field.setFocus()
    field.selectAll()
    QTest.keyClicks(field, "20 g")
    QTest.keyClick(field, Qt.Key.Key_Return)
    assert page.table.rowCount() == 0
    assert page.verdict.text() == "No plate fits: none meets the asked mass"
    page.write_report(tmp_path)
    assert (tmp_path / "plates-1.svg").is_file()
    QTest.keyClick(page.back, Qt.Key.Key_Left, Qt.KeyboardModifier.AltModifier)
    assert workspace.overview.isVisible()
