"""The window with a real session on the simulator; and what it keeps on disk."""

import gc
import multiprocessing

import pytest
from on_screen import show
from PySide6.QtCore import QCoreApplication, QEvent, Qt
from PySide6.QtGui import QImage
from PySide6.QtWidgets import QApplication, QDialog, QFileDialog, QLabel, QLineEdit, QMessageBox, QPushButton
from windows import LONG_MS, dialog_of, hiss, quiet_window

from underfoot.calibration.procedures.procedure import Result
from underfoot.engine.commands import TileEqualiser
from underfoot.engine.target import Target
from underfoot.floor.layout import default_floor
from underfoot.floor.profile import Profile, Response
from underfoot.nodes import REGISTRY
from underfoot.patch.patch import Patch
from underfoot.widgets import pictures
from underfoot.widgets.dialogs.audio_dialog import AudioDialog
from underfoot.widgets.dialogs.shortcuts import ShortcutsDialog
from underfoot.widgets.garbage import spare
from underfoot.widgets.session import bridge
from underfoot.widgets.session.settings import LOW_LEVEL_DB, Autosave, Settings
from underfoot.widgets.window import CALIBRATE, MONITOR, MainWindow


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    """A folder with a patch to open and room for what the window keeps."""
    folder = tmp_path_factory.mktemp("window")
    hiss().save(folder / "hiss.json")
    return folder


@pytest.fixture(scope="module")
def playing(qapp, place, until):
    """A window whose session plays on the simulated floor."""
    window = MainWindow(place / "kept", Target(default_floor()), place / "hiss.json")
    window.resize(1280, 800)
    window.show()
    window.start()
    window.document.keep()
    until(lambda: _runs(window), "the engine runs", seconds=LONG_MS / 1000)
    assert bridge._kernels_loaded.wait(LONG_MS / 1000)
    yield window
    window.leave()
    window.deleteLater()
    QCoreApplication.sendPostedEvents(None, QEvent.Type.DeferredDelete)


@pytest.fixture
def window(playing, place, qtbot):
    """The same window as it was at first: playing, its own patch open and saved, Design on the screen."""
    show(qtbot, playing)
    yield playing
    for dialog in playing.findChildren(QDialog):
        dialog.close()
    QCoreApplication.sendPostedEvents(None, QEvent.Type.DeferredDelete)
    playing.document.read(place / "hiss.json")
    playing.show_workspace(0)
    playing.player.play()


def _runs(window):
    QCoreApplication.processEvents()
    return "Plays on" in window._where.text()


# --- playing ---


def test_the_simulator_plays_at_once_at_a_low_level(window, qtbot):
    session = window.player.session
    assert session.playing
    assert session.level_db == LOW_LEVEL_DB
    qtbot.waitUntil(lambda: session.health.peak > 0.0, timeout=LONG_MS)
    qtbot.waitUntil(lambda: window.transport._engine.text().endswith(" %"), timeout=LONG_MS)
    assert window.transport.target.text() == "Simulated floor  2 × 2"


def test_workspaces_change_by_key_and_only_what_is_seen_is_read(window, qtbot):
    qtbot.keyClick(window, Qt.Key.Key_2, Qt.KeyboardModifier.ControlModifier)
    assert window.workspace == MONITOR
    assert window.monitor.isVisible()
    with qtbot.waitSignal(window.bridge.vibrated, timeout=LONG_MS):
        pass
    qtbot.keyClick(window, Qt.Key.Key_1, Qt.KeyboardModifier.ControlModifier)
    assert window.workspace == 0
    assert not window.bridge.wants_vibration


def test_space_stops_and_plays_unless_text_is_edited(window, qtbot):
    window.show_workspace(MONITOR)
    qtbot.keyClick(window.monitor.map, Qt.Key.Key_Space)
    assert not window.player.session.playing
    qtbot.keyClick(window.monitor.table, Qt.Key.Key_Space)
    assert window.player.session.playing
    window.show_workspace(0)
    field = window.design.palette_panel.findChild(QLineEdit)
    field.setFocus()
    qtbot.keyClick(field, Qt.Key.Key_Space)
    assert field.text() == " "
    assert window.player.session.playing
    field.clear()


@pytest.mark.parametrize("workspace", [0, MONITOR, CALIBRATE])
def test_escape_is_panic_and_play_lets_sound_out_again(window, qtbot, workspace):
    window.show_workspace(workspace)
    session = window.player.session
    qtbot.keyClick(window.focusWidget() or window, Qt.Key.Key_Escape)
    assert session.panicked
    assert not window.player.playing
    assert "Panic" in window._message.fullText()
    qtbot.waitUntil(lambda: session.health.peak < 1e-6, timeout=LONG_MS)
    qtbot.mouseClick(window.transport.play, Qt.MouseButton.LeftButton)
    assert not session.panicked
    qtbot.waitUntil(lambda: session.health.peak > 1e-4, timeout=LONG_MS)


def test_the_level_goes_to_the_engine_and_is_remembered(window, qtbot):
    window.transport.level.setFocus()
    qtbot.keyClick(window.transport.level, Qt.Key.Key_PageUp)
    assert window.player.session.level_db == LOW_LEVEL_DB + 3.0 == window.settings.level_db
    qtbot.keyClick(window.transport.level, Qt.Key.Key_PageDown)


def test_a_step_on_the_simulator_is_in_the_table(window, qtbot):
    window.show_workspace(MONITOR)
    qtbot.waitUntil(lambda: window.monitor.table.steps.rowCount() >= 2, timeout=LONG_MS)


def test_recording_is_a_click_and_ends_with_one(window, qtbot, tmp_path, monkeypatch):
    monkeypatch.setattr("underfoot.widgets.session.player.platformdirs.user_documents_dir", lambda: str(tmp_path))
    qtbot.mouseClick(window.transport.record, Qt.MouseButton.LeftButton)
    path = window.player.session.recording
    assert path.parent == tmp_path / "Underfoot"
    assert window.transport.record.isChecked()
    qtbot.waitUntil(lambda: path.exists() and path.stat().st_size > 0, timeout=LONG_MS)
    qtbot.mouseClick(window.transport.record, Qt.MouseButton.LeftButton)
    assert window.player.session.recording is None
    assert str(path) in window._message.fullText()
    qtbot.waitUntil(
        lambda: not any("recorder" in child.name for child in multiprocessing.active_children()), timeout=LONG_MS
    )


def test_a_preview_comes_for_what_is_selected(window, qtbot):
    with qtbot.waitSignal(window.bridge.previewed, timeout=LONG_MS) as came:
        window.design.canvas.patch_scene.select(["noise"])
    assert not came.args[0].error


# --- the patch ---


def test_an_edit_is_played_and_leaves_an_unsaved_mark(window, qtbot):
    assert window.windowTitle() == "Hiss[*] – Underfoot"
    assert not window.isWindowModified()
    window.design.document.edit(window.design.patch().set("noise", "amplitude", 2.0, REGISTRY), "Set amplitude")
    assert window.isWindowModified()
    assert window.player.session.patch.node("noise").parameters["amplitude"] == 2.0
    window.design.document.stack.undo()
    assert not window.isWindowModified()


def test_save_writes_the_file_and_takes_the_mark_away(window, qtbot, place):
    window.design.document.edit(window.design.patch().set("noise", "low", 80.0, REGISTRY), "Set low")
    qtbot.keyClick(window, Qt.Key.Key_S, Qt.KeyboardModifier.ControlModifier)
    assert Patch.load(place / "hiss.json", REGISTRY).node("noise").parameters["low"] == 80.0
    assert not window.isWindowModified()
    hiss().save(place / "hiss.json")


def test_save_as_asks_for_a_file(window, qtbot, tmp_path):
    window.action("save as").trigger()
    dialog = dialog_of(window, QFileDialog)
    dialog.setDirectory(str(tmp_path))
    dialog.selectFile("other.json")
    dialog.accept()
    assert Patch.load(tmp_path / "other.json", REGISTRY).title == "Hiss"
    assert window.settings.recent[0] == str(tmp_path / "other.json")


def test_unsaved_work_is_asked_about_before_another_patch(window, qtbot):
    edited = window.design.patch().set("noise", "amplitude", 3.0, REGISTRY)
    for answer, title in ((QMessageBox.StandardButton.Cancel, "Hiss"), (QMessageBox.StandardButton.Discard, "")):
        window.design.document.edit(edited, "Set amplitude")
        window.action("new").trigger()
        question = dialog_of(window, QMessageBox)
        qtbot.mouseClick(question.button(answer), Qt.MouseButton.LeftButton)
        assert window.design.patch().title == title
    assert window.player.session.patch == Patch()


def test_a_file_that_cannot_be_opened_is_said_in_one_line(window, tmp_path):
    bad = tmp_path / "bad.json"
    bad.write_text('{"format": "underfoot-patch", "version": 99}')
    window.document.open(bad)
    assert "version is 99" in window._message.fullText()
    assert window.design.patch().title == "Hiss"


def test_presets_open_as_a_copy(window):
    menu = next(a.menu() for a in window.transport.menu.menu().actions() if a.text() == "Presets")
    menu.actions()[0].trigger()
    assert window.document.path is None
    assert window.document.is_saved
    assert window.design.patch().nodes


def test_pictures_are_taken_of_every_workspace(window, qtbot, tmp_path, monkeypatch):
    monkeypatch.setattr(pictures, "PLAY_S", 0.0)
    monkeypatch.setattr(pictures, "SETTLE_MS", 50)
    (tmp_path / "shots").mkdir()
    photographer = pictures.Photographer(window, tmp_path / "shots")
    with qtbot.waitSignal(photographer.done, timeout=LONG_MS):
        photographer.start()
    sizes = {path.name: QImage(str(path)).size().toTuple() for path in (tmp_path / "shots").iterdir()}
    assert sizes == {
        f"{name}-{width}x{height}.png": (width, height)
        for name in ("design", "monitor", "calibrate")
        for width, height in ((1280, 800), (1920, 1080))
    }


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
    return Result("response", "Response", (), "", True, apply=lambda profile: profile.with_part(part))


def test_a_profile_that_is_saved_is_in_the_engine_at_once_and_flagged_where_it_is_old(window, qtbot, monkeypatch):
    session, sent = window.player.session, []
    send = session.send
    monkeypatch.setattr(session, "send", lambda command: (sent.append(command), send(command)))
    window.show_workspace(CALIBRATE)
    qtbot.mouseClick(window.calibrate.choice.cards["response"], Qt.MouseButton.LeftButton)
    window.calibrate.profiles.save("t2", _with_response(31.0))
    qtbot.waitUntil(lambda: bool(sent), timeout=LONG_MS)
    assert sent == [TileEqualiser("t2", 31.0, ((0.5, 0.0, 0.0, 1.0, 0.0, 0.0),))]
    assert window.player.session is session
    assert Profile.load(f"{window.player.target.profiles}/t2.json").acceleration_per_unit == 31.0
    assert window.transport.flags.isVisible()
    assert "days old" in window.transport.flags.toolTip()
    window.show_workspace(0)
    qtbot.mouseClick(window.transport.flags, Qt.MouseButton.LeftButton)
    assert window.workspace == CALIBRATE


def test_the_target_is_let_go_for_a_calibration_and_opened_again(qtbot, tmp_path, place):
    window = quiet_window(qtbot, tmp_path, place / "hiss.json")
    with qtbot.waitSignal(window.player.retargeted, timeout=LONG_MS):
        window.start()
    with qtbot.waitSignal(window.player.released, timeout=LONG_MS):
        window.player.release()
    assert window.player.session is None
    with qtbot.waitSignal(window.player.retargeted, timeout=LONG_MS):
        window.player.reopen()
    assert window.player.session.patch == window.design.patch()


def test_a_session_that_is_being_opened_is_let_go_too(qtbot, tmp_path, place):
    window = quiet_window(qtbot, tmp_path, place / "hiss.json")
    with qtbot.waitSignal(window.player.released, timeout=LONG_MS):
        window.start()
        window.player.release()
    assert window.player.session is None


def test_a_profile_that_cannot_be_used_does_not_keep_the_session_from_playing(qtbot, tmp_path, place):
    window = quiet_window(qtbot, tmp_path, place / "hiss.json")
    folder = window.calibrate.profiles.folder
    folder.mkdir(parents=True)
    (folder / "t1.json").write_text("{}")
    window.player.set_target(window.player.target)
    with qtbot.waitSignals([window.player.said, window.player.retargeted], timeout=LONG_MS):
        window.start()
    assert window.player.target.profiles == ""
    assert window.player.session is not None


# --- dialogs, targets ---


def test_shortcuts_are_listed(window, qtbot):
    qtbot.keyClick(window, Qt.Key.Key_F1)
    texts = [label.text() for label in dialog_of(window, ShortcutsDialog).findChildren(QLabel)]
    for words in ("Save", "Play or stop", "Undo", "Panic: silence at once"):
        assert words in texts


def test_the_audio_dialog_pulses_one_tile(window, qtbot):
    window.document.new()
    window.show_workspace(MONITOR)
    quiet = window.player.session.health
    qtbot.waitUntil(lambda: window.player.session.health.peak < 1e-6 < quiet.peak, timeout=LONG_MS)
    qtbot.mouseClick(window.transport.audio, Qt.MouseButton.LeftButton)
    dialog = dialog_of(window, AudioDialog)
    qtbot.waitUntil(lambda: dialog._devices is not None, timeout=LONG_MS)
    assert dialog.values() == (None, 48_000, 128)
    shaken = set()
    window.bridge.vibrated.connect(lambda first, samples: shaken.update(map(int, samples.any(axis=0).nonzero()[0])))
    qtbot.mouseClick(next(b for b in dialog.findChildren(QPushButton) if b.text() == "t3"), Qt.MouseButton.LeftButton)
    qtbot.waitUntil(lambda: bool(shaken), timeout=LONG_MS)
    assert shaken == {2}


# --- what is kept ---


def test_unsaved_work_survives_a_crash_and_not_a_clean_close(qtbot, tmp_path):
    hiss().save(tmp_path / "hiss.json")
    first = quiet_window(qtbot, tmp_path, tmp_path / "hiss.json")
    edited = hiss().set("noise", "amplitude", 4.0, REGISTRY)
    first.design.document.edit(edited, "Set amplitude")
    kept = tmp_path / "unsaved" / "work-0.json"
    qtbot.waitUntil(kept.exists, timeout=10_000)
    # As the system would after a crash: the lock is free, the work is still there.
    first.document._autosave._lock.unlock()
    second = quiet_window(qtbot, tmp_path)
    assert second.design.patch() == edited
    assert second.document.path == tmp_path / "hiss.json"
    assert second.isWindowModified()
    assert "did not close by itself" in second._message.fullText()
    second.document.save()
    second.close()
    assert not second.isVisible()
    assert not kept.exists()


def test_a_window_that_is_told_to_leave_keeps_unsaved_work(qtbot, tmp_path):
    first = quiet_window(qtbot, tmp_path)
    first.design.document.edit(hiss("Left behind"), "All")
    first.leave()
    assert quiet_window(qtbot, tmp_path).design.patch().title == "Left behind"


def test_keys_come_back_to_the_window_when_a_question_is_answered(qtbot, tmp_path):
    window = quiet_window(qtbot, tmp_path)
    window.design.document.edit(hiss(), "All")
    window.close()
    question = dialog_of(window, QMessageBox)
    qtbot.waitUntil(question.isActiveWindow)
    qtbot.keyClick(question, Qt.Key.Key_Escape)
    qtbot.waitUntil(window.isActiveWindow)


def test_what_is_loaded_is_not_looked_through_for_garbage(qtbot, tmp_path):
    window = quiet_window(qtbot, tmp_path)
    before = gc.get_freeze_count()
    spare(window)
    try:
        frozen = gc.get_freeze_count()
        assert frozen > before
        kept = [[] for _ in range(100)]
        window.calibrate.wizard.ready.emit()
        assert gc.get_freeze_count() >= frozen + len(kept)
    finally:
        gc.unfreeze()


def test_closing_asks_about_unsaved_work(qtbot, tmp_path):
    window = quiet_window(qtbot, tmp_path)
    window.design.document.edit(hiss(), "All")
    window.close()
    assert window.isVisible()
    question = dialog_of(window, QMessageBox)
    qtbot.mouseClick(question.button(QMessageBox.StandardButton.Discard), Qt.MouseButton.LeftButton)
    assert not window.isVisible()
    assert Settings.load(tmp_path).window_bytes


def test_two_windows_keep_their_work_apart(tmp_path):
    one, two = Autosave(tmp_path), Autosave(tmp_path)
    one.keep(hiss("One"), None)
    two.keep(hiss("Two"), tmp_path / "two.json")
    assert one.rescue(REGISTRY).patch.title == "One"
    assert two.rescue(REGISTRY).path == tmp_path / "two.json"
    two.close()
    three = Autosave(tmp_path)
    assert three.rescue(REGISTRY).patch.title == "Two"
    three.put_aside()
    assert three.rescue(REGISTRY) is None
    four = Autosave(tmp_path)
    assert four.rescue(REGISTRY).patch.title == "Two"


@pytest.mark.parametrize(
    "text", ["", "{", '{"level_db": "loud"}', "\udcff".encode(errors="surrogateescape").decode("latin-1")]
)
def test_settings_that_cannot_be_read_are_the_first_ones(tmp_path, text):
    (tmp_path / "settings.json").write_text(text)
    assert Settings.load(tmp_path) == Settings()


def test_a_window_leaves_no_process_behind(qtbot, tmp_path):
    window = MainWindow(tmp_path, Target(default_floor()), None)
    before = set(multiprocessing.active_children())
    window.show()
    window.start()
    window.leave()
    assert set(multiprocessing.active_children()) <= before
    assert window not in [w for w in QApplication.topLevelWidgets() if w.isVisible()]
