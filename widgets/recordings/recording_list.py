"""The list of recordings: those in the program's folder, and added files and folders."""

import stat
import time
from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from functools import partial
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QItemSelectionModel, QObject, QPoint, QSignalBlocker, QSize, Qt, Signal
from PySide6.QtGui import QColor, QIcon, QPainter, QPixmap
from PySide6.QtWidgets import (
    QFileDialog,
    QHBoxLayout,
    QLineEdit,
    QListWidget,
    QListWidgetItem,
    QPushButton,
    QVBoxLayout,
    QWidget,
)

from underfoot.errors import UnderfootError
from underfoot.files import reason_of
from underfoot.floor.layout import Floor, grid_of
from underfoot.quantities import counted, first_of
from underfoot.records.recording_format import SUFFIXES
from underfoot.records.renaming import use_of
from underfoot.records.summary import Summary, summary_of
from underfoot.widgets import theme
from underfoot.widgets.background import BackgroundWorker, Task
from underfoot.widgets.controls.file_dialog import ask_file, file_dialog
from underfoot.widgets.controls.inline_edit import InlineEdit
from underfoot.widgets.controls.key_names import with_native_keys
from underfoot.widgets.controls.menu import Menu
from underfoot.widgets.controls.question import ask
from underfoot.widgets.controls.trash import move_to_trash
from underfoot.widgets.pictures import blank_picture
from underfoot.widgets.plots.painting import polygon
from underfoot.widgets.recordings.tracks import time_text

NOTHING = "Nothing was recorded yet. Ctrl+R records what is played."
NOT_FOUND = "No recording has these words in its name, date or floor."
MOST_NAMED = 8
"""Recordings whose names are shown before several are deleted."""
BEGINS_S = 60.0
"""Time within which a recording begins whose name an empty file keeps, in this window or another."""
LIST_PX = 35 * theme.GRID
PICTURE = QSize(72, 32)
_ALONE = QItemSelectionModel.SelectionFlag.ClearAndSelect
_PATH = Qt.ItemDataRole.UserRole
_WORDS = Qt.ItemDataRole.UserRole + 1


class Summaries(QObject):
    """Reads the summaries of recordings in sequence, in a thread."""

    found = Signal(object)
    """`Summary`."""
    failed = Signal(object, str)
    """Path, and why it cannot be read."""

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._worker = BackgroundWorker(self)
        self._is_closed = False

    def read(self, paths: Iterable[Path]) -> None:
        """Read these recordings instead of the previous request; do nothing after `close`."""
        self._worker.stop()
        if not self._is_closed:
            self._worker.compute(partial(self._read, list(paths)))

    def close(self) -> None:
        """Stop reading for good; later requests start no thread."""
        self._is_closed = True
        self._worker.stop()
        self._worker.join()

    def _read(self, paths: list[Path], task: Task) -> list[object]:
        for path in paths:
            if task.is_stopped():
                break
            try:
                self.found.emit(summary_of(path))
            except (UnderfootError, OSError) as error:
                self.failed.emit(path, str(error))
        return []


class _Row(QListWidgetItem):
    """A recording, in the order of when it was begun: a mark in an old one writes its file anew.

    Until its summary is read it counts as begun when its file was last written.
    """

    def __init__(self, path: Path, begun_s: float) -> None:
        super().__init__(path.stem)
        self.begun_s = begun_s

    def __lt__(self, other: object) -> bool:
        return isinstance(other, _Row) and self.begun_s < other.begun_s


class RecordingList(QWidget):
    """The list of recordings, newest first; one is selected, or several are, to be compared."""

    chosen = Signal(object)
    """The `Path` of the recording to be opened."""
    compared = Signal(list)
    """Carries the paths of recordings to be compared, the earliest first; of a single one, its feet."""
    notified = Signal(str)
    deleted = Signal(list)
    """Carries the paths of recordings that are about to be deleted, and must be closed."""
    rename_requested = Signal(object, str)
    """Carries the `Path` of a recording, and the new name that was typed."""

    def __init__(self, folder: Callable[[], Path], added: list[str], use_here: Callable[[Path], str]) -> None:
        """Create the list. `folder` returns the program's folder of recordings.

        `added` are further files and folders; `add` appends to it. `use_here` tells why this window cannot delete one
        now, with what to do; "" if it can.
        """
        super().__init__()
        theme.fill(self, "panel")
        self.setFixedWidth(LIST_PX)
        self._folder, self._added, self._use_here = folder, added, use_here
        self.summaries, self.unused = Summaries(self), BackgroundWorker(self)
        self._known: dict[Path, Summary] = {}
        self._rows: dict[Path, _Row] = {}
        self._marked: list[Path] = []
        self.search = QLineEdit()
        self.search.setPlaceholderText("Search by name, date or floor")
        self.search.setAccessibleName("Search recordings")
        self.search.setClearButtonEnabled(True)
        self.list = QListWidget()
        self.list.setAccessibleName("Recordings")
        self.list.setSelectionMode(QListWidget.SelectionMode.ExtendedSelection)
        self.list.setIconSize(PICTURE)
        self.list.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self.list.setTextElideMode(Qt.TextElideMode.ElideRight)
        self.empty_text = theme.paragraph("", "muted")
        self.inline = InlineEdit(self.list.viewport())
        self.problem = theme.paragraph("", "alarm")
        self.problem.hide()
        self.add_file, self.add_folder = QPushButton("Open…"), QPushButton("Folder…")
        self.add_folder.setToolTip("Show the recordings of another folder, too")
        self.delete = QPushButton("Delete…")
        self.delete.setToolTip("Move the chosen recordings to the trash (Delete)")
        self._lay_out()
        self._connect()

    def refresh(self) -> None:
        """Update the list from the folders."""
        paths = self._paths()
        if paths.keys() != self._rows.keys():  # new rows would end a selection by Shift amid it
            self._rebuild(paths)
        self._filter()
        self.summaries.read(paths)

    def _rebuild(self, paths: dict[Path, float]) -> None:
        selected = [item.data(_PATH) for item in reversed(self._items()) if item.isSelected()]  # a search may hide it
        with QSignalBlocker(self.list):
            self.list.clear()
            self._rows = {path: _Row(path, written_s) for path, written_s in paths.items()}
            for path, item in self._rows.items():
                item.setData(_PATH, path)
                item.setSizeHint(QSize(0, 60))
                self.list.addItem(item)
                if path in self._known:
                    self._show(self._known[path])
                else:
                    item.setIcon(_icon(np.zeros(0, np.float32)))
                    item.setToolTip(str(path))
            self._sort()
        self.mark(*selected)

    def add(self, path: Path) -> None:
        """Add a file or folder to the list permanently."""
        path = path.absolute()
        if path not in self._paths() and str(path) not in self._added:
            self._added.append(str(path))
        self.refresh()

    def mark(self, *paths: Path) -> None:
        """Mark the open recording, or those that are compared."""
        self._marked = list(paths)
        items = [item for path in paths if (item := self._rows.get(path.absolute())) is not None]
        with QSignalBlocker(self.list):
            for number, item in enumerate(items):
                how = QItemSelectionModel.SelectionFlag.Select if number else _ALONE
                self.list.setCurrentItem(item, how)
        self.delete.setEnabled(bool(self.chosen_paths()))

    def chosen_path(self) -> Path | None:
        """Return the selected recording; None if none or several are."""
        paths = self.chosen_paths()
        return paths[0] if len(paths) == 1 else None

    def chosen_paths(self) -> list[Path]:
        """Return the selected recordings, the earliest first."""
        return [item.data(_PATH) for item in reversed(self._items()) if item.isSelected() and not item.isHidden()]

    def ask_to_delete(self) -> None:
        """Delete the selected recordings, after a question; none while one of them is in use."""
        paths = self.chosen_paths()
        if use := next(filter(None, map(self._use_here, paths)), ""):
            self.show_problem(use)
        elif paths and not self.unused.is_busy:
            text = f"Move {_named(paths)} to the trash?{_names(paths)}"
            ask(self, "Delete recordings", text, "Move to trash", lambda: self._delete(paths))

    def edit_name(self) -> None:
        """Open a field for the name of the selected recording."""
        item, path = self.list.currentItem(), self.chosen_path()
        if item is None or path is None or self.inline.isVisible():
            return
        self.show_problem("")
        self.list.scrollToItem(item)
        over = self.list.visualItemRect(item).adjusted(PICTURE.width() + theme.GRID, -theme.GRID + 2, 0, 0)
        self.inline.open(over, path.stem, lambda name: self._request_name(path, name))

    def show_renamed(self, old: Path, new: Path) -> None:
        """Show a recording under its new name."""
        self._added[:] = [str(new) if place == str(old) else place for place in self._added]
        self._known.pop(old, None)
        is_chosen = self.chosen_path() == old
        self.refresh()
        if is_chosen:
            self.mark(new)

    def show_problem(self, why: str) -> None:
        """Say below the list why a recording could not be renamed or deleted; "" for no reason."""
        self.problem.setText(why)
        self.problem.setVisible(bool(why))

    def close_down(self) -> None:
        """End the threads."""
        self.summaries.close()
        self.unused.stop()
        self.unused.join()

    # --- files ---

    def _paths(self) -> dict[Path, float]:
        """Return when the recordings in all folders, and the single files, were last written, the latest first."""
        found: dict[Path, float] = {}
        for place in (self._folder(), *map(Path, self._added)):
            files: list[Path] = []
            with suppress(OSError):  # a folder that is away, or that nobody may look into
                files = sorted(place.iterdir()) if place.is_dir() else [place]
            for file in files:
                if file.suffix.lower() in SUFFIXES:
                    with suppress(OSError):  # it went meanwhile: the others are there
                        status = file.stat()
                        keeps_name = status.st_size == 0 and time.time() - status.st_mtime < BEGINS_S
                        if stat.S_ISREG(status.st_mode) and not keeps_name:
                            found[file.absolute()] = status.st_mtime
        return dict(sorted(found.items(), key=lambda one: -one[1]))

    def _request_name(self, path: Path, name: str) -> None:
        if name != path.stem:
            self.rename_requested.emit(path, name)

    def _show_menu(self, at: QPoint) -> None:
        if self.list.itemAt(at) is None:
            return
        menu = Menu(self.list)
        paths = self.chosen_paths()
        menu.addAction("Compare" if len(paths) > 1 else "Compare left and right", lambda: self.compared.emit(paths))
        menu.addAction("Rename…\tF2", self.edit_name).setEnabled(self.chosen_path() is not None)
        menu.addAction("Delete…\tDel", self.ask_to_delete)
        menu.open_once(self.list.viewport().mapToGlobal(at))

    def _delete(self, paths: Sequence[Path]) -> None:
        self.deleted.emit(paths)
        self.unused.compute(lambda task: [(path, use_of(path, "deleted")) for path in paths if not task.is_stopped()])

    def _move_to_trash(self, uses: Sequence[tuple[Path, str]]) -> None:
        """Move to the trash what no other program uses: one that records would go on in a file that nobody finds."""
        self.show_problem("; ".join(first_of([use for _, use in uses if use], 1)))
        paths = [path for path, use in uses if not use]
        left = [path for path in paths if not move_to_trash(path)]
        self._tell_gone([path for path in paths if path not in left], "in the trash")
        if (chosen := self.chosen_path()) is not None and dict(uses).get(chosen):
            self.chosen.emit(chosen)  # it was closed, since the window's own reader counts as one
        if left:
            text = f"There is no trash for {_named(left)}. Delete for good?{_names(left)}"
            ask(self, "Delete recordings", text, "Delete", lambda: self._remove(left))

    def _remove(self, paths: Sequence[Path]) -> None:
        gone, refusals = [], []
        for path in paths:
            try:
                path.unlink()
                gone.append(path)
            except OSError as error:
                refusals.append(f"{path} cannot be deleted: {reason_of(error)}")
        self._tell_gone(gone, "deleted")
        if refusals:  # last: the window shows one line
            self.notified.emit("; ".join(first_of(refusals, 1)))

    def _tell_gone(self, gone: Sequence[Path], where: str) -> None:
        if gone:
            what = f"{gone[0].name} is" if len(gone) == 1 else f"{len(gone)} recordings are"
            self.notified.emit(f"{what} {where}.")
        self.refresh()

    def _ask_file(self) -> None:
        suffixes = "Recordings (*.underfoot *.uf)"
        ask_file(self, "Open a recording", suffixes, self.chosen.emit, str(self._folder()))

    def _ask_folder(self) -> None:
        dialog = file_dialog(self, "A folder of recordings", str(self._folder()))
        dialog.setFileMode(QFileDialog.FileMode.Directory)
        dialog.fileSelected.connect(lambda name: self.add(Path(name)))
        dialog.open()

    # --- display ---

    def _items(self) -> list[_Row]:
        items = (self.list.item(row) for row in range(self.list.count()))
        return [item for item in items if isinstance(item, _Row)]

    def _sort(self) -> None:
        if any(above < below for above, below in pairwise(self._items())):
            self.list.sortItems(Qt.SortOrder.DescendingOrder)

    def update_colours(self) -> None:
        """Redraw the pictures in the current colours."""
        for summary in self._known.values():
            self._show(summary)

    def _add_summary(self, summary: Summary) -> None:
        self._known[summary.path] = summary
        before = self.chosen_paths()
        self._show(summary)
        self._sort()
        if self.search.text():
            self._filter()
        chosen = self.chosen_paths()
        if len(chosen) > 1 and chosen != before:  # another one is the earliest
            self.compared.emit(chosen)

    def _show(self, summary: Summary) -> None:
        item = self._rows.get(summary.path)
        if item is not None:
            item.begun_s = summary.begun.timestamp()
            item.setText(f"{summary.path.stem}\n{summary_text(summary)}")
            item.setToolTip(str(summary.path))
            item.setIcon(_icon(summary.force_n))
            typed = floor_text(summary.floor).replace(" × ", "x")  # no keyboard has the sign
            item.setData(_WORDS, f"{summary.begun:%Y-%m-%d %H:%M %B} {summary.floor.title} {typed}")

    def _show_failure(self, path: Path, why: str) -> None:
        item = self._rows.get(path)
        if item is not None:
            item.setText(f"{path.stem}\ncannot be read")
            item.setToolTip(why)

    def _filter(self) -> None:
        words = self.search.text().casefold().split()
        for item in self._items():
            known = f"{item.text()} {item.data(_WORDS) or ''}".casefold()
            item.setHidden(not all(word in known for word in words))
        self.empty_text.setText(NOT_FOUND if self.list.count() else with_native_keys(NOTHING))
        self.empty_text.setVisible(all(item.isHidden() for item in self._items()))
        self.delete.setEnabled(bool(self.chosen_paths()))

    def _choose(self) -> None:
        paths = self.chosen_paths()
        if not paths:  # a click beside them: what is shown stays marked
            self.mark(*self._marked)
            return
        self._marked = paths
        self.delete.setEnabled(True)
        self.show_problem("")
        if len(paths) == 1:
            self.chosen.emit(paths[0])
        else:
            self.compared.emit(paths)

    def _connect(self) -> None:
        self.unused.found.connect(self._move_to_trash)
        self.summaries.found.connect(self._add_summary)
        self.summaries.failed.connect(self._show_failure)
        self.search.textChanged.connect(self._filter)
        self.list.itemSelectionChanged.connect(self._choose)
        self.list.setContextMenuPolicy(Qt.ContextMenuPolicy.CustomContextMenu)
        self.list.customContextMenuRequested.connect(self._show_menu)
        self.add_file.clicked.connect(self._ask_file)
        self.add_folder.clicked.connect(self._ask_folder)
        self.delete.clicked.connect(self.ask_to_delete)

    def _lay_out(self) -> None:
        line = QHBoxLayout()
        for button in (self.add_file, self.add_folder, self.delete):
            line.addWidget(button)
        column = QVBoxLayout(self)
        column.addWidget(theme.label("RECORDINGS", "heading"))
        column.addWidget(self.search)
        column.addWidget(self.empty_text)
        column.addWidget(self.list, 1)
        column.addWidget(self.problem)
        column.addLayout(line)


def _named(paths: Sequence[Path]) -> str:
    """Return what a question calls these recordings."""
    return f"“{paths[0].stem}”" if len(paths) == 1 else counted(len(paths), "recording")


def _names(paths: Sequence[Path]) -> str:
    """Return the names of several recordings, for below the question about them."""
    return "\n\n" + "\n".join(first_of([path.stem for path in paths], MOST_NAMED)) if len(paths) > 1 else ""


def summary_text(summary: Summary) -> str:
    """Return time and duration, and on a second line the floor and the number of steps."""
    steps = "" if summary.steps is None else f"  ·  {counted(summary.steps, 'step')}"
    when = f"{summary.begun:%d %b %H:%M}".lstrip("0")
    return f"{when}  ·  {time_text(summary.length_s, 1.0)}\n{floor_text(summary.floor)}{steps}"


def floor_text(floor: Floor) -> str:
    """Return a short description of a floor.

    >>> from underfoot.floor.layout import default_floor
    >>> floor_text(default_floor(2, 3))
    '2 × 3'
    """
    grid = grid_of(floor)
    return f"{grid[0]} × {grid[1]}" if grid else counted(len(floor.tiles), "tile")


def _icon(force_n: NDArray[np.float32]) -> QIcon:
    """Return the picture as an icon that looks the same when selected."""
    made, picture = QIcon(), _picture(force_n)
    for mode in (QIcon.Mode.Normal, QIcon.Mode.Selected):
        made.addPixmap(picture, mode)
    return made


def _picture(force_n: NDArray[np.float32]) -> QPixmap:
    """Return a small picture of the largest forces over time."""
    picture = blank_picture(PICTURE, 2.0, QColor(theme.GROUND))
    if len(force_n) and force_n.max() > 0.0:
        painter = QPainter(picture)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(QColor(theme.FORCE))
        x = np.linspace(0.0, PICTURE.width(), len(force_n))
        y = PICTURE.height() - 2.0 - (PICTURE.height() - 5.0) * np.clip(force_n / force_n.max(), 0.0, 1.0)
        ends = np.array([[PICTURE.width(), PICTURE.height()], [0.0, PICTURE.height()]], np.float64)
        painter.drawPolygon(polygon(np.concatenate([np.column_stack([x, y]), ends])))
        painter.end()
    return picture
