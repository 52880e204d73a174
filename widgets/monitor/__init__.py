"""The Monitor workspace: the floor from above, forces, vibration and footsteps, live."""

from PySide6.QtWidgets import QWidget

from underfoot.widgets.workspace import Workspace, WorkspaceContext, WorkspaceDeclaration


def _make(context: WorkspaceContext, parent: QWidget) -> Workspace:
    from underfoot.widgets.monitor.workspace import MonitorWorkspace

    return MonitorWorkspace(parent)


WORKSPACE = WorkspaceDeclaration(name="Monitor", key="Ctrl+2", icon="monitor", package=__name__, make=_make)
