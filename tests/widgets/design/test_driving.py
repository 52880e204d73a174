"""Driving a parameter from its context menu, in the inspector and on the canvas."""

import numpy as np
import pytest
from design_samples import drag, middle, port, send
from on_screen import show, type_into
from PySide6.QtCore import QEvent, QPoint, Qt, QTimer
from PySide6.QtGui import QContextMenuEvent
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QMenu

from underfoot.engine.reports import Preview
from underfoot.network.cue_patch import require_settable
from underfoot.nodes import REGISTRY
from underfoot.patch.grouping import published
from underfoot.patch.patch import Patch
from underfoot.patch.program import Program
from underfoot.widgets.controls.number_editor import NumberEditor
from underfoot.widgets.design.driving import DRIVERS, driver_range, with_driver
from underfoot.widgets.design.message import VISIBLE_MS, Message


@pytest.fixture
def workspace(qtbot, all_nodes):
    """A tone through a low-pass to the tile, with the filter selected."""
    made = all_nodes
    made.resize(1280, 748)
    show(qtbot, made)
    patch = Patch().add("tone", REGISTRY, (0, 0)).add("low-pass", REGISTRY, (240, 0))
    patch = patch.add("tile-output", REGISTRY, (480, 0)).connect("tone.out", "low-pass.signal", REGISTRY)
    made.set_patch(patch.connect("low-pass.out", "tile-output.acceleration", REGISTRY))
    made.canvas.patch_scene.select(["low-pass"])
    made.canvas.setFocus()
    yield made
    made.canvas.setFocus()  # with the focus goes what is said over a field


def ask(widget, place):
    """The menu key, or a right click, at a place of a widget."""
    reason = QContextMenuEvent.Reason.Mouse
    QApplication.sendEvent(widget, QContextMenuEvent(reason, place, widget.mapToGlobal(place)))
    return QApplication.activePopupWidget()


def click(qtbot, menu, *words):
    """Click through a menu that is open, and through those within it."""
    for word in words:
        action = next(action for action in menu.actions() if action.text() == word)
        into = action.menu()
        QTest.mouseClick(menu, Qt.MouseButton.LeftButton, pos=menu.actionGeometry(action).center())
        if into is not None:
            qtbot.waitUntil(into.isVisible)
        menu = into
    for open_menu in [w for w in QApplication.topLevelWidgets() if isinstance(w, QMenu)]:
        open_menu.close()


def offered(menu, type):
    """The words of a menu for a driver of this type: those that follow the force say so."""
    return next(one.text() for one in menu.actions() if one.text().startswith(REGISTRY[type].label))


@pytest.mark.parametrize("type", DRIVERS)
def test_each_driver_stands_beside_and_moves_by_a_tenth_in_one_step_of_undo(qtbot, workspace, type):
    before = workspace.patch()
    editor = workspace.inspector.editors["cutoff"]
    menu = ask(editor.field, editor.field.rect().center())
    click(qtbot, menu, offered(menu, type))
    after = workspace.patch()
    driver = next(node for node in after.nodes if node.type == type)
    assert (f"{driver.id}.out", "low-pass.cutoff") in after.wires
    assert workspace.document.stack.count() == 1
    program = Program(after, REGISTRY, ("t1",), scopes=(f"{driver.id}.out",))
    out = []
    for at in range(0, 96_000, 960):
        for name, signal in program.engine_signals.items():
            signal[:] = 500.0 if name == "force_n" else 0.0
        program.run(at, 960)
        out.append(program.scope[f"{driver.id}.out"][0, :960].copy())
    heard = np.concatenate(out)
    if type == "random-walk":
        assert driver.parameters == {"centre": 300.0, "deviation": 15.0}
    else:
        assert heard.min() >= 270.0 - 1e-9
        assert heard.max() <= 330.0 + 1e-9
    if type == "map":
        assert heard[-1] == pytest.approx(270.0 + 60.0 * 500.0 / 750.0)
    elif type not in ("random-walk", "value"):
        assert heard.max() - heard.min() == pytest.approx(60.0, abs=0.5)
    workspace.undo_action.trigger()
    assert workspace.patch() == before


def test_new_drivers_never_lie_on_other_nodes():
    patch = Patch().add("low-pass", REGISTRY, (240, 0)).add("tone", REGISTRY, (0, 0))
    for name, type in (("cutoff", "lfo"), ("q", "stance-curve")):
        patch = with_driver(patch, REGISTRY, "low-pass", name, type)
    places = [node.at for node in patch.nodes]
    for i, a in enumerate(places):
        assert all(abs(a[0] - b[0]) >= 176 or abs(a[1] - b[1]) >= 160 for b in places[:i])
    again = with_driver(patch, REGISTRY, "tone", "amplitude", "stance-curve")
    assert sum(node.type == "tile-force" for node in again.nodes) == 1


@pytest.mark.parametrize("type", ["stance-curve", "map"])
def test_a_loudness_that_follows_the_force_is_silence_where_nobody_stands(type):
    patch = with_driver(Patch().add("noise", REGISTRY, amplitude=3.0), REGISTRY, "noise", "amplitude", type)
    program = Program(patch, REGISTRY, ("t1", "t2"), block=48_000, scopes=("noise.out", f"{type}.out"))
    program.engine_signals["force_n"][0] = 750.0
    program.run(0, 48_000)
    assert program.scope[f"{type}.out"].max() == pytest.approx(3.0, rel=1e-3)
    assert program.scope["noise.out"][0].any()
    assert not program.scope["noise.out"][1].any()


@pytest.mark.parametrize(
    ("type", "loud", "ends"),
    [("map", -2.0, (0.0, -2.0)), ("map", 0.0, (0.0, 1.0)), ("lfo", 2.0, (1.8, 2.2)), ("lfo", 0.0, (0.0, 1.0))],
)
def test_a_loudness_is_driven_from_nothing_to_its_value_by_the_force_and_around_it_by_others(type, loud, ends):
    patch = Patch().add("mix", REGISTRY, level_a=loud)
    driver = with_driver(patch, REGISTRY, "mix", "level_a", type).node(type).parameters
    assert (driver.get("out_low", driver["low"]), driver.get("out_high", driver["high"])) == pytest.approx(ends)


@pytest.mark.parametrize(
    "type", [type for type in REGISTRY if any(p.kind == "number" for p in REGISTRY[type].parameters.values())]
)
def test_a_swing_lies_in_the_range_and_is_none_of_its_ends_alone(type):
    for parameter in REGISTRY[type].parameters.values():
        if parameter.kind == "number":
            low, high = driver_range(parameter, parameter.default)
            assert parameter.low <= low < high <= parameter.high


def test_a_port_is_shown_on_asking_and_hidden_again(qtbot, workspace):
    item = workspace.canvas.patch_scene.nodes["low-pass"]
    canvas = workspace.canvas
    place = canvas.mapFromScene(item.mapToScene(item.geometry.plot.center()))
    click(qtbot, ask(canvas.viewport(), place), "Drive", "Q", "A wire: show its port")
    assert [port.name for port in item.geometry.ports if port.side == "in"] == ["signal", "q"]
    canvas.patch_scene.select([])
    assert item.geometry.port("in", "q") is not None
    at = canvas.mapFromScene(item.port_place("in", "q"))
    click(qtbot, ask(canvas.viewport(), at), "Drive q with", "Hide its port")
    assert item.geometry.port("in", "q") is None
    assert workspace.document.stack.count() == 0


def test_a_driven_parameter_shows_from_where_to_where_it_goes(qtbot, workspace):
    editor = workspace.inspector.editors["cutoff"]
    click(qtbot, ask(editor.slider, editor.slider.rect().center()), "LFO")
    curve = np.linspace(270.0, 330.0, 480)
    workspace.previews.show_preview(Preview(0, 48_000.0, np.zeros(480), {"out": curve}), "lfo")
    assert editor.driver.text() == "LFO: 270 to 330 Hz  ×"
    workspace.canvas.patch_scene.select(["lfo"])
    qtbot.waitUntil(lambda: workspace.preview.node == "lfo")
    workspace.previews.show_preview(Preview(0, 48_000.0, np.zeros(480), {"out": curve}), "lfo")
    assert workspace.preview.note.full_text.startswith("peak 330 Hz, RMS")
    workspace.canvas.patch_scene.select(["low-pass"])
    qtbot.waitUntil(lambda: workspace.preview.node == "low-pass")
    editor = workspace.inspector.editors["cutoff"]
    send(editor.driver, QEvent.Type.MouseButtonPress, QPoint(20, 8), Qt.MouseButton.LeftButton)
    send(editor.driver, QEvent.Type.MouseButtonRelease, QPoint(20, 8), Qt.MouseButton.LeftButton)
    assert not any(target == "low-pass.cutoff" for _, target in workspace.patch().wires)
    assert "300 Hz" in editor.field.text()
    workspace.set_patch(workspace.patch().remove(["lfo"]))
    workspace.canvas.patch_scene.select(["low-pass"])
    editor = workspace.inspector.editors["cutoff"]
    click(qtbot, ask(editor.slider, editor.slider.rect().center()), "LFO")
    assert editor.driver.text() == "driven by LFO  ×"  # of the new one nothing has been computed


def test_the_menu_says_what_it_is_about(workspace):
    editor = workspace.inspector.editors["cutoff"]
    menu = ask(editor.field, editor.field.rect().center())
    heading = menu.actions()[0]
    assert heading.text() == "Drive cutoff with"
    assert not heading.isEnabled()
    menu.close()


@pytest.mark.parametrize(
    ("ends", "said"),
    [((0.5, 1.0), "−6.02 to 0 dB"), ((-2.0, 2.0), "6.02 dB ø to 6.02 dB"), ((-1.0, -0.5), "0 to −6.02 dB ø")],
)
def test_the_range_of_a_driven_gain_is_read_in_full_and_as_the_field_shows_it(qtbot, ends, said):
    editor = NumberEditor(REGISTRY["gain"].parameters["gain"])
    qtbot.addWidget(editor)
    editor.resize(240, 40)
    show(qtbot, editor)
    editor.set_driven("A rather long name of a node", "#ffffff", ends)
    assert editor.driver.text().endswith(f": {said}  ×")
    assert editor.driver.text().startswith("A")
    assert "…" in editor.driver.text()
    assert said in editor.driver.toolTip()
    editor.resize(170, 40)  # as beside a long label: what drives it was a mere ellipsis before the range
    QApplication.processEvents()
    assert editor.driver.text().startswith("A rather"), editor.driver.text()


def test_a_right_click_on_a_wire_is_about_the_wire(workspace):
    scene = workspace.canvas.patch_scene
    ends = port(workspace, "tone", "out", "out"), port(workspace, "low-pass", "in", "signal")
    menu = ask(workspace.canvas.viewport(), (ends[0] + ends[1]) / 2)
    words = [action.text() for action in menu.actions()]
    menu.close()
    assert "Delete" in words
    assert "Duplicate" not in words
    assert scene.selected() == []
    workspace.canvas.actions_by_name["delete"].trigger()
    assert workspace.patch().wires == (("low-pass.out", "tile-output.acceleration"),)


def test_a_click_on_a_wire_previews_the_output_that_it_carries(qtbot, workspace):
    patch = Patch().add("contact", REGISTRY, (0, 0)).add("scale", REGISTRY, (240, 0))
    patch = patch.add("tile-output", REGISTRY, (480, 0))
    workspace.set_patch(patch.connect("contact.y", "scale.signal", REGISTRY))
    canvas, preview = workspace.canvas, workspace.preview
    wire = canvas.patch_scene.wires["contact.y", "scale.signal"]
    at = canvas.mapFromScene(wire.boundingRect().center())
    for before in ("tile-output", "contact"):  # which has x in front
        canvas.patch_scene.select([before])
        qtbot.waitUntil(lambda node=before: preview.node == node)
        preview.output.setCurrentIndex(0)
        QTest.mouseClick(canvas.viewport(), Qt.MouseButton.LeftButton, pos=at)
        qtbot.waitUntil(lambda: preview.node == "contact" and preview.port.name == "y")
        assert canvas.selected_ids() == []
    QTest.mouseClick(canvas.viewport(), Qt.MouseButton.LeftButton, pos=QPoint(20, 20))
    qtbot.waitUntil(lambda: preview.node == "tile-output")
    QTest.mouseClick(canvas.viewport(), Qt.MouseButton.LeftButton, pos=at)
    qtbot.waitUntil(lambda: preview.node == "contact")
    QTest.keyClick(canvas, Qt.Key.Key_Delete)
    qtbot.waitUntil(lambda: preview.node == "tile-output")


def test_an_edit_leaves_the_output_that_was_chosen_after_a_click_on_a_wire(qtbot, workspace):
    patch = Patch().add("contact", REGISTRY, (0, 0)).add("scale", REGISTRY, (240, 0))
    workspace.set_patch(patch.connect("contact.y", "scale.signal", REGISTRY))
    preview, scene = workspace.preview, workspace.canvas.patch_scene
    scene.select(["contact"])
    qtbot.waitUntil(lambda: preview.node == "contact")
    scene.select([])
    scene.choose(scene.wires["contact.y", "scale.signal"])
    assert preview.port.name == "y"
    preview.output.setCurrentText("x")
    workspace.document.edit(workspace.patch().set("contact", "tiles", "t1", REGISTRY), "Set tiles")
    with qtbot.waitSignal(workspace.previews.preview_requested):
        pass
    assert preview.port.name == "x"


def test_an_envelope_that_is_pulled_into_the_open_can_go_to_the_loudness_of_a_tone(workspace):
    workspace.set_patch(Patch().add("attack-decay", REGISTRY))
    start = port(workspace, "attack-decay", "out", "out")
    drag(workspace, start, start + QPoint(160, 0))
    QTest.keyClick(workspace.canvas.search.field, Qt.Key.Key_Return)
    assert workspace.canvas.search.isVisible(), "nothing is chosen yet: the wire is still held"
    QTest.keyClicks(workspace.canvas.search.field, "waveshaped")
    QTest.keyClick(workspace.canvas.search.field, Qt.Key.Key_Return)
    assert workspace.patch().wires == (("attack-decay.out", "tone.amplitude"),)


def test_a_wire_ends_at_the_port_that_it_was_brought_to(workspace):
    """As the node opened under the wire, the port moved down, and another one was in its place."""
    patch = with_driver(workspace.patch(), REGISTRY, "low-pass", "q", "lfo").add("value", REGISTRY, (0, 320))
    workspace.set_patch(patch)
    drag(workspace, port(workspace, "value", "out", "out"), port(workspace, "low-pass", "in", "q"))
    assert workspace.patch().wires == (*patch.wires[:-1], ("value.out", "low-pass.q"))


@pytest.mark.parametrize(
    ("type", "end"), [("lfo", "low"), ("random-walk", "deviation"), ("step-sequence", "high"), ("stance-curve", "low")]
)
def test_the_ends_of_a_driver_are_in_the_unit_of_what_it_drives(qtbot, workspace, type, end):
    editor = workspace.inspector.editors["cutoff"]
    menu = ask(editor.field, editor.field.rect().center())
    click(qtbot, menu, offered(menu, type))
    driver = next(node.id for node in workspace.patch().nodes if node.type == type)
    workspace.canvas.patch_scene.select([driver])
    editor = workspace.inspector.editors[end]
    assert editor.field.text().endswith(" Hz")
    type_into(qtbot, editor, "0.12 kHz")
    assert workspace.patch().node(driver).parameters[end] == 120.0
    workspace.set_patch(workspace.patch().disconnect([(f"{driver}.out", "low-pass.cutoff")]))
    workspace.canvas.patch_scene.select([driver])
    editor = workspace.inspector.editors[end]
    assert editor.field.text() == "120"
    type_into(qtbot, editor, "5 Hz")
    assert "a wire gives it the unit" in editor.field.toolTip()
    assert workspace.patch().node(driver).parameters[end] == 120.0


def test_a_map_has_the_unit_of_its_signal_on_one_side_and_of_what_it_drives_on_the_other(qtbot, workspace):
    patch = workspace.patch().add("tile-force", REGISTRY, (0, 300)).add("map", REGISTRY, (200, 300))
    patch = patch.connect("tile-force.force", "map.signal", REGISTRY).connect("map.out", "tone.amplitude", REGISTRY)
    workspace.set_patch(patch)
    workspace.canvas.patch_scene.select(["map"])
    editors = workspace.inspector.editors
    for end, text, value in (("high", "0.7 kN", 700.0), ("out_low", "-20 dB", 0.1), ("out_high", "2*3", 6.0)):
        type_into(qtbot, editors[end], text)
        assert workspace.patch().node("map").parameters[end] == pytest.approx(value), end
    assert editors["high"].field.text() == "700 N"
    assert editors["out_high"].field.text() == "6"


@pytest.mark.parametrize(
    ("source", "type", "pointed_at", "to"),
    [
        ("stance-curve", "modal-bank", "", "modal-bank.level"),  # and not the strike, which takes events
        ("stance-curve", "modal-bank", "pitch", "modal-bank.pitch"),
        ("lfo", "tone", "", "tone.amplitude"),
        ("lfo", "tone", "frequency", "tone.frequency"),
        ("lfo", "gain", "gain", "gain.signal"),
    ],
)
def test_a_modulator_dropped_on_a_node_drives_the_row_that_is_pointed_at_or_the_loudness(
    qtbot, workspace, source, type, pointed_at, to
):
    patch = Patch().add(source, REGISTRY, (0, 0)).add(type, REGISTRY, (320, 0))
    workspace.set_patch(patch)
    workspace.canvas.fit_view(all_nodes=True)
    drag(workspace, port(workspace, source, "out", "out"), middle(workspace, type), release=False)
    item = workspace.canvas.patch_scene.nodes[type]
    at = item.geometry.plot.center()
    if pointed_at:
        at.setY(item.port_place("in", pointed_at).y() - item.pos().y())
    place = workspace.canvas.mapFromScene(item.mapToScene(at))
    send(workspace.canvas.viewport(), QEvent.Type.MouseMove, place, Qt.MouseButton.LeftButton)
    send(workspace.canvas.viewport(), QEvent.Type.MouseButtonRelease, place, Qt.MouseButton.LeftButton)
    assert workspace.patch().wires == ((f"{source}.out", to),)


def test_a_wire_of_another_unit_dropped_on_a_row_goes_nowhere_else(workspace):
    """A force on a frequency's row, beside its name, drove the loudness."""
    workspace.set_patch(Patch().add("tile-force", REGISTRY).add("tone", REGISTRY, (320, 0)))
    canvas, item = workspace.canvas, workspace.canvas.patch_scene.nodes["tone"]
    canvas.zoom_to(1.0)
    item.set_ports(item.driven, shows_all=True)
    beside = item.mapToScene(item.geometry.width - 24.0, item.geometry.port("in", "frequency").at.y())
    item.set_ports(item.driven, shows_all=False)
    force = port(workspace, "tile-force", "out", "force")
    drag(workspace, force, canvas.mapFromScene(beside))
    assert workspace.patch().wires == ()
    assert canvas.message.startswith("Tile force brings N; frequency is in Hz")
    drag(workspace, force, canvas.mapFromScene(beside), modifiers=Qt.KeyboardModifier.ShiftModifier)
    assert workspace.patch().wires == (("tile-force.force", "map.signal"), ("map.out", "tone.frequency"))


def test_a_parameter_of_a_node_in_a_group_can_be_driven_and_shown_on_the_sub_patch(qtbot, workspace):
    workspace.canvas.group()
    workspace.canvas.patch_scene.select(["low-pass"])
    (copying,) = workspace.inspector.editors["cutoff"].actions()  # a frame shows no parameters
    assert copying.text() == "Copy its OSC message"
    workspace.canvas.collapse()
    workspace.canvas.open_group("group")
    workspace.canvas.patch_scene.select(["low-pass"])
    editor = workspace.inspector.editors["cutoff"]
    click(qtbot, ask(editor.label, editor.label.rect().center()), "Show on the sub-patch")
    assert workspace.patch().groups[0].published == ("low-pass.cutoff",)
    editor = workspace.inspector.editors["cutoff"]
    click(qtbot, ask(editor.label, editor.label.rect().center()), "LFO")
    assert ("lfo.out", "low-pass.cutoff") in workspace.patch().wires


def test_a_chain_is_built_with_keys_and_an_open_menu_keeps_its_letters(qtbot, workspace):
    chosen = workspace.canvas.patch_scene.selected()
    menu = ask(workspace.canvas.viewport(), QPoint(2, 2))
    QTest.keyClick(menu, Qt.Key.Key_N)  # next node, on the canvas
    assert workspace.canvas.patch_scene.selected() == chosen
    menu.close()
    workspace.set_patch(Patch().add("tile-force", REGISTRY))
    scene = workspace.canvas.patch_scene
    scene.select(["tile-force"])
    workspace.canvas.setFocus()
    for words in ("footfall", "impact"):
        QTest.keyClick(workspace.canvas, Qt.Key.Key_C)
        QTest.keyClick(workspace.canvas.connection_search.field, Qt.Key.Key_Return)
        QTest.keyClicks(workspace.canvas.search.field, words)
        QTest.keyClick(workspace.canvas.search.field, Qt.Key.Key_Return)
    assert workspace.patch().wires == (("tile-force.force", "footfall.force"), ("footfall.onset", "impact.strike"))
    assert scene.selected() == ["impact"]


def test_a_wire_that_brings_newtons_to_a_plain_number_says_what_to_put_between(qtbot, workspace):
    """Noise was 700 times as loud, without a word."""
    canvas = workspace.canvas
    workspace.set_patch(Patch().add("tile-force", REGISTRY).add("noise", REGISTRY, (240, 0)))
    drag(workspace, port(workspace, "tile-force", "out", "force"), middle(workspace, "noise"))
    (wire,) = workspace.patch().wires
    assert wire == ("tile-force.force", "noise.amplitude")
    assert canvas.message.startswith("Tile force brings N; ")
    assert canvas.findChild(Message).findChild(QTimer).interval() > VISIBLE_MS, "it takes longer to read"
    steps = workspace.document.stack.count()
    ends = port(workspace, "tile-force", "out", "force"), port(workspace, "noise", "in", "amplitude")
    drag(workspace, *ends)
    assert "gave way" not in canvas.message, "the same wire again replaces none"
    assert workspace.document.stack.count() == steps
    QTest.mouseDClick(canvas.viewport(), Qt.MouseButton.LeftButton, pos=(ends[0] + ends[1]) / 2)
    assert canvas.message == "", "nor does it stay when that is done"
    QTest.keyClicks(canvas.search.field, "force envelope")
    QTest.keyClick(canvas.search.field, Qt.Key.Key_Return)
    assert ("force-envelope.out", "noise.amplitude") in workspace.patch().wires


def test_so_does_one_that_brings_metres_but_not_a_sound_that_is_a_factor(qtbot, workspace):
    canvas = workspace.canvas
    patch = Patch().add("tile-place", REGISTRY).add("tone", REGISTRY, (0, 200)).add("gain", REGISTRY, (240, 0))
    workspace.set_patch(patch)
    canvas.connect_ports("tile-place.distance", "gain.gain")
    assert canvas.message == "Tile place brings m; gain is a plain number. Double-click the wire for a Map between"
    workspace.undo_action.trigger()
    canvas.connect_ports("tone.out", "gain.gain")
    assert canvas.message == ""


@pytest.mark.parametrize(
    ("node", "name", "copied"),
    [
        ("low-pass", "cutoff", "/underfoot/set low-pass cutoff 300"),
        ("lfo", "low", "/underfoot/set lfo low 270"),
    ],
)
def test_the_message_that_sets_a_parameter_is_copied_from_its_menu(qtbot, workspace, node, name, copied):
    """What a controller has to send: neither the node's id nor the parameter's name is that on its label."""
    patch = workspace.patch()
    workspace.set_patch(with_driver(patch, REGISTRY, "low-pass", "cutoff", "lfo") if node == "lfo" else patch)
    workspace.canvas.patch_scene.select([node])
    label = workspace.inspector.editors[name].label
    with qtbot.waitSignal(workspace.notified) as said:
        click(qtbot, ask(label, label.rect().center()), "Copy its OSC message")
    assert QApplication.clipboard().text() == copied
    assert copied in said.args[0]
    _, id, parameter, value = copied.split()
    require_settable(workspace.patch(), id, parameter, float(value), REGISTRY)
    workspace.document.edit(with_driver(workspace.patch(), REGISTRY, node, name, "value"), "Drive")
    menu = ask(label, label.rect().center())
    assert "Copy its OSC message" not in [action.text() for action in menu.actions() if action.isVisible()]
    menu.close()


def test_a_large_count_is_copied_to_its_last_digit(workspace):
    workspace.set_patch(workspace.patch().add("fibre-bundle", REGISTRY, fibres=1_234_567))
    workspace.canvas.patch_scene.select(["fibre-bundle"])
    workspace.inspector.editors["fibres"].actions()[-1].trigger()
    assert QApplication.clipboard().text() == "/underfoot/set fibre-bundle fibres 1234567"


@pytest.fixture
def sub_patch(workspace):
    """The filter in a sub-patch, which is selected, and on which its cutoff is shown."""
    QTest.keyClick(workspace.canvas, Qt.Key.Key_E, Qt.KeyboardModifier.ControlModifier)
    workspace.document.edit(published(workspace.patch(), "group", "low-pass.cutoff", True), "Show on the sub-patch")
    return workspace


def test_a_driver_of_a_node_in_a_sub_patch_is_in_it_too(qtbot, sub_patch):
    QTest.keyClick(sub_patch.canvas, Qt.Key.Key_Return)
    sub_patch.canvas.patch_scene.select(["low-pass"])
    editor = sub_patch.inspector.editors["cutoff"]
    click(qtbot, ask(editor.field, editor.field.rect().center()), "LFO")
    assert set(sub_patch.canvas.patch_scene.nodes) == {"low-pass", "lfo"}
    assert sub_patch.patch().groups[0].members == ("low-pass", "lfo")


def test_a_parameter_on_a_sub_patch_is_driven_disconnected_and_hidden_from_there(qtbot, sub_patch):
    scene, shown = sub_patch.canvas.patch_scene, sub_patch.inspector.editors["low-pass.cutoff"]
    click(qtbot, ask(shown.field, shown.field.rect().center()), "LFO")
    assert set(scene.nodes) == {"tone", "tile-output", "lfo"}
    assert shown.driver.text().startswith("driven by LFO")
    assert not shown.slider.isEnabled()
    QTest.mouseClick(shown.driver, Qt.MouseButton.LeftButton)
    assert ("lfo.out", "low-pass.cutoff") not in sub_patch.patch().wires
    assert shown.slider.isEnabled()
    click(qtbot, ask(shown.field, shown.field.rect().center()), "Show on the sub-patch")
    assert sub_patch.patch().groups[0].published == ()


def test_of_several_nodes_it_is_said_in_how_many_a_parameter_is_driven_and_no_menu_is_offered(workspace):
    patch = workspace.patch().add("low-pass", REGISTRY, (240.0, 200.0))
    workspace.set_patch(with_driver(patch, REGISTRY, "low-pass", "cutoff", "lfo"))
    workspace.canvas.patch_scene.select(["low-pass", "low-pass1"])
    editor = workspace.inspector.editors["cutoff"]
    assert editor.label.text() == "Cutoff: driven in 1 of 2"
    assert "Right-click" not in editor.label.toolTip()
    workspace.document.edit(workspace.patch().disconnect([("lfo.out", "low-pass.cutoff")]), "Disconnect")
    workspace.canvas.patch_scene.select(["low-pass", "low-pass1"])
    assert workspace.inspector.editors["cutoff"].label.text() == "Cutoff"
    workspace.canvas.patch_scene.select(["low-pass"])
    assert "Right-click" in workspace.inspector.editors["cutoff"].label.toolTip()
