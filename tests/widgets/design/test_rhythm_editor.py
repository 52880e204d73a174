"""The bar of a rhythm, under mouse and keys."""

from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st
from msgspec.structs import replace
from on_screen import show
from PySide6.QtCore import QPoint, Qt
from PySide6.QtTest import QTest

from underfoot.models.signals.rhythm import RHYTHMS, STEPS
from underfoot.nodes import REGISTRY
from underfoot.parameters import Rows
from underfoot.patch.groups import Group
from underfoot.patch.patch import Patch
from underfoot.widgets.design.rhythm_editor import RhythmBar, RhythmEditor, placed
from underfoot.widgets.design.workspace import DesignWorkspace

LEFT, NONE = Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier

NOTES = Rows(((0, 4, 1.0), (12, 4, 0.5)), (("step", 0, 23), ("length", 1, 24), ("amplitude", 0.0, 1.0)), most=24)


@pytest.fixture
def bar(qtbot):
    editor = RhythmEditor(NOTES)
    qtbot.addWidget(editor)
    editor.resize(240, 140)
    show(qtbot, editor)
    editor.bar.kept_by = editor  # Python would let go of it, and Qt of the bar
    return editor.bar


def spot(bar: RhythmBar, step: float, height: float) -> QPoint:
    area = bar.area()
    return QPoint(round(area.x() + step / STEPS * area.width()), round(area.bottom() - height * area.height()))


def test_a_click_sets_a_note_and_a_right_click_takes_it_away_each_as_a_change_of_its_own(bar):
    began = []
    bar.edit_began.connect(lambda: began.append(len(bar.notes())))
    QTest.mouseClick(bar, LEFT, NONE, spot(bar, 8.5, 0.5))
    assert [note[:2] for note in bar.notes()] == [(0, 4), (8, 1), (12, 4)]
    assert bar.notes()[1][2] == pytest.approx(0.5, abs=0.02)
    QTest.mouseClick(bar, LEFT, NONE, spot(bar, 20.5, 0.5))
    for step in (8.5, 20.5):
        QTest.mouseClick(bar, Qt.MouseButton.RightButton, NONE, spot(bar, step, 0.2))
    assert [note[0] for note in bar.notes()] == [0, 12]
    assert began == [2, 3, 4, 3]


def test_dragging_moves_a_note_but_not_over_another(bar):
    QTest.mousePress(bar, LEFT, NONE, spot(bar, 13.5, 0.2))
    QTest.mouseMove(bar, spot(bar, 7.5, 0.2))
    assert [note[0] for note in bar.notes()] == [0, 6]
    QTest.mouseMove(bar, spot(bar, 3.5, 0.2))
    QTest.mouseRelease(bar, LEFT, NONE, spot(bar, 3.5, 0.2))
    assert [note[0] for note in bar.notes()] == [0, 6]


def test_dragging_the_right_edge_stretches_each_time_as_a_change_of_its_own(bar):
    began = []
    bar.edit_began.connect(lambda: began.append(bar.notes()[1][1]))
    for before, after in (16.0, 20.0), (20.0, 18.0):
        QTest.mousePress(bar, LEFT, NONE, spot(bar, before, 0.2))
        QTest.mouseMove(bar, spot(bar, after, 0.2))
        QTest.mouseRelease(bar, LEFT, NONE, spot(bar, after, 0.2))
        assert bar.notes()[1][:2] == (12, after - 12)
    assert began == [4, 8]


def test_keys_choose_move_stretch_and_take_away(bar):
    bar.setFocus()
    QTest.keyClick(bar, Qt.Key.Key_P)
    QTest.keyClick(bar, Qt.Key.Key_Right)
    QTest.keyClick(bar, Qt.Key.Key_Right, Qt.KeyboardModifier.ShiftModifier)
    QTest.keyClick(bar, Qt.Key.Key_Up)
    assert bar.notes()[1] == (13, 5, 0.55)
    QTest.keyClick(bar, Qt.Key.Key_Delete)
    QTest.keyClick(bar, Qt.Key.Key_Return)
    assert bar.notes() == [(0, 4, 1.0), (4, 1, 0.6)]


def test_what_keys_do_to_another_note_is_a_change_of_its_own(bar):
    """All of it was undone at once, since the bar had the focus."""
    bar.setFocus()
    began = []
    bar.edit_began.connect(lambda: began.append(len(bar.notes())))
    for key in "N", "Right", "Right", "N", "Up", "PageUp", "Return":
        QTest.keyClick(bar, getattr(Qt.Key, f"Key_{key}"))
    assert bar.notes() == [(0, 1, 0.6), (2, 4, 1.0), (12, 4, 0.6)]
    assert began == [2, 2, 2, 2]


@given(st.lists(st.tuples(st.integers(-2, 25), st.integers(-1, 26), st.floats(0, 1)), max_size=12))
def test_notes_never_lie_on_one_another(wishes):
    notes: list = []
    for wish in wishes:
        notes = placed([*notes, wish], len(notes), wish) or notes
    NOTES.check(notes)
    assert all(a[0] + a[1] <= b[0] for a, b in pairwise(notes))
    assert all(step + length <= STEPS for step, length, _ in notes)


def test_the_menu_has_r1_to_r8_and_gives_their_notes(bar):
    editor = bar.kept_by
    actions = editor.rhythms.menu().actions()
    assert [action.text()[:2] for action in actions] == [f"R{k}" for k in range(1, 9)]
    given, chosen = [], []
    editor.value_changed.connect(given.append)
    editor.rhythm_chosen.connect(chosen.append)
    actions[2].trigger()
    notes = [(note.step, note.length, note.amplitude) for note in RHYTHMS[2].notes]
    assert chosen == [RHYTHMS[2]]
    assert [[tuple(note) for note in value] for value in given] == [notes]
    assert bar.notes() == notes


@pytest.mark.parametrize(
    ("chosen", "key"), [(["rhythm"], "notes"), (["group"], "rhythm.notes"), (["rhythm", "rhythm1"], "notes")]
)
def test_a_rhythm_from_the_menu_sets_bar_and_repeats_too_as_one_change(qtbot, chosen, key):
    """Also where a sub-patch shows the notes, and of several: they were numbers in a table there."""
    workspace = DesignWorkspace(REGISTRY)
    qtbot.addWidget(workspace)
    show(qtbot, workspace)
    patch = Patch().add("rhythm", REGISTRY).add("rhythm", REGISTRY)
    group = Group("group", ("rhythm", "rhythm1"), collapsed=True, published=("rhythm.notes",))
    workspace.set_patch(replace(patch, groups=(group,) if chosen == ["group"] else ()))
    workspace.canvas.patch_scene.select(chosen)
    workspace.inspector.editors[key].rhythms.menu().actions()[2].trigger()
    for node in ("rhythm", "rhythm1")[: len(chosen)]:
        found = workspace.patch().node(node).parameters
        assert (found["bar"], found["repeats"]) == (RHYTHMS[2].bar_s, RHYTHMS[2].repeats)
        assert len(found["notes"]) == len(RHYTHMS[2].notes)
    assert workspace.document.stack.count() == 1
