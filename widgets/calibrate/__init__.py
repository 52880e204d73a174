"""The Calibrate workspace: any procedure, one page per step, and each tile's profile."""

from PySide6.QtWidgets import QWidget

from underfoot.widgets.workspace import Workspace, WorkspaceContext, WorkspaceDeclaration


def _make(context: WorkspaceContext, parent: QWidget) -> Workspace:
    from underfoot.calibration.procedures import CALIBRATIONS
    from underfoot.widgets.calibrate.workspace import CalibrateWorkspace

    return CalibrateWorkspace(context.folder / "profiles", context.settings, CALIBRATIONS, parent=parent)


WORKSPACE = WorkspaceDeclaration(name="Calibrate", key="Ctrl+3", icon="calibrate", package=__name__, make=_make)
