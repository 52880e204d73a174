"""Exports the patch to a format of another program; lists the formats and what each omits."""

from collections.abc import Callable
from functools import partial
from pathlib import Path

from PySide6.QtCore import Qt
from PySide6.QtWidgets import (
    QComboBox,
    QHBoxLayout,
    QListWidget,
    QListWidgetItem,
    QPushButton,
    QVBoxLayout,
    QWidget,
)

from underfoot.exchange.format import Export, Format
from underfoot.exchange.formats import WRITTEN
from underfoot.exchange.losses import losses
from underfoot.quantities import pretty_text
from underfoot.widgets import theme
from underfoot.widgets.controls.dialog import Dialog
from underfoot.widgets.controls.panels import progress_bar
from underfoot.widgets.dialogs.file_chooser import FileChooser
from underfoot.widgets.polled_process import PolledProcess

STEP, WALK = "one step over one tile", "a walk over this floor"


class ExportDialog(Dialog):
    """Asks for a format and a file, and has a process beside write it. Closing stops that.

    `export(walks)` is what is to be written, on one step or on a walk over the floor; `name` is what files are called.
    """

    def __init__(self, export: Callable[[bool], Export], name: str, file_chooser: FileChooser, parent: QWidget) -> None:
        super().__init__("Export", parent)
        self._export, self._name, self._file_chooser = export, name, file_chooser
        self._writing = PolledProcess("export", self)
        self._writing.received.connect(self._show_answer)
        self._writing.ended.connect(lambda _: self._stop("The process that wrote it died; export again."))
        self._path = Path()
        self.formats = QListWidget()
        self.formats.setAccessibleName("Formats")
        self.formats.setFixedWidth(32 * theme.GRID)
        self.formats.setSpacing(4)
        for one in WRITTEN:
            item = QListWidgetItem(f"{one.label}  {', '.join(suffix for suffix in one.suffixes if suffix)}")
            item.setData(Qt.ItemDataRole.UserRole, one)
            self.formats.addItem(item)
        self.note = theme.paragraph("", "muted")
        self.losses_title = theme.label("", "heading")
        self.losses = QListWidget()
        self.losses.setAccessibleName("What will be lost")
        self.losses.setWordWrap(True)
        self.losses.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self.losses.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self.playing_note = QComboBox()
        self.playing_note.setAccessibleName("What it plays on")
        self.playing_note.addItems([STEP, WALK])
        self.progress = progress_bar("Writing", 2)
        self.progress.setRange(0, 0)
        self.message = theme.paragraph("", "small")
        self.write = QPushButton("Export…")
        self.write.setProperty("role", "primary")
        self.write.setDefault(True)
        self.write.setMinimumWidth(12 * theme.GRID)
        self.write.clicked.connect(self._start_or_stop)
        self.formats.currentItemChanged.connect(lambda *_: self._show_format())
        self._lay_out()
        self.formats.setCurrentRow(0)
        self.resize(104 * theme.GRID, 64 * theme.GRID)
        self.formats.setFocus()

    def _lay_out(self) -> None:
        played = QHBoxLayout()
        played.addWidget(theme.label("It plays on"))
        played.addWidget(self.playing_note)
        played.addStretch()
        right = QVBoxLayout()
        right.setSpacing(theme.GRID)
        for widget in (self.note, self.losses_title, self.losses):
            right.addWidget(widget)
        right.addLayout(played)
        middle = QHBoxLayout()
        middle.setSpacing(2 * theme.GRID)
        middle.addWidget(self.formats)
        middle.addLayout(right, 1)
        close = QPushButton("Close")
        close.setAutoDefault(False)
        close.clicked.connect(self.close)
        below = QHBoxLayout()
        below.addWidget(self.message, 1)
        below.addWidget(close)
        below.addWidget(self.write)
        column = self.column(theme.GRID)
        column.addLayout(middle, 1)
        column.addWidget(self.progress)
        column.addLayout(below)

    @property
    def format(self) -> Format:
        """The format that is chosen."""
        chosen: Format = self.formats.currentItem().data(Qt.ItemDataRole.UserRole)
        return chosen

    def done(self, result: int) -> None:
        """Stop the export; Esc, Close and the frame's button all end here."""
        self._stop("")
        super().done(result)

    def _show_format(self) -> None:
        """Show what the chosen format omits."""
        self.note.setText(f"{self.format.note[:1].upper()}{self.format.note[1:]}.")
        lines = losses(self._export(False).patch, self.format.carries)
        self.losses_title.setText("WHAT WILL BE LOST" if lines else "NOTHING WILL BE LOST")
        self.losses.clear()
        self.losses.addItems([pretty_text(line) for line in lines])
        self._show_busy(False)  # no other can be chosen while one is written
        self.message.setText("")

    # --- writing ---

    def _start_or_stop(self) -> None:
        if self._writing.is_running:
            self._stop("Stopped; nothing was written.")
            return
        suffix = self.format.suffix
        patterns = " ".join(f"*{suffix}" for suffix in self.format.suffixes if suffix) or "*"
        name = f"{self._name}{suffix}"
        self._file_chooser.ask(
            f"Export to {self.format.label}", f"{self.format.label} ({patterns})", self.begin, name, suffix, self
        )

    def begin(self, path: Path) -> None:
        """Write this file; a process beside does it."""
        walks = self.playing_note.currentText() == WALK or "parameters" in self.format.carries
        write = self.format.write
        assert write is not None
        self._path = path
        self._writing.begin(partial(write, self._export(walks), path))
        self._show_busy(True)
        self.message.setText("Playing and writing, in another process; the first time compiles for up to a minute…")

    def _show_answer(self, answers: list[tuple[str, ...] | str]) -> None:
        answer = answers[0]
        self._stop(answer if isinstance(answer, str) else "\n".join([f"Written: {self._path}", *answer]))

    def _stop(self, message: str) -> None:
        self._writing.stop()
        self._show_busy(False)
        self.message.setText(message)

    def _show_busy(self, busy: bool) -> None:
        self.progress.setVisible(busy)
        self.formats.setDisabled(busy)
        self.playing_note.setDisabled(busy or "parameters" in self.format.carries)  # such a format is not played
        self.write.setText("Stop" if busy else "Export…")
