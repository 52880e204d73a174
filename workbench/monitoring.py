"""Stream of contacts and footsteps of a source, as printed and written by `underfoot monitor`."""

import math
import os
import shutil
import time
from collections.abc import Iterable, Iterator
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from msgspec.structs import replace
from numpy.typing import NDArray

from underfoot.clock import once_in
from underfoot.devices.accelerometers import LINK, accelerometers_of
from underfoot.devices.transports import target_forms
from underfoot.engine.reports import (
    NOTHING,
    SOUND_CARD,
    Compiling,
    EngineStopped,
    Fault,
    Health,
    Notice,
    OutputChanged,
    PatchRefused,
    ProcessDied,
    Report,
    Started,
)
from underfoot.engine.session import Session
from underfoot.engine.target import Target, live_target, require_source, sound_device
from underfoot.errors import BadFile, BadValue, DeviceError
from underfoot.files import no_file
from underfoot.floor.contacts import SILENT_S
from underfoot.floor.footsteps import Step
from underfoot.floor.layout import Floor
from underfoot.floor.step_finder import CHUNK, Detections, StepFinder
from underfoot.floor.tile_response import ResponseTotals
from underfoot.nodes import REGISTRY
from underfoot.patch.patch import Patch
from underfoot.records.force_files import forms_or_walks, read_force_file, require_as_many_tiles
from underfoot.records.recording import Recording, is_recording
from underfoot.records.recording_format import SUFFIXES, name_now
from underfoot.records.survey import RecordedForces
from underfoot.records.tables import step_columns

AGAIN_S, ROOM_BYTES = 300.0, 1 << 30
"""Seconds after which a recording that has ended is followed by another one, and room for ten minutes of 48 tiles."""
_WAIT_S = 0.02
_Piece = tuple[NDArray[np.float64], NDArray[np.float64]]
"""Times (n,) in seconds, and corner forces (n, tiles, 4) in newtons."""
_TURNED_N = 100.0
"""Below minus this load, and with a fifth of it above 0, forces are probably those on the foot."""


@dataclass(frozen=True)
class StreamOptions:
    """Equipment of a session besides its source: profiles, sample rate of hardware, sound card, accelerometers."""

    profiles: Path | None
    sensor_hz: float | None
    sound: str | None
    accelerometers: str

    def of(self, target: Target) -> Target:
        """Return the target with this equipment; `BadValue` for invalid accelerometers."""
        sound = sound_device(self.sound)
        heard = accelerometers_of(self.accelerometers, target.floor)
        if sound is None and any(one.channel != LINK for one in heard):
            raise BadValue(
                "--accelerometers are on inputs of a sound card; allowed: with --sound DEVICE, or over the link"
            )
        return replace(target, profiles=str(self.profiles or ""), sound=sound, accelerometers=heard)


class FileStream:
    """Stream of a force table, or of a `recording` with what is noted of its steps, as fast as possible."""

    is_live = False
    """Whether it cannot be had again."""
    failure = ""
    """Failure that did not end the stream, reported at the end."""

    def __init__(
        self,
        pieces: Iterable[_Piece],
        floor: Floor,
        rate_hz: float,
        seconds: float | None,
        recording: Recording | None = None,
    ) -> None:
        self.floor = floor
        self._recording = recording
        self.notes = None if recording is None else recording.notes()
        self._pieces, self._seconds = pieces, math.inf if seconds is None else seconds
        self._finder = StepFinder(floor, rate_hz)
        self._stopped = False
        self._steps = 0
        self._range_n: tuple[float, float] | None = None
        """The least and the largest load of a tile."""

    def __iter__(self) -> Iterator[Detections]:
        for time_s, force_n in self._chunks():
            loads = force_n.sum(axis=2)
            known, (least_n, most_n) = loads[np.isfinite(loads)], self._range_n or (0.0, 0.0)
            self._range_n = float(known.min(initial=least_n)), float(known.max(initial=most_n))
            yield self._counted(self._finder.feed(time_s, force_n))
        yield self._counted(self._finder.finish())

    def _chunks(self) -> Iterator[_Piece]:
        end_s = math.inf
        for time_s, force_n in self._pieces:
            end_s = min(end_s, float(time_s[0]) + self._seconds)
            kept = int(np.searchsorted(time_s, end_s))
            for at in range(0, kept, CHUNK):
                if self._stopped:
                    return
                end = min(at + CHUNK, kept)
                yield time_s[at:end], force_n[at:end]
            if kept < len(time_s):
                return

    def _counted(self, found: Detections) -> Detections:
        self._steps += len(found.steps)
        return found if self.notes is None else replace(found, steps=self.notes.on(found.steps))

    def stop(self) -> None:
        """Stop after the present chunk."""
        self._stopped = True

    def close(self) -> None:
        """Close the recording."""
        if self._recording is not None:
            self._recording.close()

    def warnings(self) -> list[str]:
        """Return warnings about the data."""
        return [*self._finder.warnings(), *self._doubts()]

    def _doubts(self) -> Iterator[str]:
        """Yield what speaks for another unit or the other sign: forces that no walk has."""
        if self._stopped or self._range_n is None:
            return
        least, most = self._range_n
        loaded = f"the tiles' loads are {least:.4g} to {most:.4g} N"
        if -least > _TURNED_N and -least > 5.0 * most:
            yield f"{loaded}: a press is positive; are these of the other sign?"
        elif not self._steps:
            yield f"no steps found: {loaded}"


class SessionStream:
    """Stream of a running session, in real time. `DeviceError` if nothing can be played."""

    is_live = True
    failure = ""
    notes = None

    def __init__(self, target: Target, seconds: float | None, record: Path | None, patch: Path | None) -> None:
        self.floor = target.floor
        self._seconds = math.inf if seconds is None else seconds
        self._rate = target.rate
        played = Patch.load(patch, REGISTRY) if patch else Patch(title="monitor")
        folder = patch.parent if patch else None
        self._session = Session(target, played, REGISTRY, folder, is_edited=False)
        self._finder = StepFinder(target.floor, self._session.force_rate_hz)
        self._record = record
        self._stopped = False
        self._response = ResponseTotals(len(target.floor.tiles)) if target.accelerometers else None

    def __iter__(self) -> Iterator[Detections]:
        session = self._session
        if self._record is not None:
            session.record(self._record)
        session.start()
        now = 0.0
        messages: list[str] = []
        while now < self._seconds and not self._stopped:
            try:
                for report in session.poll():
                    messages += messages_of(report, session.health)
            except DeviceError as error:
                if not now:
                    raise
                self.failure = str(error)  # what was found until then is kept
                break
            if self._response is not None:
                self._response.feed(*session.response.read()[1:])
            frames, forces = session.force.read()
            if len(frames):
                now = float(frames[-1]) / self._rate
            else:  # nothing more may arrive
                now = max(now, session.played_s - SILENT_S)
                time.sleep(_WAIT_S)
            if len(frames) or messages:
                kept = frames / self._rate < self._seconds
                yield replace(self._finder.feed(frames[kept] / self._rate, forces[kept]), messages=tuple(messages))
                messages.clear()
        if self._response is not None:
            messages += self._response.lines(self.floor)
        yield replace(self._finder.finish(), messages=tuple(messages))

    def stop(self) -> None:
        """Stop as soon as possible."""
        self._stopped = True

    def close(self) -> None:
        """End the session; afterwards `failure` also says whether its recording is incomplete."""
        self.failure = recording_failure(self._session, self._record) or self.failure
        self._session.close()

    def warnings(self) -> list[str]:
        """Return warnings about the data."""
        return self._finder.warnings()


def messages_of(report: Report, health: Health) -> Iterator[str]:
    """Yield the messages of a report to the user; `DeviceError` for an engine that cannot begin, or is given up."""
    match report:
        case OutputChanged(text, where) if where == NOTHING:
            raise DeviceError(text)
        case OutputChanged(text):
            yield text
        case EngineStopped(text) | PatchRefused(text) if not health.running and not health.frame:
            raise DeviceError(text)
        case Started(where, notice) if notice:
            yield notice if where == SOUND_CARD else f"{notice}; going on without sound"
        case Notice(text) if text:
            yield text
        case Compiling(ready, total):
            yield f"first use: preparing kernels and plates: {ready} of {total} parts ready"
        case ProcessDied(process, reason, is_restarted=True):
            yield f"the {process} was lost and is started again: {reason}"
        case Fault(node, tile, frame):
            yield f"node {node} made a value that is not finite, on tile {tile} at frame {frame}"


def recording_failure(session: Session, path: Path | None) -> str:
    """End a command's recording, if there is one; return why its file is not whole, or ""."""
    if path is None:
        return ""
    if session.recording is None:  # the session has said why
        return f"{path} was not recorded to the end"
    return "; ".join(session.stop_recording())


class LastingRecording:
    """The recording to `path`, if that is not None, of a command that may run for months.

    Where it ends, as on a full disk, another one begins beside it, named by the time, once there is room.
    """

    def __init__(self, session: Session, path: Path | None) -> None:
        self._session, self._path, self._failure, self._is_due = session, path, "", once_in(AGAIN_S)
        if path is not None:
            session.record(path)

    def poll(self) -> str:
        """Begin another recording if it is time; return a line that says so, or ""."""
        if self._path is None or self._session.recording is not None or not self._is_due():
            return ""
        folder = self._path.parent
        try:
            if shutil.disk_usage(folder).free < ROOM_BYTES:
                return ""
        except OSError:  # it is gone, as a disk that was unplugged
            return ""
        self._failure = self._failure or recording_failure(self._session, self._path)
        self._path = folder / f"{name_now()}{SUFFIXES[0]}"
        self._session.record(self._path)
        return f"the recording goes on in {self._path}"

    def end(self) -> str:
        """End it; return why its first file is not whole, or the last one, or ""."""
        return self._failure or recording_failure(self._session, self._path)


def require_forces_file(argument: str, source: str, profiles: Path | None) -> None:
    """Raise `BadFile` if a source that is neither simulator nor hardware is no file, and `BadValue` for profiles."""
    if not os.path.isfile(source):
        simulators = "simulator, simulator:PARAMETERS.json, simulator:people=N,path=PATH"
        allowed = f"{simulators}, {target_forms()}, {forms_or_walks()}"
        raise BadFile(f"{source} cannot be read: {no_file(source)} ({argument} is {allowed})")
    if profiles is not None:
        raise BadValue(f"--profiles is for tiles that send readings; {source} is in newtons")


def open_stream(
    source: str,
    floor: Path | None,
    seconds: float | None,
    pace: bool,
    record: Path | None,
    patch: Path | None,
    equipment: StreamOptions,
) -> FileStream | SessionStream:
    """Open the stream of a simulator ("simulator", with ":" and its kind), hardware, a force CSV, or a recording."""
    live = live_target(source, floor, equipment.sensor_hz)
    if live is not None:
        target = equipment.of(live)
        require_source(target)
        return SessionStream(target, seconds, record, patch)
    require_forces_file("SOURCE", source, equipment.profiles)
    if equipment.sound is not None or equipment.accelerometers:
        raise BadValue(f"--sound and --accelerometers are for a simulator and for hardware; {source} is a file")
    path, given = Path(source), Floor.load(floor) if floor else None
    if is_recording(path):
        if pace or record is not None or patch is not None:
            allowed = "--floor, --steps, --contacts, --seconds and --json"
            raise BadValue(f"{source} is a recording; allowed with it: {allowed}")
        return _recorded(path, given, seconds)
    forces, layout = read_force_file(path, given)
    if pace or record is not None or patch is not None:
        target = Target(layout, kind="replay", source=str(path), repeats=False)
        return SessionStream(target, min(forces.seconds, seconds or math.inf), record, patch)
    return FileStream([(forces.time_s, forces.force_n)], layout, forces.rate_hz, seconds)


def _recorded(path: Path, floor: Floor | None, seconds: float | None) -> FileStream:
    """Open a recording, of any length, as a stream; `BadFile` for none, and for another number of tiles."""
    with ExitStack() as unless_read:
        recording = unless_read.enter_context(Recording(path))
        forces = RecordedForces(recording)
        require_as_many_tiles(path, forces.floor, floor)
        if recording.ends("force")[1] is None:
            raise BadFile(f"{path} holds no force samples: it was ended before the first")
        stream = FileStream(forces.pieces(), floor or forces.floor, forces.rate_hz, seconds, recording)
        unless_read.pop_all()
    return stream


def step_line(step: Step) -> str:
    """Return a footstep as a readable line."""
    return (
        f"{step.step:4d}  {step.start_s:9.3f} s  {step.tile:>6}  {step.side:7}  {step.contact_ms:6.0f} ms  "
        f"{step.peak1_n:6.0f} {step.valley_n:6.0f} {step.peak2_n:6.0f} N  {step.impulse_ns:6.1f} N s  "
        f"{_figure(step.loading_kn_s, '6.1f')} kN/s{' (spike)' if step.spike else ''}"
        f"  person {step.person}{_length(step)}{step.left_out and f'  left out: {step.left_out}'}"
    )


def _figure(value: float, form: str) -> str:
    """Return a formatted number, or a dash of the same width if it is missing."""
    text = f"{value:{form}}"
    return "–".rjust(len(text)) if math.isnan(value) else text


def _length(step: Step) -> str:
    return f"  {step.step_length_mm:4.0f} mm" if math.isfinite(step.step_length_mm) else ""


def step_figures(step: Step, *, recorded: bool = False) -> dict[str, Any]:
    """Return a footstep as data, by the columns of its table; missing figures are None."""
    values = {name: column[0].item() for name, column in step_columns([step], recorded=recorded).items()}
    return {name: None if value != value else value for name, value in values.items()}
