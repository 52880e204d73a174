"""Moves deleted files to the desktop's trash, from which they can be restored."""

from pathlib import Path

from PySide6.QtCore import QDir, QFile, QStandardPaths


def move_to_trash(path: Path) -> bool:
    """Move a file to the trash, and return whether it is gone from its place.

    Qt makes the trash, but not the folder of the user's data around it: a home that no desktop has used has none.
    """
    QDir().mkpath(QStandardPaths.writableLocation(QStandardPaths.StandardLocation.GenericDataLocation))
    QFile.moveToTrash(str(path))
    return not path.exists()
