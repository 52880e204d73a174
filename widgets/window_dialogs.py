"""The dialogs of the window's menu; each is imported when it is opened."""

from collections.abc import Sequence

from PySide6.QtWidgets import QWidget

from underfoot.engine.card_search import CardSearch
from underfoot.engine.commands import Pulse
from underfoot.file_places import FilePlace
from underfoot.patch.effective import without_missing
from underfoot.widgets.dialogs.shortcuts import Keys
from underfoot.widgets.session.settings import DEFAULT_ADDRESSES
from underfoot.widgets.session.target_selection import TargetSelection
from underfoot.widgets.workspace import WorkspaceContext


class WindowDialogs:
    """Opens the dialogs of `window` and connects them to the session, without blocking."""

    def __init__(self, window: QWidget, context: WorkspaceContext, target_selection: TargetSelection) -> None:
        self._window, self._context = window, context
        self._target_selection = target_selection

    def open_audio(self) -> None:
        """Choose sound card, rate, block and channels; a click on a tile plays a pulse on it."""
        from underfoot.widgets.dialogs.audio_dialog import AudioDialog

        controller, search = self._context.controller, CardSearch()
        target = controller.target
        dialog = AudioDialog(search.find, search.give_up, target.floor, self._window)
        dialog.set_values(target.sound, target.rate, target.block, self._context.settings.accelerometers)
        dialog.applied.connect(self._target_selection.set_sound)
        dialog.pulse_requested.connect(lambda tile: controller.send(Pulse(tile)))
        dialog.open()

    def open_network(self) -> None:
        """Choose what is sent to and taken from other programs; an open dialog is raised."""
        from underfoot.widgets.dialogs.network_dialog import NetworkDialog

        opened = self._window.findChild(NetworkDialog)
        if opened is not None:
            opened.activateWindow()
            return
        settings, network = self._context.settings, self._context.network
        dialog = NetworkDialog(
            network.apply, lambda: network.counts, lambda: network.problem,
            {**DEFAULT_ADDRESSES, **settings.network_addresses}, settings.network_on, self._window,
        )  # fmt: skip
        dialog.show()

    def open_cost(self) -> None:
        """Measure the run time of a block of the open patch."""
        from underfoot.engine.target import is_simulated
        from underfoot.widgets.dialogs.cost_dialog import CostDialog

        open_patch, target = self._context.open_patch, self._context.controller.target
        patch = without_missing(open_patch.patch, self._context.registry)
        how = {"block": target.block, "profiles": target.profiles, "folder": open_patch.folder}
        CostDialog(patch, target.floor, {**how, "simulated": is_simulated(target)}, self._window).open()

    def open_about(self) -> None:
        """Show version, folders and licences."""
        from underfoot.widgets.dialogs.about import AboutDialog

        AboutDialog(self._context.folder, self._window).open()

    def open_shortcuts(self, groups: Sequence[tuple[str, Keys]]) -> None:
        """Show keys in groups, each under its heading."""
        from underfoot.widgets.dialogs.shortcuts import ShortcutsDialog

        ShortcutsDialog(groups, self._window).open()

    def open_file_error(self, place: FilePlace) -> None:
        """Show the place of an error in a file, instead of the place shown before."""
        from underfoot.widgets.dialogs.file_error_dialog import FileErrorDialog

        for opened in self._window.findChildren(FileErrorDialog):
            opened.close()
        FileErrorDialog(place, self._window).open()
