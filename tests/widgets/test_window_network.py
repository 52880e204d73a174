"""The window serves its session: contacts of the floor under the mouse go out, cues are played and edit nothing.

The stress test of a whole floor is served, too.
"""

import json
import math
import os
from contextlib import closing

import pytest
from free_ports import free_port
from osc_ends import LOOPBACK, CursorDecoder, OscEnd
from PySide6.QtCore import QPoint, Qt
from PySide6.QtTest import QTest
from windows import LONG_MS, dialog_of, noise_patch

from underfoot.bench.stress import whole_floor
from underfoot.engine.commands import PressTile
from underfoot.engine.reports import SensorFaults
from underfoot.network.server import Counts
from underfoot.widgets.design.blind_test import BlindTest
from underfoot.widgets.design.driving import with_driver
from underfoot.widgets.dialogs.network_dialog import NetworkDialog
from underfoot.widgets.session import network_link
from underfoot.widgets.session.network_link import HEARD_MESSAGE, LENT_MESSAGE
from underfoot.widgets.session.settings import DEFAULT_ADDRESSES, Settings
from underfoot.widgets.under_load import TickReporter


@pytest.fixture
def client():
    with closing(OscEnd()) as made:
        yield made


@pytest.fixture
def served(window, client, qtbot):
    """A window that sends TUIO 1.1 and messages to the client, and takes cues at this port, as set in the dialog."""
    port = free_port()
    qtbot.keyClick(window, Qt.Key.Key_N, Qt.KeyboardModifier.ControlModifier | Qt.KeyboardModifier.ShiftModifier)
    dialog = dialog_of(window, NetworkDialog)
    for name, address in (("tuio", client.text), ("listen", f"{LOOPBACK}:{port}")):
        dialog.addresses[name].setText(address)
        qtbot.keyClick(dialog.check_boxes[name], Qt.Key.Key_Space)
    qtbot.mouseClick(dialog.apply, Qt.MouseButton.LeftButton)
    assert not dialog.note.text()
    yield port
    window.network.apply({**window.settings.network_addresses}, [])


def answer(client, qtbot, address, number):
    qtbot.waitUntil(lambda: any(n == number for n, *_ in client.received(address)), timeout=60_000)
    return next(rest for n, *rest in client.received(address) if n == number)


def test_a_preset_of_ones_own_is_played_by_a_cue(window, served, client, qtbot):
    folder = window.workspaces["Design"].browsing.folder
    folder.mkdir(parents=True, exist_ok=True)
    noise_patch().save(folder / "hiss of mine.json")
    client.send_message(served, "/underfoot/play", "hiss of mine", "t1", -6.0, 4)
    answer(client, qtbot, "/underfoot/played", 4)
    assert any(node.id.startswith("noise--") for node in window.controller.session.patch.nodes)
    client.send_message(served, "/underfoot/stop", "all", 7)
    answer(client, qtbot, "/underfoot/played", 7)


def test_a_press_on_a_tile_is_a_cursor(window, served, client, qtbot):
    decoder, session = CursorDecoder(), window.controller.session

    def decoded():
        for datagram in client.datagrams():
            decoder.decode(datagram)
        return decoder.cursors

    tile = session.target.floor.tiles[3]
    session.send(PressTile(tile.id, 0.0, 0.0, 600.0))
    box_m = 0.615

    def is_there():
        x, y = tile.centre_m
        return any(abs(at[0] - x / box_m) + abs(at[1] - 1.0 + y / box_m) < 0.02 for at in decoded().values() if at)

    qtbot.waitUntil(is_there)
    session.send(PressTile(tile.id, 0.0, 0.0, 0.0))
    qtbot.waitUntil(lambda: not is_there())
    assert window.network.counts.sent > 0


def test_a_cue_is_played_and_leaves_the_document_as_it_is(window, served, client, qtbot):
    document = window.open_patch.patch
    client.send_message(served, "/underfoot/play", "wood", "t1", -6.0, 5)
    frame, _, _ = answer(client, qtbot, "/underfoot/played", 5)
    assert frame > 0
    assert window.open_patch.patch == document
    assert any(node.id.endswith("--wood") for node in window.controller.session.patch.nodes)
    client.send_message(served, "/underfoot/stop", "all", 6)
    answer(client, qtbot, "/underfoot/played", 6)
    assert window.controller.session.patch == document


def test_cues_end_when_nothing_is_served_any_more(window, served, client, qtbot):
    client.send_message(served, "/underfoot/play", "wood", "t1", -6.0, 7)
    client.send_message(served, "/underfoot/set", "noise", "high", 4000.0, 8)
    for number in (7, 8):
        answer(client, qtbot, "/underfoot/played", number)
    window.network.apply(window.settings.network_addresses, ["tuio"])
    assert window.controller.session.patch != window.open_patch.patch, "a session that is served keeps its cues"
    assert window.network.values
    window.network.apply(window.settings.network_addresses, [])
    assert window.controller.session.patch == window.open_patch.patch
    assert not window.network.values


def test_panic_from_outside_is_shown_and_a_study_is_left_alone(window, served, client, qtbot):
    client.send_message(served, "/underfoot/panic")
    qtbot.waitUntil(lambda: not window.controller.is_playing)
    assert "Panic" in window.status.message
    window.controller.lend()
    client.send_message(served, "/underfoot/strike", "all", 1.0, 8)
    assert answer(client, qtbot, "/underfoot/refused", 8)[1] == LENT_MESSAGE
    client.send_message(served, "/underfoot/mark", "m", 9)  # disturbs nobody, and the recording has it
    assert answer(client, qtbot, "/underfoot/played", 9)[0] > 0
    window.controller.take_back()
    window.network.apply({**window.settings.network_addresses, "send": client.text}, ["send"])
    qtbot.waitUntil(lambda: bool(client.received("/underfoot/health")))
    assert client.received("/underfoot/health")[0][-2:] == ["panic", ""]
    window.bridge.reported.emit([SensorFaults({("t1", 3): "sensor 3 is dead"}, "nothing comes from t2")])
    wrong = ["panic", "nothing comes from t2; tile t1: sensor 3 is dead"]
    qtbot.waitUntil(lambda: client.received("/underfoot/health")[-1][-2:] == wrong)


def test_a_preset_is_heard_as_it_is_and_cues_wait_for_the_patch(window, served, client, qtbot):
    """What a fader had set of the patch was in a preset with a node of the same id, and so was what came then."""
    client.send_message(served, "/underfoot/set", "noise", "high", 4000.0, 11)
    answer(client, qtbot, "/underfoot/played", 11)
    preset = noise_patch("Other")
    window.listening.play_preset(preset)
    assert window.controller.session.patch == preset
    client.send_message(served, "/underfoot/set", "noise", "high", 5000.0, 12)
    assert answer(client, qtbot, "/underfoot/refused", 12)[1] == HEARD_MESSAGE
    window.listening.play_preset(None)
    assert window.controller.session.patch.node("noise").parameters["high"] == 4000.0


def test_a_line_of_marks_that_is_unplugged_is_said(window, qtbot):
    """Only the dialog knew, where somebody opened it."""
    pty = pytest.importorskip("pty")
    far, near = pty.openpty()
    window.network.apply({**window.settings.network_addresses, "serial_marks": os.ttyname(near)}, ["serial_marks"])
    os.close(near)
    os.close(far)
    qtbot.waitUntil(lambda: window.status.message.startswith("Network: marks cannot be read from"), timeout=60_000)
    window.network.apply({**window.settings.network_addresses}, [])


def test_what_is_not_possible_now_stands_in_the_dialog_as_an_alarm(qtbot):
    """A port with a slip of the pen was refused in small grey print, as the last cue was."""
    problems = ["marks cannot be read from COM33: there is no such port"]
    dialog = NetworkDialog(print, Counts, lambda: problems[-1], dict(DEFAULT_ADDRESSES), ["serial_marks"])
    qtbot.addWidget(dialog)
    dialog.show()
    assert dialog.trouble.text() == "Marks cannot be read from COM33: there is no such port."
    assert dialog.trouble.isVisible()
    problems.append("")
    qtbot.waitUntil(lambda: not dialog.trouble.isVisible())


def test_what_was_chosen_is_there_at_the_next_start(window, served, client, tmp_path):
    window.settings.save(tmp_path)
    kept = Settings.load(tmp_path)
    assert kept.network_on == ["tuio", "listen"]
    assert kept.network_addresses["tuio"] == client.text


def test_a_port_that_is_taken_leaves_all_as_it_was(window, served, client, qtbot):
    with closing(OscEnd()) as other, pytest.raises(Exception, match="choose another port"):
        window.network.apply({**window.settings.network_addresses, "listen": other.text}, ["listen"])
    assert window.settings.network_on == ["tuio", "listen"]
    client.send_message(served, "/underfoot/mark", "still here", 9)
    answer(client, qtbot, "/underfoot/played", 9)


def test_what_is_taken_as_the_session_begins_is_served_once_it_is_free(window, client, qtbot, monkeypatch):
    """As where a network comes after the window: nothing was sent until somebody looked."""
    monkeypatch.setattr(network_link, "AGAIN_S", 0.0)
    before = window.settings.network_addresses
    with closing(OscEnd()) as other:
        window.settings.network_addresses, window.settings.network_on = {"listen": other.text}, ["listen"]
        window.controller.opened.emit(window.controller.target)
        qtbot.waitUntil(lambda: window.status.message.startswith("Network: nothing is sent to other programs: cues"))
        assert "choose another port" in window.network.problem
    qtbot.waitUntil(lambda: window.status.message == "Network: all is sent and taken again.")
    client.send_message(other.port, "/underfoot/mark", "heard", 10)
    answer(client, qtbot, "/underfoot/played", 10)
    window.network.apply(before, [])


def test_a_value_that_is_set_from_outside_is_not_that_of_another_patch_with_such_a_node(window, served, client, qtbot):
    """B was heard with what a fader had set of A, and a blind test with the same of both."""

    def test_blindly():
        window.workspaces["Design"].listen_bar.actions_by_name["blind test"].trigger()
        window.findChild(BlindTest).close()

    switch = window.open_patch.switch
    to_others = (lambda: window.open_patch.read(window.open_patch.path), switch, switch, test_blindly)
    for number, to_another in enumerate(to_others, 50):
        client.send_message(served, "/underfoot/set", "noise", "high", 4000.0, number)
        answer(client, qtbot, "/underfoot/played", number)
        assert window.network.values
        to_another()
        assert window.controller.session.patch == window.open_patch.patch
        assert not window.network.values


def test_what_is_set_of_a_preset_on_a_tile_stays_when_what_is_set_of_the_patch_is_kept(window, served, client, qtbot):
    document = window.workspaces["Design"].document
    cues = ("play", "wood", "t1", -6.0), ("set", "creak--wood", "pitch", 0.5), ("set", "noise", "high", 4000.0)
    for number, (name, *arguments) in enumerate(cues, 60):
        client.send_message(served, f"/underfoot/{name}", *arguments, number)
        answer(client, qtbot, "/underfoot/played", number)
    window.workspaces["Design"].inspector.keep_requested.emit()
    assert document.patch.node("noise").parameters["high"] == 4000.0
    assert window.network.values == {("creak--wood", "pitch"): 0.5}
    document.stack.undo()
    assert window.controller.session.patch.node("noise") == document.patch.node("noise"), "its end is not undone"


@pytest.fixture
def tuned(window, served):
    """The window with its noise selected, which other programs may set; the patch is afterwards as it was."""
    before, design = window.open_patch.patch, window.workspaces["Design"]
    design.canvas.patch_scene.select(["noise"])
    yield design
    design.document.edit(before, "Back")


def test_a_value_that_is_set_from_outside_moves_its_control_and_the_hand_takes_it_over(
    window, served, client, tuned, qtbot
):
    """A fader moved nothing that is seen, and then the knob nothing that is heard: the fader's value stood for good."""
    editor, document, steps = tuned.inspector.editors["high"], window.open_patch.patch, tuned.document.stack.count()

    def played():
        return window.controller.session.patch.node("noise").parameters.get("high", editor.parameter.default)

    def fader(value, number):
        client.send_message(served, "/underfoot/set", "noise", "high", value, number)
        answer(client, qtbot, "/underfoot/played", number)

    fader(4000.0, 21)
    assert (editor.field.text(), editor.value()) == ("4 kHz", 4000.0)
    assert editor.slider.position() == pytest.approx(editor.parameter.position(4000.0))
    assert editor.label.text() == "High: by OSC"
    assert (window.open_patch.patch, tuned.document.stack.count()) == (document, steps)
    assert window.open_patch.is_saved

    left, middle = (editor.slider.rect().center() - QPoint(dx, 0) for dx in (40, 0))
    QTest.mousePress(editor.slider, Qt.MouseButton.LeftButton, pos=left)
    by_hand = editor.value()
    assert played() == tuned.patch().node("noise").parameters["high"] == by_hand != 4000.0, "who moved it last"
    fader(5000.0, 22)
    assert (editor.value(), played()) == (by_hand, 5000.0), "it does not leave the hand that holds it"
    QTest.mouseRelease(editor.slider, Qt.MouseButton.LeftButton, pos=middle)
    assert editor.value() == 5000.0
    QTest.mousePress(editor.field, Qt.MouseButton.LeftButton)
    fader(5500.0, 26)
    assert editor.value() == 5000.0
    QTest.mouseRelease(editor.field, Qt.MouseButton.LeftButton)
    assert editor.value() == 5500.0

    next(action for action in editor.actions() if action.text().startswith("Back to")).trigger()
    assert editor.value() == played() == by_hand
    assert editor.label.text() == "High"
    fader(6000.0, 23)
    next(action for action in editor.actions() if action.text() == "Keep what OSC has set").trigger()
    assert tuned.patch().node("noise").parameters["high"] == played() == 6000.0
    assert (editor.label.text(), tuned.document.stack.undoText()) == ("High", "Keep what OSC has set")
    fader(6500.0, 28)
    tuned.undo_action.trigger()
    assert tuned.patch().node("noise").parameters["high"] == played() == editor.value() == by_hand
    tuned.redo_action.trigger()
    fader(7000.0, 24)
    client.send_message(served, "/underfoot/stop", "all", 25)
    answer(client, qtbot, "/underfoot/played", 25)
    assert editor.value() == 6000.0


def test_osc_is_not_said_to_set_what_a_wire_drives(window, served, client, tuned, qtbot):
    client.send_message(served, "/underfoot/set", "noise", "high", 4000.0, 27)
    answer(client, qtbot, "/underfoot/played", 27)
    tuned.document.edit(with_driver(tuned.patch(), tuned.registry, "noise", "high", "lfo"), "Drive")
    editor = tuned.inspector.editors["high"]
    assert editor.label.text() == "High"
    assert not [action.text() for action in editor.actions() if action.isVisible()]


def test_what_is_set_of_one_of_several_selected_nodes_is_shown(window, served, client, tuned, qtbot):
    tuned.document.edit(tuned.patch().add("noise", tuned.registry), "Add")
    tuned.canvas.patch_scene.select(["noise1", "noise"])
    client.send_message(served, "/underfoot/set", "noise", "high", 4000.0, 28)
    answer(client, qtbot, "/underfoot/played", 28)
    editor = tuned.inspector.editors["high"]
    assert editor.label.text() == "High: 700 Hz to 4 kHz, by OSC"
    editor.reset()
    assert (editor.label.text(), window.network.values) == ("High", {})


def test_the_first_of_many_refused_messages_is_said(window, served, client, qtbot, monkeypatch):
    """It was told in a dialog that nobody has open while they play."""
    said = []
    window.controller.notified.connect(said.append)
    for number, quiet_s in ((31, 0.0), (32, math.inf)):
        monkeypatch.setattr(network_link, "QUIET_S", quiet_s)
        client.send_message(served, "/underfoot/set", "noise", "hihg", 1.0, number)
        answer(client, qtbot, "/underfoot/refused", number)
        qtbot.waitUntil(lambda: bool(said))
    (only,) = said
    assert only.startswith("Network: a message was refused: parameter is 'hihg'; allowed: low")


def test_what_the_window_under_load_reports_is_what_the_stress_test_reads(window, qtbot, tmp_path, monkeypatch, capsys):
    """In one process, on the simulator, and with a report a tick in place of one a second."""
    monkeypatch.setattr("platformdirs.user_documents_dir", lambda: str(tmp_path))
    watched, reporter = whole_floor.Watched(), TickReporter(window)
    reporter.setInterval(1)
    reporter.begin()
    path = window.controller.session.recording

    def has_settled():
        for line in map(json.loads, capsys.readouterr().out.splitlines()):
            watched.add(line, line["pids"])
        return path.exists() and sum(map(len, (line["ticks_ms"] for line in watched.lines[10:]))) > 10

    qtbot.waitUntil(has_settled, timeout=LONG_MS)
    reporter.stop()
    reporter.deleteLater()
    window.controller.recording.record(False)
    qtbot.waitUntil(lambda: not window.controller.recording.is_written(path), timeout=LONG_MS)
    _, _, samples, ticks, memory, recorded = whole_floor.judged(watched, has_cards=False)
    assert samples.found == "0 lost"
    assert ticks.times > 10
    assert "engine" in memory.found
    assert recorded.times > 0
    assert recorded.passed, recorded.found
