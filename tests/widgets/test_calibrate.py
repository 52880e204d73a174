"""The Calibrate workspace and its wizard, driven by clicks and keys through a small calibration of their own."""

import itertools
import threading

import numpy as np
import pytest
from calibrate_desk import Desk
from calibrate_samples import PAGES, Scale
from on_screen import show
from PySide6.QtCore import QCoreApplication, QEvent, Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import (
    QAbstractButton,
    QApplication,
    QMessageBox,
    QWidget,
)

from underfoot.calibration.procedure import Page
from underfoot.calibration.rig import PressRequest, Sound
from underfoot.engine.target import Target
from underfoot.errors import BadMeasurement, DeviceError
from underfoot.floor.layout import default_floor
from underfoot.floor.profile import Profile, Response
from underfoot.widgets.calibrate.measuring import Pace, WatchedRig
from underfoot.widgets.calibrate.page_view import PageView
from underfoot.widgets.calibrate.wizard import going_words

# --- from first to last ---


def test_by_clicks_from_first_to_last_page_and_into_the_profile(desk):
    desk.begin()
    desk.go("result")
    assert desk.made[0][1].loads == ["standing"]
    wizard = desk.wizard
    assert wizard.result.verdict.text() == "It rings true."
    assert wizard.result.warnings.text() == "•  the bell is small"
    assert wizard.result.table.item(0, 1).text() == "0.5 dB"
    assert desk.files() == []
    desk.click(wizard.saving)
    desk.wait(lambda: desk.written)
    profile, kind, folder = desk.written[0]
    assert (profile, kind) == (Profile.load(folder / "t1.json"), "response")
    assert profile.response.acceleration_per_unit == pytest.approx(5.0, abs=0.01)
    desk.wait(lambda: not desk.workspace.is_measuring)
    assert desk.made[0][1].closed
    assert not wizard.saving.isEnabled()
    desk.click(wizard.closing)
    assert "errs by 0.5 dB" in desk.workspace.choice.cards["response"].text_shown()
    assert desk.workspace.overview.begin.isEnabled()


def test_by_keys_from_first_to_last_page(desk):
    desk.workspace.overview.begin.setFocus()
    QTest.keyClick(desk.workspace.overview.begin, Qt.Key.Key_Return)
    desk.wait(lambda: desk.page == "setup")
    field = desk.wizard.page.editors[0].field
    assert field.hasFocus()
    field.selectAll()
    QTest.keyClicks(field, "120 N")
    seen = []
    for page in PAGES[1:]:
        desk.wait(lambda: desk.wizard.snapshot.waits)
        while desk.page != page:
            before = desk.wizard.snapshot
            QTest.keyClick(QApplication.focusWidget(), Qt.Key.Key_Return)
            desk.wait(lambda before=before: desk.wizard.snapshot is not before and desk.wizard.snapshot.waits)
        seen.append(desk.page)
    assert tuple(seen) == PAGES[1:]
    assert desk.made[0][0].answers["stiffness_n"] == 120.0
    desk.wait(desk.wizard.saving.hasFocus)
    QTest.keyClick(desk.wizard.saving, Qt.Key.Key_Return)
    desk.wait(lambda: desk.written)


def test_it_runs_by_itself_with_no_hands_every_page_seen(desk):
    seen = []
    desk.wizard.shown.connect(lambda snapshot: seen.append(snapshot.page.key))
    desk.workspace.pace = Pace()
    desk.click(desk.workspace.overview.begin_alone)
    desk.wait(lambda: desk.page == "result")
    assert tuple(dict.fromkeys(seen)) == PAGES
    assert not desk.wizard.snapshot.alone
    assert desk.files() == []


def test_a_run_by_itself_is_paused_and_goes_on(desk):
    desk.workspace.pace = Pace(0.4, 20.0)
    desk.click(desk.workspace.overview.begin_alone)
    desk.wait(lambda: desk.page == "tare")
    desk.click(desk.wizard.running)
    desk.wait(lambda: not desk.wizard.snapshot.alone)
    stood, reads = desk.page, desk.made[0][1].reads
    desk.qtbot.wait(500)
    assert (desk.page, desk.made[0][1].reads) == (stood, reads)
    desk.click(desk.wizard.running)
    desk.wait(lambda: desk.page == "result")


def test_typed_values_are_given_and_an_earlier_page_remembers_them(desk):
    desk.begin()
    field = desk.wizard.page.editors[0].field
    field.setFocus()
    QTest.keyClicks(field, "250")
    desk.go("tare")
    assert desk.made[0][0].answers == {"stiffness_n": 250.0, "kind": "spring"}
    desk.click(desk.wizard.backing)
    desk.wait(lambda: desk.page == "setup")
    assert desk.wizard.page.editors[0].value() == 250.0


def test_what_is_typed_counts_also_in_a_window_without_the_focus(desk, qtbot):
    """As where no window manager gives the focus to anybody, or the floor's view has it."""
    desk.begin()
    other = QWidget()
    qtbot.addWidget(other)
    show(qtbot, other)
    assert not desk.workspace.isActiveWindow()
    field = desk.wizard.page.editors[0].field
    field.selectAll()
    QTest.keyClicks(field, "250")
    desk.click(desk.wizard.going)
    desk.wait(lambda: desk.page == "tare")
    assert desk.made[0][0].answers["stiffness_n"] == 250.0


def test_the_focus_stays_in_the_wizard_while_something_is_measured(qtbot, tmp_path):
    gate = threading.Event()
    desk = Desk(qtbot, tmp_path, gate=gate)
    try:
        desk.begin()
        desk.go("bell")
        desk.click(desk.wizard.going)
        assert not desk.wizard.going.isEnabled()
        assert desk.workspace.window().focusWidget() is desk.wizard
    finally:
        gate.set()
    desk.wait(desk.wizard.saving.hasFocus)


def test_a_page_of_silence_listens_and_does_not_play(qtbot):
    view = PageView()
    qtbot.addWidget(view)
    for signal, words in ((np.zeros(4800), "Listens for 100 ms"), (np.ones(4800), "Plays for 100 ms")):
        page = Page(words, "a", "b", sound=Sound(signal, 48_000, "none"))
        view.show_page(page)
        assert view.where.text() == f"{words} with nothing on the tile"
        assert going_words(page, by_hand=False, waits=True) == ("Play" if signal.any() else "Listen")


def test_an_empty_tile_is_read_and_a_press_is_waited_for():
    empty, loaded = (Page("a", "b", "c", press=PressRequest((0.0, 0.0), force_n)) for force_n in (0.0, 100.0))
    states = ((True, True), (False, True), (False, False))
    words = [going_words(page, by_hand, waits) for page in (empty, loaded) for by_hand, waits in states]
    assert words == ["Reading…", "Read", "Reading…", "Waiting for the press", "Press", "Pressing…"]


def test_before_a_first_calibration_the_tile_is_pictured(desk):
    assert desk.workspace.overview.picture.isVisible()
    assert not desk.workspace.overview.table.isVisible()
    Profile(tile="t1").with_part(Response(made="2026-01-01", frequencies_hz=(50.0,), magnitude=(1.0,))).save(
        desk.file()
    )
    desk.workspace.profiles.follow(default_floor())
    desk.wait(desk.workspace.overview.table.isVisible)
    assert not desk.workspace.overview.picture.isVisible()


def test_back_and_skip_go_where_they_say(desk):
    desk.begin()
    desk.go("weigh")
    QTest.keyClick(desk.wizard, Qt.Key.Key_Left, Qt.KeyboardModifier.AltModifier)
    desk.wait(lambda: desk.page == "tare")
    assert not desk.wizard.skipping.isVisible()
    desk.go("weigh")
    desk.click(desk.wizard.skipping)
    desk.wait(lambda: desk.page == "note")


# --- what is refused ---


def test_a_refusal_is_one_line_on_the_page_and_nothing_is_lost(desk):
    desk.begin()
    desk.go("weigh")
    field = desk.wizard.page.editors[0].field
    field.setFocus()
    QTest.keyClicks(field, "40 N")
    desk.click(desk.wizard.going)
    desk.wait(desk.wizard.refusal.isVisible)
    assert desk.wizard.refusal.text() == "40\xa0N was typed, but the scale says more"
    assert desk.page == "weigh"
    field = desk.wizard.page.editors[0].field
    field.setFocus()
    field.selectAll()
    QTest.keyClicks(field, "100 N")
    desk.go("note")
    assert not desk.wizard.refusal.isVisible()


def test_an_answer_that_makes_no_sense_is_refused_by_the_procedure(desk):
    desk.begin()
    desk.go("weigh")
    field = desk.wizard.page.editors[0].field
    field.setFocus()
    QTest.keyClicks(field, "0")
    desk.click(desk.wizard.going)
    desk.wait(lambda: "a weight weighs something" in desk.wizard.refusal.text())


def test_what_cannot_be_typed_is_not_given(desk):
    desk.begin()
    field = desk.wizard.page.editors[0].field
    field.setFocus()
    QTest.keyClicks(field, "5000 N")
    desk.click(desk.wizard.going)
    desk.wait(desk.wizard.refusal.isVisible)
    assert "allowed: 1 to 1000\xa0N" in desk.wizard.refusal.text()
    assert desk.made[0][0].answers == {}
    assert desk.page == "setup"


def test_a_rig_that_cannot_be_had_is_said_and_only_cancel_is_left(qtbot, tmp_path):
    desk = Desk(qtbot, tmp_path, failure=DeviceError("the port is not there"))
    desk.click(desk.workspace.overview.begin)
    desk.wait(lambda: desk.wizard.refusal.text() == "the port is not there")
    assert [b for b in desk.wizard.findChildren(QAbstractButton) if b.isVisible() and b.isEnabled()] == [
        desk.wizard.leaving
    ]
    desk.click(desk.wizard.leaving)
    assert desk.workspace.overview.isVisible()


# --- leaving ---


@pytest.mark.parametrize("page", PAGES)
def test_cancel_at_any_page_changes_nothing(desk, page):
    Profile(tile="t1").with_part(Response(made="2026-01-01", frequencies_hz=(50.0,), magnitude=(1.0,))).save(
        desk.file()
    )
    before = desk.file().read_bytes()
    desk.begin()
    desk.go(page)
    desk.click(desk.wizard.closing if page == "result" else desk.wizard.leaving)
    assert desk.workspace.overview.isVisible()
    desk.wait(lambda: not desk.workspace.is_measuring)
    assert desk.made[0][1].closed
    assert desk.files() == ["t1.json"]
    assert desk.file().read_bytes() == before
    assert desk.written == []


def test_nothing_waits_for_what_is_computed_and_it_can_be_left(qtbot, tmp_path):
    gate = threading.Event()
    desk = Desk(qtbot, tmp_path, gate=gate)
    try:
        desk.begin()
        desk.go("bell")
        desk.click(desk.wizard.going)
        desk.wait(lambda: desk.wizard.busy.isVisible())
        assert "Playing" in desk.wizard.busy_words.text()
        desk.click(desk.wizard.leaving)
        assert desk.workspace.overview.isVisible()
        assert not desk.workspace.overview.begin.isEnabled()
    finally:
        gate.set()
    desk.wait(desk.workspace.overview.begin.isEnabled)
    assert desk.made[0][1].silenced.is_set()


def test_a_panic_stops_the_sound_and_the_page_stays(qtbot, tmp_path):
    desk = Desk(qtbot, tmp_path)
    desk.begin()
    desk.go("bell")
    desk.workspace.silence()
    assert desk.made[0][1].silenced.is_set()
    bell = desk.made[0][1]
    play = bell.play

    def panics(sound):
        desk.workspace.silence()
        return play(sound)

    bell.play = panics
    desk.click(desk.wizard.going)
    desk.wait(desk.wizard.refusal.isVisible)
    assert "was stopped" in desk.wizard.refusal.text()
    assert desk.page == "bell"
    bell.play = play
    desk.go("result")


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


def test_another_target_ends_the_measurement(desk):
    desk.begin()
    desk.workspace.set_target(Target(default_floor(1, 3)))
    assert desk.workspace.overview.isVisible()
    desk.wait(lambda: not desk.workspace.is_measuring)
    assert desk.workspace.choice.map.choice() == "t1"
    desk.workspace.set_target(Target(default_floor(1, 3), kind="replay", source="walk.csv"))
    assert "cannot be pressed" in desk.workspace.overview.note.text()
    assert not desk.workspace.overview.begin.isEnabled()


# --- hardware ---


def test_on_hardware_the_link_is_asked_for_and_a_person_presses(qtbot, tmp_path):
    desk = Desk(qtbot, tmp_path, kind="serial")
    assert not desk.workspace.overview.begin_alone.isVisible()
    desk.click(desk.workspace.overview.begin)
    assert desk.wanted == ["release"]
    assert desk.made == []
    desk.workspace.begin_released()
    desk.wait(lambda: desk.page == "setup")
    assert not desk.wizard.running.isVisible()
    desk.click(desk.wizard.going)
    desk.wait(lambda: desk.page == "weigh")
    scale = desk.made[0][1]
    scale.hand_n = 90.0
    desk.click(desk.wizard.going)
    desk.wait(lambda: desk.page == "note")
    desk.click(desk.wizard.leaving)
    question = next(box for box in desk.wizard.findChildren(QMessageBox) if box.isVisible())
    desk.click(question.button(QMessageBox.StandardButton.Cancel))
    assert desk.wizard.isVisible()
    desk.click(desk.wizard.leaving)
    question = next(box for box in desk.wizard.findChildren(QMessageBox) if box.isVisible())
    desk.click(question.button(QMessageBox.StandardButton.Discard))
    desk.wait(lambda: desk.wanted == ["release", "reopen"])
    assert scale.closed
    QCoreApplication.sendPostedEvents(None, QEvent.Type.DeferredDelete)


def test_a_page_that_waits_for_a_person_says_so(qtbot, tmp_path):
    desk = Desk(qtbot, tmp_path, kind="serial")
    desk.click(desk.workspace.overview.begin)
    desk.workspace.begin_released()
    desk.wait(lambda: desk.page == "setup")
    desk.go("weigh")
    desk.made[0][1].hand_n = 500.0
    desk.click(desk.wizard.going)
    desk.wait(lambda: "the scale says more" in desk.wizard.refusal.text())
    assert desk.page == "weigh"


# --- hands and eyes ---


def test_everything_that_takes_the_focus_has_a_name(desk):
    desk.begin()
    for page in PAGES:
        desk.go(page)
        for widget in desk.workspace.findChildren(QWidget):
            if widget.isVisible() and widget.focusPolicy() & Qt.FocusPolicy.TabFocus and widget.focusProxy() is None:
                text = widget.text() if isinstance(widget, QAbstractButton) else ""
                assert widget.accessibleName() or text, (page, widget)


def test_tab_goes_through_the_fields_and_then_the_buttons(desk):
    desk.begin()
    first, second = desk.wizard.page.editors
    order = []
    for _ in range(8):
        order.append(QApplication.focusWidget())
        QTest.keyClick(QApplication.focusWidget(), Qt.Key.Key_Tab)
    assert order[0] is first.field
    assert order.index(second.box) < order.index(desk.wizard.leaving) < order.index(desk.wizard.going)


def test_nothing_overlaps_or_is_cut_off_at_the_smallest_size(desk):
    desk.begin()
    for page in PAGES:
        desk.go(page)
        for view in (desk.wizard, desk.wizard.page if page != "result" else desk.wizard.result):
            inside = view.rect()
            for widget in view.children():
                if isinstance(widget, QWidget) and widget.isVisible():
                    assert inside.contains(widget.geometry()), (page, widget)
        buttons = sorted(
            (b.geometry() for b in desk.wizard.leaving.parentWidget().findChildren(QAbstractButton) if b.isVisible()),
            key=lambda place: place.x(),
        )
        assert all(a.right() < b.left() for a, b in itertools.pairwise(buttons))
