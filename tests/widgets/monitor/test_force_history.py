"""Back through what was measured while the session goes on, and footsteps that nobody saved."""

import csv
import tracemalloc
from datetime import datetime, timedelta

import numpy as np
import pytest
from made_steps import STEP
from on_screen import show
from PySide6.QtCore import QPoint, QPointF, Qt
from PySide6.QtGui import QWheelEvent
from PySide6.QtWidgets import QApplication

from underfoot.floor.layout import default_floor
from underfoot.widgets.controls.step_table import StepTable
from underfoot.widgets.monitor.force_history import ForceHistory
from underfoot.widgets.monitor.workspace import MonitorWorkspace
from underfoot.widgets.session.footstep_tracker import ForceUpdate

RATE = 48_000.0


def force_at(time_s):
    """A force that says when it was."""
    return 100.0 + time_s


def update_of(begin_s, end_s, tiles=4):
    """Samples from one second to another."""
    time_s = np.arange(round(begin_s * 1000), round(end_s * 1000)) / 1000.0
    force_n = np.broadcast_to(force_at(time_s)[:, None, None] / 4.0, (len(time_s), tiles, 4)).astype(np.float32)
    return ForceUpdate(time_s, force_n, np.zeros(tiles), np.zeros(tiles, bool), (), ())


@pytest.fixture
def monitor(qtbot, tmp_path):
    made = MonitorWorkspace()
    qtbot.addWidget(made)
    made.steps.folder = tmp_path / "footsteps"
    made.resize(1280, 728)
    made.set_session(default_floor(), RATE, is_simulated=True)
    show(qtbot, made)
    return made


def shown(monitor):
    """The force at the right edge of the plot."""
    return float(monitor.force.plot.drawing.series[-1].y[-1])


def test_what_was_measured_minutes_ago_is_scrolled_to_while_the_session_goes_on(monitor, qtbot):
    for begin_s in range(0, 120, 4):
        monitor.add_forces(update_of(begin_s, begin_s + 4))
    monitor.draw()
    assert shown(monitor) == pytest.approx(force_at(120.0), abs=0.1)
    monitor.time_bar.setValue(600)
    assert shown(monitor) == pytest.approx(force_at(60.0), abs=0.1)
    monitor.add_forces(update_of(120, 124))
    monitor.draw()
    assert shown(monitor) == pytest.approx(force_at(60.0), abs=0.1)
    assert monitor.time_bar.maximum() == 1240
    drawn = [monitor.force.plot.drawing]
    for _ in range(6):
        monitor.draw()
        drawn.append(monitor.force.plot.drawing)
    assert len(set(map(id, drawn))) == 2  # what stands still is not drawn at every tick
    at = QPointF(300.0, 60.0)
    event = QWheelEvent(
        at, monitor.force.plot.mapToGlobal(at), QPoint(), QPoint(0, 120), Qt.MouseButton.NoButton,
        Qt.KeyboardModifier.NoModifier, Qt.ScrollPhase.NoScrollPhase, False,
    )  # fmt: skip
    QApplication.sendEvent(monitor.force.plot, event)
    assert monitor.time.end_s == pytest.approx(59.0)
    qtbot.keyClick(monitor, Qt.Key.Key_End, Qt.KeyboardModifier.ShiftModifier)
    monitor.draw()
    assert shown(monitor) == pytest.approx(force_at(124.0), abs=0.1)


def test_the_spectrogram_goes_back_with_it(monitor):
    time_s = np.arange(round(20 * RATE)) / RATE
    for first in range(0, len(time_s), 24_000):
        loud = 0.5 * ((time_s[first] >= 2.0) & (time_s[first] < 4.0))
        tone = loud * np.sin(2.0 * np.pi * 200.0 * time_s[first : first + 24_000])
        monitor.add_vibration(first, np.tile(tone[:, None], (1, 4)).astype(np.float32))
    monitor.add_forces(update_of(0, 20))
    monitor.draw()
    assert monitor.vibration.spectrogram.drawing.heat.levels.max() == 0
    monitor.scroll_to(6.0)
    heat = monitor.vibration.spectrogram.drawing.heat
    assert heat.levels.max() > 200
    loud = np.flatnonzero(heat.levels.max(axis=0) > 200)
    at_s = heat.x[0] + (loud + 0.5) / heat.levels.shape[1] * (heat.x[1] - heat.x[0])
    assert 6.0 + at_s[0] == pytest.approx(2.0, abs=0.1)
    assert 6.0 + at_s[-1] == pytest.approx(4.0, abs=0.1)


def test_memory_of_the_past_is_bounded_and_pieces_do_not_matter():
    whole, pieces = ForceHistory(2, 1.0, 1000.0), ForceHistory(2, 1.0, 1000.0)
    update = update_of(0, 4, 2)
    whole.append(update.time_s, update.force_n)
    for begin in range(0, 4000, 7):
        part = slice(begin, begin + 7)
        pieces.append(update.time_s[part], update.force_n[part])
    for one, other in zip(whole.samples_before(2.5, 2.0, 1), pieces.samples_before(2.5, 2.0, 1), strict=True):
        np.testing.assert_allclose(one, other)
        assert len(one) == 200
    times, forces = whole.samples_before(2.5, 2.0, 1)
    np.testing.assert_allclose(forces.sum(axis=1), force_at(times - 0.0005), rtol=1e-5)
    tracemalloc.start()
    try:
        large = ForceHistory(900, 0.1, 1000.0)
        taken, _ = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert np.isnan(large.first_s)
    assert 64 << 20 <= taken <= 136 << 20


def test_the_table_follows_also_when_it_is_made_smaller_or_was_not_to_be_seen(qtbot):
    table = StepTable()
    qtbot.addWidget(table)
    table.resize(1000, 300)
    show(qtbot, table)
    bar = table.verticalScrollBar()
    for _ in range(40):
        table.steps.add([STEP])
    table.resize(700, 160)
    table.steps.add([STEP])
    assert bar.value() == bar.maximum() > 0
    table.hide()
    for _ in range(20):
        table.steps.add([STEP])
    table.show()
    table.steps.add([STEP])
    qtbot.waitUntil(lambda: bar.value() == bar.maximum())


def test_footsteps_that_nobody_saved_are_kept_when_the_floor_changes(monitor, tmp_path):
    said = []
    monitor.notified.connect(said.append)
    monitor.add_steps([STEP, STEP])
    monitor.set_session(default_floor(1, 2), RATE, is_simulated=True)
    (file,) = (tmp_path / "footsteps").iterdir()
    with file.open() as kept:
        assert [row["tile"] for row in csv.DictReader(kept)] == [STEP.tile] * 2
    assert str(file) in said[-1]
    assert monitor.steps.table.steps.rowCount() == 0
    monitor.add_steps([STEP])
    monitor.steps.export(tmp_path / "saved.csv")
    monitor.set_session(default_floor(), RATE, is_simulated=True)
    monitor.close_down()
    assert list((tmp_path / "footsteps").iterdir()) == [file]
    file.unlink()
    monitor.add_steps([STEP])
    said.clear()
    monitor.close_down()
    assert len(list((tmp_path / "footsteps").iterdir())) == 1
    assert said == []  # the window calls what is said now what could not be kept


def test_footsteps_that_another_window_keeps_in_the_same_second_stay(monitor, tmp_path):
    """As where both are ended with the person's session."""
    now, folder = datetime.now(), tmp_path / "footsteps"
    folder.mkdir()
    theirs = [folder / f"{now + timedelta(seconds=later):%Y-%m-%d %H.%M.%S}.csv" for later in range(60)]
    for file in theirs:
        file.write_text("theirs")
    monitor.add_steps([STEP])
    monitor.close_down()
    (own,) = {*folder.iterdir()} - {*theirs}
    assert own.stem.endswith(" 2")
    assert STEP.tile in own.read_text()
    assert {file.read_text() for file in theirs} == {"theirs"}
