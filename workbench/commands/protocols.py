"""Protocols on the command line: a preset's name, or a file."""

from pathlib import Path
from typing import TYPE_CHECKING

from underfoot.errors import BadFile

if TYPE_CHECKING:
    from underfoot.experiments.protocol import Protocol


def opened_protocol(named: str) -> "tuple[Protocol, Path]":
    """The protocol of a preset's name or in a file, and the folder where its patches lie; `BadFile` for none."""
    from underfoot.experiments.protocol import Protocol
    from underfoot.nodes import REGISTRY
    from underfoot.patch import library

    presets = library.protocols()
    path = presets.get(named, Path(named))
    if not path.is_file():
        raise BadFile(f"there is no protocol {named!r}; allowed: a file, or {', '.join(presets)}")
    return Protocol.load(path, REGISTRY), path.parent
