"""The About dialog: version, licence, libraries, and the program's folders."""

import html
import platform
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from PySide6.QtCore import Qt
from PySide6.QtGui import QShowEvent
from PySide6.QtWidgets import QApplication, QDialogButtonBox, QLabel, QWidget

import underfoot
from underfoot.files import cache_folder
from underfoot.version import __version__
from underfoot.widgets import theme
from underfoot.widgets.controls.dialog import Dialog

LIBRARIES = ("PySide6-Essentials", "numpy", "scipy", "numba", "sounddevice", "soundfile", "pyserial", "msgspec")


class AboutDialog(Dialog):
    """`folder` is where settings, profiles and unsaved work are kept."""

    def __init__(self, folder: Path, parent: QWidget | None = None) -> None:
        super().__init__("About Underfoot", parent)
        self._text = "\n".join((f"Underfoot {__version__}", *_system(), *_folders(folder)))
        layout = self.column(theme.GRID)
        layout.addWidget(theme.label(f"Underfoot {__version__}", "title"))
        layout.addWidget(theme.label("A workbench for vibrotactile floors: design, calibrate, monitor, experiment."))
        layout.addWidget(theme.label("Its systems are those of Yon Visell's thesis “Walking on virtual ground”."))
        layout.addWidget(theme.label("MIT licence: use it, change it, pass it on; it comes without warranty.", "muted"))
        layout.addWidget(_documentation())
        for line in (*_system(), *_folders(folder)):
            shown = theme.paragraph(line, "small")
            shown.setTextInteractionFlags(shown.textInteractionFlags().TextSelectableByMouse)
            layout.addWidget(shown)
        buttons = self.button_row(QDialogButtonBox.StandardButton.Close)
        copy = buttons.addButton("Copy for a report", QDialogButtonBox.ButtonRole.ActionRole)
        copy.clicked.connect(lambda: QApplication.clipboard().setText(self._text))
        layout.addSpacing(theme.GRID)
        layout.addWidget(buttons)
        self.setFixedWidth(70 * theme.GRID)

    def showEvent(self, event: QShowEvent) -> None:
        # All of it: on a small screen Qt would open it lower, and cut its lines.
        layout = self.layout()
        assert layout is not None
        self.setFixedHeight(layout.totalHeightForWidth(self.width()))
        super().showEvent(event)


def _documentation() -> QLabel:
    """Return a link to the documentation: the built site, or else the pages beside the sources."""
    sources = Path(underfoot.__file__).resolve().parent.parent
    places = (sources / "site" / "index.html", sources / "docs")
    is_checkout = (sources / "mkdocs.yml").is_file()  # else beside it are other people's packages
    found = next((place for place in places if place.exists()), None) if is_checkout else None
    link = "the pages in docs, beside the sources"
    if found is not None:
        link = f'<a href="{found.as_uri()}">{html.escape(str(found))}</a>'
    shown = theme.paragraph(f"Documentation: {link}", "muted")
    shown.setTextFormat(Qt.TextFormat.RichText)
    shown.setOpenExternalLinks(True)
    return shown


def _system() -> list[str]:
    libraries = ", ".join(f"{name} {_version(name)}" for name in LIBRARIES)
    return [f"Python {platform.python_version()} on {platform.platform(terse=True)}", libraries]


def _folders(folder: Path) -> list[str]:
    return [f"Settings, profiles and unsaved work: {folder}", f"Compiled kernels: {cache_folder()}"]


def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return "unknown"
