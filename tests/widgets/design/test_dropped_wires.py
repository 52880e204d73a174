"""Wires that are let go on a node or on an input that has one: which input they take, and what adds them up."""

import pytest
from design_samples import drag, middle, port
from on_screen import show
from PySide6.QtCore import QPointF, Qt
from PySide6.QtTest import QTest

from underfoot.nodes import REGISTRY
from underfoot.patch.patch import Patch


@pytest.fixture
def workspace(qtbot, all_nodes):
    all_nodes.resize(1280, 748)
    show(qtbot, all_nodes)
    return all_nodes


def test_a_wire_that_is_dropped_on_a_node_takes_a_free_input(workspace):
    patch = Patch().add("noise", REGISTRY).add("tone", REGISTRY, (0, 200)).add("stance-curve", REGISTRY, (0, 400))
    workspace.set_patch(patch.add("mix", REGISTRY, (300, 0)).add("gain", REGISTRY, (300, 300)))
    for source, target in (("noise", "mix"), ("tone", "mix"), ("tone", "gain"), ("stance-curve", "gain")):
        drag(workspace, port(workspace, source, "out", "out"), middle(workspace, target))
    assert workspace.patch().wires == (
        ("noise.out", "mix.d"), ("tone.out", "mix.c"), ("tone.out", "gain.signal"), ("stance-curve.out", "gain.gain"),
    )  # fmt: skip
    workspace.set_patch(
        Patch().add("gain", REGISTRY).add("gain", REGISTRY, (0, 200)).add("tile-output", REGISTRY, (300, 0))
    )
    for source in ("gain", "gain1"):
        drag(workspace, port(workspace, source, "out", "out"), middle(workspace, "tile-output"))
    assert workspace.patch().wires == (("gain1.out", "tile-output.acceleration"),)
    said = "The wire from Gain (gain).out gave way: an input takes one. With Shift, or by C, Mix adds both."
    assert workspace.canvas.message == said
    workspace.undo_action.trigger()
    workspace.canvas.patch_scene.select(["gain1"])
    QTest.keyClick(workspace.canvas, Qt.Key.Key_C)
    QTest.keyClicks(workspace.canvas.connection_search.field, "acceleration")
    QTest.keyClick(workspace.canvas.connection_search.field, Qt.Key.Key_Return)
    assert workspace.patch().wires == (("gain1.out", "tile-output.acceleration"),)
    assert workspace.canvas.message == said, "by keys it gave way without a word"


def name_of(workspace, id, name):
    """Return the middle of a port's name, at most; a parameter's is below the inputs while a wire is over its node."""
    item = workspace.canvas.patch_scene.nodes[id]
    item.set_ports(item.driven, shows_all=True)
    at = item.geometry.port("in", name).at + QPointF(24, 0)
    item.set_ports(item.driven, shows_all=False)
    return workspace.canvas.mapFromScene(item.mapToScene(at))


def test_a_wire_that_is_dropped_on_the_name_of_a_port_takes_that(workspace):
    """An LFO that was let go on the name of a cutoff took the filter's signal away, and a force on that of a frequency
    drove the loudness.
    """
    canvas = workspace.canvas
    patch = Patch().add("noise", REGISTRY).add("lfo", REGISTRY, (0, 200)).add("tile-force", REGISTRY, (0, 400))
    patch = patch.add("low-pass", REGISTRY, (300, 0)).add("tone", REGISTRY, (300, 300))
    workspace.set_patch(patch.connect("noise.out", "low-pass.signal", REGISTRY))
    canvas.zoom_to(1.0)
    lfo, force = port(workspace, "lfo", "out", "out"), port(workspace, "tile-force", "out", "force")
    drag(workspace, lfo, name_of(workspace, "low-pass", "cutoff"))
    drag(workspace, force, name_of(workspace, "tone", "frequency"))
    wires = [("noise.out", "low-pass.signal"), ("lfo.out", "low-pass.cutoff")]
    assert list(workspace.patch().wires) == wires
    assert canvas.message.startswith("Tile force brings N; frequency is in Hz")
    drag(workspace, force, name_of(workspace, "tone", "amplitude"))
    assert list(workspace.patch().wires) == [*wires, ("tile-force.force", "tone.amplitude")]
    canvas.zoom_to(0.3)
    drag(workspace, port(workspace, "lfo", "out", "out"), name_of(workspace, "low-pass", "q"))
    assert ("lfo.out", "low-pass.signal") in workspace.patch().wires, "no name is shown where it is too small"


def test_a_second_wire_is_added_by_a_mix_or_a_join_with_shift_or_by_keys(workspace):
    """It took seven gestures: as Max adds what comes to an inlet, everybody draws the second wire first."""
    outputs, canvas = ("noise", "tone", "texture"), workspace.canvas
    patch = Patch().add("tile-output", REGISTRY, (480, 0))
    for place, type in enumerate(outputs):
        patch = patch.add(type, REGISTRY, (0, 160 * place))
    before = patch.connect("noise.out", "tile-output.acceleration", REGISTRY)
    workspace.set_patch(before)
    canvas.zoom_to(1.0)
    for id in outputs[1:]:
        ends = port(workspace, id, "out", "out"), port(workspace, "tile-output", "in", "acceleration")
        drag(workspace, *ends, modifiers=Qt.KeyboardModifier.ShiftModifier)
    added = {("noise.out", "mix.a"), ("tone.out", "mix.b"), ("mix.out", "tile-output.acceleration")}
    assert {*workspace.patch().wires} == added | {("texture.out", "mix.c")}, "the third goes to the same"
    for _ in outputs[1:]:
        workspace.undo_action.trigger()
    assert workspace.patch() == before, "each is one step"
    canvas.patch_scene.select(["tone"])
    QTest.keyClick(canvas, Qt.Key.Key_C)
    QTest.keyClicks(canvas.connection_search.field, "by mix")
    QTest.keyClick(canvas.connection_search.field, Qt.Key.Key_Return)
    assert {*workspace.patch().wires} == added
    two = workspace.patch().add("tile-output", REGISTRY).connect("mix.out", "tile-output1.acceleration", REGISTRY)
    workspace.set_patch(two)
    canvas.add_up("texture.out", "tile-output1.acceleration")
    assert ("texture.out", "mix1.b") in workspace.patch().wires, "the other output has no more than before"
    events = Patch().add("footfall", REGISTRY).add("poisson", REGISTRY, (0, 160)).add("impact", REGISTRY, (320, 0))
    workspace.set_patch(events.connect("footfall.onset", "impact.strike", REGISTRY))
    canvas.add_up("poisson.out", "impact.strike")
    assert ("poisson.out", "join.b") in workspace.patch().wires
    workspace.set_patch(before)
    canvas.patch_scene.select(["noise", "tile-output"])
    canvas.collapse()
    canvas.add_up("tone.out", "tile-output.acceleration")
    assert {*workspace.patch().wires} == added
    assert "mix" in workspace.patch().groups[0].members, "beside a wire that is not seen, in its sub-patch"


def test_a_wire_to_a_parameter_in_another_unit_gets_a_map_between_with_shift(workspace):
    """As in Max, where it needs none, it is drawn first, and was refused: the list, two wires and four numbers more."""
    canvas, shift = workspace.canvas, Qt.KeyboardModifier.ShiftModifier
    patch = Patch().add("tile-force", REGISTRY).add("tone", REGISTRY, (480, 0)).add("tile-output", REGISTRY, (720, 0))
    workspace.set_patch(before := patch.connect("tone.out", "tile-output.acceleration", REGISTRY))
    canvas.zoom_to(1.0)
    canvas.patch_scene.nodes["tone"].show_port("frequency", wanted=True)
    force, frequency = port(workspace, "tile-force", "out", "force"), port(workspace, "tone", "in", "frequency")
    drag(workspace, force, frequency)
    offer = "Tile force brings N; frequency is in Hz. Let it go with Shift, and a Map goes between"
    assert (canvas.message, workspace.patch()) == (offer, before)
    drag(workspace, force, frequency, modifiers=shift)
    wires = {("tile-force.force", "map.signal"), ("map.out", "tone.frequency")}
    assert {*workspace.patch().wires} == {*before.wires, *wires}
    ranges = {"low": 0.0, "high": 750.0, "out_low": 45.0, "out_high": 55.0}
    assert workspace.patch().node("map").parameters == ranges
    assert canvas.selected_ids() == ["map"]
    workspace.undo_action.trigger()
    assert workspace.patch() == before, "it is one step"
    canvas.patch_scene.select(["tile-force"])
    QTest.keyClick(canvas, Qt.Key.Key_C)
    QTest.keyClicks(canvas.connection_search.field, "frequency")
    assert [row.name for row in canvas.connection_search.list.rows()][-1] == "Waveshaped tone: frequency, by Map"
    QTest.keyClick(canvas.connection_search.field, Qt.Key.Key_Return)
    assert ({*workspace.patch().wires}, workspace.patch().node("map").parameters) == ({*before.wires, *wires}, ranges)
    workspace.undo_action.trigger()
    workspace.set_patch(patch.add("lfo", REGISTRY, (0, 240)).connect("lfo.out", "tone.frequency", REGISTRY))
    force, frequency = port(workspace, "tile-force", "out", "force"), port(workspace, "tone", "in", "frequency")
    drag(workspace, force, frequency, modifiers=shift)
    assert canvas.message == "The wire from LFO.out gave way: an input takes one."
    workspace.set_patch(before)
    canvas.patch_scene.nodes["tone"].show_port("frequency", wanted=True)
    played = port(workspace, "tile-output", "out", "played")
    drag(workspace, played, port(workspace, "tone", "in", "frequency"), modifiers=shift)
    assert (canvas.message, workspace.patch()) == ("Frequency would follow itself", before)


def test_a_wire_that_is_pulled_off_its_input_gets_a_map_between_too(workspace):
    """It was refused, and Shift did nothing."""
    canvas, patch = workspace.canvas, Patch().add("tile-force", REGISTRY).add("tone", REGISTRY, (480, 0))
    patch = patch.add("noise", REGISTRY, (480, 300)).connect("tile-force.force", "noise.amplitude", REGISTRY)
    workspace.set_patch(patch)
    canvas.zoom_to(1.0)
    amplitude, frequency = port(workspace, "noise", "in", "amplitude"), name_of(workspace, "tone", "frequency")
    drag(workspace, amplitude, frequency)
    assert canvas.message.endswith("Let it go with Shift, and a Map goes between")
    assert workspace.patch() == patch
    drag(workspace, amplitude, frequency, modifiers=Qt.KeyboardModifier.ShiftModifier)
    assert workspace.patch().wires == (("tile-force.force", "map.signal"), ("map.out", "tone.frequency"))
    workspace.undo_action.trigger()
    assert workspace.patch() == patch, "it is one step"


def test_a_map_to_what_is_outside_of_the_open_sub_patch_goes_beside_what_it_follows(workspace):
    canvas, patch = workspace.canvas, Patch().add("tile-force", REGISTRY).add("gain", REGISTRY, (240, 0))
    workspace.set_patch(patch.add("tone", REGISTRY, (960, 400)))
    canvas.patch_scene.select(["tile-force", "gain"])
    canvas.collapse()
    group = workspace.patch().groups[0].id
    canvas.open_group(group)
    canvas.connect_by_map("tile-force.force", "tone.frequency")
    assert workspace.patch().wires == (("tile-force.force", "map.signal"), ("map.out", "tone.frequency"))
    assert "map" in workspace.patch().group(group).members
    assert canvas.selected_ids() == ["map"]
    left = {id: item.pos().x() for id, item in canvas.patch_scene.nodes.items()}
    assert left["tile-force"] < left["map"]


def test_what_would_begin_by_itself_waits_for_the_first_events_that_it_is_wired_to(workspace):
    """A sound that footfalls were to play went on in its loop, and a sequence went on at 4 Hz."""
    canvas, patch = workspace.canvas, Patch().add("footfall", REGISTRY)
    for place, type in enumerate(("wav-player", "step-sequence", "rhythm")):
        patch = patch.add(type, REGISTRY, (320, 160 * place))
    patch = patch.add("wav-player", REGISTRY, (640, 0), mode="loop")  # as was chosen
    patch = patch.add("wav-player", REGISTRY, (640, 160)).connect("footfall.onset", "wav-player2.start", REGISTRY)
    workspace.set_patch(patch)
    onset = port(workspace, "footfall", "out", "onset")
    drag(workspace, onset, middle(workspace, "wav-player"))
    assert canvas.message == "WAV player: mode is now at events; it was loop"
    workspace.undo_action.trigger()
    assert workspace.patch() == patch, "it is one step"
    drag(workspace, onset, middle(workspace, "wav-player"))
    drag(workspace, onset, middle(workspace, "step-sequence"))
    drag(workspace, onset, middle(workspace, "wav-player1"))
    assert canvas.message == ""
    drag(workspace, port(workspace, "footfall", "out", "lift_off"), port(workspace, "wav-player2", "in", "start"))
    canvas.patch_scene.select(["footfall"])
    QTest.keyClick(canvas, Qt.Key.Key_C)
    QTest.keyClicks(canvas.connection_search.field, "rhythm")
    QTest.keyClick(canvas.connection_search.field, Qt.Key.Key_Return)
    assert {node.id: node.parameters for node in workspace.patch().nodes} == {
        "footfall": {},
        "wav-player": {"mode": "at events"},
        "step-sequence": {"pace": "at events"},
        "rhythm": {"begin": "at events"},
        "wav-player1": {"mode": "loop"},
        "wav-player2": {},  # which had events before, and went on in its loop
    }


def test_what_is_put_into_a_wire_of_events_or_takes_the_place_of_what_has_one_waits_for_them(workspace):
    """A sound in place of an impact, R, went on in its loop, and a rhythm between footfalls and an impact at once."""
    canvas = workspace.canvas
    patch = Patch().add("footfall", REGISTRY).add("impact", REGISTRY, (480, 0)).add("rhythm", REGISTRY, (240, 240))
    workspace.set_patch(before := patch.connect("footfall.onset", "impact.strike", REGISTRY))
    wire = canvas.patch_scene.wires["footfall.onset", "impact.strike"]
    title = canvas.patch_scene.nodes["rhythm"].sceneBoundingRect().topLeft() + QPointF(40, 10)
    drag(workspace, canvas.mapFromScene(title), canvas.mapFromScene(wire.path_middle()))
    assert workspace.patch().node("rhythm").parameters == {"begin": "at events"}
    assert canvas.message == "Rhythm: begin is now at events; it was at once"
    workspace.undo_action.trigger()
    assert workspace.patch() == before, "it is one step"
    canvas.patch_scene.select(["impact"])
    QTest.keyClick(canvas, Qt.Key.Key_R)
    QTest.keyClicks(canvas.search.field, "wav player")
    QTest.keyClick(canvas.search.field, Qt.Key.Key_Return)
    assert workspace.patch().node("wav-player").parameters == {"mode": "at events"}
    canvas.replace("breakpoints")
    assert workspace.patch().node("breakpoints").parameters == {}, "which waits as it is"
