"""A session that a study or a scene has is not changed under it, but afterwards."""

import pytest
from free_ports import free_port
from long_recording import write_recording
from on_screen import show
from PySide6.QtCore import QMimeData, QPoint, QPointF, Qt, QUrl
from PySide6.QtGui import QDragEnterEvent, QDropEvent
from PySide6.QtWidgets import QApplication, QMessageBox
from study_bench import SLOW_MS, Bench
from windows import dialog_of, quiet_window, wait_until_playing

from underfoot.engine.target import Target
from underfoot.floor.layout import default_floor
from underfoot.patch import preset_files
from underfoot.studies import floor_watch
from underfoot.widgets.window import MainWindow

LEFT = Qt.MouseButton.LeftButton


def drop(window, path):
    data = QMimeData()
    data.setUrls([QUrl.fromLocalFile(str(path))])
    copy, none = Qt.DropAction.CopyAction, Qt.KeyboardModifier.NoModifier
    QApplication.sendEvent(window, QDragEnterEvent(QPoint(50, 50), copy, data, LEFT, none))
    QApplication.sendEvent(window, QDropEvent(QPointF(50, 50), copy, data, LEFT, none))


@pytest.fixture
def window(qtbot, tmp_path, patch_folder):
    """A window of the test's own, for whose session another will be opened."""
    made = quiet_window(qtbot, tmp_path / "kept", patch_folder / "hiss.json")
    made.start()
    wait_until_playing(made)
    return made


def test_forces_that_are_dropped_wait_for_the_end_of_a_participants_session(window, qtbot, tmp_path, monkeypatch):
    """The study waited forever for a session that was closed."""
    monkeypatch.setattr(floor_watch, "SILENT_S", SLOW_MS / 1000.0)  # a busy machine may stall the engine for a second
    controller, session = window.controller, window.controller.session
    window.main_bar.tabs["Experiment"].click()
    bench = Bench(window, qtbot, tmp_path)
    bench.choose()
    bench.rate(1)
    drop(window, preset_files.walks()["corridor"])
    assert window.status.message == "The target changes when the study or the scene has ended."
    assert controller.session is session
    bench.rate(1)
    assert len(bench.entries()) == 2
    with qtbot.waitSignal(controller.opened):
        bench.workspace.running.leave()
    assert controller.session.target.kind == "replay"


def test_a_recording_that_ends_while_a_scene_plays_stays_until_the_scene_has_ended(window, qtbot, tmp_path):
    controller = window.controller
    for name in ("Recordings", "Scenes"):
        window.workspaces.choose(name)
    recordings, scenes = window.workspaces["Recordings"], window.workspaces["Scenes"]
    window.open_file(write_recording(tmp_path / "walk.underfoot", 1.0, default_floor(1, 2)))
    qtbot.waitUntil(lambda: recordings.axis.content is not None and recordings.axis.content.overview is not None)
    recordings.playback.looping.setChecked(True)
    with qtbot.waitSignal(controller.opened):
        qtbot.mouseClick(recordings.playback.button, LEFT)
    wait_until_playing(window)
    window.main_bar.tabs["Scenes"].click()
    qtbot.mouseClick(scenes.panel.start, LEFT)
    qtbot.waitUntil(lambda: scenes.stage is not None)
    stage = scenes.stage
    recordings.playback.looping.setChecked(False)
    qtbot.waitUntil(lambda: not recordings.playback.player.is_playing)
    assert scenes.stage is stage
    window.main_bar.tabs["Experiment"].click()
    start = window.workspaces["Experiment"].start
    start.participant.setText("P1")
    qtbot.mouseClick(start.begin_button, LEFT)  # which made an empty session
    assert window.status.message == "A study or a scene has the session; end that first."
    assert (start.begin_button.text(), start.begin_button.isEnabled()) == ("Begin", True)
    window.main_bar.tabs["Scenes"].click()
    assert controller.session is stage.session
    window.main_bar.tabs["Recordings"].click()
    qtbot.mouseClick(recordings.playback.button, LEFT)
    assert window.status.message == "A study, a scene or a calibration has the floor: end that first."
    window.main_bar.tabs["Scenes"].click()
    with qtbot.waitSignal(controller.opened):
        qtbot.mouseClick(scenes.panel.start, LEFT)
    assert controller.session.target.kind == "simulator"
    assert controller.session.patch.title == "Hiss"


def test_tiles_that_a_scene_has_are_not_calibrated_and_those_that_are_recorded_after_a_question(qtbot, tmp_path):
    """The session was closed for that, and with it what a study had it for, or a recording that was running."""
    target = Target(default_floor(1, 1), kind="udp", source=f"127.0.0.1:{free_port()}")
    window = MainWindow(tmp_path / "kept", target)
    qtbot.addWidget(window, before_close_func=lambda w: w.leave())
    show(qtbot, window)
    for name in ("Calibrate", "Scenes"):
        window.workspaces.choose(name)
    window.start()
    wait_until_playing(window)
    scenes, overview = window.workspaces["Scenes"], window.workspaces["Calibrate"].overview
    window.main_bar.tabs["Scenes"].click()
    qtbot.mouseClick(scenes.panel.start, LEFT)
    qtbot.waitUntil(lambda: scenes.stage is not None)
    window.main_bar.tabs["Calibrate"].click()
    qtbot.mouseClick(overview.begin, LEFT)
    assert window.status.message == "A study or a scene has the session; end that first."
    assert scenes.stage is not None
    assert window.controller.session is scenes.stage.session
    window.main_bar.tabs["Scenes"].click()
    qtbot.mouseClick(scenes.panel.start, LEFT)
    qtbot.waitUntil(lambda: scenes.stage is None)
    window.main_bar.tabs["Calibrate"].click()
    qtbot.mouseClick(window.main_bar.record, LEFT)
    qtbot.mouseClick(overview.begin, LEFT)
    question = dialog_of(window, QMessageBox)
    assert question.text() == "A recording is running. It ends, and is saved, before the tile is calibrated."
    qtbot.keyClick(question, Qt.Key.Key_Return)
    assert window.controller.recording.is_on
    qtbot.mouseClick(overview.begin, LEFT)
    with qtbot.waitSignal(window.controller.released):
        qtbot.mouseClick(dialog_of(window, QMessageBox).button(QMessageBox.StandardButton.Yes), LEFT)
    assert not window.controller.recording.is_on
