"""C3D: tiles as force plates of type 3, as gait laboratories read them.

A plate's frame has z down: x is the tile's, y is against the tile's. Corners and sensors are in the order that the C3D
manual gives for type 3: (+x, +y), (-x, +y), (-x, -y), (+x, -y) of the plate's frame. Its forces are those of the ground
on the foot, as motion capture systems write them and other programs draw them: those of a press are negative.
"""

import math
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from underfoot.errors import BadFile
from underfoot.files import replaced, written
from underfoot.floor.footsteps import Step
from underfoot.floor.layout import Floor, Tile
from underfoot.records.c3d_files import C3DFile
from underfoot.records.even_samples import even_forces, even_rate
from underfoot.records.exports import ExportFormat, ExportSource

if TYPE_CHECKING:
    import ezc3d

CHANNELS = ("FX12", "FX34", "FY14", "FY23", "FZ1", "FZ2", "FZ3", "FZ4")
"""The channels of a plate of type 3."""
PLATE_SIGNS = np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]])
"""The corners of a plate in its own frame."""
MOST = 255
"""Values along one dimension of a parameter: it is told in a byte. As the C3D manual has it, the 256th and the
following values of LABELS are in LABELS2, the next ones in LABELS3. Of force plates there can be no more."""
MOST_TEXT = 100
"""Bytes that are kept of a mark's text: the longest is the size of all in a parameter, of at most 255 bytes each, and
`MOST` of them must stay within its 32 KiB."""
_INT = 2
"""The type of a whole number in a C3D file, which ezc3d would not choose."""
SAMPLES_A_FRAME = 10
"""Frames of a C3D file are those of cameras: of force there are some samples in each, more where the file is long."""
MOST_FRAMES = 65535
"""Frames of a file, and samples of all channels in one of them: the header tells both in two bytes."""


def sensor_order(tile: Tile) -> tuple[NDArray[np.intp], float, float] | None:
    """Return the order of a tile's sensors on a C3D plate, and their distances (m) from its middle along x and y.

    None if they do not lie in a rectangle about the middle.

    >>> from underfoot.floor.layout import default_floor
    >>> sensor_order(default_floor(1, 1).tiles[0])
    (array([3, 2, 1, 0]), 0.1335, 0.1335)
    """
    places = np.array(tile.sensors_m) * (1.0, -1.0)  # in the plate's frame
    a, b = np.abs(places).mean(axis=0).tolist()
    wanted = PLATE_SIGNS * (a, b)
    away = np.hypot(*np.moveaxis(places[:, None] - wanted, -1, 0))
    order = away.argmin(axis=0)
    if a <= 0.0 or b <= 0.0 or away.min(axis=0).max() > 1e-6 or len(set(order.tolist())) < 4:
        return None
    return order, a, b


def _write(export: ExportSource, path: Path) -> None:
    try:
        import ezc3d
    except ImportError:
        raise BadFile(f"{path} cannot be written: ezc3d is missing; install underfoot[c3d]") from None
    forces = export.forces
    if len(forces.floor.tiles) > MOST:
        raise BadFile(f"{path} would have {len(forces.floor.tiles)} force plates; allowed: up to {MOST}")
    corners, first_s, rate_hz, in_frame = _even(export, path)
    made = ezc3d.c3d()
    made["parameters"]["POINT"]["RATE"]["value"] = [_frame_rate(rate_hz, in_frame)]
    made["parameters"]["POINT"]["UNITS"]["value"] = ["mm"]
    made["parameters"]["POINT"]["LABELS"]["value"] = []
    made["data"]["points"] = np.zeros((4, 0, len(corners) // in_frame))
    labels, analogs = _analogs(forces.floor, corners, path)
    _describe_analogs(made, labels, rate_hz)
    made["data"]["analogs"] = analogs[None]
    _describe_plates(made, forces.floor)
    made.add_parameter("UNDERFOOT", "TILES", list(forces.floor.ids))
    made.add_parameter("UNDERFOOT", "FIRST_S", [export.from_s + first_s])
    made.add_parameter("UNDERFOOT", "BEGUN", [export.begun])
    _add_people_and_events(made, export, first_s)  # last: a byte tells some readers how much there is of parameters
    export.report_progress("Writing", 0.95)
    with replaced(path) as part, written(path):
        named = Path(f"{part}.c3d")  # a name without the suffix would be given it
        try:
            made.write(str(named))
            _tell_size(named)
            _require_whole(named, path)
            named.replace(part)
        finally:
            named.unlink(missing_ok=True)


def _tell_size(named: Path) -> None:
    """Tell the largest size of the parameters that a byte can, if they are longer: ezc3d tells what is over."""
    with named.open("r+b") as file:
        header = file.read(512)
        if int.from_bytes(header[16:18], "little") - 2 > MOST:  # the blocks before the data, without the header's
            file.seek(514)
            file.write(bytes([MOST]))


def _require_whole(named: Path, path: Path) -> None:
    """Raise `BadFile` for a file that is cut: ezc3d does not say that a disk is full."""
    try:
        C3DFile(named)
    except BadFile:
        raise BadFile(f"{path} cannot be written: only a part of it could be; is there room on the disk?") from None


def _even(export: ExportSource, path: Path) -> tuple[NDArray[np.float32], float, float, int]:
    """Corner forces at even times (n, tiles, 4), the time of the first, samples a second, and samples in a frame.

    The last samples of a stretch that fill no frame are left out; otherwise the last sample is held to the end of its
    frame. Zeros would be a foot off.
    """
    forces = export.forces
    pieces = list(export.pieces("Reading forces"))
    if not pieces:
        raise BadFile(f"{export.recording.path} holds no force samples{' there' if export.stretch_s else ''}")
    time_s = np.concatenate([one for one, _ in pieces])
    rate_hz = even_rate(time_s, forces.rate_hz)
    count = round((float(time_s[-1]) - float(time_s[0])) * rate_hz) + 1
    in_frame = max(SAMPLES_A_FRAME, -(-count // MOST_FRAMES))
    channels = len(CHANNELS) * len(forces.floor.tiles)
    if channels * in_frame > MOST_FRAMES:
        most_s = MOST_FRAMES // channels * MOST_FRAMES / rate_hz
        raise BadFile(f"{path} would have {count / rate_hz:.0f} s; allowed: {most_s:.0f} s; export it as .h5")
    corners = even_forces(time_s, np.concatenate([force_n for _, force_n in pieces]), rate_hz, in_frame)
    corners[count:] = corners[count - 1]
    if export.stretch_s is not None and count >= in_frame:
        corners = corners[: count // in_frame * in_frame]
    return corners, float(time_s[0]), rate_hz, in_frame


def _frame_rate(rate_hz: float, in_frame: int) -> float:
    """Return frames a second, as a 32-bit number that is not rounded up: readers divide the rates, and cut.

    >>> 128.0 / float(np.float32(12.8)) < 10.0 <= 128.0 / _frame_rate(128.0, 10)
    True
    """
    sample_rate, frame_rate = float(np.float32(rate_hz)), np.float32(rate_hz / in_frame)
    while sample_rate / float(frame_rate) < in_frame:
        frame_rate = np.nextafter(frame_rate, np.float32(0.0))
    return float(frame_rate)


def _analogs(floor: Floor, corners: NDArray[np.float32], path: Path) -> tuple[list[str], NDArray[np.float64]]:
    """Return names and samples (channels, n) of all plates."""
    labels, values = [], np.zeros((8 * len(floor.tiles), len(corners)))
    for row, tile in enumerate(floor.tiles):
        found = sensor_order(tile)
        if found is None:
            raise BadFile(
                f"{path}: tile {tile.id} is no plate of type 3; allowed: sensors in a rectangle about the middle"
            )
        labels += [f"{tile.id}.{name}" for name in CHANNELS]
        values[8 * row + 4 : 8 * row + 8] -= corners[:, row, found[0]].T
    return labels, values


def _describe_analogs(made: "ezc3d.c3d", labels: list[str], rate_hz: float) -> None:
    analog = made["parameters"]["ANALOG"]
    count = len(labels)
    analog["RATE"]["value"] = [rate_hz]
    analog["GEN_SCALE"]["value"] = [1.0]
    _put(made, "ANALOG", "LABELS", labels)
    _put(made, "ANALOG", "DESCRIPTIONS", ["vertical force" if ".FZ" in label else "not measured" for label in labels])
    _put(made, "ANALOG", "UNITS", ["N"] * count)
    _put(made, "ANALOG", "SCALE", [1.0] * count)
    _put(made, "ANALOG", "OFFSET", [0] * count)


def _describe_plates(made: "ezc3d.c3d", floor: Floor) -> None:
    count = len(floor.tiles)
    corners, origins = np.zeros((3, 4, count)), np.zeros((3, count))
    for row, tile in enumerate(floor.tiles):
        found = sensor_order(tile)
        assert found is not None
        half = np.array(tile.size_m) / 2.0
        corners[:2, :, row] = 1e3 * tile.to_floor(PLATE_SIGNS * half * (1.0, -1.0)).T
        origins[:, row] = 1e3 * found[1], 1e3 * found[2], -1e3 * tile.sensor_depth_m
    plates = made["parameters"]["FORCE_PLATFORM"]
    plates["USED"]["value"] = [count]
    plates["TYPE"]["value"] = [3] * count
    plates["ZERO"]["value"] = [0, 0]
    plates["CORNERS"]["value"] = corners
    plates["ORIGIN"]["value"] = origins
    plates["CHANNEL"]["value"] = np.arange(1, 8 * count + 1).reshape(count, 8).T


def _add_people_and_events(made: "ezc3d.c3d", export: ExportSource, first_s: float) -> None:
    """Add who walked, steps as foot strikes and foot offs, and marks."""
    steps = [step for found in export.found("Looking for steps") for step in found.steps]
    names = [_name(person) for person in sorted({step.person for step in steps} - {0})]
    made.add_parameter("SUBJECTS", "USED", [len(names)])
    made.add_parameter("SUBJECTS", "NAMES", names)
    events = sorted(_events(steps, export.marks()))
    minutes = np.array([math.floor(max(at - first_s, 0.0) / 60.0) for at, *_ in events], np.float64)
    times = np.array([at - first_s for at, *_ in events], np.float64) - 60.0 * minutes
    made.add_parameter("EVENT", "USED", [len(events)])
    if events:
        _put(made, "EVENT", "TIMES", np.stack([minutes, times]))
        _put(made, "EVENT", "LABELS", [label for _, _, label, _, _ in events])
        _put(made, "EVENT", "CONTEXTS", [context for _, context, _, _, _ in events])
        _put(made, "EVENT", "SUBJECTS", [name for _, _, _, name, _ in events])
        _put(made, "EVENT", "DESCRIPTIONS", [text for *_, text in events])


def _name(person: int) -> str:
    return f"Person {person}" if person else ""


def _put(made: "ezc3d.c3d", group: str, name: str, values: list[Any] | NDArray[np.float64]) -> None:
    """Add a parameter with one value per item; split it if there are more than `MOST`."""
    count = np.shape(values)[-1]
    for number, first in enumerate(range(0, count, MOST), 1):
        part = values[..., first : first + MOST] if isinstance(values, np.ndarray) else values[first : first + MOST]
        called = name if number == 1 else f"{name}{number}"
        made.add_parameter(group, called, part)
        if name == "OFFSET":
            made["parameters"][group][called]["type"] = _INT


def _events(steps: list[Step], marks: list[tuple[float, str]]) -> Iterator[tuple[float, str, str, str, str]]:
    for step in steps:
        context = {"left": "Left", "right": "Right"}.get(step.side, "General")
        name, description = _name(step.person), f"step {step.step}, tile {step.tile}"
        yield step.start_s, context, "Foot Strike", name, description
        yield step.start_s + 1e-3 * step.contact_ms, context, "Foot Off", name, description
    for time_s, text in marks:
        yield time_s, "General", "Mark", "", text.encode()[:MOST_TEXT].decode(errors="ignore")


FORMAT = ExportFormat(
    ".c3d",
    "C3D: tiles as force plates of type 3 (eight channels), steps and marks as events",
    "vibration, contacts, commands; forces beyond 32-bit floats; uneven times; lost samples, which are on a line for "
    "up to 40 ms, and longer gaps, which are 0 N; "
    f"texts of marks beyond {MOST_TEXT} bytes; more than {MOST} tiles (needs ezc3d: install underfoot[c3d])",
    _write,
)
