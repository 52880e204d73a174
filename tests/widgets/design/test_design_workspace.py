"""The Design workspace: inspector and document."""

import pytest
from design_samples import LEFT, REGISTRY, sample, send
from on_screen import show
from PySide6.QtCore import QEvent, QPoint, Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication
from shiboken6 import isValid
from windows import delete_widgets, quiet_window

from underfoot import nodes
from underfoot.engine.target import Target
from underfoot.errors import BadFile
from underfoot.floor.layout import default_floor
from underfoot.patch.patch import Patch
from underfoot.widgets.controls.fields import ParameterEditor
from underfoot.widgets.design.shared_parameters import shared_parameters
from underfoot.widgets.design.workspace import DesignWorkspace
from underfoot.widgets.window import MainWindow

# --- the inspector ---


def test_typing_a_number_with_its_unit_sets_the_parameter(workspace, qtbot):
    workspace.canvas.patch_scene.select(["step"])
    field = workspace.inspector.editors["threshold"].field
    with qtbot.waitSignal(workspace.patch_edited) as edited:
        field.setFocus()
        field.selectAll()
        QTest.keyClicks(field, "0.25 kN")
        QTest.keyClick(field, Qt.Key.Key_Return)
    assert edited.args[0].node("step").parameters == {"threshold": 250.0}
    assert "250 N" in field.text()


def test_what_is_out_of_range_is_not_taken_and_says_why(workspace):
    workspace.canvas.patch_scene.select(["step"])
    before = workspace.patch()
    field = workspace.inspector.editors["threshold"].field
    field.setFocus()
    field.selectAll()
    QTest.keyClicks(field, "5000")
    QTest.keyClick(field, Qt.Key.Key_Return)
    assert workspace.patch() == before
    assert "1 to 1000 N" in field.toolTip()
    QTest.keyClick(field, Qt.Key.Key_Escape)
    assert "30 N" in field.text()


@pytest.mark.parametrize("leave", ["tab", "click"])
def test_what_is_refused_when_its_field_is_left_is_said_on_the_canvas(workspace, leave):
    workspace.canvas.patch_scene.select(["step"])
    field = workspace.inspector.editors["threshold"].field
    QTest.mouseClick(field, Qt.MouseButton.LeftButton)
    QTest.keyClicks(field, "3000")
    if leave == "tab":
        QTest.keyClick(field, Qt.Key.Key_Tab)
        assert field.text() == "30 N"
    else:
        QTest.mouseClick(workspace.canvas.viewport(), Qt.MouseButton.LeftButton, pos=QPoint(5, 5))
    assert workspace.canvas.message == "Threshold: 3000.0; allowed: 1 to 1000 N"
    assert workspace.document.stack.count() == 0


def test_what_a_table_refuses_is_said_on_the_canvas(qtbot):
    workspace = DesignWorkspace(nodes.REGISTRY)
    qtbot.addWidget(workspace)
    workspace.set_patch(Patch().add("breakpoints", nodes.REGISTRY))
    workspace.canvas.patch_scene.select(["breakpoints"])
    workspace.inspector.editors["points"].table.item(0, 0).setText("soon")
    assert workspace.canvas.message.startswith("Points: 'soon' is not a number")
    assert workspace.document.stack.count() == 0


def test_undo_in_the_field_of_a_number_is_of_the_patch_unless_something_is_being_typed(workspace):
    control, shift = Qt.KeyboardModifier.ControlModifier, Qt.KeyboardModifier.ShiftModifier
    workspace.canvas.patch_scene.select(["step"])
    field = workspace.inspector.editors["threshold"].field
    field.setFocus()
    field.selectAll()
    QTest.keyClicks(field, "250")
    QTest.keyClick(field, Qt.Key.Key_Return)
    QTest.keyClick(field, Qt.Key.Key_Z, control)
    assert (workspace.patch(), field.text(), field.selectedText()) == (sample(), "30 N", "30 N")
    QTest.keyClick(field, Qt.Key.Key_Z, control | shift)
    assert workspace.patch().node("step").parameters == {"threshold": 250.0}
    assert field.text() == "250 N"
    QTest.keyClicks(field, "3")
    QTest.keyClick(field, Qt.Key.Key_Z, control)
    assert field.text() == "250 N"
    assert workspace.patch().node("step").parameters == {"threshold": 250.0}


def test_both_customs_of_redo_are_there_and_the_sheet_names_keys_that_a_keyboard_has(workspace):
    control, shift = Qt.KeyboardModifier.ControlModifier, Qt.KeyboardModifier.ShiftModifier
    moved = sample().move({"hum": (0.0, 400.0)})
    workspace.document.edit(moved, "Move")
    for key, held in ((Qt.Key.Key_Y, control), (Qt.Key.Key_Z, control | shift)):
        QTest.keyClick(workspace.canvas, Qt.Key.Key_Z, control)
        assert workspace.patch() == sample()
        QTest.keyClick(workspace.canvas, key, held)
        assert workspace.patch() == moved
    told = dict(workspace.shortcuts)
    assert (told["Undo"], told["Redo"]) == ("Ctrl+Z", "Ctrl+Shift+Z, Ctrl+Y")
    assert told["Move what is selected, or else the view"].startswith("Arrow keys")
    assert told["Left edges in line"] == "Ctrl+Shift+Left"


def test_dragging_a_slider_is_one_step_of_undo(workspace):
    workspace.canvas.patch_scene.select(["hum"])
    slider = workspace.inspector.editors["frequency"].slider
    y = slider.height() // 2
    send(slider, QEvent.Type.MouseButtonPress, QPoint(20, y), LEFT)
    for x in (40, 80, 120, slider.width()):
        send(slider, QEvent.Type.MouseMove, QPoint(x, y), LEFT)
    send(slider, QEvent.Type.MouseButtonRelease, QPoint(slider.width(), y), LEFT)
    assert workspace.patch().node("hum").parameters["frequency"] == 1000.0
    assert workspace.document.stack.count() == 1
    send(slider, QEvent.Type.MouseButtonPress, QPoint(20, y), LEFT)
    send(slider, QEvent.Type.MouseButtonRelease, QPoint(20, y), LEFT)
    assert workspace.document.stack.count() == 2
    workspace.undo_action.trigger()
    workspace.undo_action.trigger()
    assert workspace.patch() == sample()
    assert workspace.inspector.editors["frequency"].value() == 50.0


def test_every_control_of_a_node_can_be_reached_and_reset(workspace):
    workspace.canvas.patch_scene.select(["hum"])
    editors = workspace.inspector.editors
    assert list(editors) == ["frequency", "chains", "sharing"]
    editors["chains"].slider.setFocus()
    QTest.keyClick(editors["chains"].slider, Qt.Key.Key_Home)
    assert workspace.patch().node("hum").parameters["chains"] == 1
    editors["sharing"].box.setFocus()
    QTest.keyClick(editors["sharing"].box, Qt.Key.Key_Down)
    assert workspace.patch().node("hum").parameters["sharing"] == "local"
    editors["chains"].reset_button.click()
    editors["sharing"].reset_button.click()
    assert editors["chains"].value() == 2000
    assert workspace.patch().node("hum").parameters == {"chains": 2000, "sharing": "global"}
    assert editors["chains"].reset_button.isHidden()


def test_tiles_are_chosen_by_buttons(workspace):
    workspace.canvas.patch_scene.select(["shaker"])
    buttons = workspace.inspector.editors["tiles"].buttons
    assert list(buttons) == ["all", "t1", "t2", "t3", "t4"]
    buttons["t3"].click()
    buttons["t1"].click()
    assert workspace.patch().node("shaker").parameters["tiles"] == "t1+t3"
    buttons["t3"].click()
    buttons["t1"].click()
    assert workspace.patch().node("shaker").parameters["tiles"] == "all"


def test_the_buttons_of_tiles_with_long_ids_can_be_read(workspace, qtbot):
    workspace.inspector.set_tiles(["jump-front-left", "jump-front-right", "landing"])
    workspace.canvas.patch_scene.select(["shaker"])
    buttons = workspace.inspector.editors["tiles"].buttons.values()
    qtbot.waitUntil(lambda: all(button.isVisible() for button in buttons))
    assert [button.text() for button in buttons if button.width() < button.sizeHint().width()] == []
    assert [button.accessibleName() for button in buttons][::3] == ["All tiles", "Tile landing"]  # a word to read aloud


def test_the_tiles_of_the_floor_are_offered_before_its_session_is_open(qtbot, tmp_path):
    window = MainWindow(tmp_path, Target(default_floor(1, 2)))
    qtbot.addWidget(window, before_close_func=lambda w: w.leave())
    show(qtbot, window)
    design = window.workspaces["Design"]
    design.canvas.add("tile-output")
    assert list(design.inspector.editors["tiles"].buttons) == ["all", "t1", "t2"]


def test_with_nothing_selected_the_patch_itself_is_edited(workspace):
    workspace.canvas.patch_scene.select([])
    field = workspace.inspector.editors["title"].field
    field.setFocus()
    field.selectAll()
    QTest.keyClicks(field, "Gravel")
    QTest.keyClick(field, Qt.Key.Key_Return)
    assert workspace.patch().title == "Gravel"
    workspace.undo_action.trigger()
    assert workspace.patch().title == "sample"


# --- the document ---


def test_a_patch_is_the_same_after_saving_and_opening(workspace, tmp_path):
    workspace.canvas.patch_scene.select(["step"])
    workspace.inspector.edited.emit(["step"], "threshold", 44.0, "")
    path = tmp_path / "sample.json"
    workspace.patch().save(path, REGISTRY)
    edited = workspace.patch()
    workspace.set_patch(Patch())
    assert not workspace.canvas.patch_scene.nodes
    workspace.set_patch(Patch.load(path, REGISTRY))
    assert workspace.patch() == edited
    assert not workspace.document.stack.canUndo()


def test_a_file_that_is_no_patch_is_not_taken():
    with pytest.raises(BadFile):
        Patch.loads("{}", REGISTRY)


def test_set_patch_does_not_say_that_it_was_edited(workspace, qtbot):
    with qtbot.assertNotEmitted(workspace.patch_edited):
        workspace.set_patch(sample())


# --- several nodes ---


def test_the_same_parameter_of_several_nodes_is_set_at_once(workspace):
    before = workspace.patch().add("hum", REGISTRY, (0.0, 400.0), frequency=80.0, sharing="local")
    workspace.set_patch(before)
    workspace.canvas.patch_scene.select(["hum", "hum1"])
    editors = workspace.inspector.editors
    assert list(editors) == ["frequency", "chains", "sharing"]
    assert editors["frequency"].label.text() == "Frequency: 50 Hz to 80 Hz"
    assert editors["chains"].label.text() == "Chains"
    assert editors["sharing"].label.text() == "Sharing: several values"
    assert editors["frequency"].reset_button.isVisible()  # also where the first of them has its default
    field = editors["frequency"].field
    field.setFocus()
    field.selectAll()
    QTest.keyClicks(field, "60")
    QTest.keyClick(field, Qt.Key.Key_Return)
    assert [workspace.patch().node(id).parameters["frequency"] for id in ("hum", "hum1")] == [60.0, 60.0]
    assert editors["frequency"].label.text() == "Frequency"
    assert workspace.undo_action.text() == "Undo: set frequency of 2 nodes"
    slider = editors["chains"].slider
    for place in (0.2, 0.6):
        slider.moved.emit(place)
    assert workspace.document.stack.count() == 2
    workspace.undo_action.trigger()
    workspace.undo_action.trigger()
    assert workspace.patch() == before


def test_nodes_of_other_types_share_what_has_the_same_name_and_unit():
    def shared(*types):
        return shared_parameters([nodes.REGISTRY[type] for type in types])

    assert "cutoff" in shared("low-pass", "high-pass")
    assert "gain" not in shared("gain", "low-pass")
    low, high = (nodes.REGISTRY[type].parameters["cutoff"] for type in ("low-pass", "high-pass"))
    both = shared("low-pass", "high-pass")["cutoff"]
    assert (both.low, both.high) == (max(low.low, high.low), min(low.high, high.high))


def test_undo_says_what_it_takes_back(workspace, qtbot):
    workspace.canvas.patch_scene.select(["push", "step", "hum"])
    QTest.keyClick(workspace.canvas, Qt.Key.Key_Right)
    assert workspace.undo_action.text() == "Undo: move 3 nodes"
    assert workspace.redo_action.text() == "Redo"
    assert not workspace.redo_action.isEnabled()
    with qtbot.waitSignal(workspace.notified) as said:
        QTest.keyClick(workspace.canvas, Qt.Key.Key_Z, Qt.KeyboardModifier.ControlModifier)
    assert said.args == ["Undone: move 3 nodes"]
    assert workspace.redo_action.text() == "Redo: move 3 nodes"
    with qtbot.waitSignal(workspace.notified) as said:
        workspace.redo_action.trigger()
    assert said.args == ["Redone: move 3 nodes"]


def test_the_preview_has_the_name_that_a_node_was_given(qtbot, workspace):
    workspace.canvas.patch_scene.select(["hum"])
    qtbot.waitUntil(lambda: workspace.preview.title.full_text == "Hum")
    workspace.document.edit(workspace.patch().name("hum", "Engine"), "Rename")
    qtbot.waitUntil(lambda: workspace.preview.title.full_text == "Engine")


def test_undo_that_takes_the_node_of_a_field_away_leaves_the_focus_to_the_canvas(qtbot, tmp_path):
    undo = Qt.Key.Key_Z, Qt.KeyboardModifier.ControlModifier
    workspace = quiet_window(qtbot, tmp_path).workspaces["Design"]
    workspace.canvas.add("tone")
    field = workspace.inspector.editors["frequency"].field
    field.setFocus()
    QTest.keyClicks(field, "60")
    QTest.keyClick(field, Qt.Key.Key_Return)
    QTest.keyClick(field, *undo)
    assert field.hasFocus()
    QTest.keyClick(field, *undo)
    assert "tone" not in [node.id for node in workspace.patch().nodes]
    assert workspace.canvas.hasFocus()


def test_what_is_typed_when_another_node_is_selected_is_set_and_the_page_is_that_of_the_other(workspace):
    workspace.canvas.patch_scene.select(["hum"])
    field = workspace.inspector.editors["frequency"].field
    field.setFocus()
    field.selectAll()
    QTest.keyClicks(field, "77")
    workspace.canvas.patch_scene.select(["step"])
    assert workspace.patch().node("hum").parameters["frequency"] == 77.0
    shown = [one for one in workspace.inspector.findChildren(ParameterEditor) if one.isVisible()]
    assert shown == list(workspace.inspector.editors.values()) != []
    assert workspace.canvas.hasFocus()


def test_a_key_leads_from_the_canvas_to_the_parameters_and_back(workspace):
    """Fifteen Tabs lay between."""
    QTest.keyClick(workspace.canvas, Qt.Key.Key_F6)
    assert QApplication.focusWidget() is workspace.inspector.editors["title"].field
    workspace.canvas.patch_scene.select(["hum"])
    QTest.keyClick(workspace.canvas, Qt.Key.Key_F6)
    field = workspace.inspector.editors["frequency"].field
    assert field.hasFocus()
    QTest.keyClicks(field, "60")
    QTest.keyClick(field, Qt.Key.Key_F6)
    assert workspace.canvas.hasFocus()
    assert workspace.patch().node("hum").parameters == {"frequency": 60.0}
    workspace.canvas.patch_scene.select(["hum", "push"])
    view = workspace.canvas.viewport()
    QTest.keyClick(workspace.canvas, Qt.Key.Key_F6)
    assert workspace.canvas.message == "What is selected has no parameters to change"
    assert workspace.canvas.hasFocus()
    workspace.canvas.patch_scene.select(["hum"])
    delete_widgets()
    assert isValid(view), "none but the page is gone"


# --- copies in other folders ---


def test_a_sound_file_is_found_where_its_player_is_pasted(qtbot, tmp_path):
    def opened(folder, patch, key):
        made = DesignWorkspace(nodes.REGISTRY)
        qtbot.addWidget(made)
        made.set_folder(folder)
        made.set_patch(patch)
        show(qtbot, made)
        made.canvas.select_all()
        QTest.keyClick(made.canvas, key, Qt.KeyboardModifier.ControlModifier)
        return made.patch().nodes[-1].parameters["file"]

    opened(tmp_path / "one", Patch().add("wav-player", nodes.REGISTRY, file="hiss.wav"), Qt.Key.Key_C)
    file = tmp_path / "one" / "hiss.wav"
    assert opened(tmp_path / "one", Patch(), Qt.Key.Key_V) == "hiss.wav"
    assert opened(tmp_path / "two", Patch(), Qt.Key.Key_V) == str(file)
    assert opened(tmp_path, Patch(), Qt.Key.Key_V) == str(file.relative_to(tmp_path))
