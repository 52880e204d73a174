"""Files with a custom node, `nodes/TYPE.py` beside a patch, as bytes; and those that this process has run.

Nothing is imported here, so that a process that starts others does not load numpy before them.
"""

import hashlib
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

FOLDER = "nodes"
"""Where they lie, beside the patch."""


@dataclass(frozen=True)
class NodeFile:
    """A file with the node of its name, as it was read.

    >>> NodeFile("nodes/squeak.py", b"").type
    'squeak'
    """

    path: str
    source: bytes

    @property
    def type(self) -> str:
        """The node that it is to declare."""
        return Path(self.path).stem

    @cached_property
    def sha256(self) -> str:
        """What consent is remembered by."""
        return hashlib.sha256(self.source).hexdigest()


RUNNING: dict[str, NodeFile] = {}
"""By type, the files that this process has run (`underfoot.patch.own_nodes`)."""


def running() -> tuple[NodeFile, ...]:
    """The files that this process has run: the processes that it starts are told of them, and ask nobody."""
    return tuple(RUNNING.values())


def has_nodes(folder: Path) -> bool:
    """Whether patches in `folder` may have nodes of their own."""
    return (folder / FOLDER).is_dir()
