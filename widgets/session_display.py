"""Display of the session's reports in the main bar, the progress bar and the status line."""

from pathlib import Path

from PySide6.QtCore import QObject

from underfoot.engine.reports import Health, OutputChanged, Started
from underfoot.engine.target import Target
from underfoot.widgets.controls.panels import progress_bar
from underfoot.widgets.main_bar import MainBar
from underfoot.widgets.session import targets
from underfoot.widgets.session.controller import SessionController
from underfoot.widgets.session.target_settings import target_text
from underfoot.widgets.status_line import StatusLine

STARTING = "Starting the engine…"
RELEASED = "Nothing plays while a tile is calibrated"
LENT = "; the patch waits for the end of the scene or study"
_NO_ENGINE = Health(False, 0.0, 0.0, 0, 0, 0.0, 0.0, 0.0, 0.0, 0, 0.0, 0)
COMPILING = "kernels and simulated plates, for their first use"


class SessionDisplay(QObject):
    """Shows target, output, compiling, health and recording of the controller's session."""

    def __init__(self, controller: SessionController, main_bar: MainBar, status: StatusLine, level_db: float) -> None:
        super().__init__(main_bar)
        self._controller, self._main_bar, self._status = controller, main_bar, status
        self._output, self._silence_reason = "", ""
        self.progress = progress_bar("Compiling", 2)
        main_bar.set_targets(targets.choices())
        main_bar.set_target(target_text(controller.target), targets.keys_of(controller.target))
        main_bar.set_level(level_db)
        main_bar.set_playing(controller.is_playing)
        main_bar.set_recording("")
        bridge = controller.bridge
        controller.opened.connect(self._show_target)
        controller.released.connect(self._show_released)
        controller.playing_changed.connect(main_bar.set_playing)
        controller.playing_changed.connect(self._show_output)
        controller.recording.changed.connect(self._show_recording)
        controller.target_locked.connect(main_bar.target.setDisabled)
        controller.target_locked.connect(self._show_output)
        bridge.started.connect(self._use_start)
        bridge.output_changed.connect(self._use_output)
        bridge.floor_silent.connect(status.show_floor)
        bridge.compile_progressed.connect(self._show_compiling)
        bridge.health_reported.connect(self._show_health)

    def show_starting(self) -> None:
        """Show that the engine is starting."""
        self._status.show_session(STARTING)

    def _show_target(self, target: Target) -> None:
        self._main_bar.set_target(target_text(target), targets.keys_of(target))
        self._output = self._silence_reason = ""  # until the engine of this session has started
        self._show_output()

    def _show_released(self) -> None:
        self._status.show_floor(False)
        self._show_health(_NO_ENGINE)
        self._show_output()

    def _use_start(self, report: Started) -> None:
        self._output, self._silence_reason = report.where, report.notice
        self._show_output()

    def _use_output(self, report: OutputChanged) -> None:
        self._output, self._silence_reason = report.where, report.silence
        self._show_output()

    def _show_output(self) -> None:
        """Show the output, and why it is silent for as long as it is."""
        self._main_bar.set_audio_problem("" if self._controller.is_released else self._silence_reason)
        self._show_compiling(1, 1)

    def _show_compiling(self, ready: int, total: int) -> None:
        is_busy = ready < total
        self.progress.setRange(0, max(total, 1))
        self.progress.setValue(ready if is_busy else 0)
        if self._controller.is_released:
            self._status.show_session(RELEASED)
        elif is_busy:
            self._status.show_session(f"{ready} of {total} parts prepared: {COMPILING}")
        else:
            text = "Playing on" if self._controller.is_playing else "Silent until played on"
            waits = LENT if self._controller.is_lent else ""
            self._status.show_session(
                f"{text}: {self._output}{waits}" if self._output else STARTING, self._silence_reason
            )

    def _show_health(self, health: Health) -> None:
        tiles, is_blind = len(self._controller.target.floor.tiles), self._controller.is_blind
        self._main_bar.set_health(health, tiles, is_blind=is_blind)

    def _show_recording(self, path: Path | None) -> None:
        self._main_bar.set_recording(f"Recording to {path}" if path else "")
