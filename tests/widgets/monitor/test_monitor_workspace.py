"""The Monitor workspace, fed with recorded steps."""

import numpy as np
import pytest
from made_steps import SPIKE, STEP
from measured import DATA, walk
from msgspec.structs import replace
from on_screen import place_on, show
from PySide6.QtCore import QEvent, QObject, QPointF, Qt
from PySide6.QtGui import QHelpEvent
from PySide6.QtWidgets import QAbstractButton, QApplication, QLabel

from underfoot.drawing.shapes import Text
from underfoot.engine.commands import PressTile, Tare, Walk
from underfoot.floor.contacts import ContactRows, OngoingContact
from underfoot.floor.layout import default_floor
from underfoot.widgets.monitor.running_spectrum import RunningSpectrum
from underfoot.widgets.monitor.workspace import MonitorWorkspace
from underfoot.widgets.session.footstep_tracker import FootstepTracker, ForceUpdate

RATE = 48_000.0


def update_of(*contacts):
    """A millisecond of force, with these contacts on the floor in the end."""
    load_n = np.zeros(4)
    for contact in contacts:
        load_n[contact.tiles[0]] = contact.force_n
    return ForceUpdate(np.zeros(1), np.zeros((1, 4, 4)), load_n, np.zeros(4, bool), contacts, ())


@pytest.fixture
def monitor(qtbot):
    made = MonitorWorkspace()
    qtbot.addWidget(made)
    made.resize(1280, 728)
    made.set_session(default_floor(), RATE, is_simulated=True)
    show(qtbot, made)
    return made


def sum_curve(monitor):
    """The curve of a tile's whole force, which is drawn last."""
    return monitor.force.plot.drawing.series[-1]


def play_through(monitor, recorded, noise=0.05):
    """Play a recording through, 60 times a second, with a vibration wherever a foot is."""
    floor, forces = recorded
    monitor.set_session(floor, RATE, is_simulated=False)
    tracker = FootstepTracker(floor, RATE, forces.rate_hz)
    assert tracker.wait_for_kernels(120.0)
    loads = np.zeros(len(floor.tiles))
    steps = []
    times = forces.time_s - forces.time_s[0]
    rng = np.random.default_rng(1)
    for tick in range(int(times[-1] * 60) + 1):
        now = slice(*np.searchsorted(times, [tick / 60, (tick + 1) / 60]))
        tracker.add(times[now] * RATE, forces.force_n[now])
        update, new = tracker.track(1_000)
        if update is not None:
            loads = update.load_n
            monitor.add_forces(update)
        monitor.add_steps(new)
        steps += new
        monitor.add_vibration(
            tick * 800, (noise * (loads > 50) * rng.normal(size=(800, len(loads)))).astype(np.float32)
        )
        monitor.draw()
    return steps, tracker, float(times[-1])


@pytest.fixture
def recorded():
    if not DATA.is_dir():
        pytest.skip(f"the measured walks are not at {DATA}")
    return walk("two-plates/walk")


def test_recorded_steps_fill_curves_picture_and_table(monitor, recorded, qtbot):
    _, tracker, _ = play_through(monitor, recorded)
    monitor.add_steps(tracker.finish())
    assert monitor.steps.table.steps.rowCount() == 2
    contact = [step.contact_ms for step in monitor.steps.table.steps.steps]
    assert contact == pytest.approx([580, 579], abs=2)
    assert monitor.steps.count.text() == "2 steps"
    assert np.nanmax(sum_curve(monitor).y) == pytest.approx(799, abs=5)
    assert monitor.force.plot.ranges[3] == 1000.0
    assert monitor.vibration.history.spectrum.levels().max() > 100
    assert monitor.force.readouts[0].text().endswith(" N")
    assert monitor.steps.export_button.isEnabled()


def test_another_tile_is_shown_with_what_it_did_before(monitor, recorded, qtbot):
    play_through(monitor, recorded)
    before = monitor.vibration.history.spectrum.levels().copy()
    monitor.map.choose_tile("p2")
    for _ in range(40):
        monitor.draw()
    assert not np.array_equal(monitor.vibration.history.spectrum.levels(), before)
    assert monitor.vibration.history.spectrum.levels().any()
    monitor.map.choose_tile("p1")
    for _ in range(40):
        monitor.draw()
    np.testing.assert_array_equal(monitor.vibration.history.spectrum.levels(), before)


def test_a_long_stretch_of_vibration_is_analysed_bit_by_bit(monitor):
    samples = np.random.default_rng(2).normal(size=(3 * int(RATE), 4)).astype(np.float32)
    monitor.add_vibration(48_000, samples)
    assert not monitor.vibration.history.spectrum.levels().any()
    for _ in range(8):
        monitor.draw()
    whole = RunningSpectrum(RATE, 10.0)
    whole.feed(48_000, samples[:, 0])
    np.testing.assert_array_equal(monitor.vibration.history.spectrum.levels()[:, -1000:], whole.levels())


def test_following_chooses_the_tile_of_the_newest_foot(monitor, recorded, qtbot):
    qtbot.mouseClick(monitor.force.following, Qt.MouseButton.LeftButton)
    monitor.map.choose_tile("t4")
    steps, tracker, _ = play_through(monitor, recorded)
    steps += tracker.finish()
    assert monitor.map.chosen_tile() == steps[-1].tile != steps[0].tile
    for key in (Qt.Key.Key_Left, Qt.Key.Key_Right, Qt.Key.Key_Up, Qt.Key.Key_Down):
        qtbot.keyClick(monitor.map, key)
    assert not monitor.force.following.isChecked()


def test_a_pause_holds_the_picture_and_loses_nothing(monitor, recorded, qtbot):
    qtbot.mouseClick(monitor.force.pausing, Qt.MouseButton.LeftButton)
    assert monitor.time.is_paused
    assert monitor.force.when.text() == "paused"
    monitor.resume()
    recorded_s = play_through(monitor, recorded)[2]
    x = sum_curve(monitor).x
    monitor.pause()
    floor = monitor.map.grab().toImage()
    times = recorded_s + np.arange(1, 200) / 1000.0
    at_m, on = np.linspace(0.1, 0.2, 199), np.ones((199, 2), bool)
    foot = ContactRows(times, np.full(199, 1000), at_m, at_m, np.full(199, 600.0), on)
    still = ForceUpdate(times, np.full((199, 2, 4), 300.0), np.zeros(2), np.zeros(2, bool), (), (foot,))
    monitor.add_forces(still)
    monitor.draw()
    assert monitor.map.grab().toImage() == floor
    assert np.array_equal(sum_curve(monitor).x, x, equal_nan=True)
    monitor.resume()
    monitor.draw()
    assert not np.array_equal(sum_curve(monitor).x, x, equal_nan=True)
    for _ in range(6):  # figures are readable: not every tick changes them
        monitor.draw()
    assert (monitor.force.when.text(), monitor.force.readouts[0].text()) == ("now", "1\u202f200 N")


def test_feet_that_came_down_in_a_pause_have_trails_after_it(monitor):
    """Those of its last three seconds, which are still seen."""
    monitor.pause()
    x_m, on = np.linspace(0.05, 0.55, 100), np.ones((100, 4), bool)
    for foot, y_m in enumerate((0.1, 0.5)):
        times_s = 5.0 * foot + np.arange(100) / 100.0
        rows = ContactRows(times_s, np.full(100, foot), x_m, np.full(100, y_m), np.full(100, 600.0), on)
        monitor.add_forces(ForceUpdate(times_s, np.zeros((100, 4, 4)), np.zeros(4), np.zeros(4, bool), (), (rows,)))
    paused = monitor.map.grab().toImage()
    monitor.resume()
    monitor.draw()
    resumed = monitor.map.grab().toImage()
    places = [monitor.map.to_screen().map(QPointF(0.5, y_m)).toPoint() for y_m in (0.1, 0.5)]
    assert [resumed.pixel(at) != paused.pixel(at) for at in places] == [False, True]


def test_what_is_not_on_the_screen_is_not_drawn(monitor, recorded):
    monitor.hide()
    play_through(monitor, recorded)
    assert not sum_curve(monitor).x.size
    assert monitor.steps.count.text() != "none yet"


def test_hands_become_commands(monitor, qtbot):
    said = []
    monitor.commanded.connect(said.append)
    monitor.floor.press_n.setCurrentText("800 N")
    tile = default_floor().tiles[3]
    qtbot.mouseClick(monitor.map, Qt.MouseButton.LeftButton, pos=place_on(monitor.map, tile, 0.05, 0.0))
    assert said == [
        PressTile("t4", pytest.approx(0.05, abs=2e-3), pytest.approx(0.0, abs=2e-3), 800.0),
        PressTile("t4", 0.0, 0.0, 0.0),
    ]
    qtbot.mouseClick(monitor.floor.walker, Qt.MouseButton.LeftButton)
    qtbot.mouseClick(monitor.floor.tare, Qt.MouseButton.LeftButton)
    assert said[2:] == [Walk(False), Tare()]


def test_the_span_of_time_is_chosen(monitor, qtbot):
    assert monitor.force.plot.ranges[:2] == (-5.0, 0.0)
    ten = monitor.force.span_buttons[10.0]
    qtbot.mouseClick(ten, Qt.MouseButton.LeftButton)
    assert monitor.force.plot.ranges[:2] == monitor.vibration.spectrogram.ranges[:2] == (-10.0, 0.0)
    assert ten.isChecked()
    assert not monitor.force.span_buttons[5.0].isChecked()


def test_the_gait_of_each_person_is_told_under_the_mouse(monitor):
    """Computed at each step, also while Monitor was hidden, it took milliseconds of a tick."""
    monitor.add_steps([replace(STEP, step=number, side=("left", "right")[number % 2]) for number in range(4)])
    assert monitor.steps.count.toolTip() == ""
    at = monitor.steps.count.rect().center()
    QApplication.sendEvent(
        monitor.steps.count, QHelpEvent(QEvent.Type.ToolTip, at, monitor.steps.count.mapToGlobal(at))
    )
    assert monitor.steps.count.toolTip() == "person 2: 4 steps, stance 612 ms, stance 0 % asymmetric"


def test_the_cadence_of_who_limps_is_the_number_of_steps_in_a_minute(monitor):
    monitor.add_steps([replace(STEP, cadence_per_min=60.0 / step_s) for step_s in (0.5, 0.9)])
    assert monitor.steps.cadence.text() == "86 a minute"


def test_export_says_where_the_steps_are_or_why_they_are_not(monitor, qtbot, tmp_path):
    monitor.add_steps([STEP, SPIKE])
    with qtbot.waitSignal(monitor.notified) as said:
        monitor.steps.export(tmp_path / "steps.csv")
    assert said.args[0].startswith("2 footsteps")
    assert len((tmp_path / "steps.csv").read_text().splitlines()) == 3
    monitor.steps.clear()
    monitor.add_steps([STEP])
    with qtbot.waitSignal(monitor.notified) as said:
        monitor.steps.export(tmp_path / "steps.csv")
    assert said.args[0].startswith("1 footstep saved")
    with qtbot.waitSignal(monitor.notified) as said:
        monitor.steps.export(tmp_path / "missing" / "steps.csv")
    assert "cannot be written" in said.args[0]
    qtbot.mouseClick(monitor.steps.clear_button, Qt.MouseButton.LeftButton)
    assert monitor.steps.count.text() == "none yet"


def test_the_colours_end_at_the_output_level(monitor):
    monitor.vibration.set_level(-23.0)
    assert monitor.vibration.level_key.low.text() == "−90"
    assert monitor.vibration.level_key.high.text() == "−20 dB of full scale"


@pytest.mark.parametrize("size", [(1280, 728), (1920, 1008)])
def test_no_word_is_cut_off(monitor, qtbot, size):
    monitor.resize(*size)
    monitor.add_steps([STEP])
    qtbot.waitExposed(monitor)
    for widget in [*monitor.findChildren(QLabel), *monitor.findChildren(QAbstractButton)]:
        if widget.isVisible() and widget.text() and "<" not in widget.text():
            wide = widget.fontMetrics().horizontalAdvance(widget.text())
            assert wide <= widget.width(), widget.text()


def vibrate(monitor, gains, ticks=100):
    """A tone on every tile: commanded 1 m/s^2 at 200 Hz, measured `gains` times as much."""
    for tick in range(ticks):
        tone = np.sin(2.0 * np.pi * 200.0 * (np.arange(800) + 800 * tick) / RATE)
        asked = np.repeat(tone[:, None], 4, axis=1).astype(np.float32)
        monitor.add_response(800 * tick, asked, asked * np.array(gains, np.float32))
        monitor.draw()


def test_levels_show_what_a_tile_is_asked_and_does_and_what_is_felt(monitor, qtbot):
    qtbot.keyClick(monitor, Qt.Key.Key_L)
    assert monitor.vibration.levels.isVisible()
    assert not monitor.vibration.spectrogram.isVisible()
    vibrate(monitor, [2.0, 1.0, 1.0, 0.1])
    drawn = {series.name: series for series in monitor.vibration.levels.drawing.series}
    thresholds = {one.style for name, one in drawn.items() if name.startswith("felt")}
    assert thresholds == {"dashed", "line"}  # two dashed greys were told apart by their order alone
    commanded, measured = drawn["commanded"], drawn["measured"]
    loudest = int(np.argmax(commanded.y))
    assert commanded.x[loudest] == 200.0
    assert commanded.y[loudest] == pytest.approx(0.0, abs=0.2)
    assert measured.y[loudest] - commanded.y[loudest] == pytest.approx(6.0, abs=0.1)
    line = next(one for one in monitor.findChildren(QLabel) if one.text().startswith("commanded"))
    said = line.text().replace("\u00a0", " ").replace("\u2060", "")
    assert "commanded 1 m/s², measured 2 (+6.0 dB, 0 % unexplained)" in said
    assert "noticed by 100 %; perceived stiffness: not covered" in said
    assert line.heightForWidth(line.width()) <= line.height(), "all of it is seen at 1280 pixels"
    qtbot.keyClick(monitor, Qt.Key.Key_L)
    assert monitor.vibration.spectrogram.isVisible()


def test_a_tile_that_does_not_do_what_it_is_told_is_marked_on_the_map(monitor):
    before = monitor.map.grab().toImage()
    vibrate(monitor, [1.0, 1.0, 1.0, 0.1])
    assert monitor.vibration.tile_levels.deviating().tolist() == [False, False, False, True]
    assert monitor.map.grab().toImage() != before


def test_a_tile_that_is_silent_or_loses_samples_is_marked_on_the_map_until_it_sends_again(monitor):
    """It was told once, in a line that is gone after some seconds."""

    def picture(lost, at_s):
        force_n = np.zeros((500, 4, 4))
        for tile, share in enumerate(lost):
            force_n[: int(500 * share), tile] = np.nan
        times = at_s + np.arange(500) / 250.0
        monitor.add_forces(replace(update_of(), time_s=times, force_n=force_n))
        for _ in range(8):
            monitor.draw()
        return monitor.map.grab().toImage()

    shares = ([0, 0, 0, 0], [0, 1, 0, 0], [0, 0.3, 0, 0], [0, 0.04, 0, 0])
    well, silent, lossy, nearly = (picture(lost, 10.0 * k) for k, lost in enumerate(shares))
    assert well == nearly
    assert len({image.bits().tobytes() for image in (well, silent, lossy)}) == 3


def test_where_nothing_is_measured_levels_say_so(monitor, qtbot):
    qtbot.keyClick(monitor, Qt.Key.Key_L)
    monitor.draw()
    assert monitor.vibration.levels.drawing.note == "nothing is measured here"


def test_who_stood_on_a_floor_that_is_unplugged_is_not_shown_any_more(monitor):
    def picture(update):
        monitor.add_forces(update)
        monitor.draw()
        return monitor.map.grab().toImage()

    nobody = picture(update_of())
    somebody = picture(update_of(OngoingContact(1, 0.15, 0.15, 600.0, (0,))))
    assert somebody != nobody
    monitor.empty_floor(True)
    monitor.draw()
    assert monitor.map.grab().toImage() == nobody


def test_the_plot_of_a_floor_that_sends_nothing_is_emptied_once(monitor):
    monitor.add_forces(update_of())
    monitor.draw()
    assert sum_curve(monitor).x.size
    drawn = []
    for tick in range(3):  # time goes on with the vibration
        monitor.time.advance_to(60.0 + tick)
        monitor.draw()
        drawn.append(monitor.force.plot.drawing)
    assert not sum_curve(monitor).x.size
    assert drawn[0] is drawn[1] is drawn[2]


class Paintings(QObject):
    """Counts how often some widgets are painted."""

    def __init__(self, *widgets):
        super().__init__()
        self.count = 0
        for widget in widgets:
            widget.installEventFilter(self)

    def eventFilter(self, watched, event):
        self.count += event.type() == QEvent.Type.Paint
        return False


def test_an_idle_floor_is_not_painted_anew_until_somebody_comes(monitor):
    def go_on(first_s, seconds, load_n=0.0, contacts=()):
        for tick in range(round(10 * seconds)):
            times = first_s + 0.1 * tick + 0.001 * np.arange(1, 101)
            force_n = np.full((100, 4, 4), 0.25 * load_n)
            monitor.add_vibration(round(RATE * times[0]) - 48, np.zeros((4800, 4), np.float32))
            monitor.add_forces(ForceUpdate(times, force_n, np.full(4, load_n), np.zeros(4, bool), contacts, ()))
            monitor.draw()
            QApplication.processEvents()

    go_on(0.0, 5.5)
    painted = Paintings(monitor.force.plot, monitor.vibration.spectrogram, monitor.map)
    go_on(5.5, 1.0)
    assert not painted.count
    go_on(6.5, 0.2, 80.0, (OngoingContact(1, 0.15, 0.15, 320.0, (0,)),))
    assert painted.count == 3  # the map at each other tick
    assert sum_curve(monitor).y[-1] == 80.0
    go_on(6.7, 5.2)
    painted.count = 0
    go_on(11.9, 0.5)
    assert not painted.count
    assert not sum_curve(monitor).y.any()


def test_no_frame_has_both_the_map_and_the_numbers(monitor):
    """Together they would make it the longest."""
    painted, frames = Paintings(monitor.map), []
    for tick in range(12):
        update = update_of(OngoingContact(1, 0.15 + 0.01 * tick, 0.15, 700.0 + tick, (0,)))
        monitor.add_forces(replace(update, time_s=np.full(1, 0.02 * tick), force_n=np.full((1, 4, 4), 50.0 + tick)))
        before, painted.count = monitor.force.readouts[0].text(), 0
        monitor.draw()
        QApplication.processEvents()
        frames.append((painted.count > 0, monitor.force.readouts[0].text() != before))
    assert (True, True) not in frames
    assert frames.count((True, False)) > 4
    assert frames.count((False, True)) == 2


def test_the_times_are_written_under_the_lowest_plot_of_them(qtbot, monitor):
    """Under the spectrogram; with levels in its place, which are over frequency, under the forces."""

    def times_of(plot):
        return [shape.text for shape in plot.frame.shapes if isinstance(shape, Text) and shape.text.endswith(" s")]

    assert (times_of(monitor.force.plot), times_of(monitor.vibration.spectrogram)) == ([], ["0 s"])
    qtbot.keyClick(monitor, Qt.Key.Key_L)
    assert monitor.vibration.levels.isVisible()
    assert times_of(monitor.force.plot) == ["0 s"]
    qtbot.keyClick(monitor, Qt.Key.Key_L)
    assert times_of(monitor.force.plot) == []
