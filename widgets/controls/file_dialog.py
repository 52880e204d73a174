"""File dialogs: the desktop's own, or Qt's with the program's buttons if there is none."""

from collections.abc import Callable
from pathlib import Path

import platformdirs
from PySide6.QtCore import QSize, Qt
from PySide6.QtWidgets import QFileDialog, QSplitter, QToolButton, QWidget

from underfoot.widgets import theme
from underfoot.widgets.controls.dialog import room_for

_BUTTON_ICONS = {
    "backButton": "arrow-left",
    "forwardButton": "arrow-right",
    "toParentButton": "arrow-up",
    "newFolderButton": "folder-new",
    "listModeButton": "list",
    "detailModeButton": "details",
}
"""Qt's names of its buttons, and their pictures."""
ended_in: list[Path] = []
"""The folders of what was chosen, the last one first; Qt itself remembers where a dialog began."""


def documents_folder() -> Path:
    """Return the folder of the window's recordings, and of what else a person keeps without having chosen another."""
    return Path(platformdirs.user_documents_dir()) / "Underfoot"


def ask_save(
    parent: QWidget, title: str, name: str, filter: str, suffix: str, then: Callable[[Path], object]
) -> QFileDialog:
    """Ask for a file to be written, `name` to begin with, and call `then` with its path; return the dialog.

    A name that is typed without a suffix gets `suffix`.
    """
    dialog = file_dialog(parent, title, name, filter)
    dialog.setAcceptMode(QFileDialog.AcceptMode.AcceptSave)
    dialog.setDefaultSuffix(suffix.removeprefix("."))
    dialog.fileSelected.connect(lambda path: then(Path(path)))
    dialog.open()
    return dialog


def ask_file(parent: QWidget, title: str, filter: str, then: Callable[[Path], object], folder: str = "") -> QFileDialog:
    """Ask for a file that is there, and call `then` with its path; return the dialog, which is open."""
    dialog = file_dialog(parent, title, folder, filter)
    dialog.setFileMode(QFileDialog.FileMode.ExistingFile)
    dialog.fileSelected.connect(lambda name: then(Path(name)))
    dialog.open()
    return dialog


def file_dialog(parent: QWidget, title: str, folder: str = "", filter: str = "") -> QFileDialog:
    """Return a dialog that shows the files that match `filter`; it is deleted when it closes.

    It begins in `folder`, or with a file in it. What is not absolute is in the folder where the last dialog ended, and
    of the first one in the documents', as far as that is there: the working directory may be any.
    """
    documents = documents_folder()
    there = (place for place in (*ended_in, documents, *documents.parents) if place.is_dir())
    dialog = QFileDialog(parent, title, str(next(there, documents) / folder), filter)
    dialog.filesSelected.connect(lambda paths: ended_in.insert(0, Path(paths[0]).parent))
    dialog.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
    for name, icon in _BUTTON_ICONS.items():
        button = dialog.findChild(QToolButton, name)
        if isinstance(button, QToolButton):
            button.setIcon(theme.icon(icon, theme.TEXT))
    splitter = dialog.findChild(QSplitter, "splitter")
    if isinstance(splitter, QSplitter):  # wide enough for folders and dates
        dialog.resize(QSize(100 * theme.GRID, 60 * theme.GRID).boundedTo(room_for(dialog)))
        splitter.setSizes([18 * theme.GRID, 80 * theme.GRID])
    return dialog
