"""The page of a study: what it is, how a session of it begins, and what was found."""

from PySide6.QtCore import Qt
from PySide6.QtGui import QResizeEvent
from PySide6.QtWidgets import QVBoxLayout, QWidget

from underfoot.experiments.duration import about, usual_s, usual_trials
from underfoot.experiments.method import ListedMethod
from underfoot.experiments.methods import METHODS
from underfoot.experiments.protocol import Protocol
from underfoot.experiments.study import all_stages
from underfoot.quantities import counted, pretty_text
from underfoot.widgets import theme
from underfoot.widgets.experiment.session_start import SessionStart
from underfoot.widgets.experiment.studies import StudyFile
from underfoot.widgets.experiment.study_findings import StudyFindings

LOW_PX = 84 * theme.GRID
"""Height below which drawings and tables are side by side."""


class StudyOverview(QWidget):
    """Shows a study's title and stages, the row that begins a session, and the findings."""

    def __init__(self, start: SessionStart, findings: StudyFindings) -> None:
        super().__init__()
        self.title, self.facts = theme.paragraph("", "title"), theme.paragraph()
        self.about, self.state = theme.paragraph("", "muted"), theme.paragraph("", "muted")
        self._findings = findings
        column = QVBoxLayout(self)
        column.setContentsMargins(theme.MARGINS)
        column.setSpacing(theme.GRID)
        for part in (self.title, self.about, self.facts, start, findings.buttons, self.state):
            column.addWidget(part)
        column.addWidget(findings.results, 1)
        start.stated.connect(self.state.setText)
        findings.stated.connect(self.state.setText)

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Place tables beside the drawings if the window is low."""
        super().resizeEvent(event)
        self._findings.arrange(Qt.Orientation.Vertical if self.height() > LOW_PX else Qt.Orientation.Horizontal)

    def show_study(self, study: StudyFile) -> None:
        """Show the title and the stages of a study."""
        self.title.setText(study.title)
        self.about.setText(pretty_text(study.protocol.about))
        self.facts.setText(f"{facts_of(study.protocol)}  ·  orders by seed {study.protocol.seed}")


def facts_of(protocol: Protocol) -> str:
    """Return a protocol's stages in words, in one line, and how long they take."""
    lines: list[str] = []
    for stage in protocol.order():
        if stage.method is None:
            words = {"consent": "consent", "read": "instruction", "learn": "learning", "level": "level"}
            lines.append(words.get(stage.kind, stage.kind) + (f", {stage.seconds:.0f}\xa0s" if stage.seconds else ""))
            continue
        method = METHODS[stage.method.kind]
        is_known = issubclass(method, ListedMethod) or "trials" in method.parameters or stage.most_trials
        count = f"{'' if is_known else 'some '}{counted(usual_trials(protocol, stage)[0], 'trial')}"
        practice = ", practice" if stage.practice else ""
        begun = f", begun by {stage.start}" if method.uses_stimuli else ""
        lines.append(f"{method.name[0].lower()}{method.name[1:]}: {count}{practice}{begun}")
    if protocol.participant:
        lines.insert(1 if lines[0] == "consent" else 0, "questions about the participant")
    return "  ·  ".join([*lines, about(sum(usual_s(protocol, stage) for stage in all_stages(protocol, "1")))])
