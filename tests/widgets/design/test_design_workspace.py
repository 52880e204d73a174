"""The Design workspace: inspector, document, and what the engine says."""

import numpy as np
import pytest
from design_samples import LEFT, NONE, REGISTRY, sample, send
from msgspec.structs import replace
from on_screen import show
from PySide6.QtCore import QCoreApplication, QEvent, QPoint, Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QLabel
from windows import quiet_window

from underfoot import nodes
from underfoot.drawing import Drawing, Series
from underfoot.engine.reports import Costs, Distributions, Fault, Outlines, Preview
from underfoot.engine.target import Target
from underfoot.errors import BadFile
from underfoot.floor.layout import default_floor
from underfoot.patch.patch import Patch
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
    told = dict(workspace.shortcuts())
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


# --- what the engine says ---


def test_previews_are_asked_for_and_shown(workspace, qtbot):
    with qtbot.waitSignal(workspace.previews.preview_requested) as wanted:
        workspace.canvas.patch_scene.select(["hum"])
    assert wanted.args == ["hum", "t1", False]
    time_s = np.arange(4800) / 48000
    signal = 3.0 * np.sin(2 * np.pi * 250 * time_s)
    workspace.previews.show_preview(Preview(1, 48000.0, np.full(4800, 700.0), {"out": signal}), "hum")
    assert "peak 3 m/s²" in workspace.preview.note.full_text
    with qtbot.waitSignal(workspace.previews.preview_requested) as wanted:
        workspace.inspector.edited.emit(["hum"], "frequency", 60.0, "")
    assert wanted.args == ["hum", "t1", False]


def test_the_preview_is_of_the_tile_that_is_chosen_beside_it(workspace, qtbot):
    with qtbot.waitSignal(workspace.previews.preview_requested):
        workspace.canvas.patch_scene.select(["hum"])
    workspace.previews.show_preview(Preview(1, 48000.0, np.ones(4800), {"out": np.zeros(4800)}), "hum")
    with qtbot.waitSignal(workspace.previews.preview_requested) as wanted:
        QTest.keyClick(workspace.preview.tiles, Qt.Key.Key_Down)
    assert wanted.args == ["hum", "t2", False]
    assert workspace.preview.pad.tile.id == "t2"
    with qtbot.waitSignal(workspace.previews.small_plots.outlines_requested) as wanted:
        workspace.previews.show_preview(Preview(2, 48000.0, np.ones(4800), {"out": np.zeros(4800)}), "hum")
    assert {*wanted.args[0], "hum"} == {node.id for node in workspace.patch().nodes}


def test_small_plots_come_together_and_what_was_edited_meanwhile_is_asked_for_again(workspace, qtbot):
    others = {node.id for node in workspace.patch().nodes} - {"hum"}
    with qtbot.waitSignal(workspace.previews.preview_requested):
        workspace.canvas.patch_scene.select(["hum"])
    with qtbot.waitSignal(workspace.previews.small_plots.outlines_requested) as wanted:
        workspace.previews.show_preview(Preview(1, 48000.0, np.ones(4800), {"out": np.zeros(4800)}), "hum")
    assert set(wanted.args[0]) == others
    workspace.inspector.edited.emit(["step"], "threshold", 60.0, "")
    reached = []
    workspace.previews.small_plots.signal_ranges_changed.connect(lambda reach: reached.append(dict(reach)))
    outlines = Outlines(1, {"push.force": np.array([-2.0, 3.0])}, {"step.onset": np.array([[0.5, 1.0]])})
    with qtbot.waitSignal(workspace.previews.small_plots.outlines_requested) as wanted:
        workspace.previews.show_outlines(outlines)
    assert reached[-1]["push.force"] == (-2.0, 3.0)
    assert wanted.args[0] == ["step"]


def test_a_node_of_another_patch_does_not_show_the_plot_of_the_one_that_had_its_id(workspace):
    canvas, node = workspace.canvas, workspace.canvas.patch_scene.nodes["hum"]

    def picture(title, frequency):
        patch = workspace.patch().set("hum", "frequency", frequency, REGISTRY)
        workspace.document.edit(replace(patch, title=title), "Edit")
        return canvas.viewport().grab(canvas.mapFromScene(node.sceneBoundingRect()).boundingRect()).toImage()

    bare = picture("One", 60.0)
    workspace.previews.show_preview(Preview(1, 48000.0, np.ones(4800), {"out": np.ones(4800)}), "hum")
    drawn = picture("One", 61.0)
    assert drawn != bare, "until the new one comes"
    assert picture("A new title", 61.0) == drawn
    assert picture("Another", 62.0) == bare


@pytest.mark.parametrize("strengths", [(1.0, 0.2), (0.2, -1.0), (-1.0, -0.1)])
def test_events_of_any_sign_are_drawn_within_their_node(workspace, qapp, strengths):
    canvas, step = workspace.canvas, workspace.canvas.patch_scene.nodes["step"]
    room = canvas.mapFromScene(step.mapToScene(step.geometry.rect)).boundingRect()
    below = room.translated(0, room.height() + 1)
    bare = [canvas.viewport().grab(area).toImage() for area in (room, below)]
    step.set_curve(np.array([(0.3, strengths[0]), (0.6, strengths[1])]))
    drawn = [canvas.viewport().grab(area).toImage() for area in (room, below)]
    assert drawn[0] != bare[0]
    assert drawn[1] == bare[1]


def test_a_preview_of_a_tile_that_is_gone_is_asked_for_again(workspace, qtbot):
    QTest.keyClick(workspace.preview.tiles, Qt.Key.Key_Down)
    with qtbot.waitSignal(workspace.previews.preview_requested):
        workspace.canvas.patch_scene.select(["hum"])
    with qtbot.waitSignal(workspace.previews.preview_requested) as wanted:
        workspace.set_floor(default_floor(1, 1).tiles)
    assert wanted.args == ["hum", "t1", False]


def test_distributions_are_asked_for_with_the_preview_and_take_its_place(workspace, qtbot):
    with qtbot.waitSignal(workspace.previews.preview_requested) as wanted:
        workspace.canvas.patch_scene.select(["hum"])
    assert wanted.args[2] is False
    assert not workspace.preview.distributions.isVisible()
    workspace.preview.expect("hum", nodes.REGISTRY["stick-slip"])
    assert workspace.preview.distributions.isVisible()
    with qtbot.waitSignal(workspace.preview.distributions_requested):
        QTest.mouseClick(workspace.preview.distributions, Qt.MouseButton.LeftButton)
    assert workspace.preview.wants_distributions
    distributions = workspace.preview.distribution_view
    assert distributions.text.isVisible()
    assert not any(plot.isVisible() for plot in distributions.plots), "axes of nothing"
    drawing = Drawing("How long", "duration, ms", "density", (Series("exact", np.arange(3.0), np.arange(3.0)),))
    workspace.preview.show_distributions(Distributions(1, (drawing,)))
    assert distributions.plots[0].isVisible()
    assert distributions.plots[0].drawing is drawing
    assert not distributions.plots[1].isVisible()
    assert not workspace.preview.plots.waveform.isVisible()
    QTest.mouseClick(workspace.preview.distributions, Qt.MouseButton.LeftButton)
    assert workspace.preview.plots.waveform.isVisible()


def test_the_preview_of_an_event_output_shows_its_events(workspace, qtbot):
    workspace.canvas.patch_scene.select(["step"])
    with qtbot.waitSignal(workspace.previews.preview_requested):
        pass
    events = np.array([[480.0, 1.0, 0.0], [960.0, 0.5, 0.0]])
    workspace.previews.show_preview(Preview(1, 48000.0, np.ones(4800), {}, events={"onset": events}), "step")
    assert "2 events" in workspace.preview.note.full_text


def test_a_preview_that_failed_says_why(workspace, qtbot):
    workspace.canvas.patch_scene.select(["hum"])
    with qtbot.waitSignal(workspace.previews.preview_requested):
        pass
    workspace.previews.show_preview(Preview(1, 48000.0, np.zeros(0), {}, "no such file"), "hum")
    assert workspace.preview.note.full_text == "no such file"


def test_costs_sleep_and_faults_are_shown_on_the_nodes(workspace):
    scene = workspace.canvas.patch_scene
    shares, awake = {"push": 0.001, "step": 0.02, "shaker": 0.3}, {"push": 1, "step": 0, "shaker": 2}
    workspace.show_costs(Costs(shares, awake, ("hum",)))
    states = {id: (item.cost, item.state) for id, item in scene.nodes.items()}
    assert states == {
        "push": ("0.1 %", ""),
        "step": ("2.0 %", "asleep"),
        "hum": ("", "unused"),
        "shaker": ("30 %", ""),
    }
    workspace.show_fault(Fault("hum", "t1", 0))
    assert scene.nodes["hum"].state == "fault"
    assert "not finite" in workspace.canvas.message
    workspace.canvas.show_message("")
    pictures = []
    for chosen in ([], ["hum"]):
        scene.select(chosen)
        pictures.append(workspace.canvas.viewport().grab().toImage())
    assert pictures[0] != pictures[1], "that it is selected is seen, too"
    document = workspace.document
    document.edit(document.patch.move({"hum": (0.0, 400.0)}), "Move")
    assert scene.nodes["hum"].state == "fault"
    document.edit(document.patch.set("hum", "frequency", 81.0, REGISTRY), "Set frequency")
    assert scene.nodes["hum"].state == "", "what may have mended it takes the mark away"


def test_why_a_node_costs_nothing_fits_the_inspector(workspace, qtbot):
    """Its end, "that plays", was cut off."""
    workspace.canvas.patch_scene.select(["hum"])
    workspace.show_costs(Costs({"shaker": 0.3}, {"shaker": 2}, ("hum",)))
    labels = workspace.inspector.findChildren(QLabel)
    label = next(one for one in labels if "reaches no output that plays" in one.text())
    room = label.rect().adjusted(0, 0, 0, 1000)
    needed = label.fontMetrics().boundingRect(room, Qt.TextFlag.TextWordWrap, label.text())
    qtbot.waitUntil(lambda: label.height() >= needed.height(), timeout=5000)


def test_a_click_on_the_tile_strikes_and_a_drag_presses(workspace, qtbot):
    pad = workspace.preview.pad
    centre = pad.rect().center()
    with qtbot.waitSignal(workspace.struck) as struck, qtbot.assertNotEmitted(workspace.pressed):
        QTest.mouseClick(pad, LEFT, NONE, centre)
    assert struck.args == ["t1", 1.0]
    forces = []
    workspace.pressed.connect(lambda tile, x, y, force: forces.append((tile, round(x, 2), round(y, 2), force)))
    send(pad, QEvent.Type.MouseButtonPress, centre, LEFT)
    for by in (10, 20, 40):
        send(pad, QEvent.Type.MouseMove, centre + QPoint(by, 0), LEFT)
    send(pad, QEvent.Type.MouseButtonRelease, centre + QPoint(40, 0), LEFT)
    assert [f[:3] for f in forces] == [("t1", 0.0, 0.0)] * 4
    assert 0 < forces[0][3] < forces[1][3] < forces[2][3] < 800
    assert forces[-1][3] == 0.0


def test_a_workspace_leaves_no_widget_behind(qapp):
    QCoreApplication.sendPostedEvents(None, QEvent.Type.DeferredDelete)
    before = set(QApplication.allWidgets())
    made = DesignWorkspace(REGISTRY)
    made.set_patch(sample())
    made.canvas.patch_scene.select(["hum"])
    made.canvas.patch_scene.select(["step"])
    made.canvas.open_search(QPoint(20, 20))
    made.deleteLater()
    del made
    QCoreApplication.sendPostedEvents(None, QEvent.Type.DeferredDelete)
    assert not set(QApplication.allWidgets()) - before


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
    QTest.keyClick(workspace.canvas, Qt.Key.Key_F6)
    assert workspace.canvas.message == "What is selected has no parameters to change"


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
