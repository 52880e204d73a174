"""The compiler's process: fills the kernel cache before the engine needs it, and renders previews.

Compiling holds the interpreter for long stretches; here nobody minds. The engine then only loads what is in the cache.
"""

from collections.abc import Callable
from multiprocessing.connection import Connection

import numpy as np

from underfoot.drawing import Drawing
from underfoot.engine.child_process import leave_to_session
from underfoot.engine.kernel_loading import KernelParts
from underfoot.engine.levels import headroom_db
from underfoot.engine.loop import LoopOptions
from underfoot.engine.outlines import outlines
from underfoot.engine.preview import DRIVE, previewed
from underfoot.engine.reports import Compiled, Distributions, ErrorCurveDrawn, Outlines, Preview
from underfoot.engine.requests import CompileRequest, ErrorCurveRequest, OutlinesRequest, PreviewRequest
from underfoot.errors import UnderfootError
from underfoot.floor.tile_parameters import simulation
from underfoot.nodes import REGISTRY
from underfoot.patch.effective import effective_patch
from underfoot.patch.patch import Patch


def run(connection: Connection) -> None:
    """Run the compiler's process until the connection ends. Of requests of a kind that wait, the newest counts."""
    leave_to_session("SIGINT", "SIGHUP")
    program: CompileRequest | None = None
    picture: PreviewRequest | OutlinesRequest | None = None
    distributions: PreviewRequest | None = None
    curve: ErrorCurveRequest | None = None
    try:
        while True:
            is_idle = not connection.poll()
            if is_idle and program is not None:
                connection.send(_compiled(program, connection.send))
                program = None
            elif is_idle and picture is not None:
                if isinstance(picture, PreviewRequest):
                    connection.send(_preview(picture))
                    distributions = picture if picture.distributions else distributions
                else:
                    connection.send(_outlines(picture))
                picture = None
            elif is_idle and distributions is not None:
                connection.send(_distributions(distributions))
                distributions = None
            elif is_idle and curve is not None:
                _measure_errors(curve, connection)
                curve = None
            else:
                request = connection.recv()
                if isinstance(request, CompileRequest):
                    program = request
                elif isinstance(request, ErrorCurveRequest):
                    curve = request
                else:
                    picture = request
    except (EOFError, OSError):
        return  # the supervisor is gone


def _compiled(request: CompileRequest, progress: Callable[[object], None]) -> Compiled:
    target = request.target
    try:
        made_of, _ = simulation(target.simulation)
        options = LoopOptions(target.rate, folder=request.folder, plates=request.plates, simulation=made_of)
        patch = Patch.loads(request.patch, REGISTRY)
        KernelParts(patch, target, options, from_end=request.from_end).load(progress)
    except UnderfootError as error:
        return Compiled(request.ticket, str(error))
    return Compiled(request.ticket)


def _preview(request: PreviewRequest) -> Preview:
    try:
        patch = Patch.loads(request.patch, REGISTRY)
        type = REGISTRY[patch.node(request.node).type]
        scopes = tuple(f"{request.node}.{port.name}" for port in type.outputs)
        force_n, signals, events = previewed(
            patch,
            scopes,
            request.tile,
            request.seconds,
            request.rate,
            request.folder,
            measures=type.is_sink and not type.to_sound,
            equalisers=request.equalisers,
        )
    except UnderfootError as error:
        return Preview(request.ticket, request.rate, np.zeros(0, np.float32), {}, str(error))
    drive_peak = float(np.abs(signals.pop(DRIVE, np.zeros(0))).max(initial=0.0))
    headroom = headroom_db(drive_peak) if drive_peak > 0.0 else None
    signals = {_port(name): frames for name, frames in signals.items()}
    rows = {_port(name): found for name, found in events.items()}
    return Preview(request.ticket, request.rate, force_n, signals, events=rows, headroom_db=headroom)


def _port(name: str) -> str:
    """Return the port of an output "node.port"; other names unchanged."""
    return name.rpartition(".")[2]


def _outlines(request: OutlinesRequest) -> Outlines:
    try:
        patch = Patch.loads(request.patch, REGISTRY)
        signals, events = outlines(patch, request.nodes, request.tile, request.seconds, request.rate, request.folder)
    except UnderfootError:
        return Outlines(request.ticket, {}, {})
    return Outlines(request.ticket, signals, events)


def _measure_errors(request: ErrorCurveRequest, connection: Connection) -> None:
    """Send the node's run time as a function of error after each measured point, until another request comes."""
    from underfoot.engine.error_curve import error_curve

    try:
        node = effective_patch(Patch.loads(request.patch, REGISTRY), REGISTRY).node(request.node)
        for curve in error_curve(REGISTRY[node.type], node.parameters):
            connection.send(ErrorCurveDrawn(request.ticket, curve.drawing(), curve.description(), curve.left))
            if connection.poll():
                return
    except UnderfootError as error:
        connection.send(ErrorCurveDrawn(request.ticket, Drawing("", "", ""), "", error=str(error)))


def _distributions(request: PreviewRequest) -> Distributions:
    try:
        node = effective_patch(Patch.loads(request.patch, REGISTRY), REGISTRY).node(request.node)
        type = REGISTRY[node.type]
        return Distributions(request.ticket, type.drawings(type.values(node.parameters)))
    except UnderfootError as error:
        return Distributions(request.ticket, (), str(error))
