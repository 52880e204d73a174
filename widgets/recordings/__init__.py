"""The Recordings workspace: recordings on a time axis, their steps, and export to other programs."""

from PySide6.QtWidgets import QWidget

from underfoot.widgets.workspace import Workspace, WorkspaceContext, WorkspaceDeclaration


def _make(context: WorkspaceContext, parent: QWidget) -> Workspace:
    from underfoot.widgets.recordings.workspace import RecordingsWorkspace

    return RecordingsWorkspace(context.settings, parent)


WORKSPACE = WorkspaceDeclaration(
    name="Recordings", key="Ctrl+5", icon="recordings", package=__name__, make=_make, suffixes=(".underfoot", ".uf")
)
