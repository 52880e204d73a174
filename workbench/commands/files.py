"""What the commands' options for files have in common."""

import os
from pathlib import Path

import click

from workbench.errors import BadFile

FILE = click.Path(path_type=Path)
"""A file or folder that is named on the command line."""


def require_room(*outputs: Path | None) -> None:
    """Say before the work, and not after it, that what comes of it cannot be written."""
    for path in outputs:
        if path is not None and os.path.isdir(path):
            raise BadFile(f"{path} cannot be written: it is a folder")
        if path is not None and not os.path.isdir(path.parent):
            raise BadFile(f"{path} cannot be written: there is no folder {path.parent}")
