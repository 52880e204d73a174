"""The calibrations from first to last page by clicks and keys, on the simulator, into one profile."""

import subprocess
import sys

import numpy as np
import pytest
from on_screen import show
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication

from underfoot.calibration.procedure import PageProgress
from underfoot.calibration.procedures import CALIBRATIONS
from underfoot.devices.emulation.plate import EmulatedPlate
from underfoot.devices.plate import plate_of
from underfoot.devices.transports.serial import PtySender
from underfoot.engine.target import Target
from underfoot.errors import DeviceError
from underfoot.floor.layout import default_floor
from underfoot.floor.profile import Profile, profiles_of
from underfoot.studies.equipment import EquipmentChoice
from underfoot.widgets.calibrate import catalogue
from underfoot.widgets.calibrate.catalogue import make_procedure
from underfoot.widgets.calibrate.measuring import Pace
from underfoot.widgets.calibrate.workspace import CalibrateWorkspace
from underfoot.widgets.experiment.equipment_dialog import EquipmentDialog
from underfoot.widgets.session.settings import Settings

LONG_MS = 120_000
"""A first run compiles kernels."""


@pytest.fixture
def settings():
    return Settings()


@pytest.fixture
def workspace(qtbot, tmp_path, settings):
    made = CalibrateWorkspace(tmp_path, settings, CALIBRATIONS, Pace(0.0, 0.0))
    qtbot.addWidget(made, before_close_func=lambda w: w.close_down())
    made.set_target(Target(default_floor()))
    made.resize(1280, 726)
    show(qtbot, made)
    return made


class Hands:
    """Clicks and types; what was refused stands in `refused`."""

    def __init__(self, qtbot, workspace):
        self.qtbot, self.workspace, self.wizard = qtbot, workspace, workspace.wizard
        self.pages, self.refused = [], []
        self.wizard.page_shown.connect(self._see)

    def _see(self, snapshot):
        if snapshot.page.key not in self.pages:
            self.pages.append(snapshot.page.key)
        if snapshot.rejection:
            self.refused.append(snapshot.rejection)

    def click(self, widget):
        assert widget.isVisible()
        assert widget.isEnabled()
        self.qtbot.mouseClick(widget, Qt.MouseButton.LeftButton)

    def wait(self, holds):
        self.qtbot.waitUntil(lambda: bool(holds()), timeout=LONG_MS)

    def begin(self, kind):
        self.click(self.workspace.choice.cards[kind])
        self.click(self.workspace.overview.begin)
        self.wait(lambda: self.pages)

    def type(self, name, text):
        editor = next(e for e in self.wizard.page.editors if e.parameter.name == name)
        editor.field.setFocus()
        editor.field.selectAll()
        QTest.keyClicks(editor.field, text)

    def choose(self, name, option):
        box = next(e for e in self.wizard.page.editors if e.parameter.name == name).box
        box.setFocus()
        while box.currentText() != option:
            QTest.keyClick(box, Qt.Key.Key_Down)

    def name_plate(self, text):
        self.click(self.workspace.choice.cards["plate"])
        field = self.workspace.overview.editor.field
        field.setFocus()
        self.wait(field.hasFocus)
        QTest.keyClicks(field, text)

    def to_the_end(self):
        """Continue on every page until the last."""
        while not self.wizard.snapshot.page.last:
            self.wait(lambda: self.wizard.going.isEnabled() or self.wizard.snapshot.page.last or self.refused)
            assert not self.refused
            if not self.wizard.snapshot.page.last:
                self.click(self.wizard.going)

    def save(self):
        with self.qtbot.waitSignal(self.workspace.profile_changed, timeout=LONG_MS) as written:
            self.click(self.wizard.saving)
        self.wait(lambda: not self.workspace.is_measuring)
        self.click(self.wizard.closing)
        return written.args


@pytest.fixture
def hands(qtbot, workspace):
    return Hands(qtbot, workspace)


def test_the_choice_shows_what_is_declared(workspace):
    assert list(workspace.choice.cards) == list(CALIBRATIONS)
    for kind, declared in CALIBRATIONS.items():
        assert workspace.choice.cards[kind].accessibleName().startswith(f"{declared.name}:")


def test_forces_by_clicks_and_then_places_with_the_keyboard_for_form_and_loads(hands):
    hands.begin("fsr")
    hands.type("loadings", "2")
    hands.type("hold_s", "2 s")
    hands.to_the_end()
    result = hands.wizard.snapshot.result
    assert {page.partition("-")[0] for page in hands.pages[1:-1]} == {"foot", *(f"sensor{j}" for j in (1, 2, 3, 4))}
    hands.wait(lambda: len(hands.wizard.drawings.plots) == len(result.drawings))
    profile, kind, folder = hands.save()
    assert (kind, profile) == ("fsr", Profile.load(folder / "t1.json"))
    assert profile.is_calibrated
    assert not np.isnan(profile.force(np.full((1, 4), 20_000.0))).any()
    assert hands.workspace.choice.cards["fsr"].visible_text().startswith(profile.fsr.made)

    hands.pages.clear()
    hands.begin("centroid")
    hands.choose("form", "quick")
    hands.type("loads_n", "600")
    hands.to_the_end()
    assert len([page for page in hands.pages if page.startswith("place")]) == 9
    assert "Before" in [plot.drawing.title for plot in hands.wizard.drawings.plots]
    placed, kind, folder = hands.save()
    assert (kind, profiles_of(folder, default_floor())["t1"]) == ("centroid", placed)
    assert placed.fsr == profile.fsr
    assert np.isfinite(placed.position(np.full((1, 4), 100.0))).all()


def test_back_while_the_simulated_hand_presses_lets_go_and_the_page_is_measured_again(hands):
    hands.begin("fsr")
    for page in ("sensor1-tare", "sensor1-rise1", "sensor1-fall1"):
        hands.wait(hands.wizard.going.isEnabled)
        hands.click(hands.wizard.going)
        hands.wait(lambda page=page: hands.wizard.snapshot.page.key == page)
    hands.click(hands.wizard.backing)
    hands.wait(lambda: hands.wizard.snapshot.page.key == "sensor1-rise1")
    hands.wait(hands.wizard.going.isEnabled)
    hands.click(hands.wizard.going)
    hands.wait(lambda: hands.wizard.snapshot.page.key == "sensor1-fall1" or hands.refused)
    assert not hands.refused


def test_the_live_force_is_in_sight_in_the_smallest_window(hands, workspace):
    """By it a press is led. It was cut off below a picture that could have been smaller."""
    workspace.resize(1024, 568)
    hands.begin("fsr")
    for key in ("sensor1-tare", "sensor1-rise1"):
        hands.wait(hands.wizard.going.isEnabled)
        hands.click(hands.wizard.going)
        hands.wait(lambda key=key: hands.wizard.snapshot.page.key == key)
    page = hands.wizard.page
    page.show_live(PageProgress("Press harder, up to 600 N.", 0.5, (("force", 12.0, "N"),)))
    QApplication.processEvents()
    assert page.quantities.visibleRegion().boundingRect() == page.quantities.rect()


def test_places_want_forces_first(hands, workspace):
    hands.click(workspace.choice.cards["centroid"])
    assert "Do that first" in workspace.overview.note.text()
    assert not workspace.overview.begin.isEnabled()
    hands.click(workspace.choice.cards["response"])
    assert not workspace.overview.note.isVisible()


def test_vibration_by_keys_alone(hands):
    hands.begin("response")
    hands.type("sweep_s", "1 s")
    hands.type("passes", "1")
    while not hands.wizard.snapshot.page.last:
        hands.wait(lambda: hands.wizard.going.isEnabled() or hands.wizard.snapshot.page.last or hands.refused)
        assert not hands.refused
        if not hands.wizard.snapshot.page.last:
            QTest.keyClick(hands.workspace.window().focusWidget(), Qt.Key.Key_Return)
    profile, kind, _ = hands.save()
    assert kind == "response"
    assert len(profile.equaliser) > 0
    assert profile.response.acceleration_per_unit > 0.0


def test_a_calibration_that_runs_by_itself_and_is_cancelled_leaves_nothing(hands, workspace):
    hands.click(workspace.choice.cards["response"])
    hands.click(workspace.overview.begin_automatic)
    hands.wait(lambda: hands.wizard.snapshot is not None and hands.wizard.snapshot.page.share > 0.1)
    assert hands.wizard.running.text() == "Pause"
    hands.click(hands.wizard.leaving)
    hands.wait(lambda: not workspace.is_measuring)
    assert not workspace.profiles.folder.exists()


def test_a_weight_typed_ten_times_too_heavy_is_refused_on_the_spot(hands):
    hands.begin("fsr")
    hands.choose("reference", "known weights")
    hands.type("weights_n", "40 80 160 320 400")
    for _ in range(5):
        page = hands.wizard.snapshot.page
        hands.wait(hands.wizard.going.isEnabled)
        hands.click(hands.wizard.going)
        hands.wait(lambda page=page: hands.wizard.snapshot.page.key != page.key or hands.refused)
        assert not hands.refused
    taken = hands.wizard.snapshot.page.key
    hands.type("weight_n", "3200")
    hands.click(hands.wizard.going)
    hands.wait(lambda: hands.refused)
    assert "was typed" in hands.refused[-1]
    assert hands.wizard.snapshot.page.key == taken
    hands.wait(hands.wizard.refusal.isVisible)


def test_a_plate_by_clicks_into_the_equipment_of_a_study(settings, hands, workspace):
    emulated = EmulatedPlate()
    try:
        hands.name_plate(emulated.name)
        hands.begin("plate")
        hands.type("positions", "0 1")
        hands.type("footsteps", "3")
        hands.to_the_end()
        assert [round(to, 4) for _, to, _ in emulated.servo.moves] == [0.0, 1.0]
        result = hands.wizard.snapshot.result
        assert "footstep's line is off the others" in hands.wizard.result.verdict.text()
        hands.wait(lambda: len(hands.wizard.drawings.plots) == len(result.drawings) == 2)
        profile, kind, folder = hands.save()
        assert (kind, profile) == ("plate", Profile.load(folder / "t1.json"))
        np.testing.assert_allclose(profile.plate.stiffness_n_mm, [40.0, 160.0], rtol=0.02)
        assert workspace.choice.cards["plate"].visible_text().startswith(profile.plate.made)
        used = []
        dialog = EquipmentDialog(used.append, EquipmentChoice(), None, settings.calibrated_plate)
        hands.qtbot.addWidget(dialog)
        dialog.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose, False)
        show(hands.qtbot, dialog)
        QTest.keyClick(dialog.check_boxes["plate"], Qt.Key.Key_Space)
        hands.click(dialog.use_button)
        plate = plate_of(used[0].plate)
        assert used[0].plate == f"{emulated.name}:{folder / 't1.plate.json'}"
        assert plate.calibration.stiffness_n_mm == profile.plate.stiffness_n_mm
        plate.close()
    finally:
        emulated.close()


def test_a_plate_that_is_not_there_is_said_before_anything_is_asked(hands, workspace, tmp_path):
    hands.name_plate(str(tmp_path / "no-port"))
    hands.click(workspace.overview.begin)
    hands.wait(hands.wizard.refusal.isVisible)
    assert hands.wizard.refusal.text().startswith(f"the plate at {tmp_path / 'no-port'} cannot be opened")
    assert "\n" not in hands.wizard.refusal.text()
    hands.click(hands.wizard.leaving)
    hands.wait(lambda: not workspace.is_measuring)


def test_a_tile_that_sends_nothing_is_said_to_do_so_in_the_time_of_the_window(monkeypatch):
    """In a terminal, where this ends the measurement, it takes longer."""
    monkeypatch.setattr(catalogue, "_SILENT_S", 0.0)
    line = PtySender()
    target = Target(default_floor(), kind="serial", source=line.name)
    procedure, rig = make_procedure(CALIBRATIONS["fsr"], target, target.floor.tiles[1], Profile(tile="t2"), "")
    try:
        assert procedure.page.questions[0].default == "known weights"  # there is no load cell
        with pytest.raises(DeviceError, match="nothing comes of tile number 1"):
            [rig.read() for _ in range(3)]
    finally:
        rig.close()
        line.close()


def test_tab_goes_from_the_reference_to_begin_below_it(hands, workspace):
    """It came to the field, which is above Begin, after the figures below it."""
    hands.click(workspace.choice.cards["plate"])
    field = workspace.overview.editor.field
    field.setFocus()
    hands.wait(field.hasFocus)
    QTest.keyClick(field, Qt.Key.Key_Tab)
    assert QApplication.focusWidget() is workspace.overview.begin


def test_latency_suggests_the_block_set_under_audio():
    """What is measured with another one is not used by a session."""
    target = Target(default_floor(), block=512)
    procedure, rig = make_procedure(CALIBRATIONS["latency"], target, target.floor.tiles[0], Profile(tile="t1"), "")
    rig.close()
    assert {asked.name: asked.default for asked in procedure.page.questions}["block"] == 512


def test_vibration_listens_to_the_accelerometer_that_is_given_under_audio(null_sink):
    """The sink's monitor hears each channel on an input of its own; PortAudio looks for devices once in a process."""
    script = """
from contextlib import suppress
import numpy as np
from underfoot.calibration.rig import Sound
from underfoot.devices.accelerometers import Accelerometer
from underfoot.engine.target import Target
from underfoot.errors import BadMeasurement
from underfoot.floor.layout import default_floor
from underfoot.floor.profile import Profile
from underfoot.calibration.procedures import CALIBRATIONS
from underfoot.widgets.calibrate.catalogue import make_procedure

floor, vibration = default_floor(), CALIBRATIONS["response"]
target = Target(floor, kind="serial", sound="", accelerometers=(Accelerometer("t2", 1, 50.0),))
for tile in floor.tiles[:2]:
    procedure, rig = make_procedure(vibration, target, tile, Profile(tile=tile.id), "")
    print(procedure.page.questions[0].default)
heard = None
while heard is None:
    with suppress(BadMeasurement):  # a busy machine loses samples
        heard = rig.play(Sound(0.2 * np.sin(np.arange(9600.0)), 48_000, "none"))
print(round(float(abs(heard).max()), 2))
"""
    run = subprocess.run([sys.executable, "-c", script], check=True, capture_output=True, text=True, timeout=300)
    assert run.stdout.split() == ["100.0", "50.0", "0.2"]
