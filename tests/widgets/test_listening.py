"""A scripted hand plays from the start, loops, hears one node alone, and compares A with B: on the simulated floor."""

from itertools import pairwise

import numpy as np
import pytest
from design_samples import NONE, send
from PySide6.QtCore import QEvent, Qt
from PySide6.QtTest import QTest
from windows import VibrationRecorder, design, noise_patch

from underfoot.engine.commands import Swap
from underfoot.engine.reports import CommandApplied
from underfoot.experiments.trial_files import read_csv
from underfoot.nodes import REGISTRY
from underfoot.widgets.design.blind_test import BlindTest
from underfoot.widgets.session.listening import AuditionedOutput

LEFT = Qt.MouseButton.LeftButton


@pytest.fixture
def bench(window, qtbot):
    """The Design workspace of a window that plays, and what its engine did."""
    workspace = design(window)
    workspace.swaps = []
    window.bridge.reported.connect(
        lambda reports: workspace.swaps.extend(
            report for report in reports if isinstance(report, CommandApplied) and isinstance(report.command, Swap)
        )
    )
    workspace.canvas.setFocus()
    workspace.canvas.fit_view(all_nodes=True)
    yield workspace
    window.listening.end_audition()
    window.listening.loop(False)


def key(workspace, which, modifiers=NONE):
    QTest.keyClick(workspace.canvas, which, modifiers)


def test_p_plays_from_the_start_and_l_again_and_again(window, bench, qtbot, monkeypatch):
    shown = []
    monkeypatch.setattr(window.workspaces["Monitor"].map, "show_step", shown.append)
    key(bench, Qt.Key.Key_P)
    qtbot.waitUntil(lambda: any(swap.command.anew for swap in bench.swaps))
    assert shown == [window.listening.tile]
    lengths_s = []
    window.controller.previews.preview_computed.connect(
        lambda preview, _: lengths_s.append(len(preview.force_n) / preview.rate_hz)
    )
    QTest.keyClick(bench.listen_bar.length, Qt.Key.Key_Down)
    assert bench.listen_bar.seconds == 0.5
    qtbot.waitUntil(lambda: 0.5 in lengths_s)
    key(bench, Qt.Key.Key_L)
    assert bench.listen_bar.loop.isChecked()
    before = len(bench.swaps)

    def asked():
        return [(swap.command.from_frame, swap.frame) for swap in bench.swaps[before + 1 :]]

    # A machine under load may build some too late.
    qtbot.waitUntil(lambda: len(asked()) > 2 and any(frame == due for due, frame in asked()))
    assert {(later[0] - earlier[0]) % (0.5 * 48_000) for earlier, later in pairwise(asked())} == {0.0}
    key(bench, Qt.Key.Key_L)
    assert not window.listening.is_looping
    QTest.keyClick(bench.listen_bar.length, Qt.Key.Key_Up)
    assert bench.listen_bar.seconds == 0.0


def test_from_start_plays_where_it_was_stopped(window, bench, qtbot):
    window.controller.stop()
    QTest.mouseClick(bench.listen_bar.start_button, LEFT)
    assert window.controller.is_playing


def test_the_button_on_a_node_and_its_key_play_it_alone(window, bench, qtbot):
    node = bench.canvas.patch_scene.nodes["noise"]
    place = bench.canvas.mapFromScene(node.mapToScene(node.geometry.plot.topRight()))
    vibration = VibrationRecorder(window)
    send(bench.canvas.viewport(), QEvent.Type.MouseButtonPress, place, LEFT)
    send(bench.canvas.viewport(), QEvent.Type.MouseButtonRelease, place, LEFT)
    qtbot.waitUntil(lambda: window.listening.auditioned_output is not None)
    assert "Auditioning Noise on t1: as it is, in m/s²" in window.status.message
    assert node.is_auditioned
    assert bench.listen_bar.audition_button.isVisible()
    assert bench.patch() == noise_patch()  # the document is as it was
    qtbot.waitUntil(lambda: vibration.tiles() == ["t1"])
    bench.canvas.patch_scene.select(["noise"])
    key(bench, Qt.Key.Key_A)
    assert window.listening.auditioned_output is None
    assert not node.is_auditioned
    key(bench, Qt.Key.Key_A, Qt.KeyboardModifier.ShiftModifier)
    qtbot.waitUntil(lambda: window.listening.auditioned_output is not None)
    assert "on all tiles" in window.status.message
    QTest.mouseClick(bench.listen_bar.audition_button, LEFT)
    assert window.listening.auditioned_output is None


def test_a_node_alone_that_is_ended_at_once_is_not_followed_by_its_step(window, bench, qtbot):
    """The whole patch, once it was back, began anew with it."""
    qtbot.waitUntil(lambda: window.controller.session.is_compiled)
    bench.swaps.clear()
    window.listening.audition(AuditionedOutput("noise"))
    qtbot.waitUntil(lambda: bool(bench.swaps))
    window.listening.end_audition()
    qtbot.waitUntil(lambda: len(bench.swaps) > 1)
    bench.document.edit(bench.patch().disconnect(bench.patch().wires), "Disconnect")
    qtbot.waitUntil(lambda: len(bench.swaps) > 2)
    bench.undo_action.trigger()
    assert not any(swap.command.anew for swap in bench.swaps)


def test_a_node_is_played_alone_once_its_preview_has_come_though_others_are_asked_for_first(window, bench, qtbot):
    """It was lost, and played alone when it was chosen later, also in another patch that has a node of its id."""

    def press(amplitude):
        bench.document.edit(bench.patch().set("noise", "amplitude", amplitude, REGISTRY), "Set")
        bench.canvas.audition_requested.emit("noise")

    bench.canvas.patch_scene.select(["tile-output"])
    press(5.0)
    qtbot.waitUntil(lambda: window.listening.auditioned_output is not None)
    window.listening.end_audition()
    press(6.0)
    path = window.open_patch.path
    window.open_patch.open_untitled(noise_patch())
    with qtbot.waitSignal(window.controller.previews.preview_computed, check_params_cb=lambda _, node: node == "noise"):
        bench.canvas.patch_scene.select(["noise"])
    assert window.listening.auditioned_output is None
    window.open_patch.read(path)


def test_a_node_that_is_played_alone_is_called_by_its_name(window, bench, qtbot):
    bench.document.edit(bench.patch().name("noise", "Wind & rain"), "Rename")
    bench.canvas.patch_scene.select(["noise"])
    key(bench, Qt.Key.Key_A)
    qtbot.waitUntil(bench.listen_bar.audition_button.isVisible)
    assert bench.listen_bar.audition_button.text() == "Wind && rain alone  ×"
    assert window.status.message.startswith("Auditioning Wind & rain")
    bench.document.edit(bench.patch().name("noise", "Surf"), "Rename")
    assert bench.listen_bar.audition_button.text() == "Surf alone  ×"
    bench.listen_bar.show_auditioned("Wind and rain in the trees of the north entrance")  # as narrow as any
    assert bench.listen_bar.audition_button.text().endswith("… alone  ×")


def test_marks_are_set_by_keys_heard_and_undone(window, bench, qtbot):
    canvas = bench.canvas
    canvas.patch_scene.select(["noise", "tile-output"])
    key(bench, Qt.Key.Key_M)
    assert {node.marks for node in bench.patch().nodes} == {("muted",)}
    assert window.controller.session.patch == bench.patch()
    assert bench.document.stack.undoText() == "Mute 2 nodes"
    key(bench, Qt.Key.Key_M)
    assert bench.patch() == noise_patch()
    canvas.patch_scene.select(["tile-output"])
    key(bench, Qt.Key.Key_S)
    assert bench.patch().node("tile-output").marks == ("soloed",)
    assert bench.document.stack.undoText() == "Solo Tile output"
    key(bench, Qt.Key.Key_B)
    assert "cannot be bypassed" in canvas.message
    for _ in range(3):
        bench.undo_action.trigger()
    assert bench.patch() == noise_patch()


def test_a_and_b_have_their_own_patch_file_and_undo(window, bench, qtbot, tmp_path):
    a = bench.patch()
    key(bench, Qt.Key.Key_X)
    assert bench.listen_bar.slots["B"].isChecked()
    assert "(B)" in window.windowTitle()
    assert bench.patch() == a  # B begins as a copy
    assert window.open_patch.path is None
    louder = a.set("noise", "amplitude", 4.0, REGISTRY)
    bench.document.edit(louder, "Set amplitude")
    qtbot.waitUntil(lambda: window.controller.session.patch.node("noise").parameters == {"amplitude": 4.0})
    QTest.mouseClick(bench.listen_bar.slots["A"], LEFT)
    assert bench.patch() == a
    assert not window.isWindowModified()
    assert not window.open_patch.is_all_saved
    assert window.open_patch.path is not None
    assert not bench.undo_action.isEnabled() or bench.document.stack.undoText() != "Set amplitude"
    for _ in range(2):  # the slot that is edited stays
        QTest.mouseClick(bench.listen_bar.slots["B"], LEFT)
        assert bench.patch() == louder
    bench.undo_action.trigger()
    assert bench.patch() == a
    bench.redo_action.trigger()
    # The louder one is played as softly as the other.
    listening = window.listening
    qtbot.waitUntil(lambda: "B −12" in bench.listen_bar.state.full_text)
    assert listening.gain("A") == 1.0
    assert listening.gain("B") == pytest.approx(0.25, rel=0.02)
    assert any(node.type == "gain" for node in window.controller.session.patch.nodes)
    QTest.mouseClick(bench.listen_bar.match, LEFT)
    assert listening.gain("B") == 1.0
    QTest.mouseClick(bench.listen_bar.match, LEFT)
    # The preview draws A over B, and says by how much B is more.
    bench.canvas.patch_scene.select(["noise"])
    qtbot.waitUntil(lambda: "dB re A" in bench.preview.note.full_text)
    assert "+12.0 dB re A" in bench.preview.note.full_text
    assert [line.colour for line in bench.preview.plots.waveform.drawing.series].count("events") == 1
    QTest.mouseClick(bench.listen_bar.overlay, LEFT)
    assert "re A" not in bench.preview.note.full_text
    QTest.mouseClick(bench.listen_bar.overlay, LEFT)
    # Copied to A, and taken back there.
    QTest.mouseClick(bench.listen_bar.copy, LEFT)
    key(bench, Qt.Key.Key_X)
    assert bench.patch() == louder
    bench.undo_action.trigger()
    assert bench.patch() == a


def test_a_preview_of_an_older_edit_sets_no_level(window, bench, qtbot):
    listening, controller = window.listening, window.controller
    if window.open_patch.other is None:
        key(bench, Qt.Key.Key_X)
    slot, tile = window.open_patch.slot, bench.preview.pad.tile
    quiet = bench.patch()
    qtbot.waitUntil(lambda: listening.level("A") is not None and listening.level("B") is not None)
    loudness = listening.level(slot)
    louder = quiet.set("noise", "amplitude", 4.0 * quiet.node("noise").parameters.get("amplitude", 1.0), REGISTRY)
    bench.document.edit(louder, "Set amplitude")
    bench.undo_action.trigger()
    quiet_ones = []
    controller.previews.preview_computed.connect(lambda preview, node: quiet_ones.append((preview, node)))
    bench.previews.preview_requested.emit("tile-output", tile, False)
    qtbot.waitUntil(lambda: any(node == "tile-output" for _, node in quiet_ones))
    bench.redo_action.trigger()
    bench.previews.show_preview(quiet_ones[-1][0], "tile-output")  # as if it had arrived only now
    assert listening.level(slot) is None
    qtbot.waitUntil(lambda: listening.level(slot) is not None)
    assert listening.level(slot) == pytest.approx(4.0 * loudness, rel=0.02)
    bench.undo_action.trigger()


def test_a_blind_test_hides_all_and_keeps_every_answer(window, bench, qtbot, tmp_path, monkeypatch):
    monkeypatch.setattr("platformdirs.user_documents_dir", lambda: str(tmp_path))
    if window.open_patch.other is None:
        key(bench, Qt.Key.Key_X)
        key(bench, Qt.Key.Key_X)
    QTest.mouseClick(bench.listen_bar.blind_button, LEFT)
    test = window.findChildren(BlindTest)[-1]
    assert test.isVisible()
    assert test.size() == window.size()
    test.trials.setValue(3)
    test.seed.setValue(7)
    assert min(box.lineEdit().width() for box in (test.trials, test.seed)) > 100, "numbers cannot be seen"
    QTest.mouseClick(test.begin_button, LEFT)
    assert test.comparison is not None or "not known yet" in test.complaint.text()
    qtbot.waitUntil(lambda: all(window.listening.level(slot) is not None for slot in "AB"))
    QTest.mouseClick(test.begin_button, LEFT)
    before = window.controller.session.patch
    for key_before_x in (Qt.Key.Key_Right, Qt.Key.Key_1, Qt.Key.Key_Right, Qt.Key.Key_2, Qt.Key.Key_Left):
        QTest.keyClick(test, key_before_x)
    assert test.comparison.number == 1, "answered before X was played"
    for _ in range(3):
        swaps = len(bench.swaps)
        QTest.keyClick(test, Qt.Key.Key_3)
        qtbot.waitUntil(lambda swaps=swaps: len(bench.swaps) > swaps)
        assert bench.swaps[-1].command.anew
        QTest.mouseClick(test.answers["A"], LEFT)
    rows = read_csv(test.path)
    assert test.path.parent == tmp_path / "Underfoot"
    assert [row["answered"] for row in rows] == ["A", "A", "A"]
    right = sum(row["correct"] == "A" for row in rows)
    assert test.result.text().startswith(f"{right} of 3 right, p = ")
    assert test.kept.text().startswith(f"A was {test.comparison.a}, B was {test.comparison.b}.")
    QTest.mouseClick(test.close_button, LEFT)
    qtbot.waitUntil(lambda: not window.findChildren(BlindTest))
    assert window.controller.session.patch.title == before.title
    assert window.controller.session.playing


def test_zoom_and_cursor_of_the_preview(window, bench, qtbot):
    bench.canvas.patch_scene.select(["noise"])
    qtbot.waitUntil(lambda: "peak" in bench.preview.note.full_text)
    plot = bench.preview.plots.waveform
    area = plot.frame.area
    middle = (area.top + area.bottom) / 2
    whole = plot.ranges[:2]
    assert whole[1] == pytest.approx(900.0)
    places = [plot.rect().topLeft() + _at(x, middle) for x in (area.left + 60, area.left + 160)]
    send(plot, QEvent.Type.MouseButtonPress, places[0], LEFT)
    send(plot, QEvent.Type.MouseMove, places[1], LEFT)
    send(plot, QEvent.Type.MouseButtonRelease, places[1], LEFT)
    low, high = plot.ranges[:2]
    assert 0.0 < low < high < whole[1]
    assert bench.preview.plots.spectrogram.ranges[:2] == pytest.approx((low, high))
    assert "ms: peak" in bench.preview.note.full_text
    plot.setFocus()
    QTest.keyClick(plot, Qt.Key.Key_Plus)
    assert np.diff(plot.ranges[:2]) == pytest.approx((high - low) / 1.25, rel=1e-3)
    send(plot, QEvent.Type.MouseMove, places[1], Qt.MouseButton.NoButton)
    assert "m/s²" in bench.preview.note.full_text
    assert "dB" in bench.preview.note.full_text
    spectrogram = bench.preview.plots.spectrogram
    area = spectrogram.frame.area
    send(spectrogram, QEvent.Type.MouseMove, _at(area.left + 50, area.top + 40), Qt.MouseButton.NoButton)
    assert " ms, " in bench.preview.note.full_text
    assert "Hz: " in bench.preview.note.full_text
    QTest.keyClick(plot, Qt.Key.Key_0)
    assert plot.ranges[:2] == pytest.approx(whole)


def test_the_length_of_the_preview_is_chosen(window, bench, qtbot):
    bench.canvas.patch_scene.select(["noise"])
    bench.listen_bar.length.setCurrentIndex(3)
    bench.listen_bar.length.activated.emit(3)
    qtbot.waitUntil(lambda: bench.preview.plots.waveform.ranges[1] == pytest.approx(2000.0))
    bench.listen_bar.length.setCurrentIndex(0)
    bench.listen_bar.length.activated.emit(0)
    qtbot.waitUntil(lambda: bench.preview.plots.waveform.ranges[1] == pytest.approx(900.0))


def _at(x, y):
    from PySide6.QtCore import QPoint

    return QPoint(round(x), round(y))
