"""The preview's panel by itself: axes of silence, what is late, and the way through its buttons."""

from datetime import datetime

import numpy as np
import pytest
from design_samples import REGISTRY
from msgspec.structs import replace
from on_screen import show
from PySide6.QtCore import Qt, QTimer
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QLabel
from windows import quiet_window

from underfoot.drawing.shapes import Text
from underfoot.engine.reports import MEASURED, Costs, Distributions, OutputChanged, Preview
from underfoot.floor.layout import default_floor
from underfoot.floor.profile import Profile
from underfoot.nodes import REGISTRY as NODES
from underfoot.patch.node import Port
from underfoot.widgets.design.preview import PreviewPanel
from underfoot.widgets.design.preview_drawings import waveform
from underfoot.widgets.design.preview_signal import PreviewSignal, summary_text
from underfoot.widgets.status_line import NO_FORCE, StatusLine


def sine(amplitude, frames=4800):
    return amplitude * np.sin(2 * np.pi * 250.0 * np.arange(frames) / 48_000.0)


@pytest.fixture
def shown(qtbot):
    """A panel on the screen with the preview of a tone."""
    panel = PreviewPanel()
    qtbot.addWidget(panel)
    panel.resize(900, 300)
    panel.set_tiles(default_floor().tiles)
    show(qtbot, panel)
    panel.expect("hum", REGISTRY["hum"])
    panel.show_preview(Preview(1, 48_000.0, np.zeros(4800), {"out": sine(3.0)}))
    return panel


def test_a_long_name_of_a_tile_is_read_in_its_box_and_ends_within_its_picture(shown, qtbot):
    def edge():
        """The picture of the tile beside its left border."""
        picture = shown.pad.grab().toImage()
        left = (shown.pad.width() - shown.pad.height()) // 2 + 8
        return picture.copy(left + 2, 20, 2, picture.height() - 40)

    plain, words = edge(), "entrance-hall-right-18"
    shown.set_tiles([replace(tile, id=f"{words}-{i}") for i, tile in enumerate(default_floor().tiles)])
    assert edge() == plain
    qtbot.waitUntil(lambda: shown.tiles.width() > shown.tiles.fontMetrics().horizontalAdvance("entrance-hall"))


def test_words_on_a_narrow_force_plate_are_not_cut(shown):
    (plate, *_), size_m = default_floor().tiles, (0.2, 0.6)
    shown.set_tiles(
        [replace(plate, size_m=size_m, sensors_m=((0.09, 0.29), (-0.09, 0.29), (-0.09, -0.29), (0.09, -0.29)))]
    )
    picture = shown.pad.grab().toImage()
    height = picture.height() - 16
    left = (picture.width() - round(height * size_m[0] / size_m[1])) // 2
    edge = {picture.pixel(left + 3, y) for y in range(30, picture.height() - 30)}
    assert len(edge) == 1


def test_silence_is_drawn_on_an_axis_that_means_something():
    low, high = waveform(PreviewSignal(np.zeros(480), np.zeros(480), 48_000.0, "m/s^2")).y_range
    assert low == pytest.approx(-0.06)
    assert high == pytest.approx(1.06)
    tiny = waveform(PreviewSignal(np.full(480, 1e-12), np.zeros(480), 48_000.0, "m/s^2"))
    assert tiny.y_range[1] == pytest.approx(1.06)


def drawn(qtbot, panel, preview):
    """Show a preview, and wait until its levels are drawn, too."""
    panel.show_preview(preview)
    qtbot.waitUntil(lambda: panel.plots.is_drawn)


def test_the_waveform_comes_first_and_each_plot_of_levels_in_a_pass_of_its_own(shown, qtbot):
    """All at once they stopped the window for a tenth of a second when the first preview came."""
    qtbot.waitUntil(lambda: shown.plots.is_drawn)
    levels = shown.plots.spectrogram.drawing, shown.plots.spectrum.drawing
    shown.show_preview(Preview(2, 48_000.0, np.zeros(4800), {"out": sine(1.0)}))
    assert shown.plots.waveform.drawing.series[0].y.max() == pytest.approx(1.0, rel=1e-3)
    assert (shown.plots.spectrogram.drawing, shown.plots.spectrum.drawing) == levels
    qtbot.waitUntil(lambda: shown.plots.is_drawn)
    assert levels[0] is not shown.plots.spectrogram.drawing
    assert levels[1] is not shown.plots.spectrum.drawing


def test_the_spectrum_of_silence_ends_at_0_db(shown, qtbot):
    drawn(qtbot, shown, Preview(2, 48_000.0, np.zeros(4800), {"out": np.zeros(4800)}))
    assert shown.plots.spectrum.ranges[:2] == pytest.approx((-60.0, 0.0))
    drawn(qtbot, shown, Preview(3, 48_000.0, np.zeros(4800), {"out": sine(3e-5)}))
    assert shown.plots.spectrum.ranges[1] == pytest.approx(-90.0)


def test_what_is_awaited_for_long_leaves_no_picture_of_the_patch_before(shown, qtbot):
    assert len(shown.plots.waveform.drawing.series[0].x) == 4800
    shown.expect("hum", REGISTRY["hum"])
    qtbot.waitUntil(lambda: shown.note.full_text == "being made…")
    assert shown.plots.waveform.drawing.note == "being made…"
    assert all(not line.x.size for line in shown.plots.waveform.drawing.series)
    shown.show_preview(Preview(2, 48_000.0, np.zeros(4800), {"out": sine(1.0)}))
    assert "peak 1 m/s²" in shown.note.full_text
    assert shown.plots.waveform.drawing.note == ""


def test_another_slots_signal_lies_over_this_one_until_it_is_forgotten(shown):
    other = Preview(2, 48_000.0, np.zeros(9600), {"out": sine(1.5, 9600)})
    shown.show_other(other, "hum", Port("out", "signal", "m/s^2"), "B")
    assert "+6.0 dB re B" in shown.note.full_text
    assert shown.plots.waveform.ranges[1] == pytest.approx(200.0)
    shown.forget_other()
    assert "re B" not in shown.note.full_text
    assert shown.plots.waveform.ranges[1] == pytest.approx(100.0)


def test_commanded_measured_and_the_other_slot_are_named_on_their_curves(shown):
    shown.show_preview(Preview(2, 48_000.0, np.zeros(4800), {"out": sine(3.0), MEASURED: sine(2.0)}))
    named = {line.name: line.y.max() for line in shown.plots.waveform.drawing.series}
    assert named == {"commanded": pytest.approx(3.0, rel=1e-3), "measured": pytest.approx(2.0, rel=1e-3)}
    words = [shape.text for shape in shown.plots.waveform.frame.above if isinstance(shape, Text)]
    assert sorted(words) == ["commanded", "measured"]
    shown.show_other(
        Preview(3, 48_000.0, np.zeros(4800), {"out": sine(1.0)}), "hum", Port("out", "signal", "m/s^2"), "A"
    )
    assert {line.name for line in shown.plots.waveform.drawing.series} == {"commanded", "measured", "slot A"}


def test_a_tile_that_was_just_calibrated_is_previewed_anew(qtbot, tmp_path):
    window = quiet_window(qtbot, tmp_path)
    design, asked = window.workspaces["Design"], []
    design.previews.preview_requested.connect(lambda node, tile, distributions: asked.append(node))
    window.controller.equaliser_changed.emit("t1")
    qtbot.waitUntil(lambda: len(asked) > 0)
    sink = asked[-1]
    design.previews.show_preview(Preview(1, 48_000.0, np.zeros(480), {"played": np.zeros(480)}), sink)
    asked.clear()
    window.controller.use_profile(Profile(tile="t1"), "response", tmp_path)
    qtbot.waitUntil(lambda: asked == [sink])


def test_events_have_the_axis_of_their_own_time_also_where_the_empty_spectrogram_draws_it(qtbot):
    panel = PreviewPanel()
    qtbot.addWidget(panel)
    panel.resize(900, 300)
    panel.expect("beat", REGISTRY["beat"])
    panel.show_preview(Preview(1, 48_000.0, np.zeros(86_400), {}, events={"out": np.array([[72_000.0, 1.0, 0.0]])}))
    assert panel.plots.waveform.ranges[:2] == pytest.approx((0.0, 1800.0))
    assert panel.plots.spectrogram.ranges[:2] == pytest.approx((0.0, 1800.0))
    panel.plots.waveform.range_requested.emit(1400.0, 1600.0)
    assert panel.plots.waveform.ranges[:2] == panel.plots.spectrogram.ranges[:2] == pytest.approx((1400.0, 1600.0))


def test_tab_goes_through_the_header_from_left_to_right(shown):
    passed = []
    shown.plots.shows["Waveform"].setFocus()
    for _ in range(8):
        passed.append(QApplication.focusWidget())
        QTest.keyClick(passed[-1], Qt.Key.Key_Tab)
    order = [
        *shown.plots.shows.values(),
        shown.plots.log,
        shown.plots.range,
        shown.tiles,
        shown.plots.waveform,
        shown.plots.spectrogram,
    ]
    assert passed == order
    across = [widget.mapTo(shown, widget.rect().topLeft()).x() for widget in order[:6]]
    assert across == sorted(across)


def test_a_node_that_is_not_built_yet_is_not_called_unused(workspace):
    workspace.document.edit(workspace.patch().connect("hum.out", "shaker.acceleration", REGISTRY), "Connect")
    workspace.show_costs(Costs({"shaker": 0.3}, {"shaker": 2}, ("push", "step")))
    states = {id: item.state for id, item in workspace.canvas.patch_scene.nodes.items()}
    assert states == {"push": "unused", "step": "unused", "hum": "", "shaker": ""}


def test_why_nothing_is_heard_or_felt_stays_while_it_is_so(qtbot, tmp_path):
    window = quiet_window(qtbot, tmp_path)
    window.bridge.output_changed.emit(OutputChanged("", "the simulator, without sound", "the card is not there"))
    window.show_message("Something else")
    assert window.status.session == "Playing on: the simulator, without sound (the card is not there)"
    audio = window.main_bar.audio
    silent, tip = audio.icon().cacheKey(), audio.toolTip()
    assert tip.startswith("The card is not there\n")
    assert audio.accessibleDescription() == "the card is not there"
    window.controller.stop()
    assert window.status.session.startswith("Silent until played on: the simulator")
    window.controller.play()
    window.bridge.output_changed.emit(OutputChanged("", "sound card"))
    assert audio.icon().cacheKey() != silent
    assert tip.endswith(f"\n{audio.toolTip()}")
    before = datetime.now()
    window.bridge.floor_silent.emit(True)
    since = (NO_FORCE.format(when) for when in (before, datetime.now()))
    assert window.status.session in {f"Playing on: sound card ({words})" for words in since}
    window.bridge.floor_silent.emit(False)
    assert window.status.session == "Playing on: sound card"


def test_a_long_reason_is_whole_where_there_is_room_and_in_the_tooltip_where_there_is_none(qtbot):
    line, reason = StatusLine(), f"the sound device {20 * 'Speaker '}has gone away; plug it in"
    qtbot.addWidget(line)
    line.resize(2400, 24)
    show(qtbot, line)
    line.show_session("Playing on: the simulator", reason)
    label = line.findChildren(QLabel)[-1]
    qtbot.waitUntil(lambda: label.text() == f"Playing on: the simulator ({reason})")
    line.resize(500, 24)
    qtbot.waitUntil(lambda: label.text().endswith("…"))
    assert reason in label.toolTip()
    line.show_message("The recording was saved")
    qtbot.waitUntil(lambda: line.findChildren(QLabel)[0].text() == "The recording was saved")
    assert line.findChild(QTimer).isActive()
    line.withdraw("The recording was saved")
    assert not line.findChild(QTimer).isActive()  # the empty line would remove itself for good, every five seconds


def test_messages_that_went_by_are_read_under_the_mouse(qtbot):
    """Faults of tiles are told once, while somebody may be on the stage."""
    line = StatusLine()
    qtbot.addWidget(line)
    for k in range(40):
        line.show_message(f"tile t{k}: sensor 1 is dead")
    line.show_message("")
    last = line.findChildren(QLabel)[0].toolTip().splitlines()
    assert [one.partition("  ")[2] for one in last] == [f"tile t{k}: sensor 1 is dead" for k in range(10, 40)]


def test_without_a_node_there_are_no_distributions_to_be_shown(shown):
    shown.expect("fibre-bundle", NODES["fibre-bundle"])
    shown.distributions.click()
    assert shown.wants_distributions
    shown.clear()
    assert shown.distributions.isHidden()
    assert not shown.wants_distributions
    assert shown.plots.waveform.isVisible()


def test_distributions_of_what_is_no_more_do_not_stay(shown, qtbot):
    shown.expect("gaps", NODES["poisson"])
    shown.distributions.click()
    distributions = Distributions(1, NODES["poisson"].distributions({"interval": 0.05}))
    shown.show_distributions(distributions)
    assert shown.distribution_view.plots[0].isVisible()
    shown.expect("gaps", NODES["poisson"])
    qtbot.waitUntil(shown.distribution_view.text.isVisible)
    assert not shown.distribution_view.plots[0].isVisible()
    shown.show_distributions(distributions)
    assert shown.distribution_view.plots[0].isVisible()


def test_in_a_small_panel_the_name_is_whole_and_no_words_lie_over_the_spectrogram(shown, qtbot):
    def named():
        return [line.name for line in shown.plots.spectrogram.drawing.lines if line.name]

    assert shown.title.text() == "Hum"
    assert named()
    shown.resize(552, 210)
    qtbot.waitUntil(lambda: not named())
    assert shown.short_title.isVisible()
    assert shown.short_title.text() == "Hum"
    assert shown.title.text() == ""
    shown.expect("hum", REGISTRY["hum"], label=10 * "Slips of stones ")
    QApplication.sendPostedEvents()
    assert shown.width() == 552  # which it would leave for the room that a longer name asks for
    assert shown.short_title.text().startswith("Slips of stones")
    shown.expect("hum", REGISTRY["hum"])
    shown.resize(900, 300)
    qtbot.waitUntil(lambda: bool(named()))
    assert shown.title.text() == "Hum"
    assert shown.short_title.isHidden()


def test_what_is_for_ears_is_shown_as_far_as_it_is_heard_and_without_the_sole(shown, qtbot):
    def lines():
        return shown.plots.spectrogram.drawing.lines, shown.plots.spectrum.drawing.lines

    qtbot.waitUntil(lambda: shown.plots.is_drawn)
    assert all(lines())
    assert shown.plots.spectrum.ranges[3] == pytest.approx(2000.0)
    crackle = np.sin(2 * np.pi * 8000.0 * np.arange(4800) / 48_000.0)
    shown.expect("sound", NODES["sound-output"], is_heard=True)
    assert not any(lines())
    drawn(qtbot, shown, Preview(2, 48_000.0, np.zeros(4800), {"heard": crackle}))
    assert not any(lines())
    assert shown.plots.spectrum.ranges[3] == pytest.approx(20_000.0)
    line = shown.plots.spectrum.drawing.series[0]
    assert line.y[line.x.argmax()] == pytest.approx(8000.0, rel=0.03)
    drawn(qtbot, shown, Preview(3, 16_000.0, np.zeros(1600), {"heard": crackle[::3]}))
    assert shown.plots.spectrum.ranges[3] == pytest.approx(8000.0), "no more than is sampled"


def test_what_was_awaited_is_no_more_awaited_when_no_node_is_meant(shown, qtbot):
    shown.expect("hum", REGISTRY["hum"])
    qtbot.waitUntil(lambda: shown.note.full_text == "being made…")
    shown.clear()
    assert shown.note.full_text == "select a node"
    assert shown.plots.waveform.drawing.note == ""


@pytest.mark.parametrize(("width_px", "beside"), [(900, "title"), (520, "short_title")])
def test_in_a_narrow_panel_no_button_is_cut(shown, qtbot, width_px, beside):
    shown.expect("slip", NODES["stick-slip"])
    shown.resize(width_px, 300)
    row = (
        shown.output,
        shown.distributions,
        *shown.plots.shows.values(),
        shown.plots.log,
        shown.plots.range,
        shown.tiles,
    )

    def is_arranged():
        assert all(widget.width() >= widget.sizeHint().width() for widget in row)
        assert all(shown.rect().contains(widget.geometry()) for widget in row)
        for widget in row[:2]:  # with the name, or the row of buttons is wider than a window of 900 pixels leaves
            assert widget.y() == row[2].y() or widget.y() >= row[2].geometry().bottom() + 4
            assert abs(widget.geometry().center().y() - getattr(shown, beside).geometry().center().y()) <= 2

    qtbot.waitUntil(is_arranged)


@pytest.mark.parametrize(("headroom_db", "said"), [(6.0, "headroom 6 dB"), (0.0, "limited at full level")])
def test_that_a_signal_is_limited_is_said_before_what_a_narrow_window_cuts(headroom_db, said):
    values = np.sin(2.0 * np.pi * 250.0 / 48_000.0 * np.arange(4800))
    signal = PreviewSignal(values, np.zeros(4800), 48_000.0, "m/s^2", measured=values, headroom_db=headroom_db)
    text = summary_text(signal, None, "")
    assert text.startswith(f"peak 1 m/s², RMS 0.707 m/s², {said}; tile 1 m/s²")
