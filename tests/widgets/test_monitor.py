"""The Monitor workspace, fed with recorded steps and with signals whose picture is known."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from on_screen import show
from PySide6.QtCore import QPoint, QPointF, Qt
from PySide6.QtGui import QGuiApplication

from underfoot.engine.commands import PressTile, Tare, Walk
from underfoot.floor.contacts import Present
from underfoot.floor.footsteps import Step
from underfoot.floor.forces import read_forces
from underfoot.floor.layout import Floor, Tile, default_floor
from underfoot.records.tables import step_table
from underfoot.widgets.monitor.floor_map import FloorMap
from underfoot.widgets.monitor.force_plot import ForcePlot
from underfoot.widgets.monitor.spectrogram import FLOOR_DB, HIGH_HZ, LOW_HZ, ROWS, RunningSpectrum
from underfoot.widgets.monitor.step_table import COLUMNS, StepTable
from underfoot.widgets.monitor.workspace import MonitorWorkspace
from underfoot.widgets.plots import History, thinned
from underfoot.widgets.session import bridge
from underfoot.widgets.session.bridge import Feet

DATA = Path(__file__).resolve().parents[2] / "../shared/data"
RATE = 48_000.0
STEP = Step(1, "t1", "left", 0.2, 612.4, 760.2, 500.0, 740.0, 320.04, 8.61, 210.0, 200.0)
SPIKE = Step(2, "t2", "unknown", 0.8, 604.0, 1074.0, 465.0, 942.0, 413.8, 159.0, float("nan"), 180.0, spike=True)


# --- curves and pictures ---


@given(st.lists(st.integers(1, 7), min_size=1, max_size=12))
def test_a_history_keeps_the_latest_rows_whatever_they_come_in(lengths):
    history, everything = History(5), np.zeros(0)
    for length in lengths:
        rows = np.arange(len(everything), len(everything) + length, dtype=float)
        history.append(rows)
        everything = np.concatenate([everything, rows])
        assert history.latest().tolist() == everything[-5:].tolist()


@given(st.integers(0, 1000))
def test_a_thinned_curve_keeps_least_and_largest_of_every_step(seed):
    y = np.random.default_rng(seed).normal(size=(400, 2))
    x, thin = thinned(np.arange(400.0), y, 20.0)
    assert len(x) == 40
    assert (np.diff(x) > 0).all()
    for step in range(20):
        piece, kept = y[20 * step : 20 * step + 20], thin[2 * step : 2 * step + 2]
        np.testing.assert_array_equal(np.sort(kept, axis=0), [piece.min(axis=0), piece.max(axis=0)])


@pytest.mark.parametrize("step", [1.0, 20.0])
def test_a_curve_is_broken_at_a_gap(step):
    times = np.concatenate([np.arange(100.0), np.arange(300.0, 400.0)])
    x, y = thinned(times, np.ones((200, 1)), step)
    assert np.isnan(x).sum() == np.isnan(y).sum() == 1
    assert x[int(np.flatnonzero(np.isnan(x))[0]) + 1] >= 300.0


def _sine(hz, seconds=1.0, size=1.0):
    return (size * np.sin(2 * np.pi * hz / RATE * np.arange(int(RATE * seconds)))).astype(np.float32)


@pytest.mark.parametrize(("hz", "size"), [(50.0, 1.0), (250.0, 0.1), (1000.0, 0.01)])
def test_a_sine_is_seen_at_its_frequency_and_level(hz, size):
    spectrum = RunningSpectrum(RATE, 1.0)
    spectrum.feed(0, _sine(hz, size=size))
    column = spectrum.levels()[:, 50]
    rows_hz = np.geomspace(LOW_HZ, HIGH_HZ, ROWS)
    assert abs(rows_hz[column.argmax()] - hz) <= 7.0
    level_db = FLOOR_DB * (1.0 - column.max() / 255.0)
    assert level_db == pytest.approx(20 * np.log10(size), abs=1.5)


@given(st.lists(st.integers(1, 9000), min_size=1, max_size=12))
def test_a_picture_does_not_depend_on_how_the_samples_come(lengths):
    samples = np.random.default_rng(1).normal(size=sum(lengths)).astype(np.float32)
    whole, pieces = RunningSpectrum(RATE, 0.5), RunningSpectrum(RATE, 0.5)
    whole.feed(0, samples)
    at = 0
    for length in lengths:
        pieces.feed(at, samples[at : at + length])
        at += length
    np.testing.assert_array_equal(whole.levels(), pieces.levels())
    assert whole.end_frame == pieces.end_frame


def test_missing_samples_are_dark_and_later_ones_stand_in_their_place():
    spectrum, gapless = RunningSpectrum(RATE, 1.0), RunningSpectrum(RATE, 1.0)
    samples = _sine(250.0)
    gapless.feed(0, samples)
    spectrum.feed(0, samples[:12_000])
    spectrum.feed(36_000, samples[36_000:])
    assert spectrum.end_frame == gapless.end_frame
    assert not spectrum.levels()[:, 45:55].any()
    np.testing.assert_array_equal(spectrum.levels()[:, -5:], gapless.levels()[:, -5:])


def test_the_force_axis_grows_at_once_and_shrinks_late(qtbot):
    plot = ForcePlot()
    qtbot.addWidget(plot)
    plot.set_span(5.0, [(-5.0, "−5 s"), (0.0, "0 s")])

    def top_after(force_n, now_s):
        times = np.linspace(now_s - 1.0, now_s, 200)
        plot.show_forces(times, np.full((200, 4), force_n / 4, np.float32), now_s, np.zeros(0))
        return plot.box.viewRange()[1][1]

    assert top_after(700.0, 10.0) == 1000.0
    assert top_after(1500.0, 11.0) == 2000.0
    assert top_after(100.0, 13.0) == 2000.0
    assert top_after(100.0, 17.0) == 200.0


# --- the floor ---


@pytest.fixture
def turned():
    """Three tiles, one of them turned by 30 degrees."""
    pads = ((0.1, 0.1), (-0.1, 0.1), (-0.1, -0.1), (0.1, -0.1))
    return Floor(
        (
            Tile("a", (0.3, 0.3), (0.0, 0.0), 0.0, pads),
            Tile("b", (0.3, 0.3), (0.5, 0.0), 30.0, pads),
            Tile("c", (0.3, 0.3), (0.0, 0.5), 0.0, pads),
        )
    )


@pytest.fixture
def floor_map(qtbot, turned):
    made = FloorMap()
    qtbot.addWidget(made)
    made.resize(400, 400)
    made.set_floor(turned)
    show(qtbot, made)
    return made


def _place(floor_map, tile, x_m=0.0, y_m=0.0):
    """Where a place of a tile is on the screen."""
    at = tile.to_floor((x_m, y_m))
    return floor_map.to_screen().map(QPointF(*at)).toPoint()


def test_a_click_chooses_the_tile_under_it(floor_map, qtbot, turned):
    for tile in (turned.tiles[2], turned.tiles[1], turned.tiles[0]):
        with qtbot.waitSignal(floor_map.chosen) as chosen:
            qtbot.mouseClick(floor_map, Qt.MouseButton.LeftButton, pos=_place(floor_map, tile, 0.14, 0.14))
        assert chosen.args == [tile.id]
    assert floor_map.tile_at(QPointF(2, 2)) == ""


def test_arrows_go_to_the_next_tile_that_way(floor_map, qtbot):
    for key, tile in ((Qt.Key.Key_Right, "b"), (Qt.Key.Key_Left, "a"), (Qt.Key.Key_Up, "c"), (Qt.Key.Key_Down, "a")):
        qtbot.keyClick(floor_map, key)
        assert floor_map.choice() == tile
    qtbot.keyClick(floor_map, Qt.Key.Key_Down)
    assert floor_map.choice() == "a"


def test_the_mouse_presses_in_the_tiles_own_frame_and_lets_go(floor_map, qtbot, turned):
    floor_map.can_press = True
    floor_map.set_press(200.0)
    said = []
    floor_map.pressed.connect(lambda *press: said.append(press))
    tile = turned.tiles[1]
    qtbot.mousePress(floor_map, Qt.MouseButton.LeftButton, pos=_place(floor_map, tile, 0.1, -0.05))
    qtbot.mouseMove(floor_map, _place(floor_map, tile, 0.0, 0.1))
    qtbot.mouseMove(floor_map, QPoint(1, 1))
    qtbot.mouseRelease(floor_map, Qt.MouseButton.LeftButton, pos=QPoint(1, 1))
    assert said[0] == ("b", pytest.approx(0.1, abs=2e-3), pytest.approx(-0.05, abs=2e-3), 200.0)
    assert said[1] == ("b", pytest.approx(0.0, abs=2e-3), pytest.approx(0.1, abs=2e-3), 200.0)
    assert said[2:] == [("b", 0.0, 0.0, 0.0)]


def test_a_press_ends_when_the_floor_is_hidden(floor_map, qtbot, turned):
    floor_map.can_press = True
    qtbot.mousePress(floor_map, Qt.MouseButton.LeftButton, pos=_place(floor_map, turned.tiles[0]))
    with qtbot.waitSignal(floor_map.pressed) as let_go:
        floor_map.hide()
    assert let_go.args[3] == 0.0


def test_nobody_presses_on_a_real_floor(floor_map, qtbot, turned):
    with qtbot.assertNotEmitted(floor_map.pressed):
        qtbot.mouseClick(floor_map, Qt.MouseButton.LeftButton, pos=_place(floor_map, turned.tiles[2]))


def test_a_loaded_tile_is_amber_and_a_foot_is_green(floor_map, turned):
    def colour(tile, x_m, y_m):
        at = _place(floor_map, tile, x_m, y_m)
        return floor_map.grab().toImage().pixelColor(at)

    empty = colour(turned.tiles[2], 0.0, 0.0)
    floor_map.set_loads(np.array([0.0, 0.0, 800.0]), np.array([False, True, False]))
    floor_map.set_contacts([Present(1, 0.0, 0.5, 800.0, (2,))], 1.0)
    loaded, foot = colour(turned.tiles[2], 0.0, -0.12), colour(turned.tiles[2], 0.0, 0.0)
    assert loaded.red() > empty.red() + 40
    assert foot.green() > foot.red()


# --- the table ---


@pytest.fixture
def table(qtbot):
    made = StepTable()
    qtbot.addWidget(made)
    made.resize(1000, 200)
    show(qtbot, made)
    return made


def _row(table, row):
    return [table.steps.index(row, column).data() for column in range(len(COLUMNS))]


def test_steps_are_shown_with_their_units_and_digits(table):
    table.steps.add([STEP, SPIKE])
    assert _row(table, 0) == ["1", "t1", "left", "0.20", "612", "760", "500", "740", "320.0", "8.6", "210", "200"]
    assert _row(table, 1)[2] == "–"
    assert _row(table, 1)[9:11] == ["159.0 !", "–"]
    assert "impact" in table.steps.index(1, 9).data(Qt.ItemDataRole.ToolTipRole)
    headings = [table.steps.headerData(i, Qt.Orientation.Horizontal) for i in range(len(COLUMNS))]
    assert headings[3:] == [
        "Start, s", "Contact, ms", "Peak 1, N", "Valley, N", "Peak 2, N", "Impulse, N·s", "Loading, kN/s", "Path, mm",
        "Net, mm",
    ]  # fmt: skip


def test_the_columns_are_those_of_the_step_table_in_files(table, tmp_path):
    with step_table(tmp_path / "steps.csv") as write:
        write([STEP])
    table.steps.add([STEP])
    table.export(tmp_path / "mine.csv")
    assert (tmp_path / "mine.csv").read_text() == (tmp_path / "steps.csv").read_text()
    assert (tmp_path / "mine.csv").read_text().splitlines()[0] == ",".join(column.name for column in COLUMNS)


def test_the_table_stays_at_its_end_unless_someone_reads_above(table):
    for _ in range(40):
        table.steps.add([STEP])
    bar = table.verticalScrollBar()
    assert bar.value() == bar.maximum() > 0
    bar.setValue(3)
    table.steps.add([STEP])
    assert bar.value() == 3


def test_selected_steps_are_copied_for_a_spreadsheet(table, qtbot):
    table.steps.add([STEP, SPIKE])
    table.selectRow(1)
    qtbot.keyClick(table, Qt.Key.Key_C, Qt.KeyboardModifier.ControlModifier)
    lines = QGuiApplication.clipboard().text().split("\n")
    assert len(lines) == 2
    assert lines[1].split("\t")[:4] == ["2", "t2", "unknown", "0.8"]


def test_only_the_latest_steps_are_kept(table, monkeypatch):
    monkeypatch.setattr("underfoot.widgets.monitor.step_table._MOST", 10)
    table.steps.add([STEP] * 8)
    table.steps.add([SPIKE] * 5)
    assert table.steps.rowCount() == 10
    assert _row(table, 9)[0] == "2"


# --- all of it ---


@pytest.fixture
def monitor(qtbot):
    made = MonitorWorkspace()
    qtbot.addWidget(made)
    made.resize(1280, 728)
    made.set_session(default_floor(), RATE, True)
    show(qtbot, made)
    return made


def _walk(monitor, csv, noise=0.05):
    """Play a recording through, 60 times a second, with a vibration wherever a foot is."""
    floor = Floor.load(csv.with_suffix(".floor.json"))
    forces = read_forces(csv, floor)
    monitor.set_session(floor, RATE, False)
    feet = Feet(floor, RATE, forces.rate_hz)
    assert bridge._kernels_loaded.wait(120)
    steps = []
    times = forces.time_s - forces.time_s[0]
    rng = np.random.default_rng(1)
    for tick in range(int(times[-1] * 60) + 1):
        now = slice(*np.searchsorted(times, [tick / 60, (tick + 1) / 60]))
        feet.take(times[now] * RATE, forces.force_n[now])
        told, new = feet.follow(1.0)
        if told is not None:
            monitor.take_forces(told)
        monitor.take_steps(new)
        steps += new
        loads = feet._tracker.loads_n
        monitor.take_vibration(
            tick * 800, (noise * (loads > 50) * rng.normal(size=(800, len(loads)))).astype(np.float32)
        )
        monitor.draw()
    return steps, feet


@pytest.fixture
def walk():
    csv = DATA / "two-plates/walk.csv"
    if not csv.exists():
        pytest.skip(f"{csv} is not here")
    return csv


def test_recorded_steps_fill_curves_picture_and_table(monitor, walk, qtbot):
    _, feet = _walk(monitor, walk)
    monitor.take_steps(feet._counter.finish())
    assert monitor.table.steps.rowCount() == 2
    contact = [step.contact_ms for step in monitor.table.steps.steps]
    assert contact == pytest.approx([580, 579], abs=2)
    assert monitor._steps.text() == "2"
    _, y = monitor.force._sum.getData()
    assert np.nanmax(y) == pytest.approx(799, abs=5)
    assert monitor.force.box.viewRange()[1][1] == 1000.0
    assert monitor._spectrum.levels().max() > 100
    assert monitor._figures[0].text().endswith(" N")
    assert monitor.exporting.isEnabled()


def test_another_tile_is_shown_with_what_it_did_before(monitor, walk, qtbot):
    _walk(monitor, walk)
    before = monitor._spectrum.levels().copy()
    monitor.map.set_choice("p2")
    for _ in range(40):
        monitor.draw()
    assert not np.array_equal(monitor._spectrum.levels(), before)
    assert monitor._spectrum.levels().any()
    monitor.map.set_choice("p1")
    for _ in range(40):
        monitor.draw()
    np.testing.assert_array_equal(monitor._spectrum.levels(), before)


def test_a_long_stretch_of_vibration_is_analysed_bit_by_bit(monitor):
    samples = np.random.default_rng(2).normal(size=(3 * int(RATE), 4)).astype(np.float32)
    monitor.take_vibration(48_000, samples)
    assert not monitor._spectrum.levels().any()
    for _ in range(8):
        monitor.draw()
    whole = RunningSpectrum(RATE, 10.0)
    whole.feed(48_000, samples[:, 0])
    np.testing.assert_array_equal(monitor._spectrum.levels(), whole.levels())


def test_following_chooses_the_tile_of_the_newest_foot(monitor, walk, qtbot):
    qtbot.mouseClick(monitor.following, Qt.MouseButton.LeftButton)
    monitor.map.set_choice("t4")
    steps, feet = _walk(monitor, walk)
    steps += feet._counter.finish()
    assert monitor.map.choice() == steps[-1].tile != steps[0].tile
    for key in (Qt.Key.Key_Left, Qt.Key.Key_Right, Qt.Key.Key_Up, Qt.Key.Key_Down):
        qtbot.keyClick(monitor.map, key)
    assert not monitor.following.isChecked()


def test_a_pause_holds_the_picture_and_loses_nothing(monitor, walk, qtbot):
    qtbot.mouseClick(monitor.pausing, Qt.MouseButton.LeftButton)
    assert monitor.is_paused
    monitor.resume()
    _walk(monitor, walk)
    x, _ = monitor.force._sum.getData()
    monitor.pause()
    times = monitor._times.latest()[-1] + np.arange(1, 200) / 1000.0
    still = bridge.Forces(times, np.zeros((199, 2, 4)), np.zeros(2), np.zeros(2, bool), (), ())
    monitor.take_forces(still)
    monitor.draw()
    assert np.array_equal(monitor.force._sum.getData()[0], x, equal_nan=True)
    monitor.resume()
    monitor.draw()
    assert not np.array_equal(monitor.force._sum.getData()[0], x, equal_nan=True)


def test_what_is_not_on_the_screen_is_not_drawn(monitor, walk):
    monitor.hide()
    _walk(monitor, walk)
    x, _ = monitor.force._sum.getData()
    assert x is None or len(x) == 0
    assert monitor._steps.text() != "none yet"


def test_hands_become_commands(monitor, qtbot):
    said = []
    monitor.commanded.connect(said.append)
    monitor.press_n.setCurrentText("800 N")
    tile = default_floor().tiles[3]
    qtbot.mouseClick(monitor.map, Qt.MouseButton.LeftButton, pos=_place(monitor.map, tile, 0.05, 0.0))
    assert said == [
        PressTile("t4", pytest.approx(0.05, abs=2e-3), pytest.approx(0.0, abs=2e-3), 800.0),
        PressTile("t4", 0.0, 0.0, 0.0),
    ]
    qtbot.mouseClick(monitor.walker, Qt.MouseButton.LeftButton)
    qtbot.mouseClick(monitor.tare, Qt.MouseButton.LeftButton)
    assert said[2:] == [Walk(False), Tare()]


def test_the_span_of_time_is_chosen(monitor, qtbot):
    assert monitor.force.box.viewRange()[0] == [-5.0, 0.0]
    ten = monitor._spans[10.0]
    qtbot.mouseClick(ten, Qt.MouseButton.LeftButton)
    assert monitor.force.box.viewRange()[0] == monitor.spectrogram.box.viewRange()[0] == [-10.0, 0.0]
    assert ten.isChecked()
    assert not monitor._spans[5.0].isChecked()


def test_export_says_where_the_steps_are_or_why_they_are_not(monitor, qtbot, tmp_path):
    monitor.take_steps([STEP, SPIKE])
    with qtbot.waitSignal(monitor.noticed) as said:
        monitor.export(str(tmp_path / "steps.csv"))
    assert said.args[0].startswith("2 footsteps")
    assert len((tmp_path / "steps.csv").read_text().splitlines()) == 3
    with qtbot.waitSignal(monitor.noticed) as said:
        monitor.export(str(tmp_path / "missing" / "steps.csv"))
    assert "cannot be written" in said.args[0]
    qtbot.mouseClick(monitor.clearing, Qt.MouseButton.LeftButton)
    assert monitor._steps.text() == "none yet"


def test_the_colours_end_at_the_output_level(monitor):
    monitor.set_level(-23.0)
    assert monitor._levels._low.text() == "−90"
    assert monitor._levels._high.text() == "−20 dB of full scale"


@pytest.mark.parametrize("size", [(1280, 728), (1920, 1008)])
def test_no_word_is_cut_off(monitor, qtbot, size):
    from PySide6.QtWidgets import QAbstractButton, QLabel

    monitor.resize(*size)
    monitor.take_steps([STEP])
    qtbot.waitExposed(monitor)
    for widget in [*monitor.findChildren(QLabel), *monitor.findChildren(QAbstractButton)]:
        if widget.isVisible() and widget.text() and "<" not in widget.text():
            wide = widget.fontMetrics().horizontalAdvance(widget.text())
            assert wide <= widget.width(), widget.text()
