"""The window: the transport bar, the workspaces below it, and a line of messages."""

import sys
from collections.abc import Mapping
from functools import partial
from pathlib import Path

from PySide6.QtCore import QEvent, QObject, Qt, QTimer, Signal
from PySide6.QtGui import QAction, QCloseEvent, QKeyEvent, QKeySequence, QPaintEvent, QShowEvent
from PySide6.QtWidgets import (
    QApplication,
    QMainWindow,
    QMessageBox,
    QPushButton,
    QToolButton,
    QVBoxLayout,
    QWidget,
)

from underfoot.devices.force_source import WITHOUT_HARDWARE
from underfoot.engine.child_process import ChildProcess
from underfoot.engine.target import Target
from underfoot.file_places import file_place, place_in, readable
from underfoot.floor.layout import FORMAT as FLOOR_FORMAT
from underfoot.nodes import REGISTRY
from underfoot.widgets.controls.fields import end_typing
from underfoot.widgets.controls.menu import add_action
from underfoot.widgets.controls.question import message_box
from underfoot.widgets.dialogs.file_chooser import FileChooser
from underfoot.widgets.dialogs.shortcuts import keys_of
from underfoot.widgets.main_bar import MainBar
from underfoot.widgets.menu import MainMenu
from underfoot.widgets.recolour import apply_colours
from underfoot.widgets.scenes import WORKSPACE as SCENES
from underfoot.widgets.session.controller import SessionController
from underfoot.widgets.session.dropped_files import DroppedFiles, Handlers
from underfoot.widgets.session.exchange import Exchange
from underfoot.widgets.session.listening import Listening
from underfoot.widgets.session.marking import Marking
from underfoot.widgets.session.network_link import NetworkLink
from underfoot.widgets.session.open_patch import OpenPatch, first_patch
from underfoot.widgets.session.settings_file import SettingsFile
from underfoot.widgets.session.target_chooser import TargetChooser
from underfoot.widgets.session.target_selection import TargetSelection
from underfoot.widgets.session.target_settings import remembered_target
from underfoot.widgets.session_display import SessionDisplay
from underfoot.widgets.status_line import StatusLine
from underfoot.widgets.view_menu import ViewMenu
from underfoot.widgets.window_dialogs import WindowDialogs
from underfoot.widgets.window_state import restore_window, save_window
from underfoot.widgets.workspace import WorkspaceContext
from underfoot.widgets.workspace_stack import WorkspaceStack

PANIC_KEYS = ("F12", "Shift+Esc", "Ctrl+.")
"""Panic, whatever is open."""
EXTRA_SHORTCUTS = (
    ("Play or stop, unless text is being typed", "Space"),
    ("Press the button with the focus", "Return"),
    ("Close what is open; panic where nothing is", "Esc"),
    ("Menu", "Alt+M"),
)


class MainWindow(QMainWindow):
    """Shows a patch and the session that plays it. `start` opens the session; closing the window ends it."""

    painted = Signal()
    """The window was painted for the first time."""

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
        self._is_leaving = self._was_painted = self._is_closing = False
        self._last_words: list[str] = []
        self.is_restarting = False
        """Whether it was closed to be opened anew."""
        self._settings_file = SettingsFile(folder, self.show_message, self)
        self.settings = self._settings_file.settings
        self.open_patch = OpenPatch(REGISTRY, self.settings, folder / "unsaved", self)
        self.open_patch.nodes.consent_given.connect(self._settings_file.save)
        self.controller = SessionController(
            REGISTRY, self.settings, target or remembered_target(self.settings), folder / "profiles", self, engine
        )
        self.bridge = self.controller.bridge
        self.network = NetworkLink(self.controller, self.settings, self.panic, folder / "presets")
        self.marking = Marking(self.controller, self)
        self.target_selection = TargetSelection(self.controller, self.settings)
        file_chooser = FileChooser(self, lambda: self.settings.folder, self.show_message, self.show_file_error)
        self._target_chooser = TargetChooser(
            self, self.controller, self.target_selection, file_chooser, self.show_message, self.open_file
        )
        self._exchange = Exchange(self, self.open_patch, self.controller, file_chooser, self.show_message)
        self._dropped_files = DroppedFiles(self, self._handlers, self.show_message, self.show_file_error)
        self.listening = Listening(self.controller, self.open_patch, REGISTRY)
        context = WorkspaceContext(
            REGISTRY, self.settings, folder, self.open_patch, self.controller, self.listening, self.network
        )
        self.workspaces = WorkspaceStack(context)
        self._dialogs = WindowDialogs(self, context, self.target_selection)
        self.actions_by_name = self._make_actions()
        self._build()
        self._connect()
        for line in self._settings_file.refused:
            self.show_message(line)
        self.open_patch.restore_or_open(patch_path, default_patch=first_patch())
        self._show_title()
        remembered = self.settings.workspace
        names = self.workspaces.names
        self.workspaces.choose(remembered if remembered in names else names[0])

    def start(self) -> None:
        """Open the session; what is on the screen is usable at once."""
        self._display.show_starting()
        self.controller.start()

    def _connect_workspace(self, name: str) -> None:
        """Show a new workspace's messages and warnings, and open what is pasted there."""
        workspace = self.workspaces[name]
        workspace.notified.connect(self.show_message)
        workspace.withdrawn.connect(self.status.withdraw)
        workspace.warnings_changed.connect(partial(self.main_bar.set_warnings, name))
        workspace.files_pasted.connect(self._dropped_files.open)

    def show_message(self, text: str) -> None:
        """Show a line at the bottom of the window; if it names a place in a file, show that place, too.

        A line that comes while the window closes is kept for `_show_last_words`.
        """
        if self._is_closing:
            self._last_words.append(readable(text))
            return
        self.status.show_message(readable(text))
        place = file_place(text)
        if place is not None:
            self._dialogs.open_file_error(place)

    def show_file_error(self, path: Path, text: str) -> None:
        """Say in a dialog, and at the bottom of the window, why a file cannot be read."""
        self.status.show_message(readable(text))
        self._dialogs.open_file_error(place_in(path, text))

    def open_file(self, path: Path) -> None:
        """Open a file in the workspace for it."""
        if not self.workspaces.open_file(path):
            self.show_message(f"{path} cannot be opened here")

    def perform(self, scene: str, given: Mapping[str, object]) -> None:
        """Play a scene with these parameters, and show it on the floor, once the session is open."""
        from underfoot.widgets.scenes.workspace import ScenesWorkspace  # which most starts need not load

        self.workspaces.choose(SCENES.name)
        workspace = self.workspaces[SCENES.name]
        assert isinstance(workspace, ScenesWorkspace)
        workspace.perform(scene, given)

    def _handlers(self) -> Handlers:
        """Return what opens dropped files: workspaces theirs, patches of any program, forces to be replayed, floors."""
        kinds = (kind for declared in self.workspaces.declarations for kind in (*declared.suffixes, *declared.formats))
        forces = dict.fromkeys((".csv", ".c3d"), self.target_selection.use_forces)
        floors = {FLOOR_FORMAT: self.target_selection.use_floor}
        return {**self._exchange.handlers(), **forces, **floors, **dict.fromkeys(kinds, self.open_file)}

    def panic(self) -> None:
        """Silence at once whatever makes sound."""
        self.controller.panic()
        self.workspaces.silence()

    def _save(self) -> None:
        """Save what the visible workspace edits, or else the patch."""
        end_typing(self)
        if not self.workspaces[self.workspaces.chosen].save():
            self.open_patch.save()

    def _export(self) -> None:
        """Export what the visible workspace shows, or else the patch."""
        end_typing(self)
        if not self.workspaces[self.workspaces.chosen].export():
            self._exchange.export()

    def _show_shortcuts(self) -> None:
        everywhere = [*keys_of(self.actions()), *EXTRA_SHORTCUTS]
        self._dialogs.open_shortcuts([("EVERYWHERE", everywhere), *self.workspaces.shortcuts()])

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
        """Play or stop with Space, and press the button with the focus by Return, if no widget has used the key."""
        focus = self.focusWidget()
        if event.key() == Qt.Key.Key_Space and not event.isAutoRepeat():
            self.controller.play_or_stop()
        elif event.key() in (Qt.Key.Key_Return, Qt.Key.Key_Enter) and isinstance(focus, QPushButton | QToolButton):
            if not event.isAutoRepeat():
                focus.click()
        else:
            super().keyPressEvent(event)

    def closeEvent(self, event: QCloseEvent) -> None:
        end_typing(self)
        losing = self.workspaces.would_lose
        if not self._is_leaving and (losing or not self.open_patch.is_all_saved):
            event.ignore()
            self.workspaces.ask_to_leave(losing, lambda: self.open_patch.ask_to_save_all(self._leave))
            return
        save_window(self, self.settings)
        self.settings.workspace = self.workspaces.chosen
        self.hide()
        self._is_closing = True
        self.workspaces.close_down()
        self._exchange.close()
        self.network.close()
        self.controller.close()
        self.open_patch.close()
        self._settings_file.close()
        self._show_last_words()
        super().closeEvent(event)

    def _show_last_words(self) -> None:
        """Say what could not be kept: on standard error, and in a box of its own if a person closes the window."""
        for line in self._last_words:
            print(f"underfoot: {line}", file=sys.stderr, flush=True)
        if self._last_words and not (self.open_patch.keeps_autosave or self.open_patch.reopens):
            self.last_box = message_box(None, "Underfoot", "Not all could be kept", "\n".join(self._last_words))
            self.last_box.setIcon(QMessageBox.Icon.Warning)
            self.last_box.show()

    def leave(self) -> None:
        """Close without a question; unsaved work comes back at the next start."""
        self.open_patch.keeps_autosave = True
        self._leave()

    def restart(self) -> None:
        """Close, to be opened anew at once; not while a recording, a study or hardware would have to be found again."""
        target = self.controller.target
        if self.main_bar.record.isChecked() or self.controller.is_lent or target.kind not in WITHOUT_HARDWARE:
            self.show_message("A recording, a study or hardware is at work: end it, or start Underfoot anew by hand.")
            return
        self.is_restarting = self.open_patch.reopens = True
        self.workspaces.save_for_restart(self._folder)
        self._leave()

    def _leave(self) -> None:
        self._is_leaving = True
        self.close()

    # --- layout ---

    def _build(self) -> None:
        self.view_menu = ViewMenu(self.settings, self)
        self.menu = MainMenu(self.actions_by_name, lambda: self.settings.recent, self.view_menu, self)
        self.main_bar = MainBar(self.menu)
        for declared in self.workspaces.declarations:
            self.main_bar.add_workspace(declared.name, declared.key, declared.icon)
        self.status = StatusLine()
        self._display = SessionDisplay(self.controller, self.main_bar, self.status, self.settings.level_db)
        middle = QWidget(self)
        self.setCentralWidget(middle)  # first: each change of parent has the style of all within looked up again
        layout = QVBoxLayout(middle)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(0)
        layout.addWidget(self.main_bar)
        layout.addWidget(self._display.progress)
        layout.addWidget(self.workspaces, 1)
        layout.addWidget(self.status)
        restore_window(self, self.settings)

    def _update_colours(self) -> None:
        app = QApplication.instance()
        assert isinstance(app, QApplication)
        apply_colours(app, self.settings)
        self._settings_file.save()

    def _show_title(self) -> None:
        self.setWindowTitle(f"{self.open_patch.name_and_slot}[*] – Underfoot")
        self.setWindowModified(not self.open_patch.is_saved)

    def _make_actions(self) -> dict[str, QAction]:
        """Return the actions of the whole window by name."""
        key = QKeySequence.StandardKey
        open_patch, controller = self.open_patch, self.controller
        add = partial(add_action, self, where=Qt.ShortcutContext.WindowShortcut)
        return {
            "new": add("New patch", key.New, open_patch.new),
            "open": add("Open…", key.Open, lambda: open_patch.open()),
            "save": add("Save", key.Save, self._save),
            "save as": add("Save as…", "Ctrl+Shift+S", lambda: open_patch.save_as()),
            "import": add("Import…", "Ctrl+Shift+I", self._exchange.ask),
            "export": add("Export…", "Ctrl+Shift+E", self._export),
            "play": add("Play or stop", "Ctrl+Space", controller.play_or_stop),
            # Also in the window of a participant, or of a projector, which has the keys.
            "panic": add(
                "Panic: silence at once", PANIC_KEYS, self.panic, where=Qt.ShortcutContext.ApplicationShortcut
            ),
            "record": add(
                "Record", "Ctrl+R", lambda: controller.recording.record(not self.main_bar.record.isChecked())
            ),
            "mark": add("Mark this moment", "Ctrl+M", self.marking.mark),
            "mark with words": add("Mark with words…", "Ctrl+Shift+M", self.marking.ask),
            "audio": add("Audio…", "Ctrl+,", self._dialogs.open_audio),
            "network": add("Network…", "Ctrl+Shift+N", self._dialogs.open_network),
            "cost": add("Cost of a block…", "Ctrl+Shift+B", self._dialogs.open_cost),
            "keys": add("Keyboard shortcuts", "F1", self._show_shortcuts),
            "about": add("About Underfoot", (), self._dialogs.open_about),
            "quit": add("Quit", "Ctrl+Q", self.close),
            **{
                declared.name: add(
                    f"Show {declared.name}", declared.key, partial(self.workspaces.choose, declared.name)
                )
                for declared in self.workspaces.declarations
            },
        }

    # --- connections ---

    def _connect(self) -> None:
        main_bar, open_patch, controller = self.main_bar, self.open_patch, self.controller
        self.view_menu.notified.connect(self.show_message)
        self.view_menu.restart_requested.connect(self.restart)
        self.view_menu.theme_chosen.connect(self._update_colours)
        self.menu.recent_chosen.connect(open_patch.open)
        self.menu.preset_chosen.connect(open_patch.open_preset)
        self.workspaces.created.connect(self._connect_workspace)
        self.workspaces.attached.connect(
            lambda name: self.menu.add_workspace_actions(self.workspaces[name].menu_actions())
        )
        self.workspaces.chosen_changed.connect(main_bar.set_workspace)
        main_bar.workspace_chosen.connect(self.workspaces.choose)
        main_bar.warnings_clicked.connect(self.workspaces.choose)
        main_bar.target_chosen.connect(self._target_chooser.choose)
        main_bar.play_requested.connect(controller.play)
        main_bar.stop_requested.connect(controller.stop)
        main_bar.panic_requested.connect(self.panic)
        main_bar.record_requested.connect(controller.recording.record)
        main_bar.level_chosen.connect(controller.set_level)
        main_bar.audio_requested.connect(self._dialogs.open_audio)
        controller.notified.connect(self.show_message)
        self.bridge.notified.connect(self.show_message)
        self.listening.notified.connect(self.show_message)
        open_patch.title_changed.connect(self._show_title)
        open_patch.notified.connect(self.show_message)
        open_patch.not_read.connect(self.show_file_error)
