"""The window: the transport bar, the workspaces below it, and a line of what there is to say."""

import signal
import tempfile
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import platformdirs
from PySide6.QtCore import QEvent, Qt, QTimer
from PySide6.QtGui import QAction, QKeySequence
from PySide6.QtWidgets import (
    QApplication,
    QHBoxLayout,
    QLabel,
    QMainWindow,
    QMenu,
    QProgressBar,
    QSizePolicy,
    QStackedWidget,
    QVBoxLayout,
    QWidget,
)

from underfoot.devices.sound import devices
from underfoot.devices.transports import TRANSPORTS
from underfoot.engine.messages import Health, Press, Preview, Pulse, Started, Strike
from underfoot.engine.target import Target
from underfoot.errors import UnderfootError
from underfoot.nodes import REGISTRY
from underfoot.patch import library
from underfoot.patch.patch import Patch
from underfoot.widgets import theme
from underfoot.widgets.design.node_list import SearchField
from underfoot.widgets.design.workspace import DesignWorkspace
from underfoot.widgets.garbage import spare
from underfoot.widgets.session import targets
from underfoot.widgets.session.open_patch import OpenPatch
from underfoot.widgets.session.player import Player, in_words
from underfoot.widgets.session.settings import Settings
from underfoot.widgets.transport import TransportBar

FIRST = "gravel"
MONITOR, CALIBRATE = 1, 2
MESSAGE_MS = 20_000

EXTRA_KEYS = (
    ("Play or stop, where nothing is typed", "Space"),
    ("Panic, from wherever the focus is", "Esc"),
    ("Menu", "Alt+M"),
)
MONITOR_KEYS = (
    ("Choose the next tile, with the focus on the floor", "Arrows"),
    ("Pause the picture, or go on", "P"),
    ("Copy footsteps, with the focus on the table", "Ctrl+C"),
)


CALIBRATE_KEYS = (
    ("Begin, continue, or do what the button with the focus says", "Return"),
    ("The page before", "Alt+Left"),
    ("On the floor: scale, finer with Ctrl", "+ and −"),
    ("On the floor: move, finer with Ctrl", "Arrows"),
    ("On the floor: close it", "Esc"),
)


class MainWindow(QMainWindow):
    """Shows a patch and the session that plays it. `start` opens the session; closing the window ends it."""

    def __init__(self, folder: Path, target: Target | None = None, patch_path: Path | None = None) -> None:
        super().__init__()
        self._folder = folder
        self.settings = Settings.load(folder)
        self.document = OpenPatch(REGISTRY, self.settings, folder / "unsaved", self)
        self.player = Player(REGISTRY, self.settings, target, folder / "profiles", self)
        self.bridge = self.player.bridge
        self._is_leaving = False
        self.workspaces: list[str] = []
        self._ticket, self._awaited = 0, ""
        self._plays_on = ""
        self._make_actions()
        self._build()
        self._connect()
        self.document.begin(patch_path, otherwise=_first_patch())
        self._show_title()
        self.show_workspace(0)

    def start(self) -> None:
        """Open the session; what is on the screen is usable at once."""
        self.player.start(self.document.patch, self._patch_folder())

    @property
    def workspace(self) -> int:
        """Index of the workspace on the screen."""
        return self._stack.currentIndex()

    def show_workspace(self, index: int) -> None:
        """Bring a workspace to the screen; what is not there is not drawn, nor read."""
        self._stack.setCurrentIndex(index)
        self.transport.set_workspace(index)
        self._stack.widget(index).setFocus()  # type: ignore[union-attr]
        self.bridge.wants_vibration = index == MONITOR

    def say(self, text: str) -> None:
        """One line for the person, until there is another or it has been there for a while."""
        self._message.setText(text)
        self._message.setToolTip(text)
        self._message_timer.start()

    def panic(self) -> None:
        """Silence at once, whatever makes the sound."""
        self.player.panic()
        self.calibrate.silence()

    # --- the session speaks ---

    def _show_target(self, target: Target) -> None:
        self.transport.set_target(in_words(target))
        self.design.setFloor(target.floor.tiles)
        self.monitor.set_session(target.floor, target.rate, target.kind == "simulator")
        self.calibrate.set_target(target)
        if self._awaited:
            self._want_preview(self._awaited)

    def _show_start(self, report: Started) -> None:
        self._plays_on = f"Plays on: {report.where}"
        self._show_compiling(1, 1)

    def _show_compiling(self, ready: int, total: int) -> None:
        is_busy = ready < total
        self._progress.setRange(0, max(total, 1))
        self._progress.setValue(ready if is_busy else 0)
        self._where.setText(f"Compiling what the patch needs: {ready} of {total} ready" if is_busy else self._plays_on)

    def _show_health(self, health: Health) -> None:
        self.transport.set_health(health, len(self.player.target.floor.tiles))
        self.design.showHealth(health)

    def _show_preview(self, preview: Preview) -> None:
        if preview.ticket == self._ticket:
            node, self._awaited = self._awaited, ""
            self.design.showPreview(preview, node)

    # --- hands ---

    def _edited(self, patch: Patch) -> None:
        self.document.take(patch)
        self.player.edit(patch, self._patch_folder())

    def _opened(self, patch: Patch) -> None:
        self.design.setPatch(patch)
        self.player.edit(patch, self._patch_folder())

    def _want_preview(self, node: str) -> None:
        self._awaited = node
        if self.player.session is not None:
            self._ticket = self.player.session.preview(self.document.patch, node)

    def _choose_target(self, key: str) -> None:
        kind, *what = key.split()
        if kind == "simulator":
            self.player.set_floor(*map(int, what))
        elif kind == "simulation" and what:
            self.player.use_simulation(library.simulations().get(what[0]))
        elif kind == "simulation":
            self.document.ask_file("A simulated tile", "Tiles (*.json);;All files (*)", self.player.use_simulation)
        elif kind == "floor":
            self.document.ask_file("A floor", "Floors (*.json);;All files (*)", self.player.use_floor)
        elif kind in TRANSPORTS:
            self._ask_address(kind)
        else:
            self.document.ask_file("Recorded forces", "Force tables (*.csv);;All files (*)", self.player.use_forces)

    def _ask_address(self, scheme: str) -> None:
        from underfoot.widgets.dialogs.transport_dialog import TransportDialog

        def chosen(address: str) -> None:
            try:
                self.player.use_transport(scheme, address)
            except UnderfootError as error:
                self.say(str(error))

        floor = self.player.target.floor
        dialog = TransportDialog(TRANSPORTS[scheme], floor.title or f"{len(floor.tiles)} tiles", self)
        dialog.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        dialog.chosen.connect(chosen)
        dialog.open()

    def _open_audio(self) -> None:
        from underfoot.widgets.dialogs.audio_dialog import AudioDialog

        target = self.player.target
        dialog = AudioDialog(
            lambda: [(card.name, card.channels, card.rate_hz) for card in devices()], target.floor, self
        )
        dialog.set_values(target.sound, target.rate, target.block)
        dialog.applied.connect(self.player.set_sound)
        dialog.pulse_wanted.connect(lambda tile: self.player.send(Pulse(tile)))
        dialog.open()

    def _show_shortcuts(self) -> None:
        from underfoot.widgets.dialogs.shortcuts import ShortcutsDialog, keys_of

        groups = [
            ("EVERYWHERE", [*keys_of(self.actions()), *EXTRA_KEYS]),
            ("DESIGN, WITH THE FOCUS ON THE CANVAS", keys_of(self.design.actions_by_name().values())),
            ("MONITOR", MONITOR_KEYS),
            ("CALIBRATE", CALIBRATE_KEYS),
        ]
        dialog = ShortcutsDialog(groups, self)
        dialog.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        dialog.open()

    def _patch_folder(self) -> Path | None:
        return self.document.path.parent if self.document.path else None

    # --- events ---

    def event(self, event: QEvent) -> bool:
        # Escape is looked at before any widget takes it; only the node search closes by it.
        escaped = event.type() == QEvent.Type.ShortcutOverride and event.key() == Qt.Key.Key_Escape  # type: ignore[attr-defined]
        if escaped and not isinstance(self.focusWidget(), SearchField):
            self.panic()
        if event.type() == QEvent.Type.WindowUnblocked and QApplication.activeWindow() is None:
            self.activateWindow()
        return super().event(event)

    def showEvent(self, event) -> None:
        super().showEvent(event)
        self.activateWindow()  # keys come here from the first on, also where no window manager sees to it

    def keyPressEvent(self, event) -> None:
        """What no widget had a use for."""
        if event.key() == Qt.Key.Key_Space and not event.isAutoRepeat():
            self.player.play_or_stop()
        else:
            super().keyPressEvent(event)

    def closeEvent(self, event) -> None:
        if not self._is_leaving and not self.document.is_saved:
            event.ignore()
            self.document.when_safe(self._leave)
            return
        self.settings.window_bytes = bytes(self.saveGeometry().data())
        self.hide()
        self.calibrate.close_down()
        self.player.close()
        self.document.close()
        self.settings.save(self._folder)
        super().closeEvent(event)

    def leave(self) -> None:
        """Close without a question; unsaved work comes back at the next start."""
        self.document.keeps_unsaved = True
        self._leave()

    def _leave(self) -> None:
        self._is_leaving = True
        self.close()

    # --- layout ---

    def _build(self) -> None:
        made = self._make_workspaces()
        self.transport = TransportBar(self._menu())
        self.transport.set_targets(targets.choices())
        self.transport.set_target(in_words(self.player.target))
        self.transport.set_level(self.settings.level_db)
        self.transport.set_playing(self.player.playing)
        self.transport.set_recording("")
        self._progress = QProgressBar()
        self._progress.setAccessibleName("Compiling")
        self._progress.setTextVisible(False)
        self._progress.setFixedHeight(2)
        self._stack = QStackedWidget()
        for name, widget in made:
            index = len(self.workspaces)
            self._act(name, f"Show {name}", f"Ctrl+{index + 1}", partial(self.show_workspace, index))
            self.workspaces.append(name)
            self.transport.add_workspace(name)
            self._stack.addWidget(widget)
        middle = QWidget()
        layout = QVBoxLayout(middle)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(0)
        for part in (self.transport, self._progress):
            layout.addWidget(part)
        layout.addWidget(self._stack, 1)
        layout.addWidget(self._bottom_line())
        self.setCentralWidget(middle)
        self.setMinimumSize(1024, 640)
        if not self.restoreGeometry(self.settings.window_bytes):
            self.resize(1440, 900)

    def _make_workspaces(self) -> list[tuple[str, QWidget]]:
        """The workspaces in the order of their tabs."""
        from underfoot.widgets.calibrate.catalogue import KINDS
        from underfoot.widgets.calibrate.workspace import CalibrateWorkspace
        from underfoot.widgets.monitor.workspace import MonitorWorkspace

        self.design = DesignWorkspace(REGISTRY)
        self.design.setFocusProxy(self.design.canvas)
        self.monitor = MonitorWorkspace()
        self.monitor.set_level(self.settings.level_db)
        self.calibrate = CalibrateWorkspace(self._folder / "profiles", self.settings, KINDS)
        return [("Design", self.design), ("Monitor", self.monitor), ("Calibrate", self.calibrate)]

    def _bottom_line(self) -> QWidget:
        line = QWidget()
        line.setProperty("role", "panel")
        line.setAttribute(Qt.WidgetAttribute.WA_StyledBackground)
        line.setFixedHeight(3 * theme.GRID)
        self._message = Elided()
        self._message.setAccessibleName("Message")
        self._where = theme.label("", "small")
        layout = QHBoxLayout(line)
        layout.setContentsMargins(2 * theme.GRID, 0, 2 * theme.GRID, 0)
        layout.addWidget(self._message, 1)
        layout.addWidget(self._where)
        self._message_timer = QTimer(self)
        self._message_timer.setSingleShot(True)
        self._message_timer.setInterval(MESSAGE_MS)
        self._message_timer.timeout.connect(lambda: self.say(""))
        return line

    def _show_title(self) -> None:
        self.setWindowTitle(f"{self.document.name}[*] – Underfoot")
        self.setWindowModified(not self.document.is_saved)

    # --- actions ---

    def _make_actions(self) -> None:
        key = QKeySequence.StandardKey
        document, player = self.document, self.player
        self._act("new", "New patch", key.New, document.new)
        self._act("open", "Open…", key.Open, lambda: document.open())
        self._act("save", "Save", key.Save, lambda: document.save())
        self._act("save as", "Save as…", "Ctrl+Shift+S", lambda: document.save_as())
        self._act("play", "Play or stop", "Ctrl+Space", player.play_or_stop)
        self._act("panic", "Panic: silence at once", "Ctrl+.", self.panic)
        self._act("record", "Record", "Ctrl+R", lambda: player.record(not self.transport.record.isChecked()))
        self._act("audio", "Audio…", "Ctrl+,", self._open_audio)
        self._act("keys", "Keyboard shortcuts", "F1", self._show_shortcuts)
        self._act("quit", "Quit", "Ctrl+Q", self.close)

    def _act(self, name: str, text: str, keys: Any, do: Callable[[], object]) -> None:
        action = QAction(text, self)
        action.setObjectName(name)
        action.setShortcut(keys)
        action.triggered.connect(lambda _=False: do())
        self.addAction(action)

    def action(self, name: str) -> QAction:
        """An action of the menu by its name."""
        return next(action for action in self.actions() if action.objectName() == name)

    def _menu(self) -> QMenu:
        menu = QMenu(self)
        menu.addActions([self.action("new"), self.action("open")])
        self._recent = menu.addMenu("Open recent")
        self._recent.aboutToShow.connect(self._fill_recent)
        presets = menu.addMenu("Presets")
        for name, path in library.patches().items():
            words = name.replace("-", " ").capitalize()
            presets.addAction(words).triggered.connect(lambda _=False, path=path: self.document.use(path))
        menu.addActions([self.action("save"), self.action("save as")])
        menu.addSeparator()
        menu.addActions([self.design.undo_action, self.design.redo_action])
        menu.addSeparator()
        menu.addActions([self.action(name) for name in ("play", "panic", "record", "audio")])
        menu.addSeparator()
        menu.addActions([self.action("keys"), self.action("quit")])
        return menu

    def _fill_recent(self) -> None:
        self._recent.clear()
        for path in self.settings.recent:
            self._recent.addAction(path, partial(self.document.open, Path(path)))
        if not self.settings.recent:
            self._recent.addAction("None yet").setEnabled(False)

    def _connect(self) -> None:
        transport, player, bridge = self.transport, self.player, self.bridge
        design, monitor, calibrate = self.design, self.monitor, self.calibrate
        transport.workspace_chosen.connect(self.show_workspace)
        transport.target_chosen.connect(self._choose_target)
        transport.play_wanted.connect(player.play)
        transport.stop_wanted.connect(player.stop)
        transport.panic_wanted.connect(self.panic)
        transport.record_wanted.connect(player.record)
        transport.level_chosen.connect(player.set_level)
        transport.level_chosen.connect(monitor.set_level)
        transport.audio_wanted.connect(self._open_audio)
        transport.flags_clicked.connect(lambda: self.show_workspace(CALIBRATE))
        player.said.connect(self.say)
        player.retargeted.connect(self._show_target)
        player.playing_changed.connect(transport.set_playing)
        player.recording_changed.connect(lambda path: transport.set_recording(f"Recording to {path}" if path else ""))
        bridge.started.connect(self._show_start)
        bridge.noticed.connect(self.say)
        bridge.compiling.connect(self._show_compiling)
        bridge.health.connect(self._show_health)
        bridge.costs.connect(design.showCosts)
        bridge.faulted.connect(design.showFault)
        bridge.previewed.connect(self._show_preview)
        bridge.forces.connect(monitor.take_forces)
        bridge.vibrated.connect(monitor.take_vibration)
        bridge.stepped.connect(monitor.take_steps)
        bridge.ticked.connect(monitor.draw)
        monitor.commanded.connect(player.send)
        monitor.noticed.connect(self.say)
        calibrate.noticed.connect(self.say)
        calibrate.flagged.connect(transport.set_flags)
        calibrate.profile_changed.connect(player.use_profile)
        calibrate.release_wanted.connect(player.release)
        calibrate.reopen_wanted.connect(player.reopen)
        calibrate.held.connect(lambda held: transport.target.setEnabled(not held))
        player.released.connect(calibrate.begin_released)
        design.patchEdited.connect(self._edited)
        design.previewWanted.connect(self._want_preview)
        design.struck.connect(lambda tile, strength: player.send(Strike("", tile, strength)))
        design.pressed.connect(lambda *press: player.send(Press(*press)))
        self.document.opened.connect(self._opened)
        self.document.changed.connect(self._show_title)
        self.document.said.connect(self.say)
        calibrate.set_target(player.target)


def _first_patch() -> Patch:
    """The preset that there is to play with at the first start; nothing where it is missing."""
    try:
        return Patch.load(library.patches()[FIRST], REGISTRY)
    except (KeyError, UnderfootError):
        return Patch()


class Elided(QLabel):
    """A line of text that ends in dots where there is no room for all of it."""

    def __init__(self) -> None:
        super().__init__()
        self._text = ""
        self.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Preferred)

    def setText(self, text: str) -> None:
        self._text = text
        self._fit()

    def fullText(self) -> str:
        return self._text

    def resizeEvent(self, event) -> None:
        super().resizeEvent(event)
        self._fit()

    def _fit(self) -> None:
        super().setText(self.fontMetrics().elidedText(self._text, Qt.TextElideMode.ElideRight, self.width()))


def run(target: Target | None = None, patch_path: Path | None = None, screenshot_dir: Path | None = None) -> int:
    """Open the window and stay until it is closed; the exit status.

    With `screenshot_dir` the window plays for a while, leaves a picture of every workspace there, and closes; it
    neither makes a sound nor remembers anything.
    """
    app = QApplication.instance() or QApplication(["underfoot"])
    assert isinstance(app, QApplication)
    app.setApplicationName("Underfoot")
    app.setDesktopFileName("underfoot")
    theme.apply(app)
    with tempfile.TemporaryDirectory() as passing:
        folder = Path(passing if screenshot_dir else platformdirs.user_data_dir("underfoot"))
        window = MainWindow(folder, target, patch_path)
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, lambda *_: window.leave())
        window.player.use_sound(screenshot_dir is None)
        window.show()
        spare(window)
        QTimer.singleShot(0, window.start)
        if screenshot_dir is not None:
            from underfoot.widgets.pictures import Photographer

            photographer = Photographer(window, screenshot_dir)
            photographer.done.connect(window.leave)
            photographer.start()
        return app.exec()
