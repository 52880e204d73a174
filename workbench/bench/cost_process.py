"""A process that measures where a block's time goes, for a window that goes on meanwhile."""

import signal
from contextlib import suppress
from dataclasses import dataclass
from multiprocessing.connection import Connection
from pathlib import Path

from underfoot.bench.block_stages import block_stages
from underfoot.errors import UnderfootError
from underfoot.floor.layout import Floor
from underfoot.floor.profile import profiles_of
from underfoot.nodes import REGISTRY
from underfoot.patch.patch import Patch


@dataclass(frozen=True)
class CostRequest:
    """What is to be measured. `profiles` and `folder` are paths, "" for none."""

    patch: bytes
    floor: Floor
    feet: int
    block: int
    profiles: str = ""
    folder: str = ""
    simulated: bool = False


def run(connection: Connection, request: CostRequest) -> None:
    """The process's main function: answers with `BlockStages`, or with a line that says why it could not."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for whoever opened the window
    answer: object
    try:
        answer = block_stages(
            Patch.loads(request.patch, REGISTRY),
            REGISTRY,
            request.floor,
            feet=request.feet,
            block=request.block,
            profiles=profiles_of(request.profiles, request.floor) if request.profiles else {},
            folder=Path(request.folder) if request.folder else None,
            simulated=request.simulated,
        )
    except UnderfootError as error:
        answer = str(error)
    with suppress(OSError):  # nobody waits any more
        connection.send(answer)
