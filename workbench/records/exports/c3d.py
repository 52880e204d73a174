"""C3D: tiles as force plates of type 3, as gait laboratories read them.

A plate's frame has z down: x is the tile's, y is against the tile's. Corners and sensors are in the order that the C3D
manual gives for type 3: (+x, +y), (-x, +y), (-x, -y), (+x, -y) of the plate's frame. Its forces are those of the ground
on the foot, as motion capture systems write them and other programs draw them: those of a press are negative.
"""

import math
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from underfoot.errors import BadFile
from underfoot.floor.footsteps import Step
from underfoot.floor.layout import Floor, Tile
from underfoot.records.c3d_files import MOST_FRAMES
from underfoot.records.c3d_plates import PLATE_SIGNS
from underfoot.records.c3d_writing import MOST, MOST_TEXT, MOST_WORD, Parameters, write_c3d
from underfoot.records.even_samples import even_forces, even_rate
from underfoot.records.exports import ExportFormat, ExportSource

CHANNELS = ("FX12", "FX34", "FY14", "FY23", "FZ1", "FZ2", "FZ3", "FZ4")
"""The channels of a plate of type 3."""
SAMPLES_A_FRAME = 10
"""Frames of a C3D file are those of cameras: of force there are some samples in each, more where the file is long."""
_MOST_FRAMES = MOST_FRAMES - 1
"""Frames of a file."""


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
    floor = export.forces.floor
    if len(floor.tiles) > MOST:
        raise BadFile(f"{path} would have {len(floor.tiles)} force plates; allowed: up to {MOST}")
    sensors = [_sensors(tile, path) for tile in floor.tiles]
    first_s, rate_hz, shape = _even(export, path)
    steps = export.steps("Looking for steps")
    groups: dict[str, Parameters] = {
        "ANALOG": _analogs(floor, rate_hz),
        "FORCE_PLATFORM": _plates(floor, sensors),
        "UNDERFOOT": {
            "TILES": list(floor.ids),
            "FIRST_S": export.from_s + first_s,
            "BEGUN": [export.begun],
            "CALIBRATIONS": export.calibrations,
        },
        "SUBJECTS": _people(steps),
        "EVENT": _events(export, steps, first_s),  # last: a byte tells some readers how much there is of parameters
    }
    order = np.array([one for one, *_ in sensors])
    write_c3d(path, groups, _frame_rate(rate_hz, shape[1]), shape, _samples(export, rate_hz, shape, order))


def _even(export: ExportSource, path: Path) -> tuple[float, float, tuple[int, int, int]]:
    """Return the time of the first sample, samples a second, and frames, samples in each, and channels.

    The last samples of a stretch that fill no frame are left out; otherwise the last sample is held to the end of its
    frame. Zeros would be a foot off.
    """
    forces = export.forces
    times = [time_s for time_s, _ in export.pieces("Reading times")]
    if not times:
        raise BadFile(f"{export.recording.path} holds no force samples{' there' if export.stretch_s else ''}")
    time_s = np.concatenate(times)
    back_s = -np.diff(time_s).min(initial=0.0)
    if back_s * forces.rate_hz > 0.5:  # it would be another sample's place
        back = f"the times of {export.recording.path} go back by {back_s:.4g} s"
        raise BadFile(f"{back}, and C3D has none; export it as .csv or .h5, or a stretch before or after that")
    rate_hz = even_rate(time_s, forces.rate_hz)
    count = round((float(time_s[-1]) - float(time_s[0])) * rate_hz) + 1
    in_frame = max(SAMPLES_A_FRAME, -(-count // _MOST_FRAMES))
    channels = len(CHANNELS) * len(forces.floor.tiles)
    if channels * in_frame > MOST_WORD:
        most_s = MOST_WORD // channels * _MOST_FRAMES / rate_hz
        raise BadFile(f"{path} would have {count / rate_hz:.0f} s; allowed: {most_s:.0f} s; export it as .h5")
    is_cut = export.stretch_s is not None and count >= in_frame
    return float(time_s[0]), rate_hz, (count // in_frame if is_cut else -(-count // in_frame), in_frame, channels)


def _frame_rate(rate_hz: float, in_frame: int) -> float:
    """Return frames a second, as a 32-bit number that is not rounded up: readers divide the rates, and cut.

    >>> 128.0 / float(np.float32(12.8)) < 10.0 <= 128.0 / _frame_rate(128.0, 10)
    True
    """
    sample_rate, frame_rate = float(np.float32(rate_hz)), np.float32(rate_hz / in_frame)
    while sample_rate / float(frame_rate) < in_frame:
        frame_rate = np.nextafter(frame_rate, np.float32(0.0))
    return float(frame_rate)


def _sensors(tile: Tile, path: Path) -> tuple[NDArray[np.intp], float, float]:
    found = sensor_order(tile)
    if found is None:
        raise BadFile(f"{path}: tile {tile.id} is no plate of type 3; allowed: sensors in a rectangle about the middle")
    return found


def _samples(
    export: ExportSource, rate_hz: float, shape: tuple[int, int, int], order: NDArray[np.intp]
) -> Iterator[NDArray[np.float32]]:
    """Yield the samples of all channels (n, 8 tiles), of corner forces in the order of their tiles."""
    left = shape[0] * shape[1]
    last = np.zeros((1, shape[2]), np.float32)
    for corners in even_forces(export.pieces("Writing"), rate_hz):
        part = corners[:left]
        values = np.zeros((len(part), len(order), len(CHANNELS)), np.float32)
        values[:, :, 4:] -= np.take_along_axis(part, order[None], axis=2)
        rows = values.reshape(len(part), shape[2])
        yield rows
        left, last = left - len(part), rows[-1:] if len(rows) else last
    yield last.repeat(left, axis=0)


def _analogs(floor: Floor, rate_hz: float) -> Parameters:
    labels = [f"{tile.id}.{name}" for tile in floor.tiles for name in CHANNELS]
    return {
        "USED": len(labels),
        "LABELS": labels,
        "DESCRIPTIONS": ["vertical force" if ".FZ" in label else "not measured" for label in labels],
        "GEN_SCALE": 1.0,
        "SCALE": np.ones(len(labels)),
        "OFFSET": np.zeros(len(labels), np.int16),
        "UNITS": ["N"] * len(labels),
        "RATE": rate_hz,
    }


def _plates(floor: Floor, sensors: list[tuple[NDArray[np.intp], float, float]]) -> Parameters:
    count = len(floor.tiles)
    corners, origins = np.zeros((3, 4, count)), np.zeros((3, count))
    for row, (tile, (_, a, b)) in enumerate(zip(floor.tiles, sensors, strict=True)):
        half = np.array(tile.size_m) / 2.0
        corners[:2, :, row] = 1e3 * tile.to_floor(PLATE_SIGNS * half * (1.0, -1.0)).T
        origins[:, row] = 1e3 * a, 1e3 * b, -1e3 * tile.sensor_depth_m
    return {
        "USED": count,
        "TYPE": np.full(count, 3),
        "ZERO": np.zeros(2, np.int16),
        "CORNERS": corners,
        "ORIGIN": origins,
        "CHANNEL": np.arange(1, len(CHANNELS) * count + 1).reshape(count, -1).T,
    }


def _people(steps: list[Step]) -> Parameters:
    """Return who walked, by the names that events have."""
    names = [_name(person) for person in sorted({step.person for step in steps} - {0})]
    return {"USED": len(names), "NAMES": names}


def _name(person: int) -> str:
    return f"Person {person}" if person else ""


def _events(export: ExportSource, steps: list[Step], first_s: float) -> Parameters:
    """Return steps as foot strikes and foot offs, and marks."""
    events = sorted(_told(steps, export.marks()))
    if not events:
        return {"USED": 0}
    minutes = np.array([math.floor(max(event[0] - first_s, 0.0) / 60.0) for event in events], np.float64)
    times = np.array([event[0] - first_s for event in events], np.float64) - 60.0 * minutes
    return {
        "USED": len(events),
        "TIMES": np.stack([minutes, times]),
        "LABELS": [label for _, _, label, _, _ in events],
        "CONTEXTS": [context for _, context, _, _, _ in events],
        "SUBJECTS": [name for _, _, _, name, _ in events],
        "DESCRIPTIONS": [text for *_, text in events],
    }


def _told(steps: list[Step], marks: list[tuple[float, str]]) -> Iterator[tuple[float, str, str, str, str]]:
    for step in steps:
        context = {"left": "Left", "right": "Right"}.get(step.side, "General")
        left_out = f", left out: {step.left_out}" if step.left_out else ""
        name, description = _name(step.person), f"step {step.step}, tile {step.tile}{left_out}"
        yield step.start_s, context, "Foot Strike", name, description
        yield step.end_s, context, "Foot Off", name, description
    for time_s, text in marks:
        yield time_s, "General", "Mark", "", text


FORMAT = ExportFormat(
    ".c3d",
    "C3D: tiles as force plates of type 3 (eight channels), steps and marks as events",
    "vibration, contacts, commands; forces beyond 32-bit floats; uneven times; lost samples, which are on a line for "
    "up to 40 ms, and longer gaps, which are 0 N; "
    f"texts beyond {MOST_TEXT} bytes; more than {MOST} tiles",
    _write,
)
