"""The export dialog offers the stretch that is selected on the axis."""

import json

import pytest
import soundfile
from long_recording import write_recording
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QDialogButtonBox, QFileDialog, QLineEdit
from recordings_shown import recordings_shown

from underfoot.floor.layout import default_floor
from underfoot.widgets.recordings.exporting import ExportDialog


@pytest.fixture
def workspace(qtbot, tmp_path, monkeypatch):
    """The workspace on the screen, with six seconds of a walk open."""
    monkeypatch.setattr("underfoot.widgets.recordings.workspace.documents_folder", lambda: tmp_path)
    made = recordings_shown(qtbot)
    used = {"t1": {"fsr": "2026-05-01 0f3c9a1b2d4e", "response": "2026-05-02 a07be6c51f98"}}
    about = {"calibrations": json.dumps(used)}
    made.open_file(write_recording(tmp_path / "walk.underfoot", 6.0, default_floor(1, 2), about=about))
    qtbot.waitUntil(lambda: made.axis.content is not None and made.axis.content.overview is not None)
    qtbot.waitUntil(lambda: not made.surveyor.is_busy)
    return made


def ask(workspace):
    QTest.mouseClick(workspace.export_button, Qt.MouseButton.LeftButton)
    return next(one for one in workspace.window().findChildren(ExportDialog) if one.isVisible())


def choices(dialog):
    return [dialog.stretch.itemText(row) for row in range(dialog.stretch.count())]


def test_what_is_selected_on_the_axis_is_exported_alone(workspace, qtbot, tmp_path):
    axis = workspace.axis
    axis.set_cursor(1.5)
    QTest.keyClick(axis, Qt.Key.Key_BracketLeft)
    axis.set_cursor(4.0)
    QTest.keyClick(axis, Qt.Key.Key_BracketRight)
    dialog = ask(workspace)
    assert choices(dialog) == ["Whole recording, 6.00 s", "Selected stretch, 1.500 s to 4.000 s"]
    assert dialog.stretch.currentIndex() == 1
    dialog.format.setCurrentIndex(dialog.format.findData(".wav"))
    assert "in m/s²" in dialog.about.text()
    save = dialog.findChild(QDialogButtonBox).button(QDialogButtonBox.StandardButton.Save)
    QTest.mouseClick(save, Qt.MouseButton.LeftButton)
    chooser = next(one for one in workspace.window().findChildren(QFileDialog) if one.isVisible())
    assert chooser.selectedFiles() == [str(tmp_path / "walk 1.50-4.00 s.wav")]
    line = chooser.findChild(QLineEdit, "fileNameEdit")
    line.setText(str(tmp_path / "part.wav"))
    chooser.accept()
    qtbot.waitUntil(lambda: not workspace.exporting.is_busy)
    assert len(soundfile.read(tmp_path / "part.wav")[0]) == round(2.5 * 48_000)


def test_without_a_selection_the_dialog_says_how_to_make_one_and_the_title_which_calibrations_there_were(workspace):
    assert workspace.facts.full_text == "6.0 s  ·  2 tiles  ·  simulator  ·  Forces, Vibration calibrated"
    for label in (workspace.title, workspace.facts):  # a small screen has no room for the facts
        assert "t1: Forces 2026-05-01 0f3c9a1b2d4e, Vibration 2026-05-02 a07be6c51f98" in label.toolTip()
    dialog = ask(workspace)
    assert choices(dialog) == ["Whole recording, 6.00 s"]
    hints = [label.text() for label in dialog.findChildren(type(dialog.about)) if label.isVisible()]
    assert "To export a part, select it first: drag on the ruler." in hints
    dialog.reject()
