"""The table of footsteps."""

import math

import pytest
from made_steps import SPIKE, STEP
from msgspec.structs import replace
from on_screen import show
from PySide6.QtCore import QRect, Qt
from PySide6.QtGui import QGuiApplication

from underfoot.floor.footsteps import BODY_WEIGHT_MEASURES
from underfoot.records.tables import step_table
from underfoot.widgets.controls.step_table import COLUMNS, StepTable


@pytest.fixture
def table(qtbot):
    made = StepTable()
    qtbot.addWidget(made)
    made.resize(1000, 200)
    show(qtbot, made)
    return made


def columns_of(table):
    return [column for column in range(len(COLUMNS)) if not table.isColumnHidden(column)]


def texts(table, row):
    return [table.steps.index(row, column).data() for column in columns_of(table)]


def test_steps_are_shown_with_their_units_and_digits(table):
    table.steps.add([STEP, SPIKE])
    figures = ["1", "t1", "left", "0.20", "612", "760", "500", "740", "320.0", "8.6", "210", "200"]
    assert texts(table, 0) == [*figures, "2", "–", "–", "–", "–", "–", "–", "–"]
    assert texts(table, 1)[2] == "–"
    assert texts(table, 1)[9:11] == ["159.0 !", "–"]
    columns = columns_of(table)
    assert "impact" in table.steps.index(1, columns[9]).data(Qt.ItemDataRole.ToolTipRole)
    headings = [table.steps.headerData(column, Qt.Orientation.Horizontal) for column in columns]
    assert headings[3:] == [
        "Start, s", "Contact, ms", "Peak 1, N", "Valley, N", "Peak 2, N", "Impulse, N·s", "Loading, kN/s", "Path, mm",
        "Net, mm", "Person", "Cadence, /min", "Length, mm", "Width, mm", "Swing, ms", "Both, ms", "Heading, °",
        "Heading ±, °",
    ]  # fmt: skip


@pytest.mark.parametrize("name", ["step", "start_s"])
def test_no_digit_of_what_grows_with_the_session_is_cut_off_after_days(name, table):
    """Of 100 017.03 s, after 28 hours, 00 017.03 was seen, and of step 100 017 the same."""
    table.steps.add([replace(STEP, **{name: most}) for most in (0, 1_100_017, 9_100_017)])
    height = table.rowHeight(0)
    seen = [table.viewport().grab(QRect(0, row * height, table.width(), height)).toImage() for row in (1, 2)]
    assert seen[0] != seen[1]


def test_the_columns_are_those_of_the_step_table_in_files(table, tmp_path):
    with step_table(tmp_path / "steps.csv") as write:
        write([STEP])
    table.steps.add([STEP])
    table.export(tmp_path / "mine.csv")
    assert (tmp_path / "mine.csv").read_text() == (tmp_path / "steps.csv").read_text()
    in_file = (tmp_path / "mine.csv").read_text().splitlines()[0].split(",")
    shown = [column.name for column in COLUMNS if column.name not in BODY_WEIGHT_MEASURES]
    assert in_file == [*shown, "spike", "contact"]


def test_the_table_stays_at_its_end_unless_someone_reads_above(table):
    for _ in range(40):
        table.steps.add([STEP])
    bar = table.verticalScrollBar()
    assert bar.value() == bar.maximum() > 0
    bar.setValue(3)
    table.steps.add([STEP])
    assert bar.value() == 3


def test_selected_steps_are_copied_for_a_spreadsheet(table, qtbot):
    table.steps.add([STEP, SPIKE])
    row = table.visualRect(table.model().index(1, 0)).center()
    qtbot.mouseClick(table.viewport(), Qt.MouseButton.LeftButton, pos=row)
    qtbot.keyClick(table, Qt.Key.Key_C, Qt.KeyboardModifier.ControlModifier)
    lines = QGuiApplication.clipboard().text().split("\n")
    assert len(lines) == 2
    assert lines[1].split("\t")[:4] == ["2", "t2", "unknown", "0.8"]


def test_only_the_latest_steps_are_kept(qtbot):
    table = StepTable(max_steps=10)
    qtbot.addWidget(table)
    table.steps.add([STEP] * 8)
    table.steps.add([SPIKE] * 5)
    assert table.steps.rowCount() == 10
    assert texts(table, 9)[0] == "2"


def test_rows_without_a_figure_come_before_all_others_when_sorted(qtbot):
    """NaN is neither less nor more than a figure: a sort by it would leave the others in disorder."""
    table = StepTable(sortable=True)
    qtbot.addWidget(table)
    figures = [110.0, math.nan, 104.0, math.nan, 121.0, 99.0, math.nan, 107.0]
    table.steps.add([replace(STEP, step=number, cadence_per_min=value) for number, value in enumerate(figures)])
    column = [one.name for one in COLUMNS].index("cadence_per_min")
    for order, wanted in ((Qt.SortOrder.AscendingOrder, slice(3, None)), (Qt.SortOrder.DescendingOrder, slice(5))):
        table.sortByColumn(column, order)
        shown = [one.cadence_per_min for one in table.steps_in_order()]
        assert shown[wanted] == sorted(shown[wanted], reverse=order == Qt.SortOrder.DescendingOrder)
        assert not any(map(math.isnan, shown[wanted]))
