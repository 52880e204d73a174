"""The Design workspace shows what the engine says: previews, costs, faults, distributions."""

import numpy as np
import pytest
from design_samples import LEFT, NONE, REGISTRY, sample, send
from msgspec.structs import replace
from PySide6.QtCore import QCoreApplication, QEvent, QPoint, Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QLabel

from underfoot import nodes
from underfoot.drawing import Drawing, Series
from underfoot.engine.reports import Costs, Distributions, Fault, Outlines, Preview
from underfoot.floor.layout import default_floor
from underfoot.patch.groups import Group, Note
from underfoot.widgets.design.facts import Facts
from underfoot.widgets.design.workspace import DesignWorkspace


def test_previews_are_asked_for_and_shown(workspace, qtbot):
    with qtbot.waitSignal(workspace.previews.preview_requested) as wanted:
        workspace.canvas.patch_scene.select(["hum"])
    assert wanted.args == ["hum", default_floor().tiles[0], False]
    time_s = np.arange(4800) / 48000
    signal = 3.0 * np.sin(2 * np.pi * 250 * time_s)
    workspace.previews.show_preview(Preview(1, 48000.0, np.full(4800, 700.0), {"out": signal}), "hum")
    assert "peak 3 m/s²" in workspace.preview.note.full_text
    with qtbot.waitSignal(workspace.previews.preview_requested) as wanted:
        workspace.inspector.edited.emit(["hum"], "frequency", 60.0, "")
    assert wanted.args == ["hum", default_floor().tiles[0], False]


def test_the_preview_is_of_the_tile_that_is_chosen_beside_it(workspace, qtbot):
    with qtbot.waitSignal(workspace.previews.preview_requested):
        workspace.canvas.patch_scene.select(["hum"])
    workspace.previews.show_preview(Preview(1, 48000.0, np.ones(4800), {"out": np.zeros(4800)}), "hum")
    with qtbot.waitSignal(workspace.previews.preview_requested) as wanted:
        QTest.keyClick(workspace.preview.tiles, Qt.Key.Key_Down)
    assert wanted.args == ["hum", default_floor().tiles[1], False]
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


def test_all_is_asked_for_again_of_a_session_that_takes_the_place_of_the_one_that_was_asked(workspace, qtbot):
    """Its tiles can be of the same names, and have other calibrations."""
    previews, hum = workspace.previews, Preview(1, 48000.0, np.ones(4800), {"out": np.zeros(4800)})
    with qtbot.waitSignal(previews.preview_requested):
        workspace.canvas.patch_scene.select(["hum"])
    for _ in range(2):  # of the first session, then of that after it
        with qtbot.waitSignal(previews.preview_requested) as wanted:
            workspace.set_floor(default_floor().tiles)
        assert wanted.args[0] == "hum"
        with qtbot.waitSignal(previews.small_plots.outlines_requested) as wanted:
            previews.show_preview(hum, "hum")
        assert {*wanted.args[0], "hum"} == {node.id for node in workspace.patch().nodes}
    workspace.set_patch(workspace.patch().remove(["hum", "shaker"]))  # no node's whole preview is shown
    for _ in range(2):
        with qtbot.waitSignal(previews.small_plots.outlines_requested):
            workspace.set_floor(default_floor().tiles)


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
    assert wanted.args == ["hum", default_floor(1, 1).tiles[0], False]


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
    workspace.show_fault(Fault("step", "t1", 0))
    assert (scene.nodes["hum"].state, scene.nodes["step"].state) == ("fault", "fault")
    assert workspace.canvas.message.endswith("Step, Hum")
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


def test_a_sub_patch_of_notes_alone_has_no_cost(workspace):
    """It had that of the whole patch."""
    group = Group("words", ("note",), collapsed=True)
    workspace.set_patch(replace(workspace.patch(), notes=(Note("note", "Heel", (0.0, 0.0)),), groups=(group,)))
    workspace.show_costs(Costs({"shaker": 0.3}, {"shaker": 2}))
    said = []
    for chosen in ([], ["words"]):
        workspace.canvas.patch_scene.select(chosen)
        shown = next(facts for facts in workspace.inspector.findChildren(Facts) if facts.isVisible())
        said.append([label.text() for label in shown.findChildren(QLabel)])
    assert said == [["Nodes", "4", "Wires", "1", "Cost", "30 % of a block"], ["Nodes", "0", "Cost", "–"]]


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
