"""The cost of a block, measured by a process beside the window."""

import multiprocessing

import pytest
from made_patches import hum
from on_screen import show
from PySide6.QtCore import Qt
from PySide6.QtGui import QGuiApplication
from PySide6.QtWidgets import QDialogButtonBox

from underfoot.bench.block_stages import BlockStages
from underfoot.floor.layout import default_floor
from underfoot.widgets.dialogs.cost_dialog import CostDialog

LONG_MS = 120_000


@pytest.fixture
def opened(qtbot):
    """`opened(patch)`: a dialog that measures a patch on four tiles."""
    made = []

    def open_it(patch, **how):
        made.append(CostDialog(patch, default_floor(), {"block": 128, **how}))
        made[0].setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose, False)
        qtbot.addWidget(made[0])
        made[0].show()
        return made[0]

    yield open_it
    made[0].close()
    assert not [child for child in multiprocessing.active_children() if "cost" in child.name]


def names_of(dialog):
    return [dialog.table.topLevelItem(row).text(0) for row in range(dialog.table.topLevelItemCount())]


def test_stages_and_nodes_are_shown_with_what_they_take(opened, qtbot):
    dialog = opened(hum().name("tone", "Low hum"))
    assert dialog.summary.text().startswith("Measuring")
    assert not dialog.table.header().isVisible()  # over nothing
    qtbot.waitUntil(lambda: dialog.table.topLevelItemCount() > 0, timeout=LONG_MS)
    assert dialog.table.accessibleName() == "Run time of stages and nodes"
    assert dialog.table.header().isVisible()
    names = names_of(dialog)
    assert names[0] == "STAGES"
    assert {"tracking", "safety", "NODES", "Low hum", "Tile output"} <= set(names)
    assert "a foot on 4 of 4 tiles" in dialog.summary.text()
    row = dialog.table.topLevelItem(names.index("Low hum"))
    assert float(row.text(1)) > 0.0
    assert row.text(2).endswith(" %")
    show(qtbot, dialog)
    dialog.table.scrollToItem(row)
    place = dialog.table.visualItemRect(row).center()
    qtbot.mouseClick(dialog.table.viewport(), Qt.MouseButton.LeftButton, pos=place)
    qtbot.keyClick(dialog.table, Qt.Key.Key_C, Qt.KeyboardModifier.ControlModifier)
    copied = QGuiApplication.clipboard().text().split("\n")  # for a spreadsheet
    assert copied == ["\tms a second\tShare\t", "\t".join(row.text(column) for column in range(4))]


def test_stop_ends_the_measurement_and_another_may_follow(opened, qtbot):
    dialog = opened(hum())
    qtbot.mouseClick(dialog.start_button, Qt.MouseButton.LeftButton)
    assert (dialog.summary.text(), dialog.start_button.text()) == ("Stopped.", "Measure")
    dialog.feet.setCurrentText("no tile")
    qtbot.mouseClick(dialog.start_button, Qt.MouseButton.LeftButton)
    assert dialog.start_button.text() == "Stop"
    dialog.show_cost(BlockStages(4, 0, 128, 1.0, stages=(), nodes=(), left_out=(), reading_ms=0.0))
    assert names_of(dialog) == ["STAGES", "reading"]  # and no head of nodes that there are not
    sides = [dialog.table.headerItem().textAlignment(column) for column in (1, 2)]
    assert sides == [dialog.table.topLevelItem(1).textAlignment(column) for column in (1, 2)]


def test_what_cannot_be_measured_is_said_in_one_line(opened, qtbot):
    dialog = opened(hum(), profiles="nowhere")
    qtbot.waitUntil(lambda: dialog.start_button.text() == "Measure", timeout=LONG_MS)
    assert dialog.summary.text() == "nowhere is not a folder of profiles"
    assert dialog.table.topLevelItemCount() == 0


@pytest.mark.parametrize("how", ["Esc", "Close"])
def test_it_closes_and_ends_the_measurement(opened, qtbot, how):
    dialog = opened(hum())
    if how == "Esc":
        qtbot.keyClick(dialog, Qt.Key.Key_Escape)
    else:
        button = dialog.findChild(QDialogButtonBox).button(QDialogButtonBox.StandardButton.Close)
        qtbot.mouseClick(button, Qt.MouseButton.LeftButton)
    assert not dialog.isVisible()
    assert not [child for child in multiprocessing.active_children() if "cost" in child.name]
