"""`underfoot serve`: a session without a window that sends contacts to other programs, and takes cues from them."""

import math
import time
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import click
from msgspec.structs import replace

from underfoot.clock import once_in
from underfoot.commands.compiling import report_compiling
from underfoot.commands.ending import ended_by_signals
from underfoot.commands.files import FORCES_FLOOR, RUN_CODE, complete_sources, require_outputs_writable
from underfoot.commands.options import SECONDS, command, require_seconds
from underfoot.commands.session_target import LEVEL, RECORD, SessionOptions
from underfoot.commands.telling import tell
from underfoot.devices.transports import target_forms
from underfoot.errors import BadFile, BadValue
from underfoot.options import argument, option, shared
from underfoot.quantities import counted

if TYPE_CHECKING:
    from underfoot.engine.session import Session
    from underfoot.engine.target import Target
    from underfoot.monitoring import LastingRecording
    from underfoot.network.plan import NetworkPlan
    from underfoot.network.server import NetworkServer
    from underfoot.patch.patch import Patch

_WAIT_S, _HEALTH_S = 0.005, 0.5


def _there(context: click.Context, parameter: click.Parameter, value: Path | None) -> Path | None:
    if value is not None and not value.is_dir():
        raise BadValue(f"--patches is {value}; allowed: a folder that is there")
    return value


@dataclass(frozen=True)
class ServeOptions(SessionOptions):
    """Options of the command; None if not given."""

    target: str = argument("walks", shell_complete=complete_sources())
    floor: Path | None = shared(FORCES_FLOOR)
    patch: Path | None = option(
        "The floor's own patch: a file, or a preset's name; by default none.", presets="patches"
    )
    patches: Path | None = option(
        "Folder of patches that cues can play, too, by the names of their files.", callback=_there
    )
    run_code: bool = shared(RUN_CODE)
    record: Path | None = shared(RECORD)
    level: float = shared(LEVEL)
    tuio: str = option("Address for TUIO 1.1 cursors.", "127.0.0.1:3333", show_default=True)
    tuio2: str = option("Address for TUIO 2.0 pointers.", "off", show_default=True)
    listen: str = option("Address at which to listen for cues.", "127.0.0.1:9700", show_default=True)
    send: str = option("Address for contacts, steps, health, marks.", "127.0.0.1:9701", show_default=True)
    lsl: bool = option("Send LSL streams too.", False)
    lsl_marks: bool = option("Take samples of all LSL streams of the type Markers as marks.", False)
    serial_marks: str = option("Take lines of a serial port as marks.", "off", metavar="PORT")
    seconds: float | None = shared(SECONDS)


@command(
    ServeOptions,
    help=f"""Send contacts and steps to other programs, and take cues from them (docs/network.md).

    TARGET is "simulator", simulator:PARAMETERS.json, simulator:people=N,path=PATH, {target_forms(described=True)},
    a force CSV, the preset walk "corridor", a recording, or a C3D file. Each address is HOST:PORT, or "off"; HOST is
    an IPv4 address or localhost.
    """,
)
def serve(options: ServeOptions) -> None:
    """Send contacts and steps to other programs, and play what they request."""
    from underfoot.engine.session import Session
    from underfoot.engine.target import require_source
    from underfoot.monitoring import LastingRecording
    from underfoot.network.lsl_library import lsl_library
    from underfoot.network.plan import NetworkPlan
    from underfoot.network.server import NetworkServer
    from underfoot.nodes import REGISTRY
    from underfoot.patch.patch import Patch

    require_seconds(options.seconds)
    require_outputs_writable(options.record, inputs=(options.target, options.floor, options.patch))
    plan = NetworkPlan.of(
        tuio=options.tuio, tuio2=options.tuio2, listen=options.listen, send=options.send,
        lsl=options.lsl, serial_marks=options.serial_marks, lsl_marks=options.lsl_marks,
    )  # fmt: skip
    target = _target(options)
    require_source(target)
    if plan.lsl or plan.lsl_marks:
        lsl_library()
    patch = Patch.load(options.patch, REGISTRY) if options.patch else Patch(title="serve")
    with ExitStack() as stack, report_compiling():
        session = Session(target, patch, REGISTRY, options.patch.parent if options.patch else None)
        stack.callback(session.close)
        server = NetworkServer(plan, target.floor, target.rate, session.force_rate_hz)
        stack.callback(server.close)
        for line in plan.warnings():
            tell(f"warning: {line}")
        tell("; ".join(_enabled_outputs(plan)))
        recording = LastingRecording(session, options.record)
        _run(session, server, patch, options, recording, stack)
        failure = recording.end()
        if failure:
            raise BadFile(failure)


def _run(
    session: "Session",
    server: "NetworkServer",
    patch: "Patch",
    options: ServeOptions,
    recording: "LastingRecording",
    stack: ExitStack,
) -> None:
    """Serve until the time is over, or a signal ends it."""
    from underfoot.engine.commands import Level
    from underfoot.floor.step_finder import StepFinder
    from underfoot.monitoring import messages_of
    from underfoot.network.cue_player import CuePlayer

    floor, rate = session.target.floor, session.target.rate
    finder = StepFinder(floor, session.force_rate_hz)

    def panic() -> None:
        if session.playing:
            tell("panic, by a cue: nothing plays until serve is started again")
        session.panic()

    player = CuePlayer(session, server, patch, panic, options.patches)
    stopped: list[bool] = []
    stack.enter_context(ended_by_signals(lambda: stopped.append(True)))
    session.send(Level(options.level))
    session.start()
    end_frame = math.inf if options.seconds is None else options.seconds * rate
    is_due, problem = once_in(_HEALTH_S), ""
    while session.health.frame < end_frame and not stopped:
        reports = session.poll()
        for line in (line for report in reports for line in messages_of(report, session.health)):
            tell(line)
        if problem != server.problem:
            problem = server.problem
            tell(problem or "all is sent and taken again")
        if begun := recording.poll():
            tell(begun)
        player.tick(reports)
        frames, forces = session.force.read()
        health = session.health
        if len(frames):
            found = finder.feed(frames / rate, forces)
            last_s = float(frames[-1]) / rate
            ago_s = health.frame / rate - last_s
            server.show(last_s, ago_s, finder.ongoing())
            server.send_force(last_s, ago_s, (forces - finder.baseline_n).sum(axis=2))
            for step in found.steps:
                server.send_step(step, health.frame / rate - step.start_s)
        if is_due():
            server.send_health(health, session.why_silent)
        time.sleep(_WAIT_S)
    for line in finder.warnings():
        tell(line)
    counts = server.counts
    last = f", the last one because {counts.reason}" if counts.reason else ""
    sent, received = counted(counts.sent, "datagram"), counted(counts.received, "cue")
    tell(f"{sent} sent, {received} received, {counts.refused} refused{last}")


def _target(options: ServeOptions) -> "Target":
    from underfoot.engine.target import Target, live_target, sound_device
    from underfoot.floor.layout import Floor
    from underfoot.monitoring import require_forces_file
    from underfoot.records.force_files import floor_of

    sound = sound_device(options.sound)
    live = live_target(options.target, options.floor, options.sensor_rate)
    if live is not None:
        return replace(live, sound=sound, profiles=str(options.profiles or ""))
    require_forces_file("TARGET", options.target, options.profiles)
    floor = Floor.load(options.floor) if options.floor else floor_of(options.target)
    return Target(floor, kind="replay", source=options.target, sound=sound)


def _enabled_outputs(plan: "NetworkPlan") -> list[str]:
    """Return what is sent and taken, and where, in words."""
    enabled = {
        f"TUIO 1.1 to {plan.tuio}": plan.tuio,
        f"TUIO 2.0 to {plan.tuio2}": plan.tuio2,
        f"cues at {plan.listen}": plan.listen,
        f"messages to {plan.send}": plan.send,
        "LSL streams": plan.lsl,
        "marks by LSL": plan.lsl_marks,
        f"marks from {plan.serial_marks}": plan.serial_marks,
    }
    return [words for words, is_on in enabled.items() if is_on] or ["nothing is sent and nothing is taken"]
