"""Profiling of a block in a process of its own, while the window goes on."""

from contextlib import suppress
from dataclasses import dataclass
from multiprocessing.connection import Connection
from pathlib import Path

from underfoot.bench.block_stages import block_stages
from underfoot.engine.child_process import leave_to_session
from underfoot.errors import UnderfootError
from underfoot.floor.layout import Floor
from underfoot.floor.profile import profiles_of
from underfoot.nodes import REGISTRY
from underfoot.patch.patch import Patch


@dataclass(frozen=True)
class CostRequest:
    """What to measure. `profiles` and `folder` are paths, "" for none."""

    patch: bytes
    floor: Floor
    feet: int
    block: int
    profiles: str = ""
    folder: str = ""
    simulated: bool = False


def run(connection: Connection, request: CostRequest) -> None:
    """Send `BlockStages`, or a line with the reason of a failure; the main function of the process."""
    leave_to_session("SIGINT")
    answer: object
    try:
        answer = block_stages(
            Patch.loads(request.patch, REGISTRY),
            request.floor,
            feet=request.feet,
            block=request.block,
            profiles=profiles_of(request.profiles, request.floor),
            folder=Path(request.folder) if request.folder else None,
            simulated=request.simulated,
        )
    except UnderfootError as error:
        answer = str(error)
    with suppress(OSError):  # nobody waits any more
        connection.send(answer)
