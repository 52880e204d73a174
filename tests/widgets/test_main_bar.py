"""The transport bar: what it shows, and what it says when hands are laid on it."""

import itertools

import pytest
from msgspec.structs import replace
from on_screen import choose, show
from PySide6.QtCore import QPoint, QPointF, Qt
from PySide6.QtGui import QWheelEvent
from PySide6.QtWidgets import QApplication, QMenu

from underfoot.engine.reports import Health
from underfoot.widgets.main_bar import MainBar
from underfoot.widgets.workspace import discover

WELL = Health(True, 0.114, 0.6, 0, 0, 0.0033, 0.0006, 0.0107, 0.0, 96_000, 0.25, 1)


@pytest.fixture
def bar(qtbot):
    made = MainBar(QMenu())
    qtbot.addWidget(made)
    for name, key in (("Design", "Ctrl+1"), ("Monitor", "Ctrl+2"), ("Calibrate", "Ctrl+3")):
        made.add_workspace(name, key, name.lower())
    made.set_workspace("Design")
    made.resize(1280, 48)
    show(qtbot, made)
    return made


def test_every_button_says_what_was_asked_for(bar, qtbot):
    for button, signal in ((bar.play, "play_requested"), (bar.stop, "stop_requested"), (bar.panic, "panic_requested")):
        with qtbot.waitSignal(getattr(bar, signal)):
            qtbot.mouseClick(button, Qt.MouseButton.LeftButton)
    with qtbot.waitSignal(bar.record_requested) as asked:
        qtbot.mouseClick(bar.record, Qt.MouseButton.LeftButton)
    assert asked.args == [True]
    with qtbot.waitSignal(bar.audio_requested):
        qtbot.mouseClick(bar.audio, Qt.MouseButton.LeftButton)


def test_tabs_choose_workspaces(bar, qtbot):
    with qtbot.waitSignal(bar.workspace_chosen) as chosen:
        qtbot.mouseClick(bar.tabs["Monitor"], Qt.MouseButton.LeftButton)
    assert chosen.args == ["Monitor"]
    assert bar.tabs["Monitor"].toolTip() == "Monitor (Ctrl+2)"
    bar.set_workspace("Design")
    assert [name for name, tab in bar.tabs.items() if tab.isChecked()] == ["Design"]


def test_targets_are_chosen_by_their_key(bar, qtbot):
    bar.set_targets([("a 1", "One"), ("", ""), ("b", "Two")])
    actions = bar.target.menu().actions()
    assert [action.text() for action in actions if not action.isSeparator()] == ["One", "Two"]
    with qtbot.waitSignal(bar.target_chosen) as chosen:
        actions[2].trigger()
    assert chosen.args == ["b"]
    bar.set_target("Two")
    assert bar.target.text() == "Two"


def test_the_present_target_is_marked_and_a_click_marks_nothing_that_is_not_the_target_yet(bar):
    bar.set_targets([("a", "One"), ("b", "Two"), ((("c", "Oak"),), "Wood")])
    one, two, wood = bar.target.menu().actions()
    bar.set_target("Two of oak", {"b", "c"})
    marked = [action.isChecked() for action in (one, two, *wood.menu().actions())]
    assert marked == [False, True, True]
    one.trigger()
    assert (one.isChecked(), two.isChecked()) == (False, True)


def test_targets_in_a_menu_of_their_own_are_chosen_by_clicks(bar, qtbot):
    bar.set_targets([("a", "One"), ((("b 1", "Oak"), ("", ""), ("b", "Open…")), "Wood")])
    for words, key in ((("One",), "a"), (("Wood", "Oak"), "b 1"), (("Wood", "Open…"), "b")):
        with qtbot.waitSignal(bar.target_chosen) as chosen:
            choose(bar.target, *words)
        assert chosen.args == [key]


def test_the_level_is_moved_by_keys_and_mouse_in_decibels(bar, qtbot):
    bar.set_level(-30.0)
    bar.level.setFocus()
    with qtbot.waitSignal(bar.level_chosen) as chosen:
        qtbot.keyClick(bar.level, Qt.Key.Key_Right)
    assert chosen.args == [-29.5]
    assert bar.level_text.text() == "−29.5 dB"
    assert bar.level.accessibleDescription() == "−29.5 dB of full scale"
    right = QPoint(bar.level.width() - 1, bar.level.height() // 2)
    with qtbot.waitSignal(bar.level_chosen) as chosen:
        qtbot.mouseClick(bar.level, Qt.MouseButton.LeftButton, pos=right)
    assert chosen.args == [0.0]
    qtbot.mouseDClick(bar.level, Qt.MouseButton.LeftButton, pos=right)
    assert bar.level.value() == -300


@pytest.mark.parametrize("button", [Qt.MouseButton.RightButton, Qt.MouseButton.MiddleButton])
def test_only_the_left_button_moves_the_level(bar, qtbot, button):
    bar.set_level(-40.0)
    loud = QPoint(bar.level.width() - 1, bar.level.height() // 2)
    with qtbot.assertNotEmitted(bar.level_chosen):
        qtbot.mouseClick(bar.level, button, pos=loud)
        qtbot.mouseDClick(bar.level, button, pos=loud)


def test_the_wheel_moves_the_level_only_where_it_has_the_focus(bar, qtbot):
    bar.set_level(-30.0)
    middle, none = QPointF(bar.level.rect().center()), Qt.KeyboardModifier.NoModifier
    for has_focus, level in ((False, -300), (True, -285)):
        (bar.level if has_focus else bar.play).setFocus()
        turn = (QPoint(), QPoint(0, 120), Qt.MouseButton.NoButton, none, Qt.ScrollPhase.NoScrollPhase, False)
        QApplication.sendEvent(bar.level, QWheelEvent(middle, middle, *turn))
        assert bar.level.value() == level


def test_showing_a_level_does_not_choose_it(bar, qtbot):
    with qtbot.assertNotEmitted(bar.level_chosen):
        bar.set_level(-12.0)
    assert bar.level.value() == -120


def test_health_has_a_unit_with_every_number(bar):
    bar.set_health(WELL, 4)
    shown = [bar.engine.text(), bar.asleep.text(), bar.xruns.text(), bar.lost.text(), bar.latency.text()]
    assert shown == ["11 %", "3 of 4 tiles", "0", "0", "3.3 + 10.7 ms"]
    for part in ("3.30 ms", "0.60 ms", "10.70 ms"):
        assert part in bar.latency.toolTip()


def test_an_engine_that_is_off_has_no_figures(bar):
    bar.set_health(Health(False, 0.0, 0.0, 0, 0, 0.0, 0.0, 0.0, 0.0, 0, 0.0, 0), 4)
    assert bar.engine.text() == "off"
    assert bar.latency.text() == "–"


def test_a_new_loss_is_an_alarm_and_an_old_one_is_not(bar, monkeypatch):
    now = 100.0
    monkeypatch.setattr("underfoot.widgets.main_bar.time.perf_counter", lambda: now)
    bar.xruns.show_count(2)
    assert bar.xruns.is_alarm
    now = 111.0
    bar.xruns.show_count(2)
    assert not bar.xruns.is_alarm
    bar.xruns.show_count(3)
    assert bar.xruns.is_alarm


def test_the_meter_rises_at_once_and_falls_slowly(bar):
    bar.level.show_peak(0.5)
    risen = bar.level.peak_db
    bar.level.show_peak(0.0)
    assert risen == pytest.approx(-6.02, abs=0.01)
    assert risen - 2.0 < bar.level.peak_db < risen
    for _ in range(100):
        bar.level.show_peak(0.0)
    assert bar.level.peak_db < -60.0


def test_flags_are_seen_only_where_there_are_any(bar, qtbot):
    assert not bar.warnings.isVisible()
    bar.set_warnings("Monitor", [])
    bar.set_warnings("Calibrate", [f"t{i} is too old" for i in range(12)])
    assert bar.warnings.isVisible()
    assert bar.warnings.toolTip().splitlines()[1::8] == ["t0 is too old", "and 4 more"]
    with qtbot.waitSignal(bar.warnings_clicked) as clicked:
        qtbot.mouseClick(bar.warnings, Qt.MouseButton.LeftButton)
    assert clicked.args == ["Calibrate"]
    bar.set_warnings("Calibrate", [])
    assert not bar.warnings.isVisible()


def test_recording_and_playing_are_seen(bar):
    bar.set_recording("Recording to a file")
    assert bar.record.isChecked()
    assert bar.record.toolTip() == "Recording to a file"
    bar.set_recording("")
    assert not bar.record.isChecked()
    bar.set_playing(True)
    assert bar.play.property("role") == "primary"
    bar.set_playing(False)
    assert bar.play.property("role") == ""


def test_nothing_overlaps_at_the_smallest_width(bar, qtbot):
    bar.resize(1280, 48)
    qtbot.waitExposed(bar)
    bar.set_health(WELL, 196)
    bar.set_target("Simulated floor  14 × 14")
    bar.set_warnings("Calibrate", ["too old"])
    places = [w.geometry() for w in bar.children() if hasattr(w, "isVisible") and w.isVisible()]
    assert not [pair for pair in itertools.combinations(places, 2) if pair[0].intersects(pair[1])]
    assert all(bar.rect().contains(place) for place in places)


def test_the_latency_says_whether_it_was_measured(bar):
    bar.set_health(WELL, 4)
    assert "estimated, by the device's clock" in bar.latency.toolTip()
    bar.set_health(replace(WELL, stream_latency_s=0.0107, round_trip_s=0.0214), 4)
    assert "measured, of a round trip of 21.40 ms" in bar.latency.toolTip()
    assert "by the device's clock" not in bar.latency.toolTip()
    bar.set_health(replace(WELL, stream_latency_s=0.0107, round_trip_s=0.0214, clock_trip_s=0.0212), 4)
    assert "measured, of a round trip of 21.40 ms, 21.20 ms by the device's clock" in bar.latency.toolTip()


def test_in_a_narrow_bar_what_was_lost_is_shown_before_all_else(bar):
    bar.set_health(WELL, 4)
    bar.setFixedWidth(760)
    for number in range(4, 8):
        bar.add_workspace(f"Another workspace {number}", f"Ctrl+{number}", "scenes")
    assert not bar.xruns.isVisible()
    bar.set_health(replace(WELL, xruns=2), 4)
    assert bar.xruns.isVisible()
    assert bar.xruns.text() == "2"
    bar.set_health(replace(WELL, xruns=2, lost=3), 4)
    bar.set_health(WELL, 4)  # of another session
    assert not bar.xruns.isVisible()


def test_a_target_is_not_cut_off_where_there_is_room(qtbot):
    bar = MainBar(QMenu())
    qtbot.addWidget(bar)
    bar.setFixedWidth(1600)
    show(qtbot, bar)
    for text in ("Simulated floor  12 × 12", "Replay  walk of participant 12.csv"):
        bar.set_target(text)
        bar.layout().activate()
        assert bar.target.width() >= bar.target.fontMetrics().horizontalAdvance(text) + 29


@pytest.mark.parametrize(("wide", "named"), [(1440, 6), (1100, 1), (1024, 0), (984, 0)])
def test_with_six_workspaces_a_narrow_bar_has_pictures_for_tabs_and_all_that_matters(qtbot, wide, named):
    bar = MainBar(QMenu())
    qtbot.addWidget(bar)
    for declared in discover():
        bar.add_workspace(declared.name, declared.key, declared.icon)
    bar.set_workspace("Recordings")
    bar.set_target("Simulated floor  2 × 2")
    bar.set_health(WELL, 4)
    bar.setFixedWidth(wide)
    show(qtbot, bar)
    tabs = list(bar.tabs.values())
    assert sum(bool(tab.text()) for tab in tabs) == named
    assert all(tab.text() or not tab.icon().isNull() for tab in tabs)
    assert bar.tabs["Recordings"].isChecked()
    assert bar.tabs["Recordings"].toolTip() == "Recordings (Ctrl+5)"
    assert all(figure.isVisible() for figure in (bar.engine, bar.latency, bar.xruns, bar.lost))
    if wide >= 1024:
        words = bar.target.fontMetrics().horizontalAdvance("Simulated floor  2 × 2")
        assert bar.target.width() >= words + 29, (
            "beside the words there is room for the padding of a button with a menu"
        )
