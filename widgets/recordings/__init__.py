"""The Recordings workspace: recordings on a time axis, their steps, and export to other programs."""

from underfoot.widgets.workspace import Workspace, WorkspaceContext, WorkspaceDeclaration


def _make(context: WorkspaceContext) -> Workspace:
    from underfoot.widgets.recordings.workspace import RecordingsWorkspace

    return RecordingsWorkspace(context.settings)


WORKSPACE = WorkspaceDeclaration(
    name="Recordings", key="Ctrl+5", icon="recordings", package=__name__, make=_make, suffixes=(".underfoot", ".uf")
)
