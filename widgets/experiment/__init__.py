"""The Experiment workspace: choice of a study, the experimenter's page, and the participant's window."""

from underfoot.widgets.workspace import Workspace, WorkspaceContext, WorkspaceDeclaration


def _make(context: WorkspaceContext) -> Workspace:
    from underfoot.widgets.experiment.workspace import ExperimentWorkspace

    folder = context.folder
    return ExperimentWorkspace(context.registry, folder / "studies", folder / "protocols", folder / "presets")


WORKSPACE = WorkspaceDeclaration(name="Experiment", key="Ctrl+4", icon="experiment", package=__name__, make=_make)
