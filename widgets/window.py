"""The window: the transport bar, the workspaces below it, and a line of messages."""

from collections.abc import Callable
from functools import partial
from pathlib import Path

from PySide6.QtCore import QEvent, QObject, Qt, QTimer, Signal
from PySide6.QtGui import QAction, QCloseEvent, QKeyEvent, QKeySequence, QPaintEvent, QShowEvent
from PySide6.QtWidgets import QApplication, QMainWindow, QProgressBar, QStackedWidget, QVBoxLayout, QWidget

from underfoot.engine.card_search import CardSearch
from underfoot.engine.child_process import ChildProcess
from underfoot.engine.commands import Pulse
from underfoot.engine.reports import Health, OutputChanged, Started
from underfoot.engine.target import Target
from underfoot.file_places import file_place, readable
from underfoot.nodes import REGISTRY
from underfoot.patch.effective import without_missing
from underfoot.widgets.dialogs.file_chooser import FileChooser
from underfoot.widgets.main_bar import MainBar
from underfoot.widgets.menu import MainMenu
from underfoot.widgets.recolour import apply_colours
from underfoot.widgets.session import targets
from underfoot.widgets.session.controller import SessionController
from underfoot.widgets.session.dropped_files import DroppedFiles, Handlers
from underfoot.widgets.session.exchange import Exchange
from underfoot.widgets.session.listening import Listening
from underfoot.widgets.session.marking import Marking
from underfoot.widgets.session.network_link import NetworkLink
from underfoot.widgets.session.open_patch import OpenPatch, first_patch
from underfoot.widgets.session.settings import DEFAULT_ADDRESSES
from underfoot.widgets.session.settings_file import SettingsFile
from underfoot.widgets.session.target_chooser import TargetChooser
from underfoot.widgets.session.target_selection import TargetSelection
from underfoot.widgets.session.target_settings import remembered_target, target_text
from underfoot.widgets.status_line import StatusLine
from underfoot.widgets.view_menu import ViewMenu
from underfoot.widgets.window_state import restore_splitters, restore_window, save_splitters, save_window
from underfoot.widgets.workspace import Workspace, WorkspaceContext, discover

STARTING = "Starting the engine…"
COMPILING = "kernels and simulated plates, for their first use"
PANIC_KEYS = ("F12", "Shift+Esc", "Ctrl+.")
"""Panic, whatever is open."""
EXTRA_SHORTCUTS = (
    ("Play or stop, unless text is being typed", "Space"),
    ("Close what is open; panic where nothing is", "Esc"),
    ("Menu", "Alt+M"),
)


class MainWindow(QMainWindow):
    """Shows a patch and the session that plays it. `start` opens the session; closing the window ends it."""

    painted = Signal()
    """The window is on the screen for the first time."""
    loaded = Signal()
    """Modules or kernels that stay have been loaded just now."""

    def __init__(
        self,
        folder: Path,
        target: Target | None = None,
        patch_path: Path | None = None,
        engine: ChildProcess | None = None,
    ) -> None:
        """`folder` is where settings, profiles and unsaved work are kept; without a target it is the last one.

        `engine` is a process that was started for the first session.
        """
        super().__init__()
        self._folder = folder
        self._is_leaving = self._was_painted = False
        self.is_restarting = False
        """Whether it was closed to be opened anew."""
        self._output, self._silence_reason = "", ""
        self._settings_file = SettingsFile(folder, self.show_message, self)
        self.settings = self._settings_file.settings
        self.open_patch = OpenPatch(REGISTRY, self.settings, folder / "unsaved", self)
        self.open_patch.nodes.consent_given.connect(self._settings_file.save)
        self.controller = SessionController(
            REGISTRY, self.settings, target or remembered_target(self.settings), folder / "profiles", self, engine
        )
        self.bridge = self.controller.bridge
        self.network = NetworkLink(self.controller, self.settings, self.panic)
        self.marking = Marking(self.controller, self)
        self.target_selection = TargetSelection(self.controller, self.settings)
        file_chooser = FileChooser(self, lambda: self.settings.folder, self.show_message)
        self._target_chooser = TargetChooser(
            self, self.controller, self.target_selection, file_chooser, self.show_message, self.open_file
        )
        self._exchange = Exchange(self, self.open_patch, self.controller, file_chooser, self.show_message)
        self._dropped_files = DroppedFiles(self, self._handlers, self.show_message)
        self._declarations = discover()
        self.listening = Listening(self.controller, self.open_patch, REGISTRY)
        self._context = WorkspaceContext(
            REGISTRY, self.settings, folder, self.open_patch, self.controller, self.listening
        )
        self.workspaces: dict[str, Workspace] = {}
        self.actions_by_name = self._make_actions()
        self._build()
        self._connect()
        self.open_patch.restore_or_open(patch_path, default_patch=first_patch())
        self._show_title()
        remembered = self.settings.workspace
        self.show_workspace(remembered if remembered in self.workspace_names else self.workspace_names[0])

    def start(self) -> None:
        """Open the session; what is on the screen is usable at once."""
        self.status.show_session(STARTING)
        self.controller.start()

    @property
    def workspace_names(self) -> list[str]:
        """Names of all workspaces, in the order of their tabs."""
        return [declared.name for declared in self._declarations]

    @property
    def workspace(self) -> str:
        """Name of the workspace on the screen."""
        return next(name for name, workspace in self.workspaces.items() if workspace is self._stack.currentWidget())

    def show_workspace(self, name: str) -> None:
        """Bring a workspace to the screen; those that are not there are not drawn."""
        self._make_workspace(name)
        self._stack.setCurrentWidget(self.workspaces[name])
        self.main_bar.set_workspace(name)
        self.workspaces[name].setFocus()
        for other, workspace in self.workspaces.items():
            workspace.set_active(other == name)

    def make_workspaces(self) -> None:
        """Make the workspaces that were not needed for the first picture."""
        for declared in self._declarations:
            self._make_workspace(declared.name)

    def make_next_workspace(self) -> None:
        """Load or make one that is not there yet, and go on when all that waits has been done."""
        missing = [declared for declared in self._declarations if declared.name not in self.workspaces]
        if missing and not self._is_leaving:
            if not missing[0].load():
                self._make_workspace(missing[0].name)
            QTimer.singleShot(0, self.make_next_workspace)

    def _make_workspace(self, name: str) -> None:
        if name in self.workspaces:
            return
        declared = next(declared for declared in self._declarations if declared.name == name)
        workspace = self.workspaces[name] = declared.make(self._context)
        self._stack.addWidget(workspace)
        restore_splitters(workspace, self.settings)
        self.menu.add_workspace_actions(workspace.menu_actions())
        workspace.notified.connect(self.show_message)
        workspace.withdrawn.connect(self.status.withdraw)
        workspace.warnings_changed.connect(partial(self.main_bar.set_warnings, name))
        workspace.loaded.connect(self.loaded)
        workspace.files_pasted.connect(self._dropped_files.open)
        workspace.attach(self._context)
        workspace.set_active(False)
        self.loaded.emit()

    def show_message(self, text: str) -> None:
        """Show one line for the person at the bottom of the window; of a place in a file, the place as well."""
        self.status.show_message(readable(text))
        place = file_place(text)
        if place is not None:
            from underfoot.widgets.dialogs.file_error_dialog import FileErrorDialog

            for opened in self.findChildren(FileErrorDialog):
                opened.close()  # or they lie on one another
            FileErrorDialog(place, self).open()

    def open_file(self, path: Path) -> None:
        """Open a file in the workspace that opens files of its suffix."""
        declared = next((declared for declared in self._declarations if path.suffix.lower() in declared.suffixes), None)
        if declared is None:
            self.show_message(f"{path} cannot be opened here")
            return
        self.show_workspace(declared.name)
        self.workspaces[declared.name].open_file(path)

    def _handlers(self) -> Handlers:
        """What opens files that are dropped: workspaces theirs, patches of any program, forces to be replayed."""
        ours = {suffix: self.open_file for declared in self._declarations for suffix in declared.suffixes}
        forces = dict.fromkeys((".csv", ".c3d"), self.target_selection.use_forces)
        return {**self._exchange.handlers(), **forces, **ours}

    def panic(self) -> None:
        """Silence at once, whatever makes the sound."""
        self.controller.panic()
        for workspace in self.workspaces.values():
            workspace.silence()

    def _export(self) -> None:
        """Export what the workspace on the screen has of its own, else the patch."""
        if not self.workspaces[self.workspace].export():
            self._exchange.export()

    # --- what the session reports ---

    def _show_target(self, target: Target) -> None:
        self.main_bar.set_target(target_text(target), targets.keys_of(target))
        self._output = self._silence_reason = ""  # until the engine of this session has started
        self._show_compiling(1, 1)

    def _show_start(self, report: Started) -> None:
        self._output, self._silence_reason = report.where, report.notice
        self._show_compiling(1, 1)

    def _show_output(self, report: OutputChanged) -> None:
        """Why there is no sound stays, at the right, when the line that said it has gone."""
        self._output, self._silence_reason = report.where, report.silence
        self._show_compiling(1, 1)

    def _show_compiling(self, ready: int, total: int) -> None:
        is_busy = ready < total
        self._progress.setRange(0, max(total, 1))
        self._progress.setValue(ready if is_busy else 0)
        if is_busy:
            self.status.show_session(f"{ready} of {total} parts prepared: {COMPILING}")
        else:
            text = "Playing on" if self.controller.is_playing else "Silent until played on"
            self.status.show_session(f"{text}: {self._output}" if self._output else STARTING, self._silence_reason)

    def _show_health(self, health: Health) -> None:
        self.main_bar.set_health(health, len(self.controller.target.floor.tiles))

    def _show_recording(self, path: Path | None) -> None:
        self.main_bar.set_recording(f"Recording to {path}" if path else "")

    # --- dialogs ---

    def _open_audio(self) -> None:
        from underfoot.widgets.dialogs.audio_dialog import AudioDialog

        target, search = self.controller.target, CardSearch()
        dialog = AudioDialog(
            lambda: [(card.name, card.channels, card.rate_hz) for card in search.find()],
            search.give_up,
            target.floor,
            self,
        )
        dialog.set_values(target.sound, target.rate, target.block, self.settings.accelerometers)
        dialog.applied.connect(self.target_selection.set_sound)
        dialog.pulse_requested.connect(lambda tile: self.controller.send(Pulse(tile)))
        dialog.open()

    def _open_network(self) -> None:
        from underfoot.widgets.dialogs.network_dialog import NetworkDialog

        opened = self.findChild(NetworkDialog)
        if opened is not None:
            opened.activateWindow()
            return
        settings, network = self.settings, self.network
        dialog = NetworkDialog(
            network.apply, lambda: network.counts, lambda: network.problem,
            {**DEFAULT_ADDRESSES, **settings.network_addresses}, settings.network_on, self,
        )  # fmt: skip
        dialog.show()

    def _open_cost(self) -> None:
        from underfoot.bench.cost_process import CostRequest
        from underfoot.engine.target import is_simulated
        from underfoot.widgets.dialogs.cost_dialog import CostDialog

        def request(feet: int) -> CostRequest:
            target, folder = self.controller.target, str(self.open_patch.folder or "")
            patch = without_missing(self.open_patch.patch, REGISTRY).dumps()
            return CostRequest(patch, target.floor, feet, target.block, target.profiles, folder, is_simulated(target))

        CostDialog(request, self).open()

    def _show_about(self) -> None:
        from underfoot.widgets.dialogs.about import AboutDialog

        dialog = AboutDialog(self._folder, self)
        dialog.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        dialog.open()

    def _show_shortcuts(self) -> None:
        from underfoot.widgets.dialogs.shortcuts import ShortcutsDialog, keys_of

        self.make_workspaces()
        groups = [("EVERYWHERE", [*keys_of(self.actions()), *EXTRA_SHORTCUTS])]
        for declared in self._declarations:
            focus = f", with the focus on the {declared.focus}" if declared.focus else ""
            groups.append((f"{declared.name}{focus}".upper(), [*self.workspaces[declared.name].shortcuts()]))
        dialog = ShortcutsDialog(groups, self)
        dialog.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        dialog.open()

    # --- events ---

    def event(self, event: QEvent) -> bool:
        # Escape comes here before the widget with the focus acts on it, unless that has something open to be closed.
        if event.type() == QEvent.Type.ShortcutOverride and event.key() == Qt.Key.Key_Escape:  # type: ignore[attr-defined]
            self.panic()
        # A dialog takes all keys; those of panic alone are looked for in front of it, while it is there.
        if event.type() == QEvent.Type.WindowBlocked:
            QApplication.instance().installEventFilter(self)  # type: ignore[union-attr]
        elif event.type() == QEvent.Type.WindowUnblocked:
            QApplication.instance().removeEventFilter(self)  # type: ignore[union-attr]
            if QApplication.activeWindow() is None:
                self.activateWindow()
        return super().event(event)

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        if event.type() == QEvent.Type.ShortcutOverride and isinstance(event, QKeyEvent):
            pressed = QKeySequence(event.keyCombination())
            if any(pressed == QKeySequence(key) for key in PANIC_KEYS):
                self.panic()
                event.accept()
                return True
        return super().eventFilter(watched, event)

    def paintEvent(self, event: QPaintEvent) -> None:
        super().paintEvent(event)
        if not self._was_painted:
            self._was_painted = True
            QTimer.singleShot(0, self.painted.emit)

    def showEvent(self, event: QShowEvent) -> None:
        super().showEvent(event)
        self.activateWindow()  # keys come here from the first on, also where no window manager sees to it

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Keys that no widget had a use for."""
        if event.key() == Qt.Key.Key_Space and not event.isAutoRepeat():
            self.controller.play_or_stop()
        else:
            super().keyPressEvent(event)

    def closeEvent(self, event: QCloseEvent) -> None:
        losing = [name for name, workspace in self.workspaces.items() if workspace.would_lose]
        if not self._is_leaving and (losing or not self.open_patch.is_all_saved):
            event.ignore()
            self._ask_to_leave(losing)
            return
        save_window(self, self.settings)
        self.settings.workspace = self.workspace
        self.hide()
        for workspace in self.workspaces.values():
            save_splitters(workspace, self.settings)
            workspace.close_down()
        self._exchange.close()
        self.network.close()
        self.controller.close()
        self.open_patch.close()
        self._settings_file.close()
        super().closeEvent(event)

    def leave(self) -> None:
        """Close without a question; unsaved work comes back at the next start."""
        self.open_patch.keeps_autosave = True
        self._leave()

    def restart(self) -> None:
        """Close, to be opened anew at once; not while a recording, a study or hardware would have to be found again."""
        target = self.controller.target
        if self.main_bar.record.isChecked() or self.controller.is_lent or target.kind not in ("simulator", "replay"):
            self.show_message("A recording, a study or hardware is at work: end it, or start Underfoot anew by hand.")
            return
        self.is_restarting = self.open_patch.reopens = True
        for workspace in self.workspaces.values():
            workspace.save_for_restart(self._folder)
        self._leave()

    def _ask_to_leave(self, losing: list[str]) -> None:
        """Ask in each of these workspaces, then for patches that are not saved, and close the window."""
        if losing:
            self.show_workspace(losing[0])
            self.workspaces[losing[0]].ask_to_leave(partial(self._ask_to_leave, losing[1:]))
        else:
            self.open_patch.ask_to_save_all(self._leave)

    def _leave(self) -> None:
        self._is_leaving = True
        self.close()

    # --- layout ---

    def _build(self) -> None:
        self.view_menu = ViewMenu(self.settings, self)
        self.menu = MainMenu(self.actions_by_name, lambda: self.settings.recent, self.view_menu, self)
        self.main_bar = MainBar(self.menu)
        self.main_bar.set_targets(targets.choices())
        self.main_bar.set_target(target_text(self.controller.target), targets.keys_of(self.controller.target))
        self.main_bar.set_level(self.settings.level_db)
        self.main_bar.set_playing(self.controller.is_playing)
        self.main_bar.set_recording("")
        self._progress = QProgressBar()
        self._progress.setAccessibleName("Compiling")
        self._progress.setTextVisible(False)
        self._progress.setFixedHeight(2)
        self._stack = QStackedWidget()
        for declared in self._declarations:
            self.main_bar.add_workspace(declared.name, declared.key, declared.icon)
        self.status = StatusLine()
        middle = QWidget()
        layout = QVBoxLayout(middle)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(0)
        layout.addWidget(self.main_bar)
        layout.addWidget(self._progress)
        layout.addWidget(self._stack, 1)
        layout.addWidget(self.status)
        self.setCentralWidget(middle)
        restore_window(self, self.settings)

    def _update_colours(self) -> None:
        app = QApplication.instance()
        assert isinstance(app, QApplication)
        apply_colours(app, self.settings)
        self._settings_file.save()

    def _show_title(self) -> None:
        slot = f" ({self.open_patch.slot})" if self.open_patch.other is not None else ""
        self.setWindowTitle(f"{self.open_patch.name}{slot}[*] – Underfoot")
        self.setWindowModified(not self.open_patch.is_saved)

    def _make_actions(self) -> dict[str, QAction]:
        """Everything that can be done in the whole window, by name."""
        key = QKeySequence.StandardKey
        open_patch, controller = self.open_patch, self.controller
        return {
            "new": self._add_action("New patch", key.New, open_patch.new),
            "open": self._add_action("Open…", key.Open, lambda: open_patch.open()),
            "save": self._add_action("Save", key.Save, lambda: open_patch.save()),
            "save as": self._add_action("Save as…", "Ctrl+Shift+S", lambda: open_patch.save_as()),
            "import": self._add_action("Import…", "Ctrl+Shift+I", self._exchange.ask),
            "export": self._add_action("Export…", "Ctrl+Shift+E", self._export),
            "play": self._add_action("Play or stop", "Ctrl+Space", controller.play_or_stop),
            "panic": self._add_action("Panic: silence at once", PANIC_KEYS, self.panic),
            "record": self._add_action(
                "Record", "Ctrl+R", lambda: controller.record(not self.main_bar.record.isChecked())
            ),
            "mark": self._add_action("Mark this moment", "Ctrl+M", self.marking.mark),
            "mark with words": self._add_action("Mark with words…", "Ctrl+Shift+M", self.marking.ask),
            "audio": self._add_action("Audio…", "Ctrl+,", self._open_audio),
            "network": self._add_action("Network…", "Ctrl+Shift+N", self._open_network),
            "cost": self._add_action("Cost of a block…", "Ctrl+Shift+B", self._open_cost),
            "keys": self._add_action("Keyboard shortcuts", "F1", self._show_shortcuts),
            "about": self._add_action("About Underfoot", "", self._show_about),
            "quit": self._add_action("Quit", "Ctrl+Q", self.close),
            **{
                declared.name: self._add_action(
                    f"Show {declared.name}", declared.key, partial(self.show_workspace, declared.name)
                )
                for declared in self._declarations
            },
        }

    def _add_action(
        self, text: str, keys: QKeySequence.StandardKey | str | tuple[str, ...], do: Callable[[], object]
    ) -> QAction:
        action = QAction(text, self)
        if isinstance(keys, tuple):
            action.setShortcuts([QKeySequence(key) for key in keys])
        else:
            action.setShortcut(keys)
        action.triggered.connect(lambda _=False: do())
        self.addAction(action)
        return action

    # --- connections ---

    def _connect(self) -> None:
        main_bar, bridge, open_patch, controller = self.main_bar, self.bridge, self.open_patch, self.controller
        self.view_menu.notified.connect(self.show_message)
        self.view_menu.restart_requested.connect(self.restart)
        self.view_menu.theme_chosen.connect(self._update_colours)
        self.menu.recent_chosen.connect(open_patch.open)
        self.menu.preset_chosen.connect(open_patch.open_preset)
        main_bar.workspace_chosen.connect(self.show_workspace)
        main_bar.warnings_clicked.connect(self.show_workspace)
        main_bar.target_chosen.connect(self._target_chooser.choose)
        main_bar.play_requested.connect(controller.play)
        main_bar.stop_requested.connect(controller.stop)
        main_bar.panic_requested.connect(self.panic)
        main_bar.record_requested.connect(controller.record)
        main_bar.level_chosen.connect(controller.set_level)
        main_bar.audio_requested.connect(self._open_audio)
        controller.notified.connect(self.show_message)
        controller.opened.connect(self._show_target)
        controller.playing_changed.connect(main_bar.set_playing)
        controller.playing_changed.connect(lambda: self._show_compiling(1, 1))
        controller.recording_changed.connect(self._show_recording)
        controller.target_locked.connect(main_bar.target.setDisabled)
        bridge.started.connect(self._show_start)
        bridge.notified.connect(self.show_message)
        bridge.output_changed.connect(self._show_output)
        bridge.floor_silent.connect(self.status.show_floor)
        bridge.compile_progressed.connect(self._show_compiling)
        bridge.health_reported.connect(self._show_health)
        self.listening.notified.connect(self.show_message)
        open_patch.title_changed.connect(self._show_title)
        open_patch.notified.connect(self.show_message)
