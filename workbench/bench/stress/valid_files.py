"""A valid file of every kind that the program reads, and its reader."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from msgspec.structs import replace

from underfoot.bench.stress import corruption
from underfoot.calibration.files.measurements import read_presses
from underfoot.devices.plate import PlateCalibration
from underfoot.engine.commands import Level, Play, to_text
from underfoot.engine.session_replay import ReplayJob
from underfoot.errors import UnderfootError
from underfoot.experiments.excerpts import Excerpt
from underfoot.experiments.protocol import Protocol
from underfoot.experiments.store import SessionFile
from underfoot.experiments.study import Page, Study
from underfoot.experiments.table import rows_of
from underfoot.experiments.trial_files import read_csv, write_csv
from underfoot.files import read_file
from underfoot.floor.curves import Compensation, Curve
from underfoot.floor.forces import read_forces
from underfoot.floor.layout import Floor, default_floor
from underfoot.floor.profile import Centroid, Fsr, Profile, Response
from underfoot.floor.tile_parameters import TileParameters
from underfoot.nodes import REGISTRY
from underfoot.patch import preset_files
from underfoot.patch.groups import Group, Note
from underfoot.patch.patch import Patch
from underfoot.patch.program import Program
from underfoot.records.recording import Recording
from underfoot.records.recording_writer import Writer

Damage = Callable[[bytes, np.random.Generator], bytes]


@dataclass(frozen=True)
class Kind:
    """A kind of file: `write` makes a valid one, `read` reads all of it, and `damage` is specific to its format."""

    write: Callable[[Path], object]
    read: Callable[[Path], object]
    damage: Damage | None
    """None for an SQLite file, which is damaged in place as well as byte by byte."""
    further: tuple[Callable[[Path], object], ...] = ()
    """Write other whole ones, of which half of those that are damaged are made."""


FLOOR = default_floor(1, 2)
_PROTOCOLS = preset_files.protocols()["detection-threshold"].parent


def tone(frequency_hz: float = 100.0) -> Patch:
    """Return a patch with a tone on every tile, without inputs."""
    patch = Patch(title="tone").add("tone", REGISTRY, frequency=frequency_hz, harmonics=(1.0,), amplitude=4.0)
    return patch.add("tile-output", REGISTRY).connect("tone.out", "tile-output.acceleration", REGISTRY)


def _write_patch(path: Path) -> None:
    """Write a gravel patch with a note, and a nested sub-patch that exposes a parameter."""
    patch = Patch.load(preset_files.patches()["gravel"], REGISTRY)
    ids = tuple(node.id for node in patch.nodes[:6])
    shown = next(f"{node.id}.{name}" for node in patch.nodes[:6] for name in REGISTRY[node.type].parameters)
    outer = Group("outer", (*ids, "note"), "Grains", "teal", True, (40.0, 8.0), (shown,))
    groups = (outer, Group("inner", ids[:2], collapsed=True))
    replace(patch, notes=(Note("note", "from 2 mm on"),), groups=groups).save(path)


def _write_profile(path: Path) -> None:
    knots, forces, slopes = (1000.0, 26_000.0, 51_000.0), (0.0, 250.0, 500.0), (0.01, 0.01, 0.01)
    whole = Compensation(readings=knots, forces_n=forces, slopes=slopes, widths=(3.0,), weights=(0.5, 0.5), creep=0.02)
    curve = Curve(
        family="power", unloaded_reading=1000.0, full_scale_n=500.0, readings=knots, forces_n=forces, slopes=slopes,
        compensation=whole,
    )  # fmt: skip
    corners = ((0.1, 0.1), (-0.1, 0.1), (-0.1, -0.1), (0.1, -0.1))
    response = Response(
        made="2024-05-03", frequencies_hz=(50.0, 100.0), magnitude=(10.0, 12.0), acceleration_per_unit=11.0,
        equaliser=((1.0, 0.1, 0.0, 1.0, -0.5, 0.2),), band_hz=(50.0, 750.0),
    )  # fmt: skip
    parts = (Fsr(made="2024-05-01", sensors=(curve,) * 4), Centroid(made="2024-05-02", sensors_m=corners), response)
    profile = Profile(tile="t1", serial="A7")
    for part in parts:
        profile = profile.with_part(part)
    profile.save(path)


def _read_profile(path: Path) -> None:
    profile = Profile.load(path)
    if profile.fsr is not None:
        profile.force_over_time(np.full((4, 4), 20_000.0), np.arange(4.0))
    if profile.centroid is not None:
        profile.position(np.full((4, 4), 100.0))
    np.isfinite(profile.equaliser)


def default_answers(page: Page) -> dict[str, Any]:
    """Return the answers to a page: consent, and the defaults of its questions."""
    return {"agreed": "yes"} if page.kind == "consent" else {asked.name: asked.default for asked in page.questions}


def _write_session(path: Path) -> None:
    protocol = Protocol.load(preset_files.protocols()["identification-impact"])
    file = SessionFile.create(path, protocol, "P1", preset_files.protocols()["identification-impact"].parent)
    study = Study(protocol, "P1")
    for number in range(12):
        force = Excerpt("force", 0, 96.0, 1000.0, ("t1.1", "t1.2"), np.full((50, 2), float(number)))
        file.add(study.answer(default_answers(study.page)), [force])
    file.add_note("heel, not sole")
    file.close()


def _read_session(path: Path) -> None:
    file = SessionFile.open(path)
    try:
        entries, protocol = file.entries(), file.stored_protocol()
        rows_of(protocol, file.participant, entries)
        file.patches(), file.notes()
        for number in range(len(entries)):
            file.excerpts(number + 1)
        file.study(protocol)
    finally:
        file.close()


def _write_recording(path: Path) -> None:
    about = {
        "patch": tone().dumps().decode(), "floor": FLOOR.dumps().decode(), "rate": "48000", "force_rate": "1000.0",
        "target": "simulator", "channels": "[0, 1]", "corrections": "[]",
    }  # fmt: skip
    writer = Writer(path, about)
    for first in range(0, 9600, 2400):
        for table in ("vibration", "commanded", "measured"):
            writer.put(table, first, np.full((2400, 2), 0.25, np.float32))
    samples = np.zeros((200, 10))
    samples[:, 0] = samples[:, 1] = 48.0 * np.arange(200)
    writer.put("force", 0, samples)
    writer.command(0, *to_text(Play(True)))
    for frame in (480, 4800):
        writer.command(frame, *to_text(Level(-20.0)))
    writer.close()


def _read_recording(path: Path) -> None:
    with Recording(path) as recording:
        recording.force_samples(), recording.vibration(), recording.commands(), recording.gaps()
        recording.acceleration("commanded"), recording.acceleration("measured")
    ReplayJob(path).run()


def _write_forces(path: Path) -> None:
    sensors = [f"{tile}.{sensor}" for tile in FLOOR.ids for sensor in range(1, 5)]
    table = np.column_stack([np.arange(60) / 1000.0, np.full((60, 8), 100.0)])
    np.savetxt(path, table, "%.6f", ",", header=",".join(["time_s", *sensors]), comments="")


def _write_presses(path: Path) -> None:
    table = ["tile,x_m,y_m,force_n,r1,r2,r3,r4", *(f"t1,0.{k:02},-0.{k:02},{100 + k},1,2,3,4" for k in range(20))]
    path.write_text("\n".join(table))


def _write_trials(path: Path) -> None:
    rows = [{"participant": "P1", "method": "rating", "trial": k + 1, "rating": 10.0 * k} for k in range(10)]
    write_csv(path, rows)


def _write_sound(path: Path) -> None:
    import soundfile

    with path.open("wb") as file:
        soundfile.write(file, np.sin(np.arange(4800) * 0.05), 22_050, format="WAV")


def _read_sound(path: Path) -> None:
    patch = Patch().add("wav-player", REGISTRY, file=path.name).add("tile-output", REGISTRY)
    patch = patch.connect("wav-player.out", "tile-output.acceleration", REGISTRY)
    program = Program(patch, REGISTRY, FLOOR.ids, rate=48_000.0, block=256, folder=path.parent)
    program.run(0, 256)
    if not np.isfinite(program.output).all():
        raise AssertionError("a sound file brings a value that is not finite")


def _preset(files: dict[str, Path], name: str) -> Callable[[Path], object]:
    return lambda path: path.write_bytes(files[name].read_bytes())


def _again(document: Patch | Floor | TileParameters | Protocol) -> None:
    """Check that a document that was read can be written."""
    document.dumps()


KINDS: dict[str, Kind] = {
    "patch": Kind(
        _write_patch,
        lambda path: _again(Patch.load(path, REGISTRY)),
        corruption.corrupt_document,
        tuple(_preset(preset_files.patches(), name) for name in preset_files.patches()),
    ),
    "floor": Kind(FLOOR.save, lambda path: _again(Floor.load(path)), corruption.corrupt_document),
    "profile": Kind(_write_profile, _read_profile, corruption.corrupt_document),
    "simulation": Kind(
        TileParameters().save, lambda path: _again(TileParameters.load(path)), corruption.corrupt_document
    ),
    "protocol": Kind(
        _preset(preset_files.protocols(), "detection-threshold"),
        lambda path: _again(Protocol.loads(read_file(path), str(path), _PROTOCOLS)),
        corruption.corrupt_document,
    ),
    "session of a study": Kind(_write_session, _read_session, None),
    "recording": Kind(_write_recording, _read_recording, None),
    "force CSV": Kind(_write_forces, lambda path: read_forces(path, FLOOR), corruption.corrupt_table),
    "plate": Kind(
        PlateCalibration(positions=(0.0, 0.5, 1.0), stiffness_n_mm=(40.0, 80.0, 160.0)).save,
        PlateCalibration.load,
        corruption.corrupt_document,
    ),
    "presses CSV": Kind(_write_presses, read_presses, corruption.corrupt_table),
    "trials CSV": Kind(_write_trials, read_csv, corruption.corrupt_table),
    "sound file": Kind(_write_sound, _read_sound, corruption.corrupt_head),
}
"""All kinds, by name."""


def read_error(kind: Kind, path: Path) -> str | None:
    """Return the error that refuses a file; None if it is accepted. Other exceptions pass through."""
    try:
        kind.read(path)
    except UnderfootError as error:
        return str(error)
    return None
