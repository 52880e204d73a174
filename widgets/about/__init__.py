"""The About workspace: a stub that shows what a workspace needs."""

from underfoot.widgets.workspace import Workspace, WorkspaceContext, WorkspaceDeclaration


def _make(context: WorkspaceContext) -> Workspace:
    from underfoot.widgets.about.workspace import AboutWorkspace

    return AboutWorkspace()


WORKSPACE = WorkspaceDeclaration(name="About", key="Ctrl+4", make=_make)
