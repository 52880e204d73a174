"""Files of custom nodes, `nodes/TYPE.py` beside a patch, as bytes; and those that this process has run.

This module imports nothing heavy, so that a process that only starts others does not load numpy first.
"""

import hashlib
from functools import cached_property
from pathlib import Path

from msgspec import Struct

FOLDER = "nodes"
"""Name of their folder, beside the patch."""


class NodeFile(Struct, frozen=True, dict=True):
    """File of a custom node, as it was read.

    >>> NodeFile("nodes/squeak.py", b"").type
    'squeak'
    """

    path: str
    source: bytes

    @property
    def type(self) -> str:
        """Type of the node that it has to declare."""
        return Path(self.path).stem

    @cached_property
    def sha256(self) -> str:
        """Hash by which consent is remembered."""
        return hashlib.sha256(self.source).hexdigest()


RUNNING: dict[str, NodeFile] = {}
"""Files that this process has run, by type (`underfoot.patch.custom_nodes`)."""


def running() -> tuple[NodeFile, ...]:
    """Return the files that this process has run; child processes run them without asking."""
    return tuple(RUNNING.values())


def has_nodes(folder: Path) -> bool:
    """Return whether patches in `folder` may have custom nodes."""
    return (folder / FOLDER).is_dir()
