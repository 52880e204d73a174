"""The Design workspace: palette, canvas, inspector and preview of one patch."""

from underfoot.widgets.workspace import Workspace, WorkspaceContext, WorkspaceDeclaration


def _make(context: WorkspaceContext) -> Workspace:
    from underfoot.widgets.design.workspace import DesignWorkspace

    return DesignWorkspace(context.registry)


WORKSPACE = WorkspaceDeclaration(
    name="Design", key="Ctrl+1", icon="design", package=__name__, make=_make, focus="canvas"
)
