"""A factor that a hand sets in decibels."""

import math

import pytest
from design_samples import send
from on_screen import show, type_into
from PySide6.QtCore import QEvent, QPoint, Qt
from PySide6.QtWidgets import QToolTip

from underfoot.errors import BadValue
from underfoot.nodes import REGISTRY
from underfoot.number_parsing import parse_gain
from underfoot.parameters import Count, Number
from underfoot.widgets.controls.number_editor import NumberEditor


@pytest.fixture
def editor(qtbot):
    made = NumberEditor(REGISTRY["gain"].parameters["gain"])
    qtbot.addWidget(made)
    made.resize(280, 32)
    show(qtbot, made)
    return made


def test_a_gain_is_shown_and_typed_in_decibels_and_given_as_a_factor(qtbot, editor):
    assert editor.field.text() == "0 dB"
    for text, factor in (("-6.0206", 0.5), ("+20 dB", 10.0), ("x2", 2.0), ("3x", 3.0), ("-inf", 0.0)):
        with qtbot.waitSignal(editor.value_changed) as changed:
            type_into(qtbot, editor, text)
        assert changed.args[0] == pytest.approx(factor, rel=1e-4), text


def test_a_factor_that_is_typed_alone_changes_the_number_that_is_there(qtbot, editor):
    for text, factor in (("x2", 2.0), ("*1,5", 3.0), ("/ 4", 0.75)):
        type_into(qtbot, editor, text)
        assert editor.value() == pytest.approx(factor), text
    editor.set_mixed("0 dB to 6 dB")
    type_into(qtbot, editor, "*2")
    assert (editor.value(), editor.field.property("role")) == (pytest.approx(0.75), "bad")


def test_a_small_drag_is_a_small_change_and_zero_decibels_is_a_stop(qtbot, editor):
    """Seven pixels off the stop are some decibels, not thirty; and a hand finds 0 dB again."""
    given = []
    editor.value_changed.connect(given.append)
    slider = editor.slider
    zero = QPoint(round(5 + slider.position() * (slider.width() - 10)), slider.height() // 2)
    qtbot.mousePress(slider, Qt.MouseButton.LeftButton, pos=zero)
    qtbot.mouseMove(slider, zero + QPoint(7, 0))
    assert 1.0 < given[-1] < 10.0 ** (12.0 / 20.0)
    assert "dB" in editor.field.text()
    qtbot.mouseMove(slider, zero)
    qtbot.mouseRelease(slider, Qt.MouseButton.LeftButton, pos=zero)
    assert given[-1] == 1.0
    qtbot.mouseClick(slider, Qt.MouseButton.LeftButton, pos=QPoint(0, 5))
    assert given[-1] == 0.0
    assert editor.field.text() == "−∞ dB"


def test_a_double_click_on_a_slider_sets_it_to_its_default_in_one_edit(qtbot, editor):
    """As one on the level in the main bar."""
    began = []
    editor.edit_began.connect(lambda: began.append(editor.value()))
    editor.set_value(2.0)
    place = QPoint(20, 5)
    qtbot.mouseClick(editor.slider, Qt.MouseButton.LeftButton, pos=place)
    assert editor.value() < 1.0
    qtbot.mouseDClick(editor.slider, Qt.MouseButton.LeftButton, pos=place)
    qtbot.mouseMove(editor.slider, place + QPoint(3, 0))
    assert (editor.value(), editor.field.text(), began) == (1.0, "0 dB", [2.0])


@pytest.mark.parametrize("node", ["mix", "gain", "noise", "tone", "fibre-bundle", "stick-slip", "wav-player"])
def test_no_level_of_a_node_makes_more_than_a_few_decibels_in_seven_pixels(node):
    """On a slider as wide as the inspector has it, from wherever it stands."""
    room_px = 230.0
    levels = [p for p in REGISTRY[node].parameters.values() if isinstance(p, Number) and p.is_in_db]
    assert levels
    for level in levels:
        for place in (0.1, 0.5, level.position(level.default), 0.9):
            before, after = level.value(place), level.value(place + 7.0 / room_px)
            if before > 0.0:  # some begin at 0
                assert 0.0 < 20.0 * math.log10(after / before) < 5.0, level.name


def test_a_mix_s_level_is_a_size_in_decibels_and_a_button_for_its_sign(qtbot):
    editor = NumberEditor(REGISTRY["mix"].parameters["level_a"])
    qtbot.addWidget(editor)
    editor.resize(280, 48)
    show(qtbot, editor)
    given = []
    editor.value_changed.connect(given.append)
    qtbot.mouseClick(editor.inverted, Qt.MouseButton.LeftButton)
    assert (given[-1], editor.field.text()) == (-1.0, "0 dB ø")
    qtbot.mouseClick(editor.slider, Qt.MouseButton.LeftButton, pos=QPoint(editor.slider.width() // 2, 5))
    assert -1.0 < given[-1] < 0.0, "a drag changes the size and keeps the sign"
    type_into(qtbot, editor, "x2")
    assert given[-1] == 2.0
    assert not editor.inverted.isChecked()
    type_into(qtbot, editor, "-6.0206 dB ø")
    assert given[-1] == pytest.approx(-0.5, rel=1e-4)
    assert editor.inverted.isChecked()


def test_an_arrow_key_moves_a_gain_off_0_db_and_shift_finely(qtbot, editor):
    """The stop at 0 dB is for the mouse: one key moved the slider's place and not the value."""
    given = []
    editor.value_changed.connect(given.append)
    editor.slider.setFocus()
    qtbot.keyClick(editor.slider, Qt.Key.Key_Right)
    assert 1.0 < given[-1] < 10.0 ** (2.0 / 20.0)
    assert editor.slider.accessibleDescription() == editor.field.text() != "0 dB"
    type_into(qtbot, editor, "0 dB")
    assert editor.slider.accessibleDescription() == "0 dB", "a screen reader says the value with its unit"
    editor.slider.setFocus()
    qtbot.keyClick(editor.slider, Qt.Key.Key_Left, Qt.KeyboardModifier.ShiftModifier)
    assert 10.0 ** (-0.3 / 20.0) < given[-1] < 1.0


def test_a_gain_s_place_and_value_are_inverse():
    level = Number(1.0, 0.0, 100.0, scale="gain")
    for factor in (2e-3, 0.25, 1.0, 1.05, 2.0, 100.0):
        assert level.value(level.position(factor)) == pytest.approx(factor)
    assert level.value(0.0) == 0.0
    assert level.position(0.0) == level.position(1e-4) == 0.0


def test_what_is_no_gain_is_refused():
    with pytest.raises(BadValue, match="is not a number"):
        parse_gain("loud")


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("80", "80 dB; allowed: −∞ dB to 60 dB"),
        ("99999", "∞ dB; allowed: −∞ dB to 60 dB"),
        ("loud", "'loud' is not a number; allowed: a number, with or without dB"),
        ("5 Hz", "the unit is 'hz'; allowed: a number, with or without dB"),
    ],
)
def test_whoever_types_a_gain_that_is_not_allowed_sees_why_in_decibels(qtbot, editor, text, reason):
    type_into(qtbot, editor, text)
    assert (QToolTip.isVisible(), QToolTip.text()) == (True, reason)
    assert editor.value() == 1.0
    qtbot.keyClick(editor.field, Qt.Key.Key_Escape)
    assert editor.field.text() == "0 dB"
    qtbot.waitUntil(lambda: not QToolTip.isVisible())


def test_a_click_into_a_number_replaces_it_and_a_further_click_places_the_cursor(qtbot, editor):
    editor.slider.setFocus()
    qtbot.mouseClick(editor.field, Qt.MouseButton.LeftButton)
    qtbot.keyClicks(editor.field, "20")
    qtbot.keyClick(editor.field, Qt.Key.Key_Return)
    assert editor.value() == pytest.approx(10.0)
    qtbot.mouseClick(editor.field, Qt.MouseButton.LeftButton)
    qtbot.keyClicks(editor.field, "6")
    qtbot.keyClick(editor.field, Qt.Key.Key_Return)
    assert editor.value() == pytest.approx(10.0**0.3)
    qtbot.mouseClick(editor.field, Qt.MouseButton.LeftButton)
    qtbot.mouseClick(editor.field, Qt.MouseButton.LeftButton)
    assert editor.field.selectedText() == ""


@pytest.mark.parametrize("most", [8, 1000])
def test_each_key_on_the_slider_of_a_count_changes_it(qtbot, most):
    """Also where the next count is further away than a step of the slider."""
    editor = NumberEditor(Count(1, 1, most))
    qtbot.addWidget(editor)
    show(qtbot, editor)
    given = []
    editor.value_changed.connect(given.append)
    editor.slider.setFocus()
    for key in (Qt.Key.Key_Right, Qt.Key.Key_Right, Qt.Key.Key_Left, Qt.Key.Key_Right):
        qtbot.keyClick(editor.slider, key)
    assert given == [2, 3, 2, 3]


def test_a_drag_with_shift_goes_a_tenth_of_the_way_from_where_the_knob_is(editor):
    slider, shift = editor.slider, Qt.KeyboardModifier.ShiftModifier
    slider.set_position(0.5)
    for kind, x in ((QEvent.Type.MouseButtonPress, 20), *((QEvent.Type.MouseMove, x) for x in range(20, 121))):
        send(slider, kind, QPoint(x, 8), Qt.MouseButton.LeftButton, shift)
    send(slider, QEvent.Type.MouseButtonRelease, QPoint(120, 8), Qt.MouseButton.LeftButton, shift)
    assert slider.position() == pytest.approx(0.5 + 0.1 * 100 / (slider.width() - 10), abs=0.001)


def test_a_key_after_a_drag_of_the_slider_is_an_edit_of_its_own(qtbot, editor):
    began = []
    editor.edit_began.connect(lambda: began.append(editor.value()))
    quarter = QPoint(editor.slider.width() // 4, editor.slider.height() // 2)
    qtbot.mousePress(editor.slider, Qt.MouseButton.LeftButton, pos=quarter)
    qtbot.mouseRelease(editor.slider, Qt.MouseButton.LeftButton, pos=quarter)
    dragged = editor.value()
    editor.slider.setFocus()
    qtbot.keyClick(editor.slider, Qt.Key.Key_Right)
    assert began == [1.0, dragged]
    assert editor.value() > dragged


def test_arrows_up_and_down_in_the_field_move_the_number_as_on_its_slider(qtbot, editor):
    given = []
    editor.value_changed.connect(given.append)
    began = []
    editor.edit_began.connect(lambda: began.append(editor.value()))
    type_into(qtbot, editor, "-6")
    qtbot.keyClick(editor.field, Qt.Key.Key_Up)
    higher = editor.field.text()
    assert len(began) == 2
    assert given[-1] > given[0]
    assert editor.field.selectedText() == higher
    qtbot.keyClick(editor.field, Qt.Key.Key_Escape)
    assert editor.field.text() == higher
    qtbot.keyClicks(editor.field, "-20")
    qtbot.keyClick(editor.field, Qt.Key.Key_Down, Qt.KeyboardModifier.ShiftModifier)
    assert 10.0 ** (-21.0 / 20.0) < given[-1] < 0.1
    qtbot.keyClicks(editor.field, "loud")
    qtbot.keyClick(editor.field, Qt.Key.Key_Up)
    assert editor.field.property("role") == "bad"
    assert editor.field.text() == "loud"


@pytest.mark.parametrize(
    ("parameter", "value", "up"),
    [
        (Number(0.5, 0.0, 1.0), 0.5, 0.601),
        (Count(14, 1, 40), 14, 25),  # less than a whole number at each step of its slider
        (Count(0, 0, 2**31 - 1), 7, 18),  # without a slider
    ],
)
def test_drags_up_in_a_field_without_the_cursor_move_its_number_as_one_edit_each(qtbot, parameter, value, up):
    """As in other programs. How far does not depend on how often the mouse is read."""
    editor, began = NumberEditor(parameter), []
    qtbot.addWidget(editor)
    editor.resize(280, 40)
    show(qtbot, editor)
    editor.set_value(value)
    editor.field.clearFocus()
    editor.edit_began.connect(lambda: began.append(editor.value()))
    field, left, middle = editor.field, Qt.MouseButton.LeftButton, editor.field.rect().center()

    def drag(*ways, then=Qt.KeyboardModifier.NoModifier):
        qtbot.mousePress(field, left, pos=middle)
        for x, y in ways[:-1]:
            send(field, QEvent.Type.MouseMove, middle - QPoint(x, y), left)
        send(field, QEvent.Type.MouseMove, middle - QPoint(*ways[-1]), left, then)
        send(field, QEvent.Type.MouseButtonRelease, middle - QPoint(*ways[-1]), left)

    drag((0, 5), (0, 25), (0, 40), (0, 44), then=Qt.KeyboardModifier.ShiftModifier)
    assert editor.value() == pytest.approx(up)
    assert began == [value]
    assert field.selectedText() == field.text()
    drag((0, 41), (0, 0))
    assert (editor.value(), field.text()) == (pytest.approx(up), f"{up:g}")
    drag((0, -44), then=Qt.KeyboardModifier.ShiftModifier)
    drag((0, 42))
    assert len(began) == 4
    assert field.cursor().shape() == Qt.CursorShape.SizeVerCursor


def test_a_drag_across_or_while_a_number_is_typed_selects_text(qtbot, editor):
    field, left, middle = editor.field, Qt.MouseButton.LeftButton, editor.field.rect().center()
    field.clearFocus()
    end = middle - QPoint(60, 0)
    for typed in ("", "12 dB"):
        if typed:
            type_into(qtbot, editor, "0")
            qtbot.keyClicks(field, typed)
        qtbot.mousePress(field, left, pos=QPoint(field.width() - 3, middle.y()))
        for place in (end, end, end - QPoint(0, 900)):
            send(field, QEvent.Type.MouseMove, place, left)
        assert field.cursor().shape() == Qt.CursorShape.IBeamCursor or not typed
        send(field, QEvent.Type.MouseButtonRelease, end, left)
        assert field.selectedText() == field.text() == (typed or "0 dB")
    assert editor.value() == 1.0


def test_arrows_move_a_whole_number_that_has_no_slider_to_the_next(qtbot):
    """Such as a seed, of which one wants to hear some."""
    editor = NumberEditor(Count(0, 0, 2**31 - 1, label="Seed"))
    qtbot.addWidget(editor)
    show(qtbot, editor)
    editor.field.setFocus()
    values = []
    editor.value_changed.connect(values.append)
    for key in (Qt.Key.Key_Up, Qt.Key.Key_Up, Qt.Key.Key_Down, Qt.Key.Key_Down, Qt.Key.Key_Down):
        qtbot.keyClick(editor.field, key)
    assert values == [1, 2, 1, 0]
    assert editor.field.text() == "0"


def test_arrows_move_a_number_that_has_no_slider_by_a_digit(qtbot):
    """Such as the ends of an LFO, whose range holds those of all that it may drive."""
    editor = NumberEditor(REGISTRY["lfo"].parameters["high"])
    qtbot.addWidget(editor)
    show(qtbot, editor)
    assert not editor.slider.isVisible()
    up, down, fine = Qt.Key.Key_Up, Qt.Key.Key_Down, Qt.KeyboardModifier.ShiftModifier
    editor.set_value(440.0)
    editor.field.setFocus()
    seen = []
    for key, held in ((up, 0), (down, fine), (down, 0)):
        qtbot.keyClick(editor.field, key, Qt.KeyboardModifier(held))
        seen.append(editor.value())
    assert seen == [450.0, 449.0, 439.0]
    editor.set_value(0.0)
    qtbot.keyClick(editor.field, down)
    assert editor.value() == -0.1
    editor.set_value(editor.parameter.high)
    qtbot.keyClick(editor.field, up)
    assert editor.value() == editor.parameter.high


def test_what_a_field_shows_is_typed_on_at_its_end(qtbot):
    """As in other programs: the number is not typed again to double it."""
    editor = NumberEditor(REGISTRY["low-pass"].parameters["cutoff"])
    qtbot.addWidget(editor)
    show(qtbot, editor)
    editor.set_value(1500.0)
    editor.field.setFocus()
    for text, value in (("*2", 3000.0), ("/4 + 50 Hz", 800.0)):
        qtbot.keyClick(editor.field, Qt.Key.Key_End)
        qtbot.keyClicks(editor.field, text)
        qtbot.keyClick(editor.field, Qt.Key.Key_Return)
        assert editor.value() == value
