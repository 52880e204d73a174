"""Controls made from parameters, and the figures of the preview."""

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QTableWidgetItem

from underfoot.errors import BadValue
from underfoot.parameters import Choice, Count, FilePath, Number, Numbers, Rows, Text, Tiles
from underfoot.quantities import parse_quantity, quantity
from underfoot.widgets.controls.parameter_editor import editor_for
from underfoot.widgets.design.analysis import Scale, shown_levels, spectrogram_db, spectrum_db

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


@given(st.floats(-1e9, 1e9), st.sampled_from(["N", "N/m", "m", "s", "Hz", "kg", "m/s^2", "", "dB"]))
def test_what_is_written_can_be_typed_again(value, unit):
    assert parse_quantity(quantity(value, unit, 9), unit) == pytest.approx(value, rel=1e-7, abs=1e-12)


@pytest.mark.parametrize("text", ["", "ten", "1.2.3", "5 parsecs", "0x10"])
def test_what_is_no_quantity_is_refused(text):
    with pytest.raises(BadValue):
        parse_quantity(text, "m")


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
    editor.field.given.emit(editor.field.text())
    assert editor.value() == (0.5, 0.25, 1.0)
    editor.field.given.emit("1 2 3")
    assert editor.value() == (0.5, 0.25, 1.0)
    assert "allowed" in editor.field.toolTip()


def test_rows_are_added_changed_and_taken_away(qtbot):
    editor = editor_for(Rows(((1.0, 2.0),), (("x", 0.0, 10.0), ("y", 0.0, 5.0)), most=2))
    qtbot.addWidget(editor)
    editor.adding.click()
    editor.adding.click()
    assert editor.value() == ((1.0, 2.0), (1.0, 2.0))
    editor.table.setItem(1, 0, QTableWidgetItem("7"))
    assert editor.value() == ((1.0, 2.0), (7.0, 2.0))
    editor.table.setItem(1, 0, QTableWidgetItem("11"))
    assert editor.value() == ((1.0, 2.0), (7.0, 2.0))
    assert editor.table.item(1, 0).text() == "7"
    editor.table.setCurrentCell(0, 0)
    editor.removing.click()
    assert editor.value() == ((7.0, 2.0),)


def test_a_file_below_the_patchs_folder_is_told_from_there(qtbot, tmp_path):
    editor = editor_for(FilePath(""))
    qtbot.addWidget(editor)
    editor.set_folder(tmp_path)
    editor.choose(str(tmp_path / "sounds" / "rain.wav"))
    assert editor.value() == str(Path("sounds") / "rain.wav")
    editor.choose("/elsewhere/rain.wav")
    assert editor.value() == "/elsewhere/rain.wav"


# --- the preview's figures ---


@pytest.mark.parametrize("hz", [45.0, 250.0, 990.0, 1800.0])
@pytest.mark.parametrize("log", [True, False])
def test_levels_of_a_sine_stand_at_its_frequency_and_amplitude(hz, log):
    scale = Scale(log, 20.0 if log else 0.0)
    time_s = np.arange(43_200) / 48_000.0
    signal = 0.1 * np.sin(2 * np.pi * hz * time_s)
    line = spectrum_db(signal, 48_000.0, scale)
    picture = spectrogram_db(signal, 48_000.0, scale)
    assert line.max() == pytest.approx(-20.0, abs=0.3)
    assert picture[:, 180].max() == pytest.approx(-20.0, abs=0.3)
    rows = scale.rows_hz(len(line))
    assert rows[line.argmax()] == pytest.approx(hz, rel=0.02, abs=4.0)


def test_what_is_above_the_picture_does_not_fold_into_it():
    signal = np.sin(2 * np.pi * 7000.0 * np.arange(43_200) / 48_000.0)
    assert spectrogram_db(signal, 48_000.0, Scale())[:, 20:-20].max() < -60.0
    assert spectrum_db(signal, 48_000.0, Scale()).max() < -60.0


def test_levels_become_colours_between_the_ends_of_the_range():
    shown = shown_levels(np.array([-100.0, -60.0, -30.0, 0.0, 20.0], np.float32), 0.0, 60.0)
    assert shown.tolist() == [0, 0, 127, 255, 255]


@pytest.mark.parametrize("signal", [np.zeros(0), np.zeros(1), np.zeros(500), np.full(2000, np.nan)])
def test_silence_and_nonsense_are_drawn_as_silence(signal):
    assert np.isfinite(spectrogram_db(signal, 48_000.0, Scale())).all()
    assert np.isfinite(spectrum_db(signal, 48_000.0, Scale())).all()
