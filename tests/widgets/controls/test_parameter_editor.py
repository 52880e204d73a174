"""Controls made from parameters."""

from itertools import pairwise
from pathlib import Path

import pytest
from on_screen import show
from PySide6.QtCore import QPoint, QPointF, Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QTableWidgetItem, QToolButton, QVBoxLayout, QWidget

from underfoot.errors import BadValue
from underfoot.parameters import Choice, Count, FilePath, Number, Numbers, Rows, Text, Tiles
from underfoot.scenes.target_selection import TargetSelection
from underfoot.widgets.controls.parameter_editor import editor_for

LEFT, NONE = Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier

PARAMETERS = (
    (Number(1.0, -10.0, 10.0, unit="m"), -2.5),
    (Number(30.0, 1.0, 1000.0, unit="N", scale="log"), 250.0),
    (Count(3, 0, 1000), 17),
    (Count(2000, 1, 100_000), 123),
    (Choice("b", options=("a", "b", "c")), "c"),
    (Numbers((1.0, 0.5), 0.0, 1.0, most=5), (0.25, 0.5, 1.0)),
    (Rows(((1.0, 2.0),), (("x", 0.0, 10.0), ("y", 0.0, 5.0))), ((1.0, 2.0), (3.0, 4.0))),
    (Text("one"), "two"),
    (FilePath(""), "rain.wav"),
    (Tiles(), "t1+t2"),
)


@pytest.mark.parametrize(("parameter", "value"), PARAMETERS, ids=lambda p: getattr(p, "kind", ""))
def test_a_control_shows_a_value_without_saying_that_it_changed(qtbot, parameter, value):
    editor = editor_for(parameter)
    qtbot.addWidget(editor)
    assert editor.value() == parameter.check(parameter.default)
    with qtbot.assertNotEmitted(editor.value_changed):
        editor.set_value(value)
    assert editor.value() == parameter.check(value)
    with pytest.raises(BadValue):
        editor.set_value(object())
    with qtbot.waitSignal(editor.value_changed) as changed:
        editor.reset()
    assert changed.args == [parameter.check(parameter.default)]


@pytest.mark.parametrize("parameter", [p for p, _ in PARAMETERS if isinstance(p, Number | Count)])
def test_a_slider_reaches_both_ends_and_stays_in_range(qtbot, parameter):
    editor = editor_for(parameter)
    qtbot.addWidget(editor)
    seen = []
    editor.value_changed.connect(seen.append)
    for step in range(0, 1001, 50):
        editor.slider.setValue(step)
    assert seen[0] == parameter.low
    assert seen[-1] == parameter.high
    assert all(a <= b for a, b in pairwise(seen))


def test_a_list_of_numbers_is_typed(qtbot):
    editor = editor_for(Numbers((1.0,), 0.0, 1.0, most=3))
    qtbot.addWidget(editor)
    editor.field.setText("0.5 0.25; 1")
    editor.field.committed.emit(editor.field.text())
    assert editor.value() == (0.5, 0.25, 1.0)
    editor.field.committed.emit("1 2 3")
    assert editor.value() == (0.5, 0.25, 1.0)
    assert "allowed" in editor.field.toolTip()


def test_numbers_of_a_list_are_typed_with_a_unit_that_the_label_names(qtbot):
    editor = editor_for(TargetSelection.widths_m)
    qtbot.addWidget(editor)
    assert editor.label.text() == "Widths, m"
    editor.field.selectAll()
    qtbot.keyClicks(editor.field, "45 mm, 0.1")
    qtbot.keyClick(editor.field, Qt.Key.Key_Return)
    assert editor.value() == (0.045, 0.1)


def test_numbers_of_a_list_that_are_not_edited_stay_as_they_were(qtbot):
    editor = editor_for(Numbers((1.0,), 0.0, 1.0, most=3))
    qtbot.addWidget(editor)
    editor.set_value((0.12345678, 0.5))
    editor.field.committed.emit(editor.field.text().replace("0.5", "0.25"))
    assert editor.value() == (0.12345678, 0.25)


@pytest.mark.parametrize(
    ("parameter", "shown", "bad", "good"),
    [(Numbers((1.0,), 0.0, 1.0), "1", "1 x 2", "0.5"), (Tiles(), "all", "t1+", "t1+t2")],
    ids=["numbers", "tiles"],
)
def test_a_text_that_was_refused_is_not_shown_as_the_value_once_it_is_left(qtbot, parameter, shown, bad, good):
    editor = editor_for(parameter)
    qtbot.addWidget(editor)
    show(qtbot, editor)
    for leave in (True, False):
        editor.field.setFocus()
        editor.field.setText(bad)
        qtbot.keyClick(editor.field, Qt.Key.Key_Return)
        assert editor.field.property("role") == "bad"
        assert "; allowed: " in editor.field.toolTip()
        if leave:
            editor.field.clearFocus()
            assert (editor.field.text(), editor.field.property("role")) == (shown, "")
    editor.field.setText(good)
    qtbot.keyClick(editor.field, Qt.Key.Key_Return)
    assert (editor.field.text(), editor.field.property("role")) == (good, "")


def test_rows_are_added_changed_and_taken_away(qtbot):
    editor = editor_for(Rows(((1.0, 2.0),), (("x", 0.0, 10.0), ("y", 0.0, 5.0)), most=2))
    qtbot.addWidget(editor)
    editor.add_button.click()
    editor.add_button.click()
    assert editor.value() == ((1.0, 2.0), (1.0, 2.0))
    editor.table.setItem(1, 0, QTableWidgetItem("7"))
    assert editor.value() == ((1.0, 2.0), (7.0, 2.0))
    with qtbot.waitSignal(editor.refused) as refused:
        editor.table.setItem(1, 0, QTableWidgetItem("11"))
    assert refused.args == ["x is '11'; allowed: 0 to 10"]
    assert editor.value() == ((1.0, 2.0), (7.0, 2.0))
    assert editor.table.item(1, 0).text() == "7"
    headings = editor.table.horizontalHeader().grab().toImage()
    editor.table.setCurrentCell(0, 0)
    assert editor.table.horizontalHeader().grab().toImage() == headings  # bold, a longer one is cut off
    editor.remove_button.click()
    assert editor.value() == ((7.0, 2.0),)


@pytest.mark.parametrize(
    ("typed", "value"),
    [("2k", (2000.0, 0.0)), ("3*440 hz", (1320.0, 0.0)), ("0,5 m/s²", (50.0, 0.5)), ("500 mm/s^2", (50.0, 0.5))],
)
def test_a_number_in_a_table_is_typed_as_in_a_field(qtbot, typed, value):
    editor = editor_for(Rows(((50.0, 0.0),), (("frequency Hz", 1.0, 20_000.0), ("level m/s^2", 0.0, 1.0)), most=2))
    qtbot.addWidget(editor)
    editor.table.item(0, 1 if "m/s" in typed else 0).setText(typed)
    assert editor.value() == (value,)


def test_a_file_below_the_patchs_folder_is_told_from_there(qtbot, tmp_path):
    editor = editor_for(FilePath(""))
    qtbot.addWidget(editor)
    assert "Look for a file" in [button.toolTip() for button in editor.findChildren(QToolButton)]
    editor.set_folder(tmp_path)
    editor.choose(tmp_path / "sounds" / "rain.wav")
    assert editor.value() == str(Path("sounds") / "rain.wav")
    editor.choose(Path("/elsewhere/rain.wav"))
    assert editor.value() == "/elsewhere/rain.wav"


def test_the_field_of_a_file_says_that_there_is_no_such_file(qtbot, tmp_path):
    editor = editor_for(FilePath(""))
    qtbot.addWidget(editor)
    said = []
    (tmp_path / "rain.wav").touch()
    editor.set_value("rain.wav")
    said.append(editor.label.text())  # a patch without a folder has no file by that name
    editor.set_folder(tmp_path / "moved")
    said.append(editor.label.text())
    editor.set_folder(tmp_path)
    said.append(editor.label.text())
    editor.choose(tmp_path)
    said.append(editor.label.text())
    editor.set_value("")
    said.append(editor.label.text())
    label = editor.parameter.label
    assert said == [label, f"{label}: no such file", label, f"{label}: it is a folder", label]


def test_the_wheel_changes_a_choice_only_with_the_focus(qtbot):
    window = QWidget()
    qtbot.addWidget(window)
    editor = editor_for(Choice("a", options=("a", "b", "c")))
    QVBoxLayout(window).addWidget(editor)
    show(qtbot, window)
    editor.box.clearFocus()
    place = QPointF(editor.box.mapTo(window, editor.box.rect().center()))
    QTest.wheelEvent(window.windowHandle(), place, QPoint(0, -120))
    assert editor.value() == "a"
    editor.box.setFocus()
    QTest.wheelEvent(window.windowHandle(), place, QPoint(0, -120))
    assert editor.value() == "b"


def test_the_mouse_shows_all_of_a_text_that_its_field_cuts(qtbot):
    editor = editor_for(Text("", doc="what to know about it"))
    show(qtbot, editor)
    editor.resize(200, 60)
    said, about = editor.field.toolTip(), "Small grains and a few coarse stones slip at random as the foot comes down."
    editor.set_value(about)
    assert editor.field.toolTip() == f"{about}\n{said}"
    editor.resize(1000, 60)
    assert editor.field.toolTip() == said
