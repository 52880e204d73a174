"""The Design workspace: palette, canvas, inspector and preview of one patch."""

from PySide6.QtWidgets import QWidget

from underfoot.widgets.workspace import Workspace, WorkspaceContext, WorkspaceDeclaration


def _make(context: WorkspaceContext, parent: QWidget) -> Workspace:
    from underfoot.widgets.design.workspace import DesignWorkspace

    return DesignWorkspace(context.registry, parent)


WORKSPACE = WorkspaceDeclaration(
    name="Design", key="Ctrl+1", icon="design", package=__name__, make=_make, focus="canvas"
)
