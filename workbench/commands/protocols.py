"""Protocols on the command line: a preset's name, or a file."""

from pathlib import Path
from typing import TYPE_CHECKING

from underfoot.errors import BadFile
from underfoot.files import names_file, no_file

if TYPE_CHECKING:
    from underfoot.experiments.protocol import Protocol


def opened_protocol(named: str, conditions: Path | None = None) -> "tuple[Protocol, Path]":
    """Return the protocol of a preset or of a file, and the folder of its patches; raise `BadFile` if there is none.

    With a table `conditions`, the protocol presents these.
    """
    from underfoot.experiments.protocol import Protocol
    from underfoot.patch import preset_files

    presets = preset_files.protocols()
    path = presets.get(named, Path(named))
    if not path.is_file():
        if names_file(named):
            raise BadFile(f"{named} cannot be read: {no_file(path)}")
        raise BadFile(f"there is no protocol {named!r}; allowed: a file, or {', '.join(presets)}")
    protocol = Protocol.load(path)
    if conditions is None:
        return protocol, path.parent
    from underfoot.experiments.conditions import with_conditions

    return with_conditions(protocol, path.parent, conditions)
