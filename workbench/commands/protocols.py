"""Protocols on the command line: a preset's name, or a file."""

from pathlib import Path
from typing import TYPE_CHECKING

from underfoot.errors import BadFile

if TYPE_CHECKING:
    from underfoot.experiments.protocol import Protocol


def opened_protocol(named: str, conditions: Path | None = None) -> "tuple[Protocol, Path]":
    """The protocol of a preset's name or in a file, and the folder where its patches lie; `BadFile` for none.

    With a table of `conditions` these are presented, and patches lie beside it.
    """
    from underfoot.experiments.protocol import Protocol
    from underfoot.nodes import REGISTRY
    from underfoot.patch import preset_files

    presets = preset_files.protocols()
    path = presets.get(named, Path(named))
    if not path.is_file():
        raise BadFile(f"there is no protocol {named!r}; allowed: a file, or {', '.join(presets)}")
    protocol = Protocol.load(path, REGISTRY)
    if conditions is None:
        return protocol, path.parent
    from underfoot.experiments.conditions import with_conditions

    return with_conditions(protocol, conditions, REGISTRY), conditions.parent
