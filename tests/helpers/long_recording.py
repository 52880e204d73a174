"""Recordings of any length, made of ten seconds of people who walk on the simulated floor.

`python tests/helpers/long_recording.py FILE [MINUTES]` writes one of 36 tiles, to test the window with it.
"""

import sys
from pathlib import Path

import numpy as np

from underfoot.devices.simulated_floor import SimulatedFloor
from underfoot.floor.layout import default_floor
from underfoot.floor.tile_parameters import simulation
from underfoot.patch.patch import Patch
from underfoot.records.recording_writer import Writer

RATE = 48_000
PIECE_S = 10
BLOCK = 4800


def walked(floor, seconds, people="people=1"):
    """Return samples (stamp, arrival, corners...) of people on a floor, as in a recording."""
    source = SimulatedFloor(floor, RATE, people=simulation(people)[1])
    rows = []
    for end in range(480, round(seconds * RATE) + 1, 480):
        count = source.pull(end)
        stamps = source.stamps[:count]
        rows.append(np.column_stack([stamps, stamps, source.forces[:count].reshape(count, -1)]))
    return np.concatenate(rows)


def write_recording(path, seconds, floor=None, people="people=1", vibration=True, about=None):
    """Write a recording in which loaded tiles vibrate with their force: commanded at 200 Hz, measured at 0.8 of it."""
    floor = floor or default_floor()
    piece = walked(floor, min(seconds, PIECE_S), people)
    said = {
        "patch": Patch(title="Made").dumps().decode(),
        "folder": "",
        "floor": floor.dumps().decode(),
        "rate": str(RATE),
        "force_rate": "1000.0",
        "target": "simulator",
    }
    writer = Writer(path, said | (about or {}))
    loads = np.maximum(piece[:, 2:].reshape(len(piece), -1, 4).sum(axis=2), 0.0)
    loads[loads < 20.0] = 0.0
    frames = np.arange(PIECE_S * RATE)
    tone = np.sin(2.0 * np.pi * 200.0 / RATE * frames)
    blocks = round(seconds * RATE) // BLOCK
    for number in range(blocks):
        first = number * BLOCK
        inside = first % (PIECE_S * RATE)
        at = np.searchsorted(piece[:, 0], [inside, inside + BLOCK])
        rows = piece[at[0] : at[1]].copy()
        rows[:, :2] += first - inside
        writer.put("force", number * (BLOCK // 48), rows)
        here = np.clip(np.arange(inside, inside + BLOCK) // 48, 0, len(loads) - 1)
        asked = (loads[here] * 1e-3 * tone[inside : inside + BLOCK, None] + 0.0).astype(np.float32)  # no -0
        if vibration:
            writer.put("vibration", first, asked / 20.0)
        writer.put("commanded", first, asked)
        writer.put("measured", first, 0.8 * asked)
        if number % 10 == 9:
            writer.commit()
    writer.close()
    return path


if __name__ == "__main__":
    minutes = float(sys.argv[2]) if len(sys.argv) > 2 else 30.0
    write_recording(Path(sys.argv[1]), 60.0 * minutes, default_floor(6, 6), "people=4")
