"""The export dialog: what will be lost is said before, and a process beside writes the file."""

import json
import multiprocessing

import pytest
from format_rules import RULES
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QFileDialog, QWidget
from shiboken6 import isValid
from windows import LONG_MS

from underfoot.exchange.format import Export
from underfoot.exchange.formats import FORMATS, WRITTEN
from underfoot.exchange.losses import losses
from underfoot.floor.layout import default_floor
from underfoot.nodes import REGISTRY
from underfoot.patch import preset_files
from underfoot.patch.patch import Patch
from underfoot.quantities import pretty_text
from underfoot.widgets.dialogs.export_dialog import STEP, WALK, ExportDialog
from underfoot.widgets.dialogs.file_chooser import FileChooser

SINE = Patch.load(preset_files.patches()["stimulus-sp"], REGISTRY)


@pytest.fixture
def opened(qtbot, tmp_path):
    """`opened(patch)`: the dialog of a patch on two tiles."""
    parent = QWidget()
    qtbot.addWidget(parent)
    made = []

    def open_it(patch):
        files = FileChooser(parent, lambda: str(tmp_path), lambda line: made[0].message.setText(line))
        made.append(
            ExportDialog(
                lambda walks: Export(patch, floor=default_floor(1, 2) if walks else None), "sine", files, parent
            )
        )
        made[0].setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose, False)
        made[0].show()
        return made[0]

    yield open_it
    if isValid(made[0]):
        made[0].close()
    assert not [child for child in multiprocessing.active_children() if "export" in child.name]


def choose(dialog, name):
    row = next(row for row in range(dialog.formats.count()) if WRITTEN[row].name == name)
    dialog.formats.setCurrentRow(row)


def lost(dialog):
    return [dialog.losses.item(row).text() for row in range(dialog.losses.count())]


def export_to(qtbot, dialog, path):
    """Press the button, and give the file that is asked for."""
    qtbot.mouseClick(dialog.write, Qt.MouseButton.LeftButton)
    question = dialog.parent().findChild(QFileDialog)
    question.fileSelected.emit(str(path))
    question.done(0)


def test_each_format_says_what_it_will_lose_before_it_is_written(opened):
    dialog = opened(SINE)
    for format in WRITTEN:
        choose(dialog, format.name)
        assert dialog.format is format
        assert lost(dialog) == [pretty_text(line) for line in losses(SINE, format.carries)]
    choose(dialog, "share")
    assert dialog.losses_title.text() == "NOTHING WILL BE LOST"


def test_a_file_is_written_beside_and_what_came_of_it_is_said(opened, qtbot, tmp_path):
    dialog = opened(SINE)
    choose(dialog, "hjif")
    dialog.playing_note.setCurrentText(WALK)
    export_to(qtbot, dialog, tmp_path / "sine.hjif")
    assert dialog.write.text() == "Stop"
    assert "in another process" in dialog.message.text()
    qtbot.waitUntil(lambda: dialog.write.text() == "Export…", timeout=LONG_MS)
    document = json.loads((tmp_path / "sine.hjif").read_text())
    RULES["hjif"](document)
    assert len(document["perceptions"][0]["channels"]) == 2
    assert dialog.message.text().startswith(f"Written: {tmp_path / 'sine.hjif'}")
    assert "envelope within" in dialog.message.text()


def test_stop_ends_it_and_nothing_is_written(opened, qtbot, tmp_path):
    dialog = opened(SINE)
    choose(dialog, "haptic")
    export_to(qtbot, dialog, tmp_path / "sine.haptic")
    qtbot.mouseClick(dialog.write, Qt.MouseButton.LeftButton)
    assert dialog.message.text() == "Stopped; nothing was written."
    assert not list(tmp_path.iterdir())


def test_what_an_export_plays_on_is_chosen_only_where_it_is_played(opened, qtbot, tmp_path):
    dialog = opened(SINE)
    assert dialog.playing_note.isEnabled()
    choose(dialog, "share")
    assert not dialog.playing_note.isEnabled()
    export_to(qtbot, dialog, tmp_path / "sine")
    qtbot.waitUntil(lambda: dialog.message.text().startswith("Written"), timeout=LONG_MS)
    assert not dialog.playing_note.isEnabled()


def test_what_cannot_be_written_is_said(opened, qtbot, tmp_path):
    dialog = opened(Patch(title="Empty"))
    dialog.playing_note.setCurrentText(STEP)
    choose(dialog, "csv")
    export_to(qtbot, dialog, tmp_path / "a.csv")
    qtbot.waitUntil(lambda: "plays nothing" in dialog.message.text(), timeout=LONG_MS)
    assert FORMATS["csv"].suffix == ".csv"


def test_a_file_question_ends_with_the_dialog_that_asked(opened, qtbot):
    dialog = opened(SINE)
    dialog.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)  # as in the window
    window = dialog.parent()
    qtbot.mouseClick(dialog.write, Qt.MouseButton.LeftButton)
    question = window.findChild(QFileDialog)
    assert question.isVisible()
    dialog.close()
    qtbot.waitUntil(lambda: not isValid(question))
    assert window.findChild(QFileDialog) is None
