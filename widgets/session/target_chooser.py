"""The reaction to the target chooser: a question if the choice needs one, and the change of target."""

from collections.abc import Callable
from pathlib import Path

from PySide6.QtWidgets import QWidget

from underfoot.devices.transports import TRANSPORTS
from underfoot.floor.layout import grid_of
from underfoot.patch import preset_files
from underfoot.quantities import counted
from underfoot.widgets.dialogs.file_chooser import FileChooser
from underfoot.widgets.session.controller import SessionController
from underfoot.widgets.session.target_selection import TargetSelection

FORCE_FILES = "Forces (*.csv *.underfoot *.uf *.c3d);;All files (*)"


class TargetChooser:
    """Asks in dialogs of `window`; passes errors to `notify`, and recordings to view to `open_recording`."""

    def __init__(
        self,
        window: QWidget,
        controller: SessionController,
        selection: TargetSelection,
        file_chooser: FileChooser,
        notify: Callable[[str], object],
        open_recording: Callable[[Path], object],
    ) -> None:
        self._window, self._controller, self._selection = window, controller, selection
        self._file_chooser, self._notify, self._open_recording = file_chooser, notify, open_recording

    def choose(self, key: str) -> None:
        """Handle a key of `session.targets.choices`."""
        kind, *what = key.split()
        selection, ask = self._selection, self._file_chooser.ask
        if kind == "simulator":
            selection.set_floor(*map(int, what))
        elif kind == "grid":
            self._ask_size()
        elif kind == "simulation" and what:
            selection.use_simulation(preset_files.simulations().get(what[0]))
        elif kind == "simulation":
            ask("A simulated tile", "Tiles (*.json);;All files (*)", selection.use_simulation)
        elif kind == "floor":
            ask("A floor", "Floors (*.json);;All files (*)", selection.use_floor)
        elif kind == "transport":
            self._ask_address(*what)
        elif kind == "recording":
            ask("A recording", "Recordings (*.underfoot *.uf)", self._open_recording)
        else:
            ask("Recorded forces", FORCE_FILES, selection.use_forces)

    def _ask_size(self) -> None:
        from underfoot.widgets.dialogs.grid_dialog import GridDialog

        dialog = GridDialog(*(grid_of(self._controller.target.floor) or (2, 2)), self._window)
        dialog.chosen.connect(self._selection.set_floor)
        dialog.open()

    def _ask_address(self, scheme: str) -> None:
        from underfoot.widgets.dialogs.transport_dialog import TransportDialog

        floor = self._controller.target.floor
        title = floor.title or counted(len(floor.tiles), "tile")
        TransportDialog(
            TRANSPORTS[scheme],
            title,
            lambda address: self._selection.require_transport(scheme, address),
            lambda address: self._selection.use_transport(scheme, address),
            self._window,
        ).open()
