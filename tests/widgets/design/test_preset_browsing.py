"""Presets in the window: heard, opened as an edit, saved, and found again."""

import pytest
from PySide6.QtCore import QPoint, QPointF, Qt
from PySide6.QtGui import QDragEnterEvent, QDropEvent
from PySide6.QtWidgets import QApplication, QMessageBox
from windows import noise_patch, quiet_window

from underfoot.nodes import REGISTRY
from underfoot.patch import preset_files
from underfoot.patch.patch import Patch
from underfoot.widgets.design.preset_browsing import PresetDialog
from underfoot.widgets.design.preset_drops import dragged


@pytest.fixture
def window(qtbot, tmp_path):
    noise_patch().save(tmp_path / "hiss.json")
    return quiet_window(qtbot, tmp_path / "kept", tmp_path / "hiss.json")


@pytest.fixture
def design(window):
    return window.workspaces["Design"]


def opened(qtbot, design, words):
    qtbot.keyClick(design.canvas, Qt.Key.Key_P, Qt.KeyboardModifier.ControlModifier)
    field = design.side.presets.field
    assert field.hasFocus()
    qtbot.keyClicks(field, words)
    qtbot.keyClick(field, Qt.Key.Key_Return)


def test_a_preset_is_opened_as_an_edit_that_undo_takes_back_with_its_file(window, design, qtbot, tmp_path):
    before = window.open_patch.path
    opened(qtbot, design, "ice")
    assert design.patch() == Patch.load(preset_files.patches()["material-ice"], REGISTRY)
    assert window.open_patch.path is None  # saving asks, and never writes over hiss.json
    assert window.open_patch.is_saved
    qtbot.keyClick(QApplication.focusWidget(), Qt.Key.Key_Z, Qt.KeyboardModifier.ControlModifier)
    assert design.patch() == noise_patch()
    assert design.side.presets.field.text() == "ice"  # what was typed was used, and is not what undo is about
    assert window.open_patch.path == before
    design.redo_action.trigger()
    assert design.patch().title == "Ice"
    assert window.open_patch.path is None


def test_work_that_was_not_saved_is_still_asked_for_after_a_preset_was_opened(window, design, qtbot):
    design.document.edit(design.patch().set("noise", "amplitude", 0.25, REGISTRY), "Set")
    opened(qtbot, design, "ice")
    assert not window.open_patch.is_saved


def test_a_preset_is_heard_in_place_of_the_patch_which_stays_as_it_is(window, design, qtbot):
    qtbot.keyClick(design.canvas, Qt.Key.Key_P, Qt.KeyboardModifier.ControlModifier)
    field = design.side.presets.field
    qtbot.keyClicks(field, "ice")
    qtbot.keyClick(field, Qt.Key.Key_Down)
    qtbot.waitUntil(lambda: window.controller.patch.title == "Ice")
    assert design.patch() == noise_patch()
    qtbot.keyClick(field, Qt.Key.Key_Escape)
    assert window.controller.patch.title == noise_patch().title
    assert window.open_patch.is_saved


def test_escape_goes_back_to_the_canvas_and_is_no_panic_where_nothing_was_typed(window, design, qtbot, monkeypatch):
    panics = []
    monkeypatch.setattr(window.controller, "panic", lambda: panics.append(1))
    for way in ("field", "list"):
        qtbot.keyClick(design.canvas, Qt.Key.Key_P, Qt.KeyboardModifier.ControlModifier)
        into = getattr(design.side.presets, way)
        into.setFocus()
        qtbot.waitUntil(into.hasFocus)
        qtbot.keyClick(into, Qt.Key.Key_Down)
        qtbot.keyClick(into, Qt.Key.Key_Escape)
        assert design.canvas.hasFocus()
    assert not panics
    qtbot.keyClick(design.canvas, Qt.Key.Key_Escape)
    assert panics


def test_ones_own_preset_is_saved_found_by_its_tag_and_not_replaced_without_asking(window, design, qtbot):
    design.browsing.save_action.trigger()
    dialog = window.findChild(PresetDialog)
    dialog.title.selectAll()
    qtbot.keyClicks(dialog.title, "Soft hiss")
    qtbot.keyClicks(dialog.tags, "airy, airy, quiet")
    qtbot.keyClicks(dialog.author, "Ann")
    qtbot.keyClick(dialog, Qt.Key.Key_Return)
    saved = Patch.load(design.browsing.folder / "soft-hiss.json", REGISTRY)
    assert (saved.title, saved.tags, saved.author) == ("Soft hiss", ("airy", "quiet"), "Ann")
    field = design.side.presets.field
    qtbot.keyClicks(field, "airy")
    assert [preset.title for preset in design.side.presets.list.presets()] == ["Soft hiss"]
    design.browsing.save_action.trigger()
    again = window.findChildren(PresetDialog)[-1]
    again.title.setText("Soft hiss")
    qtbot.keyClick(again, Qt.Key.Key_Return)
    assert "Replace it?" in window.findChild(QMessageBox).text()


def test_author_and_tags_are_not_in_a_file_that_has_none():
    assert b"tags" not in noise_patch().dumps()
    assert b"author" not in noise_patch().dumps()


def drop(widget, name):
    data = dragged(preset_files.patches()[name])
    none = Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier
    place, copy = QPointF(10, 10), Qt.DropAction.CopyAction
    entered = QDragEnterEvent(place.toPoint(), copy, data, *none)
    QApplication.sendEvent(widget, entered)
    assert entered.isAccepted()
    QApplication.sendEvent(widget, QDropEvent(place, copy, data, *none))


def test_a_preset_is_dropped_on_the_canvas_or_on_a_slot_and_taken_back_there(window, design, qtbot):
    drop(design.canvas.viewport(), "material-ice")
    assert design.patch().title == "Ice"
    design.undo_action.trigger()
    assert design.patch() == noise_patch()
    drop(design.listen_bar.slots["A"], "material-ice")
    assert (window.open_patch.slot, design.patch().title) == ("A", "Ice")
    for name in ("material-ice", "gravel"):
        drop(design.listen_bar.slots["B"], name)
    assert (window.open_patch.slot, design.patch().title) == ("A", "Ice")
    qtbot.keyClick(design.canvas, Qt.Key.Key_X)
    assert design.patch().title == "Gravel underfoot"
    design.undo_action.trigger()
    assert design.patch().title == "Ice"


def test_a_preset_that_is_opened_is_in_view_wherever_one_has_looked(window, design, qtbot):
    design.canvas.pan(4000, 3000)
    opened(qtbot, design, "ice")
    view = design.canvas.mapToScene(design.canvas.viewport().rect()).boundingRect()
    assert view.contains(design.canvas.patch_scene.nodes["tile"].sceneBoundingRect())


def test_the_keys_of_presets_stand_in_the_sheet_of_shortcuts(design):
    told = dict(design.shortcuts)
    assert told["Presets beside the canvas"] == "Ctrl+P"
    assert told["Save as preset"] == "Ctrl+Alt+S"


def keep(design, patch):
    """Write a preset of the user's, as another window would."""
    design.browsing.folder.mkdir(parents=True, exist_ok=True)
    patch.save(design.browsing.folder / "own.json")


def put_in(design, qtbot, words):
    """Find a preset by these words, and put it into the patch."""
    qtbot.keyClick(design.canvas, Qt.Key.Key_P, Qt.KeyboardModifier.ControlModifier)
    qtbot.keyClicks(design.side.presets.field, words)
    qtbot.keyClick(design.side.presets.field, Qt.Key.Key_Return, Qt.KeyboardModifier.ShiftModifier)


@pytest.mark.parametrize("on_list", [False, True])
def test_a_preset_is_put_into_the_patch_as_a_sub_patch_and_taken_out_again(window, design, qtbot, on_list):
    before, ice = design.patch(), Patch.load(preset_files.patches()["material-ice"], REGISTRY)
    qtbot.keyClick(design.canvas, Qt.Key.Key_P, Qt.KeyboardModifier.ControlModifier)
    panel = design.side.presets
    qtbot.keyClicks(panel.field, "ice")
    panel.list.step(1)
    qtbot.keyClick(panel.list if on_list else panel.field, Qt.Key.Key_Return, Qt.KeyboardModifier.ShiftModifier)
    after = design.patch()
    assert after.nodes[: len(before.nodes)] == before.nodes
    assert len(after.nodes) == len(before.nodes) + len(ice.nodes)
    assert len(after.wires) == len(before.wires) + len(ice.wires)
    group = next(group for group in after.groups if group.title == ice.title)
    assert group.collapsed
    assert set(group.members) >= {node.id for node in after.nodes[len(before.nodes) :]}
    assert design.canvas.patch_scene.selected() == [group.id]
    assert window.open_patch.path is not None
    design.undo_action.trigger()
    assert design.patch() == before


def test_an_empty_preset_is_not_put_in_and_the_line_says_why(window, design, qtbot):
    before = design.patch()
    keep(design, Patch(title="Nothing yet"))
    put_in(design, qtbot, "nothing yet")
    assert design.patch() == before
    assert window.status.message == "“Nothing yet” is an empty patch: there is nothing to insert"


def test_a_preset_with_a_title_too_long_for_a_group_is_put_in_view_under_its_beginning(window, design, qtbot):
    title, canvas = "Gravel under a heavy boot, " * 6, design.canvas
    keep(design, Patch(title=title).add("noise", REGISTRY, (5000.0, 5000.0)))
    seen = canvas.mapToScene(canvas.viewport().rect()).boundingRect()
    put_in(design, qtbot, "heavy boot")
    assert seen.contains(QPointF(*design.patch().groups[0].at))
    assert title.startswith(design.patch().groups[0].title)
    assert design.document.stack.undoText().startswith("Insert Gravel under a heavy boot")


def test_what_undo_brings_back_is_in_view(design, qtbot):
    first = Patch().add("noise", REGISTRY, (5000.0, 5000.0))
    design.document.edit(first, "Far away")
    opened(qtbot, design, "ice")
    for action in (design.undo_action, design.redo_action):
        action.trigger()
        canvas = design.canvas
        places = [canvas.mapFromScene(item.sceneBoundingRect().center()) for item in canvas.patch_scene.nodes.values()]
        assert any(canvas.viewport().rect().contains(place) for place in places)


def test_both_lists_have_their_words_at_the_same_place(window, design, qtbot):
    places = [design.node_palette.field.mapTo(design, QPoint())]
    qtbot.keyClick(design.canvas, Qt.Key.Key_P, Qt.KeyboardModifier.ControlModifier)
    QApplication.processEvents()
    assert [design.side.presets.field.mapTo(design, QPoint())] == places


def test_the_menu_has_the_commands_of_presets(window, design, qtbot):
    actions = {action.text(): action for action in window.menu.actions()}
    assert actions["Presets beside the canvas"].shortcut().toString() == "Ctrl+P"
    actions["Save as preset…"].trigger()
    dialog = window.findChild(PresetDialog)
    assert dialog.isVisible()
    dialog.reject()
    qtbot.waitUntil(lambda: not window.findChildren(PresetDialog))
