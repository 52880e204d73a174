"""Files of this computer that are dragged, or were copied."""

from pathlib import Path

from PySide6.QtCore import QMimeData


def local_files(data: QMimeData | None) -> list[Path]:
    """Return the local files that are dragged, or were copied in a file manager; an empty clipboard has no data."""
    return [Path(url.toLocalFile()) for url in data.urls() if url.isLocalFile()] if data is not None else []
