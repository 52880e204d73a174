"""The Calibrate workspace: the choice of tile and calibration, and the wizard that runs it."""

from collections.abc import Callable, Iterator, Mapping
from datetime import date
from functools import cached_property, partial
from itertools import count
from pathlib import Path

from PySide6.QtCore import Qt, Signal
from PySide6.QtGui import QGuiApplication, QKeyEvent, QResizeEvent
from PySide6.QtWidgets import QFileDialog, QHBoxLayout, QLayout, QStackedWidget, QWidget

from underfoot.calibration.declaration import Calibration
from underfoot.calibration.files.plate_profiles import plate_file
from underfoot.calibration.result import Result
from underfoot.devices.plate import SIMULATED
from underfoot.engine.target import Target
from underfoot.floor.layout import Tile
from underfoot.floor.profile import Part, Profile
from underfoot.widgets import theme
from underfoot.widgets.calibrate.catalogue import MakeProcedure, by_hand, make_procedure, reference_asked, why_not
from underfoot.widgets.calibrate.choice import ChoicePanel
from underfoot.widgets.calibrate.measuring import Measurement, Pace, Snapshot
from underfoot.widgets.calibrate.overview import Overview
from underfoot.widgets.calibrate.plate_page import PlatePage, parameters_of
from underfoot.widgets.calibrate.profiles import Profiles
from underfoot.widgets.calibrate.projector import FloorProjection
from underfoot.widgets.calibrate.wizard import Wizard
from underfoot.widgets.controls import true_scale
from underfoot.widgets.controls.file_dialog import file_dialog
from underfoot.widgets.controls.question import ask
from underfoot.widgets.projecting_workspace import ProjectingWorkspace
from underfoot.widgets.session.settings import Settings
from underfoot.widgets.window_state import MINIMUM_SIZE
from underfoot.widgets.workspace import WorkspaceContext

SHORTCUTS = (
    ("Begin, continue, or do what the button with the focus says", "Return"),
    ("The page before", "Alt+Left"),
    true_scale.SHORTCUT,
)


class CalibrateWorkspace(ProjectingWorkspace):
    """Runs calibrations, by the part that each makes, on the tiles of the target; profiles are stored below `root`, one
    folder per floor.
    """

    shortcuts = SHORTCUTS
    projection: FloorProjection | None
    """The view of the tile on the floor, while it is open."""
    release_requested = Signal()
    """The session should release the tiles; `begin_released` follows."""
    reopen_requested = Signal()
    """The tiles are free again."""
    profile_changed = Signal(object, str, object)
    """A `Profile` that was written, which part of it, and its folder: for use by the engine."""

    def __init__(
        self,
        root: Path,
        settings: Settings,
        calibrations: Mapping[str, type[Calibration]],
        pace: Pace | None = None,
        make: MakeProcedure = make_procedure,
        parent: QWidget | None = None,
    ) -> None:
        super().__init__(settings, parent)
        theme.fill(self, "ground")
        self.pace = pace or Pace()
        self._calibrations, self._make_procedure = calibrations, make
        self._calibration = next(iter(calibrations.values()))
        self._target: Target | None = None
        self._measurement: Measurement | None = None
        self._is_waiting = False
        self._is_closed = False
        self._refuses_lent: Callable[[], bool] = lambda: False
        self._is_recording: Callable[[], bool] = lambda: False
        self.profiles = Profiles(root, self)
        self.make(self._parts())

    def _parts(self) -> Iterator[None]:
        self.choice = ChoicePanel([(kind, one.name) for kind, one in self._calibrations.items()], self)
        yield
        self._stack = QStackedWidget(self)
        self.overview = Overview(self._stack)
        yield
        self.wizard = Wizard(self._stack)
        yield
        for view in (self.overview, self.wizard):
            self._stack.addWidget(view)
        layout = QHBoxLayout(self)
        layout.setSizeConstraint(QLayout.SizeConstraint.SetNoConstraint)  # the choice gives way where it must
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(0)
        layout.addWidget(self.choice)
        layout.addWidget(self._stack, 1)
        self.focused_first = self.choice
        self._connect()

    # --- workspace interface ---

    def attach(self, context: WorkspaceContext) -> None:
        controller = context.controller
        self._refuses_lent = controller.refuses_lent
        self._is_recording = lambda: controller.recording.is_on
        self.set_target(controller.target)
        controller.opened.connect(self.set_target)
        controller.released.connect(self.begin_released)
        self.release_requested.connect(controller.release)
        self.reopen_requested.connect(controller.reopen)
        self.profile_changed.connect(controller.use_profile)
        self.wizard.ready.connect(self.loaded)

    def silence(self) -> None:
        """Stop an automatic run, and playback."""
        if self._measurement is not None:
            self._measurement.silence()

    @property
    def would_lose(self) -> bool:
        """Whether leaving would lose manual measurements."""
        return self.wizard.would_lose

    def ask_to_leave(self, then: Callable[[], object]) -> None:
        """Ask before a measurement by hand is lost."""
        self.wizard.ask_to_leave(then)

    def close_down(self) -> None:
        """Stop the measurement, and wait for it and for pending writes."""
        self.wizard.end()
        self._close_projection()
        if self._measurement is not None:
            self._measurement.stop()
            self._measurement.join()
        self.profiles.close()

    # --- display ---

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self._fit_choice()

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Begin by Return also while the arrow keys choose the tile, but not the one that was just closed."""
        is_return = event.key() in (Qt.Key.Key_Return, Qt.Key.Key_Enter) and not event.isAutoRepeat()
        if is_return and self.choice.map.hasFocus() and self._stack.currentWidget() is self.overview:
            if not self._is_closed:
                self.overview.begin.click()
        else:
            super().keyPressEvent(event)

    def _fit_choice(self) -> None:
        """Hide the choice, which is of no use during a measurement, on a screen too small for both."""
        is_measured = self._stack.currentWidget() is self.wizard
        self.choice.setVisible(not is_measured or self.width() >= MINIMUM_SIZE.width())

    def set_target(self, target: Target) -> None:
        """Show the floor of this target and its profiles. A measurement on another one ends without changes."""
        old, self._target = self._target, target
        if old is not None and _tiles_of(old) == _tiles_of(target):
            return
        self.choice.set_floor(target.floor)
        self.leave()
        self._is_closed = False
        self.profiles.follow(target.floor, target.profiles, target.simulation)

    @property
    def tile(self) -> Tile:
        """The chosen tile."""
        assert self._target is not None
        return self._target.floor.tiles[self._target.floor.index(self.choice.map.chosen_tile())]

    @property
    def _is_simulated(self) -> bool:
        return self._target is not None and not by_hand(self._target)

    @property
    def is_measuring(self) -> bool:
        """Whether a measurement occupies a tile."""
        return self._measurement is not None or self._is_waiting

    def _show(self) -> None:
        if self._target is None:
            return
        profile = self.profiles.of(self.tile.id)
        self.choice.show_profile(profile, self._calibration.kind, self._flags(profile, self.tile.id))
        self.overview.show_kind(self._calibration.title, self._calibration.about)
        self.overview.show_part(self.tile, self._part())
        busy = "The last measurement is still ending…" if self.is_measuring else ""
        lacks = why_not(self._target) or busy or self._lacks(profile)
        self.overview.show_availability(lacks, can_run_automatically=self._is_simulated)
        reference = self._settings.references.get(self._calibration.kind, "")
        self.overview.show_reference(reference_asked(self._calibration, self._target), reference)

    def _lacks(self, profile: Profile) -> str:
        """Return what must be calibrated first; "" for nothing."""
        first = self._calibrations.get(self._calibration.requires)
        if first is None or profile.part(first.kind) is not None:
            return ""
        return f"{first.name} of this tile are not calibrated yet. Do that first, so that its readings are newtons."

    def _save_reference(self, value: str) -> None:
        self._settings.references[self._calibration.kind] = value

    def _show_profiles(self) -> None:
        self._show()
        found = self.profiles.by_tile.items()
        self.warnings_changed.emit(tuple(line for tile, profile in found for line in self._flags(profile, tile)))

    def _flags(self, profile: Profile, tile: str) -> tuple[str, ...]:
        """Return the reasons against a profile; one with a serial number alone is none yet."""
        return profile.flags(tile, date.today(), simulated=self._is_simulated) if profile.made else ()

    def _compare(self, index: int) -> None:
        profile = self.profiles.of(self.tile.id)
        earlier = getattr(profile.earlier[index], self._calibration.kind) if index >= 0 else None
        self.overview.show_part(self.tile, self._part(), earlier)

    def _part(self) -> Part | None:
        return self.profiles.of(self.tile.id).part(self._calibration.kind)

    def _choose_kind(self, kind: str) -> None:
        self._calibration, self._is_closed = self._calibrations[kind], False
        self._stack.setCurrentWidget(self.overview)
        self._show()

    @cached_property
    def plates(self) -> PlatePage:
        """The page that searches plates; it takes a third of the workspace's time to make, and few open it."""
        page = PlatePage()
        page.closed.connect(self.leave)
        page.report_requested.connect(self._ask_plate_report)
        self._stack.addWidget(page)
        return page

    def seek_plates(self) -> None:
        """Show the page that searches plates for the chosen tile."""
        if self._target is not None and not self.is_measuring:
            self.plates.show_tile(self.tile, parameters_of(self._target.simulation))
            self._stack.setCurrentWidget(self.plates)
            self.plates.setFocus()

    def _choose_tile(self) -> None:
        self._is_closed = False
        self._show()
        if isinstance(self._stack.currentWidget(), PlatePage):
            self.seek_plates()

    # --- measurement ---

    def begin(self, automatic: bool) -> None:
        """Begin the chosen calibration of the chosen tile; if `automatic`, the simulator runs all of its pages."""
        if self._target is None or self.is_measuring or why_not(self._target):
            return
        if by_hand(self._target) and self._refuses_lent():
            return
        if not by_hand(self._target):
            self._measure(automatic)
        elif self._is_recording():
            text = "A recording is running. It ends, and is saved, before the tile is calibrated."
            ask(self, "Calibrate a tile", text, "End it and begin", self._take_hardware)
        else:
            self._take_hardware()

    def _take_hardware(self) -> None:
        """Ask the session to release the tiles."""
        self._is_waiting = True
        waits = "Waiting until the session releases the tile…"
        self.overview.show_availability(waits, can_run_automatically=False)
        self.release_requested.emit()

    def begin_released(self) -> None:
        """Begin, now that the session has released the tiles."""
        if self._is_waiting:
            self._is_waiting = False
            self._measure()

    def _measure(self, automatic: bool = False) -> None:
        assert self._target is not None
        target, tile, chosen = self._target, self.tile, self._calibration
        reference = self._settings.references.get(chosen.kind, "")
        make = partial(self._make_procedure, chosen, target, tile, self.profiles.of(tile.id), reference)
        measurement = Measurement(make, by_hand=by_hand(target), pace=self.pace, parent=self)
        measurement.ended.connect(self._measurement_ended)
        self._measurement = measurement
        self.choice.setEnabled(False)
        self.wizard.begin(measurement, tile, chosen.name, self._part())
        self._stack.setCurrentWidget(self.wizard)
        self.wizard.setFocus()
        measurement.start()
        if automatic:
            measurement.run_automatically(True)

    def _close_wizard(self) -> None:
        """Return to the choice of the next tile, by the arrow keys. A second Return on Close begins nothing."""
        self.leave()
        self._is_closed = True
        self.choice.setFocus()

    def leave(self) -> None:
        """Return to the choice; a running measurement ends without changes."""
        self._close_projection()
        self.wizard.end()
        if self._measurement is not None:
            self._measurement.stop()
        self.choice.setEnabled(True)
        self._stack.setCurrentWidget(self.overview)
        self._show()

    def _measurement_ended(self) -> None:
        measurement, self._measurement = self._measurement, None
        if measurement is not None:
            measurement.join()
            if self.wizard.measurement is measurement:
                self.wizard.end()
            measurement.deleteLater()
            if measurement.by_hand:
                self.reopen_requested.emit()
        self._show()

    # --- results ---

    def _save(self, result: Result) -> None:
        self.profiles.save(self.tile.id, self._with_origin(result))

    def _with_origin(self, result: Result) -> Result:
        noted, day = self._settings.conditions, self._settings.conditions_on
        if noted and day not in ("", date.today().isoformat()):
            noted += f" (noted on {day})"
        return result.with_origin(simulated=self._is_simulated, conditions=noted)

    def _note(self, conditions: str) -> None:
        self._settings.conditions, self._settings.conditions_on = conditions.strip(), date.today().isoformat()

    def _saved(self, tile: str, kind: str) -> None:
        if self._stack.currentWidget() is self.wizard and (tile, kind) == (self.tile.id, self._calibration.kind):
            self.wizard.mark_saved()
            if self._measurement is not None:
                self._measurement.stop()
        if kind == "plate":
            self._remember_plate(tile)
        self.profile_changed.emit(self.profiles.of(tile), kind, self.profiles.folder)

    def _remember_plate(self, tile: str) -> None:
        """Have the equipment of studies suggest the plate that was just calibrated."""
        path = plate_file(self.profiles.folder / f"{tile}.json")
        port = (self._settings.references.get("plate", "").split() or [SIMULATED])[0]
        self._settings.calibrated_plate = f"{port}:{path}"

    def _not_saved(self, why: str) -> None:
        self.notified.emit(why)
        if self._stack.currentWidget() is self.wizard:
            self.wizard.mark_unsaved(why)

    def _ask_report(self, result: Result) -> None:
        self._ask_folder(result.kind, lambda folder: self.write_report(result, folder))

    def _ask_plate_report(self) -> None:
        self._ask_folder("plates", lambda folder: self.profiles.do(lambda: self.plates.write_report(folder)))

    def _ask_folder(self, subject: str, then: Callable[[Path], None]) -> None:
        """Ask for a folder, with `subject` in its suggested name, which is free, and pass it to `then`."""
        dialog = file_dialog(self, "A folder for the report", self._settings.folder)
        dialog.setAcceptMode(QFileDialog.AcceptMode.AcceptSave)  # a folder that does not exist yet can be named
        dialog.setOption(QFileDialog.Option.DontConfirmOverwrite)  # the folder's content stays
        dialog.setLabelText(QFileDialog.DialogLabel.FileName, "Folder:")
        name = f"{subject}-{self.tile.id}-{date.today().isoformat()}"
        names = (f"{name}-{k}" if k > 1 else name for k in count(1))
        dialog.selectFile(next(name for name in names if not dialog.directory().exists(name)))
        dialog.fileSelected.connect(lambda folder: then(Path(folder)))
        dialog.open()

    def write_report(self, result: Result, folder: Path) -> None:
        """Write a page with plots, figures and raw data into a folder; a line with its path follows."""
        tile, profile = self.tile.id, self.profiles.of(self.tile.id)
        if profile.tile != tile or not result.quantities:
            # not another tile's, and no figures where there is no result
            profile = Profile(tile=tile, serial=profile.serial if profile.tile == tile else "")
        result = self._with_origin(result)

        def write() -> str:
            from underfoot.calibration.files.report import write_report

            return f"The report is in {write_report(result, folder, result.apply(profile))}"

        self._settings.folder = str(folder.parent)  # where the next one is put beside it
        self.profiles.do(write)

    # --- projection ---

    def project(self) -> None:
        """Show the tile at its true size on the last screen, which is the projector's if there are several."""
        if self.projection is None:
            self.projection = FloorProjection(self.tile, self._settings.placement)
            self.projection.continue_requested.connect(self.wizard.go_on)
            self._follow_projection(self.projection)
            if self.wizard.snapshot is not None:
                self._project_page(self.wizard.snapshot)
        self.projection.show_on(QGuiApplication.screens()[-1])

    def _project_page(self, snapshot: Snapshot) -> None:
        if self.projection is not None:
            self.projection.show_page(snapshot.page, snapshot.live.ready)

    def _connect(self) -> None:
        self.choice.tile_chosen.connect(self._choose_tile)
        self.choice.plate_search_requested.connect(self.seek_plates)
        self.choice.kind_chosen.connect(self._choose_kind)
        self.choice.earlier_chosen.connect(self._compare)
        self.choice.restore_requested.connect(lambda index: self.profiles.restore(self.tile.id, index))
        self.choice.conditions.show_text(self._settings.conditions)
        self.choice.conditions.committed.connect(self._note)
        self.choice.conditions.returnPressed.connect(lambda: self._note(self.choice.conditions.text()))
        self.choice.serial_given.connect(lambda serial: self.profiles.set_serial(self.tile.id, serial))
        self.overview.begin_requested.connect(self.begin)
        self.overview.reference_given.connect(self._save_reference)
        self.wizard.closed.connect(self._close_wizard)
        self.wizard.save_requested.connect(self._save)
        self.wizard.report_requested.connect(self._ask_report)
        self.wizard.projection_requested.connect(self.project)
        self.wizard.page_shown.connect(self._project_page)
        self._stack.currentChanged.connect(self._fit_choice)
        self.profiles.changed.connect(self._show_profiles)
        self.profiles.saved.connect(self._saved)
        self.profiles.not_saved.connect(self._not_saved)
        self.profiles.notified.connect(self.notified)


def _tiles_of(target: Target) -> tuple[object, ...]:
    """Return what determines the tiles of a target."""
    return target.floor, target.kind, target.source, target.simulation
