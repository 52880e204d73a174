"""The window with a real session on the simulator."""

import gc
import multiprocessing
import threading
from functools import partial

import pytest
from live import LONG_BLOCK
from on_screen import show
from PySide6.QtCore import QPoint, Qt
from PySide6.QtGui import QImage, QTextDocument
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QInputDialog, QLabel, QLineEdit, QMenu, QMessageBox, QPushButton
from windows import (
    LONG_MS,
    VibrationRecorder,
    calibrate,
    choose_file,
    delete_widgets,
    design,
    dialog_of,
    end_window,
    monitor,
    noise_patch,
    quiet_window,
)

from underfoot.calibration.result import Result
from underfoot.engine.commands import TileEqualiser
from underfoot.engine.reports import SensorFaults
from underfoot.engine.target import Target
from underfoot.floor.layout import default_floor
from underfoot.floor.profile import Profile, Response
from underfoot.nodes import REGISTRY
from underfoot.patch.patch import Patch
from underfoot.widgets.dialogs.about import AboutDialog
from underfoot.widgets.dialogs.audio_dialog import AudioDialog
from underfoot.widgets.dialogs.shortcuts import ShortcutsDialog
from underfoot.widgets.garbage_collection import freeze_loaded
from underfoot.widgets.recordings.recording_follower import RecordingFollower
from underfoot.widgets.screenshots import SIZES, ScreenshotTaker, WaitTimes
from underfoot.widgets.session.settings import LOW_LEVEL_DB
from underfoot.widgets.window import MainWindow

# --- playing ---


def test_the_simulator_plays_at_once_at_a_low_level(window, qtbot):
    session = window.controller.session
    assert session.playing
    assert session.level_db == LOW_LEVEL_DB
    qtbot.waitUntil(lambda: session.health.peak > 0.0, timeout=LONG_MS)
    qtbot.waitUntil(lambda: window.main_bar.engine.text().endswith(" %"), timeout=LONG_MS)
    assert window.main_bar.target.text() == "Simulated floor  2 × 2"


def test_workspaces_change_by_key_and_only_what_is_seen_is_read(window, qtbot):
    qtbot.keyClick(window, Qt.Key.Key_2, Qt.KeyboardModifier.ControlModifier)
    assert window.workspaces.chosen == "Monitor"
    assert monitor(window).isVisible()
    with qtbot.waitSignal(window.bridge.vibration_read, timeout=LONG_MS):
        pass
    qtbot.keyClick(window, Qt.Key.Key_1, Qt.KeyboardModifier.ControlModifier)
    assert window.workspaces.chosen == "Design"
    assert not window.bridge.wants_vibration


def test_space_stops_and_plays_unless_text_is_edited(window, qtbot):
    window.workspaces.choose("Monitor")
    qtbot.keyClick(monitor(window).map, Qt.Key.Key_Space)
    assert not window.controller.session.playing
    qtbot.keyClick(monitor(window).steps.table, Qt.Key.Key_Space)
    assert window.controller.session.playing
    for state in (False, True):
        button = window.main_bar.play if state else window.main_bar.stop
        button.setFocus()
        qtbot.keyClick(button, Qt.Key.Key_Return)
        assert window.controller.session.playing == state, "Return presses the button with the focus"
    window.workspaces.choose("Design")
    field = design(window).node_palette.findChild(QLineEdit)
    field.setFocus()
    qtbot.keyClick(field, Qt.Key.Key_Space)
    assert field.text() == " "
    assert window.controller.session.playing
    field.clear()


@pytest.mark.parametrize("workspace", ["Design", "Monitor", "Calibrate"])
def test_escape_is_panic_and_play_lets_sound_out_again(window, qtbot, workspace):
    window.workspaces.choose(workspace)
    session, vibration = window.controller.session, VibrationRecorder(window)
    qtbot.waitUntil(lambda: vibration.any(), timeout=LONG_MS)
    qtbot.keyClick(window.focusWidget() or window, Qt.Key.Key_Escape)
    assert session.memory.status.panic
    assert not window.controller.is_playing
    assert "Panic" in window.status.message
    qtbot.waitUntil(lambda: not vibration.any(), timeout=LONG_MS)
    qtbot.mouseClick(window.main_bar.play, Qt.MouseButton.LeftButton)
    assert not session.memory.status.panic
    qtbot.waitUntil(lambda: vibration.any(), timeout=LONG_MS)


def test_escape_closes_what_is_open_and_is_panic_when_nothing_is(window, qtbot):
    session, canvas = window.controller.session, design(window).canvas
    canvas.setFocus()
    qtbot.keyClick(canvas, Qt.Key.Key_Slash)
    qtbot.keyClick(window.focusWidget(), Qt.Key.Key_Escape)
    assert not canvas.search.isVisible()
    canvas.patch_scene.select(["noise"])
    qtbot.keyClick(canvas, Qt.Key.Key_F2)
    qtbot.keyClick(window.focusWidget(), Qt.Key.Key_Escape)
    assert not canvas.inline.isVisible()
    place = canvas.mapFromScene(canvas.patch_scene.nodes["noise"].port_place("out", "out"))
    qtbot.mousePress(canvas.viewport(), Qt.MouseButton.LeftButton, pos=place)
    qtbot.keyClick(canvas, Qt.Key.Key_Escape)
    qtbot.mouseRelease(canvas.viewport(), Qt.MouseButton.LeftButton, pos=place)
    assert not session.memory.status.panic
    qtbot.keyClick(canvas, Qt.Key.Key_Escape)
    assert session.memory.status.panic


@pytest.mark.parametrize("over", ["nothing", "a list", "a name", "a dialog"])
def test_a_key_of_its_own_is_panic_whatever_is_open(window, qtbot, over):
    canvas = design(window).canvas
    opens = {"a list": Qt.Key.Key_Slash, "a name": Qt.Key.Key_F2, "a dialog": Qt.Key.Key_F1}
    for key, modifiers in (
        (Qt.Key.Key_F12, Qt.KeyboardModifier.NoModifier),
        (Qt.Key.Key_Escape, Qt.KeyboardModifier.ShiftModifier),
        (Qt.Key.Key_Period, Qt.KeyboardModifier.ControlModifier),
    ):
        window.controller.play()
        assert not window.controller.session.memory.status.panic
        show(qtbot, window)
        canvas.setFocus()
        canvas.patch_scene.select(["noise"])
        if over in opens:
            qtbot.keyClick(canvas, opens[over])
        target = dialog_of(window, ShortcutsDialog) if over == "a dialog" else window.focusWidget()
        qtbot.keyClick(target, key, modifiers)
        assert window.controller.session.memory.status.panic, key
        assert not window.controller.is_playing, key
        canvas.inline.finish(commit=False)
        for dialog in window.findChildren(ShortcutsDialog):
            dialog.close()


def test_space_plays_and_stops_on_the_canvas_too_unless_it_moves_the_view(window, qtbot):
    canvas = design(window).canvas
    canvas.setFocus()
    qtbot.keyClick(canvas, Qt.Key.Key_Space)
    assert not window.controller.is_playing
    qtbot.keyPress(canvas, Qt.Key.Key_Space)
    qtbot.mousePress(canvas.viewport(), Qt.MouseButton.LeftButton, pos=QPoint(300, 40))
    qtbot.mouseRelease(canvas.viewport(), Qt.MouseButton.LeftButton, pos=QPoint(300, 40))
    qtbot.keyRelease(canvas, Qt.Key.Key_Space)
    assert not window.controller.is_playing
    qtbot.keyClick(canvas, Qt.Key.Key_Space)
    assert window.controller.is_playing


def test_the_level_goes_to_the_engine_and_is_remembered(window, qtbot):
    window.main_bar.level.setFocus()
    qtbot.keyClick(window.main_bar.level, Qt.Key.Key_PageUp)
    assert window.controller.session.level_db == LOW_LEVEL_DB + 3.0 == window.settings.level_db
    qtbot.keyClick(window.main_bar.level, Qt.Key.Key_PageDown)


def test_a_step_on_the_simulator_is_in_the_table(window, qtbot):
    window.workspaces.choose("Monitor")
    qtbot.waitUntil(lambda: monitor(window).steps.table.steps.rowCount() >= 2, timeout=LONG_MS)


def test_faulty_sensors_of_the_session_are_on_the_map_of_monitor(window):
    for faults, said in (({("t1", 3): "sensor 3 is loose"}, True), ({}, False)):
        window.bridge.reported.emit([SensorFaults(faults)])
        assert ("t1: sensor 3 is loose." in window.workspaces["Monitor"].map.accessibleDescription()) == said


def test_recording_is_a_click_and_ends_with_one(window, qtbot, tmp_path, monkeypatch):
    monkeypatch.setattr("platformdirs.user_documents_dir", lambda: str(tmp_path))
    qtbot.mouseClick(window.main_bar.record, Qt.MouseButton.LeftButton)
    path = window.controller.session.recording
    assert path.parent == tmp_path / "Underfoot"
    assert window.main_bar.record.isChecked()
    qtbot.waitUntil(lambda: path.exists() and path.stat().st_size > 0, timeout=LONG_MS)
    qtbot.mouseClick(window.main_bar.record, Qt.MouseButton.LeftButton)
    assert window.controller.session.recording is None
    recording = window.controller.recording
    qtbot.waitUntil(lambda: recording.begun == path, timeout=LONG_MS)  # though it may have ended before it was there
    recording.begun = None  # no later test is to open it
    assert str(path) in window.status.message
    qtbot.waitUntil(
        lambda: not any("recorder" in child.name for child in multiprocessing.active_children()), timeout=LONG_MS
    )
    qtbot.waitUntil(lambda: all(thread.name != "recordings" for thread in threading.enumerate()), timeout=LONG_MS)


def test_a_preview_comes_for_what_is_selected(window, qtbot):
    with qtbot.waitSignal(window.controller.previews.preview_computed, timeout=LONG_MS) as came:
        design(window).canvas.patch_scene.select(["noise"])
    assert not came.args[0].error


def test_distributions_come_though_other_previews_were_asked_for_after_them(window, qtbot):
    """They take longer than the small plots that are asked for meanwhile."""
    workspace = design(window)
    made = Patch()
    for type in ("stick-slip", "noise", "texture"):
        made = made.add(type, REGISTRY, (0.0, 200.0 * len(made.nodes)))
    workspace.document.edit(made, "Another patch")
    workspace.canvas.patch_scene.select([made.nodes[0].id])
    qtbot.waitUntil(workspace.preview.distributions.isVisible, timeout=LONG_MS)
    workspace.preview.distributions.click()
    view = workspace.preview.distribution_view
    assert view.text.isVisible()
    assert view.text.text() == "being made…"
    qtbot.waitUntil(view.plots[0].isVisible, timeout=LONG_MS)
    assert view.plots[0].drawing.series


# --- the patch ---


def test_an_edit_is_played_and_leaves_an_unsaved_mark(window, qtbot):
    assert window.windowTitle() == "Hiss[*] – Underfoot"
    assert not window.isWindowModified()
    design(window).document.edit(design(window).patch().set("noise", "amplitude", 2.0, REGISTRY), "Set amplitude")
    assert window.isWindowModified()
    assert window.controller.session.patch.node("noise").parameters["amplitude"] == 2.0
    design(window).document.stack.undo()
    assert not window.isWindowModified()


def test_save_writes_the_file_and_takes_the_mark_away(window, qtbot, patch_folder):
    design(window).document.edit(design(window).patch().set("noise", "low", 80.0, REGISTRY), "Set low")
    qtbot.keyClick(window, Qt.Key.Key_S, Qt.KeyboardModifier.ControlModifier)
    assert Patch.load(patch_folder / "hiss.json", REGISTRY).node("noise").parameters["low"] == 80.0
    assert not window.isWindowModified()
    noise_patch().save(patch_folder / "hiss.json")


def test_save_as_asks_for_a_file(window, qtbot, tmp_path):
    choose_file(window, tmp_path / "other.json", window.actions_by_name["save as"].trigger)
    assert Patch.load(tmp_path / "other.json", REGISTRY).title == "Hiss"
    assert window.settings.recent[0] == str(tmp_path / "other.json")


def test_a_recent_file_that_is_gone_is_said_to_be_and_leaves_the_list(window, tmp_path):
    noise_patch().save(tmp_path / "gone.json")
    assert window.open_patch.read(tmp_path / "gone.json")
    (tmp_path / "gone.json").unlink()
    window.menu.recent_chosen.emit(tmp_path / "gone.json")
    assert "no such file" in window.status.message
    assert str(tmp_path / "gone.json") not in window.settings.recent


def test_unsaved_work_is_asked_about_before_another_patch(window, qtbot):
    edited = design(window).patch().set("noise", "amplitude", 3.0, REGISTRY)
    for answer, title in ((QMessageBox.StandardButton.Cancel, "Hiss"), (QMessageBox.StandardButton.Discard, "")):
        design(window).document.edit(edited, "Set amplitude")
        window.actions_by_name["new"].trigger()
        question = dialog_of(window, QMessageBox)
        qtbot.mouseClick(question.button(answer), Qt.MouseButton.LeftButton)
        assert design(window).patch().title == title
    assert window.controller.session.patch == Patch()


def test_a_file_that_cannot_be_opened_is_said_in_one_line(window, tmp_path):
    bad = tmp_path / "bad.json"
    bad.write_text('{"format": "underfoot-patch", "version": 99}')
    window.open_patch.open(bad)
    assert "version is 99" in window.status.message
    assert design(window).patch().title == "Hiss"


def test_presets_open_as_a_copy(window):
    menu = next(menu for menu in window.findChildren(QMenu) if menu.title() == "Presets")
    menu.actions()[0].trigger()
    assert window.open_patch.path is None
    assert window.open_patch.is_saved
    assert design(window).patch().nodes


def test_pictures_are_taken_of_every_workspace(window, qtbot, tmp_path):
    shows = {name: partial(window.workspaces.choose, name) for name in window.workspaces.names}
    played_s = iter((0.0, 0.5, 1.0))
    taker = ScreenshotTaker(window, shows, lambda: next(played_s), tmp_path, WaitTimes(1.0, settle_ms=50, poll_ms=1))
    with qtbot.waitSignal(taker.finished, timeout=LONG_MS):
        taker.start()
    assert next(played_s, None) is None
    sizes = {path.name: QImage(str(path)).size().toTuple() for path in tmp_path.iterdir()}
    assert sizes == {f"{name.lower()}-{w}x{h}.png": (w, h) for name in window.workspaces.names for w, h in SIZES}


# --- calibration ---


def _with_response(level):
    """A result whose part plays a full-scale unit at `level` m/s^2."""
    part = Response(
        made="2020-03-04",
        frequencies_hz=(50.0, 750.0),
        magnitude=(level, level),
        acceleration_per_unit=level,
        equaliser=((0.5, 0.0, 0.0, 1.0, 0.0, 0.0),),
    )
    return Result("response", "Response", (), "", True, part=part)


def test_a_profile_that_is_saved_is_in_the_engine_at_once_and_flagged_where_it_is_old(window, qtbot, monkeypatch):
    session, sent = window.controller.session, []
    send = session.send
    monkeypatch.setattr(session, "send", lambda command: (sent.append(command), send(command)))
    window.workspaces.choose("Calibrate")
    qtbot.mouseClick(calibrate(window).choice.cards["response"], Qt.MouseButton.LeftButton)
    calibrate(window).profiles.save("t2", _with_response(31.0))
    qtbot.waitUntil(lambda: bool(sent), timeout=LONG_MS)
    saved = Profile.load(f"{window.controller.target.profiles}/t2.json").response
    assert sent == [TileEqualiser("t2", 31.0, saved.equaliser, calibration=saved.identity)]
    assert session.calibrations == {"t2": {"response": saved.identity}}
    assert window.controller.session is session
    assert (saved.acceleration_per_unit, saved.equaliser) == (31.0, ((0.5, 0.0, 0.0, 1.0, 0.0, 0.0),))
    assert window.main_bar.warnings.isVisible()
    assert "days ago" in window.main_bar.warnings.toolTip()
    window.workspaces.choose("Design")
    qtbot.mouseClick(window.main_bar.warnings, Qt.MouseButton.LeftButton)
    assert window.workspaces.chosen == "Calibrate"


# --- dialogs ---


def test_shortcuts_are_listed(window, qtbot):
    qtbot.keyClick(window, Qt.Key.Key_F1)
    texts = [label.text() for label in dialog_of(window, ShortcutsDialog).findChildren(QLabel)]
    for words in ("Save", "Play or stop", "Undo", "Panic: silence at once"):
        assert words in texts
    assert texts[texts.index("Save") + 1] == "Ctrl+S"
    assert "About Underfoot" not in texts, "which has no key"


def test_the_audio_dialog_pulses_one_tile(window, qtbot):
    vibration = VibrationRecorder(window)
    qtbot.waitUntil(lambda: vibration.any(), timeout=LONG_MS)
    design(window).document.edit(design(window).patch().set("noise", "amplitude", 0.0, REGISTRY), "Silence")
    qtbot.waitUntil(lambda: not vibration.any(), timeout=LONG_MS)
    qtbot.mouseClick(window.main_bar.audio, Qt.MouseButton.LeftButton)
    dialog = dialog_of(window, AudioDialog)
    qtbot.waitUntil(lambda: dialog.devices is not None, timeout=LONG_MS)
    assert dialog.values() == (None, 48_000, LONG_BLOCK, "")
    qtbot.mouseClick(next(b for b in dialog.findChildren(QPushButton) if b.text() == "t3"), Qt.MouseButton.LeftButton)
    qtbot.waitUntil(lambda: vibration.any(), timeout=LONG_MS)
    assert vibration.tiles() == ["t3"]


# --- the process ---


def test_what_is_loaded_is_exempt_from_garbage_collection(qtbot, tmp_path):
    window = quiet_window(qtbot, tmp_path)
    window.workspaces.choose("Calibrate")
    gc.unfreeze()  # a command that ran in this process has frozen what there was
    gc.collect()
    before = gc.get_freeze_count()
    freeze_loaded(window.workspaces.loaded)
    try:
        frozen = gc.get_freeze_count()
        assert frozen > before
        kept = [[] for _ in range(1000)]
        calibrate(window).wizard.ready.emit()
        assert gc.get_freeze_count() >= frozen + len(kept) // 2  # of what was frozen some has gone
    finally:
        gc.unfreeze()


def test_a_window_leaves_no_process_behind(qtbot, tmp_path):
    window = MainWindow(tmp_path, Target(default_floor()), None)
    before = set(multiprocessing.active_children())
    window.show()
    window.start()
    assert window.status.session == "Starting the engine…"  # until it says what it plays on
    window.leave()
    assert set(multiprocessing.active_children()) <= before
    assert window not in [w for w in QApplication.topLevelWidgets() if w.isVisible()]
    end_window(window)


@pytest.mark.parametrize("by", ["a person", "a signal"])
def test_what_cannot_be_kept_is_said_after_the_window_too(qtbot, tmp_path, capfd, by):
    """Whoever started it by an icon sees no standard error, and the window is gone."""
    made = MainWindow(tmp_path / "kept", Target(default_floor()))
    with qtbot.waitSignal(made.painted):
        show(qtbot, made)
    path = tmp_path / "kept" / "settings.json"
    path.unlink(missing_ok=True)
    path.mkdir(parents=True)  # the disk takes no settings there
    (made.close if by == "a person" else made.leave)()
    boxes = [box for box in QApplication.topLevelWidgets() if isinstance(box, QMessageBox) and box.isVisible()]
    assert str(path) in capfd.readouterr().err
    assert len(boxes) == (by == "a person")
    for box in boxes:
        assert str(path) in box.informativeText()
        QTest.keyClick(box, Qt.Key.Key_Return)
        assert not box.isVisible()
    made.deleteLater()
    delete_widgets()


def test_about_says_what_this_is_and_copies_it_for_a_report(window, qtbot):
    window.actions_by_name["about"].trigger()
    dialog = dialog_of(window, AboutDialog)
    copy = next(button for button in dialog.findChildren(QPushButton) if button.text().startswith("Copy"))
    qtbot.mouseClick(copy, Qt.MouseButton.LeftButton)
    text = QApplication.clipboard().text()
    assert text.startswith("Underfoot 0.")
    assert "numba" in text


def test_about_names_the_documentation_in_a_folder_whose_name_has_signs_of_rich_text(qtbot, tmp_path, monkeypatch):
    sources = tmp_path / "R&amp;D"
    (sources / "docs").mkdir(parents=True)
    (sources / "mkdocs.yml").touch()
    monkeypatch.setattr("underfoot.__file__", str(sources / "workbench" / "__init__.py"))
    dialog = AboutDialog(tmp_path)
    qtbot.addWidget(dialog)
    (label,) = (label for label in dialog.findChildren(QLabel) if label.text().startswith("Documentation"))
    shown = QTextDocument()
    shown.setHtml(label.text())
    assert shown.toPlainText() == f"Documentation: {sources / 'docs'}"


# --- last, for it closes the Recordings workspace ---


def test_marks_are_set_by_keys_while_it_records_and_stand_on_both_time_axes(window, qtbot, tmp_path, monkeypatch):
    control = Qt.KeyboardModifier.ControlModifier
    monkeypatch.setattr("underfoot.widgets.session.session_recording.documents_folder", lambda: tmp_path)
    notices = []
    window.controller.notified.connect(notices.append)
    window.controller.recording.record(True)
    path = window.controller.session.recording
    window.workspaces.choose("Monitor")
    qtbot.keyClick(monitor(window), Qt.Key.Key_M)
    qtbot.waitUntil(
        lambda: any(line.name == "mark" for line in monitor(window).force.plot.drawing.lines), timeout=LONG_MS
    )
    # The recording's own time begins with it.
    qtbot.waitUntil(lambda: any("s of the session, also in the recording" in line for line in notices))
    qtbot.waitUntil(lambda: path.stat().st_size > 0, timeout=LONG_MS)  # an empty file keeps its name before
    recordings = window.workspaces["Recordings"]
    late = RecordingFollower(recordings.reader, recordings)  # of a workspace that is made only now
    late.attach(window.controller.recording)
    with qtbot.waitSignal(late.to_show, timeout=LONG_MS) as shown:
        qtbot.waitUntil(lambda: window.controller.recording.begun is not None, timeout=LONG_MS)
        late.show_begun()
    assert shown.args == [path]
    window.open_file(path)
    qtbot.waitUntil(lambda: recordings.axis.content is not None, timeout=LONG_MS)
    qtbot.keyClick(window, Qt.Key.Key_M, control | Qt.KeyboardModifier.ShiftModifier)
    asked_s = window.controller.played_s
    dialog = dialog_of(window, QInputDialog)
    dialog.setTextValue("a dog barks")
    dialog.accept()
    qtbot.waitUntil(lambda: len(recordings.axis.content.opened.marks) == 2, timeout=LONG_MS)
    said = recordings.axis.content.opened.marks[1]
    assert said.text == "a dog barks"
    assert said.frame / 48_000.0 == pytest.approx(asked_s, abs=0.3)
    before_s = recordings.axis.length_s
    qtbot.waitUntil(lambda: recordings.axis.length_s > before_s, timeout=LONG_MS)
    surveyed = []
    recordings.surveyor.progressed.connect(surveyed.append)
    window.controller.recording.record(False)
    qtbot.waitUntil(lambda: bool(surveyed) or recordings.surveyor.is_busy, timeout=LONG_MS)
    window.workspaces.choose("Design")
    recordings.close_down()
    qtbot.waitUntil(
        lambda: not any("recorder" in child.name for child in multiprocessing.active_children()), timeout=LONG_MS
    )
    qtbot.waitUntil(lambda: all(thread.name != "recordings" for thread in threading.enumerate()), timeout=LONG_MS)
