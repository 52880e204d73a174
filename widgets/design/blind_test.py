"""The blind test of A and B, which covers the whole window so that nothing identifies the patch being played."""

import time
from collections.abc import Callable, Sequence
from datetime import datetime
from functools import partial
from pathlib import Path

from PySide6.QtCore import QEvent, QObject, Qt
from PySide6.QtGui import QCloseEvent, QKeyEvent
from PySide6.QtWidgets import (
    QFormLayout,
    QHBoxLayout,
    QLayout,
    QLineEdit,
    QPushButton,
    QSpinBox,
    QStackedWidget,
    QVBoxLayout,
    QWidget,
)

from underfoot.errors import UnderfootError
from underfoot.experiments.blind_comparison import MOST_TRIALS, BlindComparison, chance_p
from underfoot.experiments.trial_files import write_csv
from underfoot.files import make_folder
from underfoot.widgets import theme
from underfoot.widgets.escape import claims_escape
from underfoot.widgets.session.listening import Listening, gain_text
from underfoot.widgets.session.open_patch import SLOTS

TRIALS = 16
"""Number of trials; of 16, twelve right answers have p = 0.038 by chance."""


class BlindTest(QWidget):
    """Covers its parent. Each answer is stored on disk, in a table of trials in `folder`, before the next trial."""

    def __init__(self, listening: Listening, titles: tuple[str, str], folder: Path, parent: QWidget) -> None:
        """Create the test. `titles` of A and B are stored in the table, and not shown."""
        super().__init__(parent)
        self.setAttribute(Qt.WidgetAttribute.WA_StyledBackground)
        self.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        self.setProperty("role", "ground")
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self._listening, self._titles, self._folder = listening, titles, folder
        self.comparison: BlindComparison | None = None
        self.path: Path | None = None
        self._began_s, self._plays = 0.0, 0
        self._pages = QStackedWidget(self)
        for page in (self._first_page(), self._trial_page(), self._last_page()):
            self._pages.addWidget(page)
        middle = QHBoxLayout(self)
        middle.addStretch(1)
        middle.addWidget(self._pages, 2)
        middle.addStretch(1)
        self._parent_widget = parent
        parent.installEventFilter(self)

    def open(self) -> None:
        """Cover the parent, and ask for the participant's id."""
        self.setGeometry(self._parent_widget.rect())
        self.show()
        self.raise_()
        self.participant.setFocus()

    def warn(self, text: str) -> None:
        """Show a warning on the first page; the test can be started nevertheless."""
        self.complaint.setText(text)

    # --- pages ---

    def _first_page(self) -> QWidget:
        self.participant, self.trials, self.seed = QLineEdit("P01"), QSpinBox(), QSpinBox()
        for box in (self.trials, self.seed):
            box.lineEdit().setTextMargins(theme.GRID, 0, theme.GRID, 0)  # a style sheet does not pad the field itself
        self.trials.setRange(1, MOST_TRIALS)
        self.trials.setValue(TRIALS)
        self.seed.setRange(0, 2**31 - 1)
        self.seed.setValue(int(time.time()) % 100_000)
        self.seed.setToolTip("The same seed and participant draw the same X again")
        form = QFormLayout()
        for label, field in (("Participant", self.participant), ("Trials", self.trials), ("Seed", self.seed)):
            field.setAccessibleName(label)
            form.addRow(theme.label(label, "muted"), field)
        self.begin_button, leave = _button("Begin", self.begin, "primary"), _button("Cancel", self.close)
        self.complaint = theme.label("", "alarm")
        text = theme.label(
            "X is A or B, drawn anew in each trial. Play A, B and X as often as you like, then say which X is.\n"
            "What is played, its pictures and its names are hidden until the end."
        )
        return _page("Is X A or B?", [text, form, self.complaint], [self.begin_button, leave])

    def _trial_page(self) -> QWidget:
        self.progress = theme.label("", "title")
        self.plays = {
            name: _button(f"Play {name}   ({key})", partial(self.play, name))
            for name, key in (("A", "1"), ("B", "2"), ("X", "3"))
        }
        self.answers = {
            slot: _button(f"X is {slot}   ({key})", partial(self.answer, slot))
            for slot, key in zip(SLOTS, ("←", "→"), strict=True)
        }
        self.now = theme.label("", "muted")
        playing, answering = QHBoxLayout(), QHBoxLayout()
        for button in self.plays.values():
            playing.addWidget(button)
        for button in self.answers.values():
            answering.addWidget(button)
        hint = theme.label("Esc silences at once. What was answered is kept if you stop.", "small")
        return _page("", [self.progress, playing, self.now, answering, hint], [_button("Stop", self.stop)])

    def _last_page(self) -> QWidget:
        self.result, self.kept = theme.label("", "title"), theme.paragraph("", "muted")
        self.kept.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
        self.close_button = _button("Close", self.close, "primary")
        return _page("", [self.result, self.kept], [self.close_button])

    # --- the test ---

    def begin(self) -> None:
        """Begin the first trial once the levels of A and B are known."""
        if self._listening.is_matched and any(self._listening.level(slot) is None for slot in SLOTS):
            self.complaint.setText("How loud A and B are is not known yet. Wait a moment, or end Match first.")
            return
        facts = {"matched": self._listening.is_matched} | {
            f"gain_{slot.lower()}_db": gain_text(self._listening, slot) for slot in SLOTS
        }
        try:
            a, b = self._titles
            self.comparison = BlindComparison(
                self.participant.text().strip(), self.trials.value(), self.seed.value(), a, b, facts
            )
            make_folder(self._folder)
        except UnderfootError as error:
            self.complaint.setText(str(error))
            return
        self.path = self._folder / f"blind test {datetime.now():%Y-%m-%d %H.%M.%S}.csv"
        self._pages.setCurrentIndex(1)
        self.setFocus()
        self._show_trial()

    def play(self, name: str) -> None:
        """Play A, B or X from the start."""
        if self.comparison is None or self.comparison.is_over:
            return
        self._plays += 1
        self.now.setText(f"{name} plays")
        self._listening.play_blind(self.comparison.x if name == "X" else name)
        if name == "X":
            for button in self.answers.values():
                button.setEnabled(True)

    def answer(self, slot: str) -> None:
        """Store the answer that X is this slot, and continue; do nothing before X has been played."""
        if self.comparison is None or self.comparison.is_over or not self.answers[slot].isEnabled():
            return
        self.comparison.answer(slot, time.perf_counter() - self._began_s, self._plays)
        if not self._save_comparison():
            return
        if self.comparison.is_over:
            self._end()
        else:
            self._show_trial()

    def stop(self) -> None:
        """End the test early; the answers are kept."""
        if self.comparison is not None and self.comparison.number > 1:
            self._end()
        else:
            self.close()

    def _save_comparison(self) -> bool:
        assert self.comparison is not None
        assert self.path is not None
        try:
            write_csv(self.path, self.comparison.rows())
        except UnderfootError as error:
            self._end()
            self.kept.setText(str(error))
            return False
        return True

    def _show_trial(self) -> None:
        assert self.comparison is not None
        self._began_s, self._plays = time.perf_counter(), 0
        self.progress.setText(f"Trial {self.comparison.number} of {self.comparison.trials}")
        self.now.setText("Play X, and A and B")
        for button in self.answers.values():
            button.setEnabled(False)

    def _end(self) -> None:
        assert self.comparison is not None
        self._listening.end_blind()
        done = self.comparison.number - 1
        p = chance_p(self.comparison.right, done)
        self.result.setText(f"{self.comparison.right} of {done} right, p = {p:.3f} by chance")
        a, b = (title or "without a title" for title in self._titles)
        self.kept.setText(
            f"A was {a}, B was {b}. One side of the binomial test. underfoot analyse reads the answers: {self.path}"
        )
        self._pages.setCurrentIndex(2)
        self.close_button.setFocus()

    # --- Qt ---

    def keyPressEvent(self, event: QKeyEvent) -> None:
        keys = {Qt.Key.Key_1: "A", Qt.Key.Key_2: "B", Qt.Key.Key_3: "X"}
        answers = {Qt.Key.Key_Left: "A", Qt.Key.Key_Right: "B"}
        if event.isAutoRepeat():
            event.accept()
        elif self._pages.currentIndex() != 1:
            self._press_on_a_form(event)
        elif event.key() in keys:
            self.play(keys[Qt.Key(event.key())])
        elif event.key() in answers:
            self.answer(answers[Qt.Key(event.key())])
        else:
            event.accept()  # keep the event from the widgets below

    def _press_on_a_form(self, event: QKeyEvent) -> None:
        """Handle a key as in a dialog, before and after the trials."""
        focus = self.focusWidget()
        if event.key() == Qt.Key.Key_Escape:
            self.close()
        elif event.key() in (Qt.Key.Key_Return, Qt.Key.Key_Enter):
            main = self.begin_button if self._pages.currentIndex() == 0 else self.close_button
            (focus if isinstance(focus, QPushButton) else main).click()
        event.accept()

    def event(self, event: QEvent) -> bool:
        # During a trial Escape is panic; otherwise it closes the test.
        return claims_escape(event, lambda: self._pages.currentIndex() != 1) or super().event(event)

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        if event.type() == QEvent.Type.Resize:
            self.setGeometry(self._parent_widget.rect())
        return False

    def closeEvent(self, event: QCloseEvent) -> None:
        self._parent_widget.removeEventFilter(self)
        self._listening.end_blind()
        super().closeEvent(event)


def _page(title: str, parts: Sequence[QWidget | QLayout], buttons: Sequence[QPushButton]) -> QWidget:
    """Return a centred page: a title, parts below one another, and buttons."""
    page = QWidget()
    column = QVBoxLayout(page)
    column.setSpacing(2 * theme.GRID)
    column.addStretch(1)
    if title:
        column.addWidget(theme.label(title, "title"))
    for part in parts:
        if isinstance(part, QWidget):
            column.addWidget(part)
        else:
            column.addLayout(part)
    row = QHBoxLayout()
    for button in buttons:
        row.addWidget(button)
    row.addStretch(1)
    column.addLayout(row)
    column.addStretch(1)
    return page


def _button(text: str, do: Callable[[], object], role: str = "") -> QPushButton:
    button = QPushButton(text)
    if role:
        button.setProperty("role", role)
    button.setFocusPolicy(Qt.FocusPolicy.TabFocus)
    button.clicked.connect(lambda _=False: do())
    return button
