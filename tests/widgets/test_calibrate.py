"""The Calibrate workspace and its wizard, driven by clicks and keys through a small calibration of their own."""

import threading
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from calibrate_driver import CalibrateDriver
from calibrate_samples import PAGES, Bell, Scale, weighing
from on_screen import show
from PySide6.QtCore import QCoreApplication, QEvent, Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import (
    QAbstractButton,
    QApplication,
    QMessageBox,
    QWidget,
)
from windows import calibrate, dialog_of, quiet_window

from underfoot.calibration.procedure import Page
from underfoot.calibration.rig import PressRequest, Sound
from underfoot.engine.target import Target
from underfoot.errors import BadMeasurement, DeviceError
from underfoot.floor.layout import default_floor
from underfoot.floor.profile import Profile, Response
from underfoot.parameters import Number, ask
from underfoot.widgets.calibrate.measuring import Measurement, Pace, WatchedRig
from underfoot.widgets.calibrate.page_view import PageView
from underfoot.widgets.calibrate.wizard import continue_text

# --- from first to last ---


def test_by_clicks_from_first_to_last_page_and_into_the_profile(driver):
    driver.begin()
    driver.go("result")
    assert driver.made[0][1].loads == ["standing"]
    wizard = driver.wizard
    assert wizard.result.verdict.text() == "It rings true."
    assert wizard.result.warnings.text() == "•  the bell is small"
    assert wizard.result.table.item(0, 1).text() == "0.5 dB"
    assert driver.files() == []
    driver.click(wizard.saving)
    driver.wait(lambda: driver.written)
    profile, kind, folder = driver.written[0]
    assert (profile, kind) == (Profile.load(folder / "t1.json"), "response")
    assert profile.response.acceleration_per_unit == pytest.approx(5.0, abs=0.01)
    driver.wait(lambda: not driver.workspace.is_measuring)
    assert driver.made[0][1].closed
    assert not wizard.saving.isEnabled()
    driver.click(wizard.closing)
    assert "errs by 0.5 dB" in driver.workspace.choice.cards["response"].visible_text()
    assert driver.workspace.overview.begin.isEnabled()


def test_by_keys_from_first_to_last_page(driver):
    driver.workspace.overview.begin.setFocus()
    QTest.keyClick(driver.workspace.overview.begin, Qt.Key.Key_Return)
    driver.wait(lambda: driver.page == "setup")
    field = driver.wizard.page.editors[0].field
    assert field.hasFocus()
    field.selectAll()
    QTest.keyClicks(field, "120 N")
    seen = []
    for page in PAGES[1:]:
        driver.wait(lambda: driver.wizard.snapshot.is_waiting)
        while driver.page != page:
            before = driver.wizard.snapshot
            QTest.keyClick(QApplication.focusWidget(), Qt.Key.Key_Return)
            driver.wait(
                lambda before=before: driver.wizard.snapshot is not before and driver.wizard.snapshot.is_waiting
            )
        seen.append(driver.page)
    assert tuple(seen) == PAGES[1:]
    assert driver.made[0][0].answers["stiffness_n"] == 120.0
    driver.wait(driver.wizard.saving.hasFocus)
    QTest.keyClick(driver.wizard.saving, Qt.Key.Key_Return)
    driver.wait(lambda: driver.written and not driver.workspace.is_measuring)
    for key in (Qt.Key.Key_Return, Qt.Key.Key_Return, Qt.Key.Key_Right, Qt.Key.Key_Return):
        QTest.keyClick(QApplication.focusWidget(), key)  # the second Return is one too many on Close
    driver.wait(lambda: driver.page == "setup" and driver.workspace.tile.id == "t2")


def test_a_calibration_runs_by_itself_with_no_hands_and_shows_every_page(driver):
    seen = []
    driver.wizard.page_shown.connect(lambda snapshot: seen.append(snapshot.page.key))
    driver.workspace.pace = Pace()
    driver.click(driver.workspace.overview.begin_automatic)
    driver.wait(lambda: driver.page == "result")
    assert tuple(dict.fromkeys(seen)) == PAGES
    assert not driver.wizard.snapshot.is_automatic
    assert driver.files() == []


def test_a_run_by_itself_is_paused_and_goes_on(driver):
    driver.workspace.pace = Pace(0.4, 20.0)
    driver.click(driver.workspace.overview.begin_automatic)
    driver.wait(lambda: driver.page == "tare")
    driver.click(driver.wizard.running)
    driver.wait(lambda: not driver.wizard.snapshot.is_automatic)
    stood, reads = driver.page, driver.made[0][1].reads
    driver.qtbot.wait(500)
    assert (driver.page, driver.made[0][1].reads) == (stood, reads)
    driver.click(driver.wizard.running)
    driver.wait(lambda: driver.page == "result")


def test_typed_values_are_given_and_an_earlier_page_remembers_them(driver):
    driver.begin()
    field = driver.wizard.page.editors[0].field
    field.setFocus()
    QTest.keyClicks(field, "250")
    driver.go("tare")
    assert driver.made[0][0].answers == {"stiffness_n": 250.0, "kind": "spring"}
    driver.click(driver.wizard.backing)
    driver.wait(lambda: driver.page == "setup")
    assert driver.wizard.page.editors[0].value() == 250.0


def test_what_is_typed_counts_also_in_a_window_without_the_focus(driver, qtbot):
    """As where no window manager gives the focus to anybody, or the floor's view has it."""
    driver.begin()
    other = QWidget()
    qtbot.addWidget(other)
    show(qtbot, other)
    assert not driver.workspace.isActiveWindow()
    field = driver.wizard.page.editors[0].field
    field.selectAll()
    QTest.keyClicks(field, "250")
    driver.click(driver.wizard.going)
    driver.wait(lambda: driver.page == "tare")
    assert driver.made[0][0].answers["stiffness_n"] == 250.0


def test_the_focus_stays_in_the_wizard_while_something_is_measured(qtbot, tmp_path):
    gate = threading.Event()
    driver = CalibrateDriver(qtbot, tmp_path, gate=gate)
    try:
        driver.begin()
        driver.go("bell")
        driver.click(driver.wizard.going)
        assert not driver.wizard.going.isEnabled()
        assert driver.workspace.window().focusWidget() is driver.wizard
    finally:
        gate.set()
    driver.wait(driver.wizard.saving.hasFocus)


def test_a_page_of_silence_listens_and_does_not_play(qtbot):
    view = PageView()
    qtbot.addWidget(view)
    for signal, words in ((np.zeros(4800), "Listens for 100 ms"), (np.ones(4800), "Plays for 100 ms")):
        page = Page(words, "a", "b", sound=Sound(signal, 48_000, "none"))
        view.show_page(page)
        assert view.place_text.text() == f"{words} with nothing on the tile"
        assert continue_text(page, by_hand=False, is_waiting=True) == ("Play" if signal.any() else "Listen")


def test_an_empty_tile_is_read_and_a_press_is_waited_for():
    empty, loaded = (Page("a", "b", "c", press=PressRequest((0.0, 0.0), force_n)) for force_n in (0.0, 100.0))
    states = ((True, False), (False, True), (False, False))
    words = [continue_text(page, by_hand, waits) for page in (empty, loaded) for by_hand, waits in states]
    assert words == ["Reading…", "Read", "Reading…", "Waiting for the press", "Press", "Pressing…"]


def test_before_a_first_calibration_the_tile_is_pictured(driver):
    assert driver.workspace.overview.picture.isVisible()
    assert not driver.workspace.overview.table.isVisible()
    Profile(tile="t1").with_part(Response(made="2026-01-01", frequencies_hz=(50.0,), magnitude=(1.0,))).save(
        driver.file()
    )
    driver.workspace.profiles.follow(default_floor())
    driver.wait(driver.workspace.overview.table.isVisible)
    assert not driver.workspace.overview.picture.isVisible()


def test_back_and_skip_go_where_they_say(driver):
    assert "what was measured" in driver.wizard.skipping.toolTip()
    assert "what was measured" in driver.wizard.backing.toolTip()
    driver.begin()
    driver.go("weigh")
    QTest.keyClick(driver.wizard, Qt.Key.Key_Left, Qt.KeyboardModifier.AltModifier)
    driver.wait(lambda: driver.page == "tare")
    assert not driver.wizard.skipping.isVisible()
    driver.go("weigh")
    driver.click(driver.wizard.skipping)
    driver.wait(lambda: driver.page == "note")


# --- what is refused ---


def test_a_refusal_is_one_line_on_the_page_and_nothing_is_lost(driver):
    driver.begin()
    driver.go("weigh")
    field = driver.wizard.page.editors[0].field
    field.setFocus()
    QTest.keyClicks(field, "40 N")
    driver.click(driver.wizard.going)
    driver.wait(driver.wizard.refusal.isVisible)
    assert driver.wizard.refusal.text() == "40\xa0N was typed, but the scale says more"
    assert driver.page == "weigh"
    assert driver.made[0][1].asked.force_n == 0.0  # the simulated hand lets go
    field = driver.wizard.page.editors[0].field
    field.setFocus()
    field.selectAll()
    QTest.keyClicks(field, "100 N")
    driver.go("note")
    assert not driver.wizard.refusal.isVisible()


def test_an_answer_that_makes_no_sense_is_refused_by_the_procedure(driver):
    driver.begin()
    driver.go("weigh")
    field = driver.wizard.page.editors[0].field
    field.setFocus()
    QTest.keyClicks(field, "0")
    driver.click(driver.wizard.going)
    driver.wait(lambda: "a weight weighs something" in driver.wizard.refusal.text())


def test_what_cannot_be_typed_is_not_given(driver):
    driver.begin()
    editor = driver.wizard.page.editors[0]
    editor.label.setText("Weight, N")
    field = editor.field
    field.setFocus()
    QTest.keyClicks(field, "5000 N")
    driver.click(driver.wizard.going)
    driver.wait(driver.wizard.refusal.isVisible)
    assert driver.wizard.refusal.text().startswith("Weight, N: 5000\xa0N is not taken; ")
    assert "allowed: 1 to 1000\xa0N" in driver.wizard.refusal.text()
    assert driver.made[0][0].answers == {}
    assert driver.page == "setup"


def test_a_rig_that_cannot_be_had_is_said_and_only_cancel_is_left(qtbot, tmp_path):
    driver = CalibrateDriver(qtbot, tmp_path, failure=DeviceError("the port is not there"))
    driver.click(driver.workspace.overview.begin)
    driver.wait(lambda: driver.wizard.refusal.text() == "the port is not there")
    assert [b for b in driver.wizard.findChildren(QAbstractButton) if b.isVisible() and b.isEnabled()] == [
        driver.wizard.leaving
    ]
    driver.click(driver.wizard.leaving)
    assert driver.workspace.overview.isVisible()


# --- leaving ---


@pytest.mark.parametrize("page", PAGES)
def test_cancel_at_any_page_changes_nothing(driver, page):
    Profile(tile="t1").with_part(Response(made="2026-01-01", frequencies_hz=(50.0,), magnitude=(1.0,))).save(
        driver.file()
    )
    before = driver.file().read_bytes()
    driver.begin()
    driver.go(page)
    driver.click(driver.wizard.closing if page == "result" else driver.wizard.leaving)
    assert driver.workspace.overview.isVisible()
    driver.wait(lambda: not driver.workspace.is_measuring)
    assert driver.made[0][1].closed
    assert driver.files() == ["t1.json"]
    assert driver.file().read_bytes() == before
    assert driver.written == []


def test_nothing_waits_for_what_is_computed_and_it_can_be_left(qtbot, tmp_path):
    gate = threading.Event()
    driver = CalibrateDriver(qtbot, tmp_path, gate=gate)
    try:
        driver.begin()
        driver.go("bell")
        driver.click(driver.wizard.going)
        driver.wait(lambda: driver.wizard.busy.isVisible() and "Playing" in driver.wizard.busy_words.text())
        driver.click(driver.wizard.leaving)
        assert driver.wizard.busy_words.text() == ""
        assert driver.workspace.overview.isVisible()
        assert not driver.workspace.overview.begin.isEnabled()
    finally:
        gate.set()
    driver.wait(driver.workspace.overview.begin.isEnabled)
    assert driver.made[0][1].silenced.is_set()


def test_a_panic_stops_the_sound_and_the_page_stays(qtbot, tmp_path):
    driver = CalibrateDriver(qtbot, tmp_path)
    driver.begin()
    driver.go("bell")
    driver.workspace.silence()
    assert driver.made[0][1].silenced.is_set()
    bell = driver.made[0][1]
    play = bell.play

    def panics(sound):
        driver.workspace.silence()
        return play(sound)

    bell.play = panics
    driver.click(driver.wizard.going)
    driver.wait(driver.wizard.refusal.isVisible)
    assert "was stopped" in driver.wizard.refusal.text()
    assert driver.page == "bell"
    bell.play = play
    driver.go("result")


def test_back_stops_the_sound_and_goes_to_the_page_before(qtbot, tmp_path):
    driver = CalibrateDriver(qtbot, tmp_path)
    driver.begin()
    driver.go("bell")
    bell = driver.made[0][1]
    bell.play = lambda sound: sound.signal * bell.silenced.wait(5.0)
    driver.click(driver.wizard.going)
    driver.click(driver.wizard.backing)
    driver.wait(lambda: driver.page == "note" and not driver.wizard.refusal.isVisible())


def test_a_sound_that_is_to_begin_after_a_panic_does_not():
    scale = Scale()
    watched = WatchedRig(scale)
    sound = Sound(np.ones(4), 48_000, "none")
    watched.silence()
    with pytest.raises(BadMeasurement, match="was stopped"):
        watched.play(sound)
    assert scale.loads == []
    watched.allow()
    assert watched.play(sound).tolist() == [0.5] * 4


def test_another_target_ends_the_measurement(driver):
    driver.begin()
    driver.workspace.set_target(Target(default_floor(1, 3)))
    assert driver.workspace.overview.isVisible()
    driver.wait(lambda: not driver.workspace.is_measuring)
    assert driver.workspace.choice.map.chosen_tile() == "t1"
    driver.workspace.set_target(Target(default_floor(1, 3), kind="replay", source="walk.csv"))
    assert "cannot be pressed" in driver.workspace.overview.note.text()
    assert not driver.workspace.overview.begin.isEnabled()


def test_the_window_asks_before_it_closes_on_what_a_person_measured(qtbot, tmp_path):
    window, made = quiet_window(qtbot, tmp_path), []
    window.workspaces.choose("Calibrate")
    tile = default_floor().tiles[0]
    make = partial(weighing(made, by_hand=True), Bell, Target(default_floor()), tile, Profile(tile="t1"), "")
    measurement = Measurement(make, by_hand=True, pace=Pace(0.0, 0.0), parent=window)
    wizard = calibrate(window).wizard
    wizard.begin(measurement, tile, "Bell", None)
    measurement.start()
    try:
        for page in ("setup", "weigh"):
            qtbot.waitUntil(lambda page=page: wizard.snapshot is not None and wizard.snapshot.page.key == page)
            made[0][1].hand_n = 90.0
            wizard.go_on()
        qtbot.waitUntil(lambda: wizard.would_lose)
        window.close()
        assert window.isVisible()
        assert window.workspaces.chosen == "Calibrate"
        qtbot.mouseClick(_button(window, QMessageBox.StandardButton.Cancel), Qt.MouseButton.LeftButton)
        assert window.isVisible()
        window.close()
        qtbot.mouseClick(_button(window, QMessageBox.StandardButton.Yes), Qt.MouseButton.LeftButton)
        assert not window.isVisible()
    finally:
        measurement.stop()
        measurement.join()


def _button(window, button):
    return dialog_of(window, QMessageBox).button(button)


# --- hardware ---


def test_on_hardware_the_link_is_asked_for_and_a_person_presses(qtbot, tmp_path):
    driver = CalibrateDriver(qtbot, tmp_path, kind="serial")
    assert not driver.workspace.overview.begin_automatic.isVisible()
    driver.click(driver.workspace.overview.begin)
    assert driver.wanted == ["release"]
    assert driver.made == []
    driver.workspace.begin_released()
    driver.wait(lambda: driver.page == "setup")
    assert not driver.wizard.running.isVisible()
    driver.click(driver.wizard.going)
    driver.wait(lambda: driver.page == "weigh")
    scale = driver.made[0][1]
    scale.hand_n = 90.0
    driver.click(driver.wizard.going)
    driver.wait(lambda: driver.page == "note")
    driver.click(driver.wizard.leaving)
    question = next(box for box in driver.wizard.findChildren(QMessageBox) if box.isVisible())
    driver.click(question.button(QMessageBox.StandardButton.Cancel))
    assert driver.wizard.isVisible()
    driver.click(driver.wizard.leaving)
    question = next(box for box in driver.wizard.findChildren(QMessageBox) if box.isVisible())
    driver.click(question.button(QMessageBox.StandardButton.Yes))
    driver.wait(lambda: driver.wanted == ["release", "reopen"])
    assert scale.closed
    QCoreApplication.sendPostedEvents(None, QEvent.Type.DeferredDelete)


def test_the_next_tile_is_set_up_as_the_one_before(qtbot, tmp_path):
    """Forty tiles are loaded with the same weights, which were typed for each."""
    driver = CalibrateDriver(qtbot, tmp_path, kind="serial")
    workspace = driver.workspace
    for tile, stiffness_n in (("t1", 300.0), ("t2", 250.0)):
        workspace.choice.map.choose_tile(tile)
        driver.click(workspace.overview.begin)
        workspace.begin_released()
        driver.wait(lambda: driver.page == "setup")
        stiffness, kind = driver.wizard.page.editors
        assert (stiffness.value(), kind.value()) == (stiffness_n, "spring")
        stiffness.set_value(250.0)
        driver.click(driver.wizard.going)
        driver.wait(lambda: driver.page == "weigh")
        assert driver.wizard.page.values() == {"weight_n": 100.0}
        driver.wizard.page.editors[0].set_value(70.0)  # of this tile alone
        workspace.leave()
        driver.wait(lambda: not workspace.is_measuring)
    assert driver.made[1][0].answers["stiffness_n"] == 250.0
    page, view = driver.made[1][0].page, driver.wizard.page
    for default, least in ((200.0, 1.0), (300.0, 260.0)):  # of its accelerometer, or of a smaller tile
        first = ask("stiffness_n", Number(default, least, 1000.0, unit="N", doc="How much it bears."))
        view.set_tile(default_floor().tiles[2], "Bell")
        view.show_page(replace(page, key="setup", questions=(first,), share=0.0))
        assert view.values() == {"stiffness_n": default}


def test_a_page_that_waits_for_a_person_says_so(qtbot, tmp_path):
    driver = CalibrateDriver(qtbot, tmp_path, kind="serial")
    driver.click(driver.workspace.overview.begin)
    driver.workspace.begin_released()
    driver.wait(lambda: driver.page == "setup")
    driver.go("weigh")
    driver.made[0][1].hand_n = 500.0
    driver.wait(driver.wizard.going.isEnabled)
    driver.click(driver.wizard.going)
    driver.wait(lambda: "the scale says more" in driver.wizard.refusal.text())
    assert driver.page == "weigh"


def test_a_line_that_is_gone_while_a_page_asks_loses_nothing(qtbot, tmp_path):
    driver = CalibrateDriver(qtbot, tmp_path, kind="serial")
    driver.click(driver.workspace.overview.begin)
    driver.workspace.begin_released()
    driver.wait(lambda: driver.page == "setup")
    driver.click(driver.wizard.going)
    driver.wait(lambda: driver.page == "weigh" and driver.wizard.snapshot.page.questions)
    scale = driver.made[0][1]
    scale.failure = DeviceError("nothing comes of tile 0")
    driver.wait(lambda: driver.wizard.refusal.text() == "nothing comes of tile 0")
    scale.failure, scale.hand_n = None, 90.0
    driver.wait(lambda: driver.wizard.refusal.text() == "")
    driver.click(driver.wizard.going)
    driver.wait(lambda: driver.page == "note")
    assert driver.workspace.is_measuring
