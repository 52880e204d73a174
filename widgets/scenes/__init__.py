"""The Scenes workspace: the floor as an interactive surface, in the window and on a projector."""

from PySide6.QtWidgets import QWidget

from underfoot.widgets.workspace import Workspace, WorkspaceContext, WorkspaceDeclaration


def _make(context: WorkspaceContext, parent: QWidget) -> Workspace:
    from underfoot.widgets.scenes.workspace import ScenesWorkspace

    return ScenesWorkspace(parent)


WORKSPACE = WorkspaceDeclaration(name="Scenes", key="Ctrl+6", icon="scenes", package=__name__, make=_make)
