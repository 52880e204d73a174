"""The Experiment workspace: choice of a study, the experimenter's page, and the participant's window."""

from PySide6.QtWidgets import QWidget

from underfoot.widgets.workspace import Workspace, WorkspaceContext, WorkspaceDeclaration


def _make(context: WorkspaceContext, parent: QWidget) -> Workspace:
    from underfoot.widgets.experiment.workspace import ExperimentWorkspace

    studies, protocols, presets = (context.folder / name for name in ("studies", "protocols", "presets"))
    return ExperimentWorkspace(studies, protocols, presets, parent)


WORKSPACE = WorkspaceDeclaration(
    name="Experiment", key="Ctrl+4", icon="experiment", package=__name__, make=_make, formats=("underfoot-protocol",)
)
