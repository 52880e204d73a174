"""The window's targets: floors, simulated tiles, recorded forces, and hardware."""

import numpy as np
import pytest
from on_screen import choose, show, type_into
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QMenu, QPushButton
from windows import LONG_MS, calibrate, choose_file, design, dialog_of, quiet_window

from underfoot.devices.emulation.emulator import Emulator
from underfoot.devices.simulated_floor import SimulatedFloor
from underfoot.devices.transports.serial import PtySender
from underfoot.engine.reports import Health
from underfoot.floor.layout import default_floor
from underfoot.floor.tile_parameters import TileParameters
from underfoot.widgets.dialogs.file_error_dialog import FileErrorDialog
from underfoot.widgets.dialogs.grid_dialog import GridDialog
from underfoot.widgets.dialogs.transport_dialog import TransportDialog
from underfoot.widgets.session.settings import Settings
from underfoot.widgets.session.target_settings import remembered_target
from underfoot.widgets.session_display import STARTING


@pytest.fixture
def window(qtbot, tmp_path, patch_folder):
    """A window of the test's own, for whose session another one will be opened."""
    made = quiet_window(qtbot, tmp_path / "kept", patch_folder / "hiss.json")
    with qtbot.waitSignal(made.controller.opened, timeout=LONG_MS):
        made.start()
    return made


def test_another_target_is_another_session_with_the_same_patch(window, qtbot):
    before = window.controller.session
    with qtbot.waitSignal(window.controller.opened, timeout=LONG_MS):
        window.main_bar.target_chosen.emit("simulator 1 3")
        assert window.controller.session is None
    session = window.controller.session
    assert session is not before
    assert [tile.id for tile in session.target.floor.tiles] == ["t1", "t2", "t3"]
    assert session.patch == design(window).patch()
    assert session.level_db == window.settings.level_db
    assert window.main_bar.target.text() == "Simulated floor  1 × 3"
    assert "The target is now" in window.status.message


def test_the_menu_marks_the_floor_and_the_tiles_that_are_played_on(window, qtbot):
    def marked():
        menu = window.main_bar.target.menu()
        actions = [action for one in (menu, *menu.findChildren(QMenu)) for action in one.actions()]
        return {action.text() for action in actions if action.isChecked()}

    assert marked() == {"Simulated floor  2 × 2", "Ideal sensors"}
    for choice, words in (
        ("simulation plywood-tile", {"Simulated floor  2 × 2", "Plywood tile"}),
        ("simulator 1 3", {"Simulated floor of another size…", "Plywood tile"}),
    ):
        with qtbot.waitSignal(window.controller.opened, timeout=LONG_MS):
            window.main_bar.target_chosen.emit(choice)
        assert marked() == words


def test_a_floor_of_another_size_is_asked_for(window, qtbot):
    """By a real click in the menu and typed numbers; what is too large is said, and cannot be used."""
    choose(window.main_bar.target, "Simulated floor of another size…")
    dialog = dialog_of(window, GridDialog)
    show(qtbot, dialog)
    type_into(qtbot, dialog.rows, "5", Qt.Key.Key_Tab)
    type_into(qtbot, dialog.columns, "32")
    assert dialog.extent.text() == "160 tiles; allowed: up to 144"
    assert dialog.isVisible()
    type_into(qtbot, dialog.rows, "3", Qt.Key.Key_Tab)
    assert dialog.extent.text() == "96 tiles, 30.5 cm square: 9.915 m along x, 0.925 m along y"
    assert dialog.extent.sizeHint().width() <= dialog.extent.width(), "it is longer than the first one, and was cut"
    type_into(qtbot, dialog.rows, "50")
    qtbot.mouseClick(dialog.use, Qt.MouseButton.LeftButton)
    assert dialog.isVisible()
    assert dialog.rows.field.text() == "50", "what is refused stays, to be corrected"
    with qtbot.waitSignal(window.controller.opened, timeout=LONG_MS):
        type_into(qtbot, dialog.columns, "4", Qt.Key.Key_End)
        qtbot.mouseClick(dialog.use, Qt.MouseButton.LeftButton)
    assert window.controller.target.floor == default_floor(3, 4)
    assert (window.settings.rows, window.settings.columns) == (3, 4)
    choose(window.main_bar.target, "Simulated floor of another size…")
    dialog = dialog_of(window, GridDialog)
    assert (dialog.rows.value(), dialog.columns.value()) == (3, 4)
    dialog.reject()


def test_while_another_target_starts_nothing_is_said_to_play(window, qtbot):
    qtbot.waitUntil(lambda: "Playing on" in window.status.session, timeout=LONG_MS)
    seen = []
    window.controller.opened.connect(lambda _: seen.append(window.status.session))
    window.main_bar.target_chosen.emit("simulator 1 3")
    qtbot.waitUntil(lambda: bool(seen), timeout=LONG_MS)
    assert seen == [STARTING]
    qtbot.waitUntil(lambda: "Playing on" in window.status.session, timeout=LONG_MS)


def test_a_target_that_cannot_be_played_is_said_and_the_floor_comes_back(window, qtbot, tmp_path):
    default_floor(1, 1).save(tmp_path / "walk.floor.json")
    (tmp_path / "walk.csv").write_text("time_s,t1.1\n0,1\n")
    said = []
    window.controller.notified.connect(said.append)
    with qtbot.waitSignal(window.controller.opened, timeout=LONG_MS):
        window.target_selection.use_forces(tmp_path / "walk.csv")
    assert any("no column t1.2" in line for line in said)
    assert window.controller.target.kind == "simulator"


def test_a_simulated_tile_is_chosen_by_clicks_and_remembered(window, qtbot):
    """Its sensors err, and its profiles are its own."""
    window.workspaces.choose("Calibrate")
    ideal = calibrate(window).profiles.folder
    with qtbot.waitSignal(window.controller.opened, timeout=LONG_MS):
        choose(window.main_bar.target, "Simulated tile or people", "Plywood tile")
    target = window.controller.target
    assert TileParameters.load(target.simulation).title.startswith("A tile of plywood")
    assert target.floor == default_floor()
    assert window.main_bar.target.text() == "Plywood tile  2 × 2"
    assert calibrate(window).profiles.folder != ideal
    loads = []
    window.bridge.forces_tracked.connect(lambda forces: loads.append(forces.force_n))
    qtbot.waitUntil(lambda: len(loads) > 20, timeout=LONG_MS)
    assert np.nanstd(np.concatenate(loads)[:200, -1]) > 0.0
    assert remembered_target(window.settings).simulation == target.simulation
    with qtbot.waitSignal(window.controller.opened, timeout=LONG_MS):
        choose(window.main_bar.target, "Simulated tile or people", "Ideal sensors")
    assert window.controller.target.simulation == ""
    assert calibrate(window).profiles.folder == ideal


def test_a_simulated_tile_from_a_file_is_looked_at_first(qtbot, tmp_path):
    window = quiet_window(qtbot, tmp_path)
    bad = tmp_path / "bad.json"
    bad.write_text('{"format": "underfoot-simulation", "version": 1, "sensors": {"creep": 2}}')
    TileParameters().save(tmp_path / "mine.json")
    target = window.main_bar.target
    for name in ("bad.json", "mine.json"):
        choose_file(window, tmp_path / name, lambda: choose(target, "Simulated tile or people", "Open…"))
        if name == "bad.json":
            assert "sensors, creep is 2" in window.status.message
            dialog_of(window, FileErrorDialog).close()
            assert window.controller.target.simulation == ""
    assert window.controller.target.simulation == str(tmp_path / "mine.json")


def test_a_simulated_tile_whose_file_is_gone_is_an_ideal_one(tmp_path):
    assert remembered_target(Settings(simulation=str(tmp_path / "gone.json"))) == remembered_target(Settings())


def test_hardware_is_chosen_in_a_dialog(window, qtbot):
    """A real pseudo-terminal, with an emulated floor behind it on which a walker walks; chosen again,
    with a second port, it begins anew, where another program was said to have it.
    """
    sender, second = PtySender(), PtySender()
    emulator = Emulator(sender, SimulatedFloor(default_floor()))
    window.settings.references["fsr"] = "9.1:0.05:120"
    window.main_bar.target_chosen.emit("transport serial")
    dialog = window.findChild(TransportDialog)
    dialog.address.setEditText("/dev/no such port")
    qtbot.keyClick(dialog.address, Qt.Key.Key_Return)
    qtbot.waitUntil(lambda: "cannot be opened" in dialog.refusal.text(), timeout=LONG_MS)
    assert dialog.isVisible()
    assert window.controller.target.kind == "simulator"
    dialog.address.setEditText(sender.name)
    emulator.start()
    try:
        with qtbot.waitSignal(window.controller.opened, timeout=LONG_MS):
            connect = next(b for b in dialog.findChildren(QPushButton) if b.text() == "Connect")
            qtbot.mouseClick(connect, Qt.MouseButton.LeftButton)
        assert window.main_bar.target.text() == f"Serial port  {sender.name}"
        assert window.controller.session.target.beside == (9,)  # of which the engine does not say that it is no tile
        heard = []
        window.bridge.forces_tracked.connect(lambda forces: heard.append(np.nanmax(forces.force_n)))
        qtbot.waitUntil(lambda: bool(heard) and max(heard) > 100.0, timeout=LONG_MS)
        qtbot.waitUntil(lambda: not window.findChildren(TransportDialog))
        window.main_bar.target_chosen.emit("transport serial")
        dialog = window.findChild(TransportDialog)
        dialog.address.setEditText(f"{second.name},{sender.name}")
        with qtbot.waitSignal(window.controller.opened, timeout=LONG_MS):
            qtbot.keyClick(dialog.address, Qt.Key.Key_Return)
    finally:
        emulator.close()
        second.close()
    assert window.settings.kind == "simulator"


def test_the_window_says_that_nothing_plays_while_a_tile_of_hardware_is_calibrated(qtbot, tmp_path):
    """It said what it had played on before, in Monitor, too, where nothing moved."""
    window = quiet_window(qtbot, tmp_path)
    window.status.show_session("Playing on: serial")
    window.status.show_floor(True)
    window.main_bar.set_health(Health(True, 0.114, 0.6, 2, 0, 0.0033, 0.0006, 0.0107, 0.0, 96_000, 0.25, 1), 4)
    window.controller.release()
    assert window.main_bar.engine.text() == "off"
    assert (window.main_bar.xruns.text(), window.main_bar.xruns.is_alarm) == ("0", False)
    assert window.status.session == "Nothing plays while a tile is calibrated"
    window.controller.play_or_stop()
    assert window.status.session == "Nothing plays while a tile is calibrated"
