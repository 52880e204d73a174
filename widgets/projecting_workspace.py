"""Workspaces that have a window for a projector."""

from PySide6.QtWidgets import QWidget

from underfoot.widgets.controls.true_scale import Placement, TrueScaleWindow
from underfoot.widgets.session.settings import Settings
from underfoot.widgets.workspace import Workspace


class ProjectingWorkspace(Workspace):
    """A workspace that has a window at true scale for a projector: `projection`, while it is open.

    Its placement is read from `_settings` by who makes the window, and kept there from then on.
    """

    def __init__(self, settings: Settings, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._settings = settings
        self.projection: TrueScaleWindow | None = None

    def _follow_projection(self, projection: TrueScaleWindow) -> None:
        """Keep the placement that the user gives to a new `projection`, and forget the window when it is closed."""
        projection.adjusted.connect(self._save_placement)
        projection.closed.connect(self._forget_projection)

    def _close_projection(self) -> None:
        if self.projection is not None:
            self.projection.close()

    def _save_placement(self, placement: Placement) -> None:
        self._settings.placement = placement

    def _forget_projection(self) -> None:
        self.projection = None
        self.window().activateWindow()
