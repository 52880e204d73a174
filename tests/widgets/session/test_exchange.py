"""Import, and files that are dropped on the window."""

import shutil
from importlib import resources
from pathlib import Path

import foreign_files as made
import pytest
from PySide6.QtCore import QMimeData, QPoint, QPointF, Qt, QUrl
from PySide6.QtGui import QDragEnterEvent, QDropEvent
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QFileDialog, QLabel, QMessageBox
from windows import design, dialog_of, noise_patch, quiet_window

from underfoot.floor.layout import default_floor
from underfoot.nodes import REGISTRY
from underfoot.patch import preset_files
from underfoot.widgets.dialogs.export_dialog import ExportDialog
from underfoot.widgets.dialogs.file_error_dialog import FileErrorDialog


@pytest.fixture
def window(qtbot, tmp_path):
    return quiet_window(qtbot, tmp_path / "kept")


def files(*paths):
    """Files as a file manager hands them on."""
    mime = QMimeData()
    mime.setUrls([QUrl.fromLocalFile(str(path)) for path in paths])
    return mime


IN_A_CORNER = QPoint(50, 50)


def drop(onto, *paths, at=IN_A_CORNER):
    """Drag files onto the window, or a part of it, and let them go; whether they were taken."""
    mime = files(*paths)
    copy, button, none = Qt.DropAction.CopyAction, Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier
    entered = QDragEnterEvent(at, copy, mime, button, none)
    entered.ignore()
    QApplication.sendEvent(onto, entered)
    if not entered.isAccepted():
        return False
    QApplication.sendEvent(onto, QDropEvent(QPointF(at), copy, mime, button, none))
    return True


def test_dropped_files_are_opened_as_patches_and_others_are_not_taken(window, qtbot, tmp_path):
    for name in ("haptic", "ahap", "hjif", "macaron", "syntacts", "wav"):
        path = made.put(tmp_path, name)
        assert drop(window, path)
        qtbot.waitUntil(lambda path=path: window.status.message == f"Imported {path.name}: it plays at each footfall")
        assert design(window).patch().node("footfall")
        assert window.open_patch.path is None
        assert not window.isWindowModified()
    (tmp_path / "a.txt").write_text("x")
    assert not drop(window, tmp_path / "a.txt")
    noise_patch("Called a text").save(tmp_path / "patch.txt")
    assert drop(window, tmp_path / "patch.txt"), "a patch may have any name, as among the recent files"
    assert design(window).patch().title == "Called a text"
    noise_patch("Dropped").save(tmp_path / "a.json")
    assert drop(window, tmp_path / "a.json")
    assert window.open_patch.path == tmp_path / "a.json"


def test_what_is_edited_while_a_file_is_imported_is_asked_for(window, qtbot, tmp_path):
    assert drop(window, made.put(tmp_path, "wav"))
    work = noise_patch("Edited meanwhile")
    design(window).document.edit(work, "All")
    qtbot.waitUntil(lambda: any(box.isVisible() for box in window.findChildren(QMessageBox)))
    dialog_of(window, QMessageBox).reject()
    assert design(window).patch() == work


def test_of_several_dropped_files_the_first_that_fits_is_opened_and_the_line_says_so(window, tmp_path):
    for name in ("a", "b"):
        noise_patch(name).save(tmp_path / f"{name}.json")
    (tmp_path / "notes.txt").write_text("x")
    assert drop(window, tmp_path / "notes.txt", tmp_path / "b.json", tmp_path / "a.json")
    assert window.open_patch.path == tmp_path / "b.json"
    assert window.status.message == "One file at a time: b.json is taken, 2 more not"


def test_of_several_dropped_files_none_is_said_to_be_open_before_the_question_about_unsaved_work(window, tmp_path):
    for name in ("a", "b"):
        noise_patch(name).save(tmp_path / f"{name}.json")
    (tmp_path / "torn.json").write_text("{")
    work = noise_patch("All")
    design(window).document.edit(work, "All")
    assert drop(window, tmp_path / "torn.json")
    assert not window.findChildren(QMessageBox)  # what cannot be read replaces no work
    dialog_of(window, FileErrorDialog).reject()
    assert drop(window, tmp_path / "b.json", tmp_path / "a.json")
    assert "open" not in window.status.message
    dialog_of(window, QMessageBox).reject()
    assert design(window).patch() == work


def test_sounds_that_are_dropped_on_the_canvas_or_pasted_are_nodes_of_the_patch_and_replace_nothing(window, tmp_path):
    """As in Max, Blender and TouchDesigner: the patch was left for one that plays the sound at each footfall."""
    work = noise_patch("Footsteps").add("wav-player", REGISTRY, (0.0, 240.0)).name("wav-player", "Crunch")
    heel = made.put(tmp_path, "wav")
    toe = shutil.copy(heel, tmp_path / "toe.WAV")
    window.open_patch.open(work.save(tmp_path / "footsteps.json") or tmp_path / "footsteps.json")
    canvas, view, stack = design(window).canvas, design(window).canvas.viewport(), design(window).document.stack

    def box(id):
        return canvas.patch_scene.nodes[id].sceneBoundingRect()

    def middle(id):
        return canvas.mapFromScene(box(id).center())

    assert drop(view, heel, toe, at=middle("wav-player"))
    players = design(window).patch().nodes[len(work.nodes) :]
    assert [(node.label, node.parameters["file"]) for node in players] == [("sound", "sound.wav"), ("toe", "toe.WAV")]
    assert not box("wav-player1").intersects(box("wav-player2"))
    assert (canvas.selected_ids(), stack.undoText()) == (["wav-player1", "wav-player2"], "Add 2 nodes")
    assert drop(view, toe, at=middle("wav-player1"))
    assert drop(view, toe, at=middle("wav-player"))
    names = [(node.label, node.parameters["file"]) for node in design(window).patch().nodes[len(work.nodes) - 1 :]]
    assert names == [("Crunch", "toe.WAV"), ("toe", "toe.WAV"), ("toe", "toe.WAV")], "a name that was given stays"
    QApplication.clipboard().setMimeData(files(heel))
    QTest.keyClick(canvas, Qt.Key.Key_V, Qt.KeyboardModifier.ControlModifier)
    assert len(design(window).patch().nodes) == 6
    for _ in range(4):
        design(window).undo_action.trigger()
    assert design(window).patch() == work
    QApplication.clipboard().clear()
    noise_patch("Opened").save(tmp_path / "a.json")
    assert drop(view, tmp_path / "a.json", heel)
    assert design(window).patch().title == "Opened", "what no node reads is left to the window"


def test_a_file_dropped_on_the_field_of_a_file_is_put_there_and_not_opened(window, tmp_path):
    path = made.put(tmp_path, "wav")
    workspace = design(window)
    workspace.document.edit(workspace.patch().add("wav-player", REGISTRY), "Add")
    workspace.canvas.patch_scene.select(["wav-player"])
    editor = workspace.inspector.editors["file"]
    assert drop(editor.field, path)
    assert workspace.patch().node("wav-player").parameters["file"] == str(path)
    assert editor.field.text() == str(path)
    assert not window.findChildren(QMessageBox)
    workspace.undo_action.trigger()
    assert editor.field.text() == ""


def test_dropped_forces_are_what_the_floor_reads(window, tmp_path):
    (tmp_path / "bad.csv").write_text("time_s,t1.1\n1,2\n")
    assert drop(window, tmp_path / "bad.csv")
    assert "has no floor beside it (bad.floor.json)" in window.status.message
    refused = dialog_of(window, FileErrorDialog)
    assert refused.error_text.text().startswith("It has no floor beside it (bad.floor.json)")
    refused.close()
    assert window.controller.target.kind == "simulator"
    walk = Path(str(resources.files("underfoot.presets"))) / "walks" / "corridor.csv"
    assert drop(window, walk)
    assert (window.controller.target.kind, window.controller.target.source) == ("replay", str(walk))


def test_dropped_floors_and_studies_are_opened_as_what_they_are(window, qtbot, tmp_path):
    (tmp_path / "lab.json").write_bytes(default_floor(1, 3).dumps())
    assert drop(window, tmp_path / "lab.json")
    assert [tile.id for tile in window.controller.target.floor.tiles] == ["t1", "t2", "t3"]
    study = tmp_path / "mine.json"
    shutil.copy(preset_files.protocols()["free-labels"], study)
    assert drop(window, study)
    experiment = window.workspaces["Experiment"]
    assert (window.workspaces.chosen, experiment.study_list.study.path) == ("Experiment", study)
    QTest.mouseClick(experiment.study_list.copy_button, Qt.MouseButton.LeftButton)
    assert drop(window, preset_files.protocols()["free-labels"])
    assert window.status.message.endswith("is not opened while a study is run or made: end that first")
    assert experiment.study_list.study.path == study


def test_files_copied_in_a_file_manager_are_opened_by_paste(window, qtbot, tmp_path):
    canvas = design(window).canvas
    noise_patch("Pasted").save(tmp_path / "a.json")
    QApplication.clipboard().setMimeData(files(tmp_path / "a.json"))
    qtbot.keyClick(canvas, Qt.Key.Key_V, Qt.KeyboardModifier.ControlModifier)
    assert window.open_patch.path == tmp_path / "a.json"
    assert design(window).patch().title == "Pasted"
    (tmp_path / "a.txt").write_text("x")
    QApplication.clipboard().setMimeData(files(tmp_path / "a.txt"))
    qtbot.keyClick(canvas, Qt.Key.Key_V, Qt.KeyboardModifier.ControlModifier)
    assert window.status.message == "a.txt cannot be opened here"
    assert design(window).patch().title == "Pasted"
    QApplication.clipboard().clear()  # data of Python's that outlives it crashes the process at its end


def test_import_asks_about_unsaved_work_first(window, qtbot, tmp_path):
    path = made.put(tmp_path, "haptic")
    design(window).document.edit(noise_patch(), "All")
    window.actions_by_name["import"].trigger()
    question = dialog_of(window, QMessageBox)
    qtbot.mouseClick(question.button(QMessageBox.StandardButton.Discard), Qt.MouseButton.LeftButton)
    chooser = dialog_of(window, QFileDialog)
    assert "*.haptic" in chooser.nameFilters()[0]
    chooser.fileSelected.emit(str(path))
    chooser.done(0)
    qtbot.waitUntil(lambda: design(window).patch().title == "Door")


def test_what_is_not_in_the_patch_is_told(window, qtbot, tmp_path):
    path = tmp_path / "a.haptic"
    path.write_text(made.json.dumps(made.haptic(author="Ada", tags=["x"])))
    drop(window, path)
    qtbot.waitUntil(lambda: window.findChild(QMessageBox) is not None)
    told = dialog_of(window, QMessageBox)
    assert told.informativeText() == "• metadata.author\n• metadata.tags"
    label = told.findChild(QLabel, "qt_msgbox_informativelabel")
    assert label.textFormat() == Qt.TextFormat.PlainText, "a file's names may have signs that would be markup"
    qtbot.keyClick(told, Qt.Key.Key_Return)


def test_a_bad_file_is_one_line_and_the_patch_stays(window, qtbot, tmp_path):
    before = design(window).patch()
    (tmp_path / "a.ahap").write_text("{}")
    drop(window, tmp_path / "a.ahap")
    qtbot.waitUntil(lambda: "Pattern" in window.status.message)
    assert "\n" not in window.status.message
    assert design(window).patch() == before
    window.actions_by_name["export"].trigger()
    dialog = window.findChild(ExportDialog)
    assert dialog.losses.count() > 5
    qtbot.keyClick(dialog, Qt.Key.Key_Escape)
    assert not dialog.isVisible()
