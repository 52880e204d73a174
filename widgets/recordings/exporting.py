"""Export of a recording from the window: file dialog, export in a process, progress, and stop."""

from functools import partial
from pathlib import Path

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QComboBox, QDialogButtonBox, QGridLayout, QWidget

from underfoot.engine.export_process import ExportRequest
from underfoot.engine.survey_process import Progress
from underfoot.quantities import pretty_text
from underfoot.records.exports import VIBRATION, formats
from underfoot.widgets import theme
from underfoot.widgets.controls.dialog import Dialog
from underfoot.widgets.controls.file_dialog import ask_save
from underfoot.widgets.polled_process import PolledProcess
from underfoot.widgets.recordings.tracks import time_text

_ONE_KIND = (".wav", ".mat")
_WORDS = {
    "commanded": "commanded acceleration, m/s²",
    "measured": "measured acceleration, m/s²",
    "vibration": "drive of the shakers, of full scale",
}


Stretch = tuple[float, float]
"""Beginning and end in seconds of a recording."""


class ExportDialog(Dialog):
    """Choice of the stretch, of the format, and of the vibration signal if the format has only one; lists what the
    format omits."""

    wanted = Signal(str, str, object)
    """Suffix, one of `VIBRATION`, and the `Stretch`; None for the whole recording."""

    def __init__(self, parent: QWidget, length_s: float, selection: Stretch | None) -> None:
        """Create the dialog; `selection` is the stretch that is selected in the recording."""
        super().__init__("Export a recording", parent)
        self.stretch, self.format, self.vibration = QComboBox(), QComboBox(), QComboBox()
        self.stretch.setAccessibleName("Stretch")
        self.format.setAccessibleName("Format")
        self.vibration.setAccessibleName("Vibration")
        self.stretch.addItem(f"Whole recording, {time_text(length_s, 0.01)}", None)
        if selection is not None:
            begin, end = (time_text(time_s, 0.001) for time_s in selection)
            self.stretch.addItem(f"Selected stretch, {begin} to {end}", selection)
            self.stretch.setCurrentIndex(1)
        no_selection = theme.paragraph("To export a part, select it first: drag on the ruler.", "muted")
        no_selection.setVisible(selection is None)
        for suffix, one in formats().items():
            self.format.addItem(one.title.partition(":")[0], suffix)
        self.format.setCurrentIndex(self.format.findData(".csv"))
        for source in VIBRATION:
            self.vibration.addItem(_WORDS[source], source)
        self.vibration.setCurrentIndex(VIBRATION.index("measured"))
        self.about, self.omissions = theme.paragraph(), theme.paragraph("", "muted")
        for label in (no_selection, self.about, self.omissions):
            label.setFixedWidth(52 * theme.GRID)
        self._vibration_label = theme.label("Vibration")
        buttons = self.button_row(QDialogButtonBox.StandardButton.Save, QDialogButtonBox.StandardButton.Cancel)
        buttons.button(QDialogButtonBox.StandardButton.Save).setText("Choose a file…")
        grid = QGridLayout(self)
        grid.setContentsMargins(theme.MARGINS)
        grid.setVerticalSpacing(theme.GRID)
        grid.addWidget(theme.label("Stretch"), 0, 0)
        grid.addWidget(self.stretch, 0, 1)
        grid.addWidget(no_selection, 1, 1)
        grid.addWidget(theme.label("Format"), 2, 0)
        grid.addWidget(self.format, 2, 1)
        grid.addWidget(self.about, 3, 1)
        grid.addWidget(self.omissions, 4, 1)
        grid.addWidget(self._vibration_label, 5, 0)
        grid.addWidget(self.vibration, 5, 1)
        grid.addWidget(buttons, 6, 0, 1, 2)
        self.format.currentIndexChanged.connect(self._show)
        self._show()

    def _show(self) -> None:
        one = formats()[self.format.currentData()]
        about = one.title.partition(":")[2].strip() or one.title
        self.about.setText(pretty_text(f"{about[0].upper()}{about[1:]}."))
        self.omissions.setText(pretty_text(f"Not carried: {one.cannot}."))
        for widget in (self._vibration_label, self.vibration):
            widget.setVisible(one.suffix in _ONE_KIND)
        self.adjustSize()

    def accept(self) -> None:
        stretch = self.stretch.currentData()
        self.wanted.emit(
            self.format.currentData(), self.vibration.currentData(), tuple(stretch) if stretch is not None else None
        )
        super().accept()


class Exporting(QWidget):
    """Runs one export at a time; its only display is its dialogs."""

    progressed = Signal(str)
    """Carries the current action in words; "" for none."""
    notified = Signal(str)

    def __init__(self, parent: QWidget) -> None:
        super().__init__(parent)
        self.hide()
        self._process = PolledProcess("export", self, "underfoot.engine.export_process")
        self._process.received.connect(self._take)
        self._process.ended.connect(self._end)
        self._folder = ""
        self._source: Path | None = None

    def is_reading(self, path: Path) -> bool:
        """Whether this recording is being exported."""
        return self.is_busy and self._source == path

    @property
    def is_busy(self) -> bool:
        """Whether a file is being written."""
        return self._process.is_running

    def ask(self, source: Path, length_s: float, selection: Stretch | None) -> None:
        """Ask for stretch, format and file, and export the recording `source`."""
        if self.is_busy:
            self.notified.emit("An export is being written; stop it, or wait until it is done.")
            return
        dialog = ExportDialog(self.window(), length_s, selection)
        dialog.wanted.connect(partial(self._ask_file, source))
        dialog.open()

    def begin(self, source: Path, path: Path, vibration: str, stretch_s: Stretch | None = None) -> None:
        """Export the recording `source`, or a stretch of it, to the file `path`, in a process."""
        self._source = source
        self._process.begin(ExportRequest(str(source), str(path), vibration, stretch_s))
        self.progressed.emit("Exporting…")

    def stop(self) -> None:
        """Stop the export and delete the partial file."""
        if self.is_busy:
            self._process.send("stop")
            self.progressed.emit("Stopping…")

    def close_down(self) -> None:
        """Stop the export, and wait for the process to end."""
        self._process.send("stop")
        self._process.stop(within_s=5.0)

    def _ask_file(self, source: Path, suffix: str, vibration: str, stretch_s: Stretch | None) -> None:
        part = "" if stretch_s is None else " {:.2f}-{:.2f} s".format(*stretch_s)
        name = str(Path(self._folder or source.parent) / f"{source.stem}{part}{suffix}")
        filter = f"{formats()[suffix].title.partition(':')[0]} (*{suffix})"

        def begin(path: Path) -> None:
            self._folder = str(path.parent)
            self.begin(source, path, vibration, stretch_s)

        ask_save(self.window(), "Export to", name, filter, suffix, begin)

    def _take(self, messages: list[Progress | str]) -> None:
        for message in messages:
            if isinstance(message, Progress):
                self.progressed.emit(f"{message.text}: {100.0 * message.share:.0f} %")
            else:
                self.notified.emit(message)

    def _end(self, how: str) -> None:
        if how:  # otherwise it has said how it went
            self.notified.emit(f"The export was lost: its process ended with {how}; export it again.")
        self.progressed.emit("")
