"""The Calibrate workspace: any procedure, one page per step, and each tile's profile."""

from underfoot.widgets.workspace import Workspace, WorkspaceContext, WorkspaceDeclaration


def _make(context: WorkspaceContext) -> Workspace:
    from underfoot.widgets.calibrate.catalogue import KINDS
    from underfoot.widgets.calibrate.workspace import CalibrateWorkspace

    return CalibrateWorkspace(context.folder / "profiles", context.settings, KINDS)


WORKSPACE = WorkspaceDeclaration(name="Calibrate", key="Ctrl+3", icon="calibrate", package=__name__, make=_make)
