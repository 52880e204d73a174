"""Export of a recording from the window: file dialog, export in a process, progress, and stop."""

from pathlib import Path

from PySide6.QtCore import QTimer, Signal
from PySide6.QtWidgets import QComboBox, QDialog, QDialogButtonBox, QFileDialog, QGridLayout, QWidget

from underfoot.engine.child_process import ChildProcess
from underfoot.engine.export_process import ExportRequest
from underfoot.engine.survey_process import Progress
from underfoot.records.exports import VIBRATION, formats
from underfoot.widgets import theme

POLL_MS = 100
_ONE_KIND = (".wav", ".mat")
_WORDS = {
    "commanded": "commanded acceleration, m/s²",
    "measured": "measured acceleration, m/s²",
    "vibration": "drive of the shakers, of full scale",
}


class ExportDialog(QDialog):
    """Choice of the format, and of the vibration signal if the format has only one; lists what the format omits."""

    wanted = Signal(str, str)
    """Suffix, and one of `VIBRATION`."""

    def __init__(self, parent: QWidget) -> None:
        super().__init__(parent)
        self.setWindowTitle("Export a recording")
        self.format, self.vibration = QComboBox(), QComboBox()
        self.format.setAccessibleName("Format")
        self.vibration.setAccessibleName("Vibration")
        for suffix, one in formats().items():
            self.format.addItem(one.title.partition(":")[0], suffix)
        self.format.setCurrentIndex(self.format.findData(".csv"))
        for source in VIBRATION:
            self.vibration.addItem(_WORDS[source], source)
        self.vibration.setCurrentIndex(VIBRATION.index("measured"))
        self.about, self.omissions = theme.label(), theme.label("", "muted")
        for label in (self.about, self.omissions):
            label.setWordWrap(True)
            label.setFixedWidth(52 * theme.GRID)
        self._vibration_label = theme.label("Vibration")
        buttons = QDialogButtonBox(QDialogButtonBox.StandardButton.Save | QDialogButtonBox.StandardButton.Cancel)
        buttons.button(QDialogButtonBox.StandardButton.Save).setText("Choose a file…")
        buttons.accepted.connect(self._accept)
        buttons.rejected.connect(self.reject)
        grid = QGridLayout(self)
        grid.setContentsMargins(*[2 * theme.GRID] * 4)
        grid.setVerticalSpacing(theme.GRID)
        grid.addWidget(theme.label("Format"), 0, 0)
        grid.addWidget(self.format, 0, 1)
        grid.addWidget(self.about, 1, 1)
        grid.addWidget(self.omissions, 2, 1)
        grid.addWidget(self._vibration_label, 3, 0)
        grid.addWidget(self.vibration, 3, 1)
        grid.addWidget(buttons, 4, 0, 1, 2)
        self.format.currentIndexChanged.connect(self._show)
        self._show()

    def _show(self) -> None:
        one = formats()[self.format.currentData()]
        about = one.title.partition(":")[2].strip() or one.title
        self.about.setText(f"{about[0].upper()}{about[1:]}.")
        self.omissions.setText(f"Not carried: {one.cannot}.")
        for widget in (self._vibration_label, self.vibration):
            widget.setVisible(one.suffix in _ONE_KIND)
        self.adjustSize()

    def _accept(self) -> None:
        self.wanted.emit(self.format.currentData(), self.vibration.currentData())
        self.accept()


class Exporting(QWidget):
    """Runs one export at a time; its only display is its dialogs."""

    progressed = Signal(str)
    """Carries the current action in words; "" for none."""
    notified = Signal(str)

    def __init__(self, parent: QWidget) -> None:
        super().__init__(parent)
        self.hide()
        self._process: ChildProcess | None = None
        self._folder = ""
        self._source: Path | None = None
        self._timer = QTimer(self)
        self._timer.setInterval(POLL_MS)
        self._timer.timeout.connect(self._poll)

    def is_reading(self, path: Path) -> bool:
        """Whether this recording is being exported."""
        return self.is_busy and self._source == path

    @property
    def is_busy(self) -> bool:
        """Whether a file is being written."""
        return self._process is not None

    def ask(self, source: Path) -> None:
        """Ask for format and file, and export the recording `source`."""
        if self.is_busy:
            self.notified.emit("An export is being written; stop it, or wait until it is done.")
            return
        dialog = ExportDialog(self.window())
        dialog.wanted.connect(lambda suffix, vibration: self._ask_file(source, suffix, vibration))
        dialog.finished.connect(dialog.deleteLater)
        dialog.open()

    def begin(self, source: Path, path: Path, vibration: str) -> None:
        """Export the recording `source` to the file `path`, in a process."""
        self._source = source
        request = ExportRequest(str(source), str(path), vibration)
        self._process = ChildProcess("export", "underfoot.engine.export_process", request)
        self._timer.start()
        self.progressed.emit("Exporting…")

    def stop(self) -> None:
        """Stop the export and delete the partial file."""
        if self._process is not None:
            self._process.send("stop")
            self.progressed.emit("Stopping…")

    def close_down(self) -> None:
        """Stop the export, and wait for the process to end."""
        process, self._process = self._process, None
        self._timer.stop()
        if process is not None:
            process.send("stop")
            process.end(5.0)

    def _ask_file(self, source: Path, suffix: str, vibration: str) -> None:
        name = str(Path(self._folder or source.parent) / f"{source.stem}{suffix}")
        dialog = QFileDialog(
            self.window(), "Export to", name, f"{formats()[suffix].title.partition(':')[0]} (*{suffix})"
        )
        dialog.setAcceptMode(QFileDialog.AcceptMode.AcceptSave)
        dialog.setDefaultSuffix(suffix.removeprefix("."))
        dialog.selectFile(name)
        dialog.fileSelected.connect(lambda path: self._chosen(source, Path(path), vibration))
        dialog.finished.connect(dialog.deleteLater)
        dialog.open()

    def _chosen(self, source: Path, path: Path, vibration: str) -> None:
        self._folder = str(path.parent)
        self.begin(source, path, vibration)

    def _poll(self) -> None:
        process = self._process
        if process is None:
            return
        is_over = not process.is_alive
        for message in process.receive():
            if isinstance(message, Progress):
                self.progressed.emit(f"{message.text}: {100.0 * message.share:.0f} %")
            else:
                self.notified.emit(message)
        if is_over:
            self._timer.stop()
            self._process = None
            process.end(1.0)
            self.progressed.emit("")
