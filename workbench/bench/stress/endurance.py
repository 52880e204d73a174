"""Long runs in a short time: memory, file handles and clocks after hours of session frames."""

import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from underfoot.bench.stress.damage import open_file_count
from underfoot.bench.stress.outcome import Effort, Outcome, Progress
from underfoot.clock import RATE_HZ
from underfoot.devices.device_clock import DeviceClocks, arrival_frame, observe
from underfoot.devices.simulated_floor import SimulatedFloor
from underfoot.engine.commands import Play
from underfoot.engine.loop import Loop, LoopOptions
from underfoot.floor.layout import default_floor
from underfoot.kernels import kernel
from underfoot.models.signals.random import stream_key, uniform
from underfoot.nodes import REGISTRY
from underfoot.patch import preset_files
from underfoot.patch.patch import Patch

MORE_MB = 8.0
"""Allowed growth of memory, in MB, from the first tenth of a run to its end."""
MOST_N, MOST_OUTPUT = 1e-6, 1e-6
"""Allowed difference of force, in newtons, and output, in full scale, from those of a loop that began later."""
_BLOCK, _PARTS, _SETTLED = 1024, 10, 400
_PPM, _JITTER = 100.0, 0.001
_CLOCK_DAYS = 1.0


def run(effort: Effort, progress: Progress) -> Iterator[Outcome]:
    """Yield the results of a walker on four tiles for `seconds` of session time, and of a device's clock for a day."""
    yield _walked(effort.length_s(120.0), progress)
    yield _clock(progress)


def _walked(seconds: float, progress: Progress) -> Outcome:
    loop = _walk_from(0)
    memory, opened, force_n, output, finite = [resident_mb()], [open_file_count()], [0.0], [0.0], True
    spent_s = 0.0
    for part in range(_PARTS):
        began = time.process_time()
        for _ in range(round(seconds * RATE_HZ / _BLOCK / _PARTS)):
            loop.run(_BLOCK)
            finite = finite and bool(np.isfinite(loop.out).all())
        spent_s += time.process_time() - began
        memory.append(resident_mb())
        opened.append(open_file_count())
        for differences, difference in zip((force_n, output), _drift(loop), strict=True):
            differences.append(difference)
        progress(
            f"stress: {(part + 1) * seconds / _PARTS:.0f} s simulated, {memory[-1]:.1f} MB, {opened[-1]} handles, "
            f"{force_n[-1]:.3g} N and {output[-1]:.3g} of full scale from a floor that began just now"
        )
    speed = loop.frame / RATE_HZ / max(spent_s, 1e-9)
    grown, left = memory[-1] - memory[1], opened[-1] - opened[1]
    found = (
        f"{loop.frame / RATE_HZ / 3600.0:.2f} h at {speed:.0f} times real time; memory {memory[0]:.1f} MB at first, "
    )
    found += f"{memory[1]:.1f} after a tenth, {memory[_PARTS // 2]:.1f} half-way, {memory[-1]:.1f} at the end; "
    found += f"handles {left:+d}; {max(force_n):.3g} N and {max(output):.3g} of full scale from floors that began later"
    good = finite and grown <= MORE_MB and left <= 0 and max(force_n) < MOST_N and max(output) < MOST_OUTPUT
    return Outcome("a walker on 4 tiles, simulated time", loop.frame, found, good)


def _walk_from(frame: int) -> Loop:
    """Return a loop that plays gravel under a walker from a session frame on."""
    floor = SimulatedFloor(default_floor(2, 2))
    floor.skip(frame)
    patch = Patch.load(preset_files.patches()["gravel"], REGISTRY)
    loop = Loop(patch, REGISTRY, floor, LoopOptions(block=_BLOCK, frame=frame))
    loop.send(Play(True))
    return loop


def _drift(loop: Loop) -> tuple[float, float]:
    """Return by how much force (N) and output of the last block differ from those of a loop begun seconds before."""
    fresh = _walk_from(max(loop.frame - _SETTLED * _BLOCK, 0))
    while fresh.frame < loop.frame:
        fresh.run(_BLOCK)
    pairs = ((loop.intake.signals[0], fresh.intake.signals[0]), (loop.out, fresh.out))
    force_n, output = (float(np.abs(old - new).max()) for old, new in pairs)
    return force_n, output


def _clock(progress: Progress) -> Outcome:
    """Test a device whose clock is 100 ppm slow, with 1 ms of jitter, for a day at 1 kHz."""
    clocks = DeviceClocks(1, float(RATE_HZ))
    hours = round(24 * _CLOCK_DAYS)
    drifts, errors_ms = [], []
    for hour in range(hours):
        first = hour * 3_600_000
        late = _observed(clocks.table, first, first + 3_600_000, stream_key("stress", "clock"), float(RATE_HZ))
        fit = clocks.fit(0)
        drifts.append(fit.drift_ppm if fit is not None else np.inf)
        errors_ms.append(1e3 * late / RATE_HZ)
    progress(f"stress: drift by the hour {min(drifts):+.2f} to {max(drifts):+.2f} ppm")
    found = f"{_PPM:.0f} ppm is told as {min(drifts):.2f} to {max(drifts):.2f}, each hour; "
    found += f"time is wrong by at most {max(errors_ms):.3f} ms at an hour's end"
    good = max(abs(drift - _PPM) for drift in drifts) < 5.0 and max(errors_ms) < 0.5
    return Outcome("a device's clock for 24 h", hours * 3_600_000, found, good)


@kernel
def _observed(table: NDArray[np.void], first: int, end: int, key: int, rate: float) -> float:
    """Add the device's samples, 1 ms apart; return the timing error of the last one, in frames."""
    for i in range(first, end):
        sent = 1e-3 * i * (1.0 + _PPM * 1e-6)
        observe(table[0], 0, 1000.0 * i, rate * (sent + _JITTER * uniform(key, i)), rate)
    truth = rate * 1e-3 * end * (1.0 + _PPM * 1e-6)
    return abs(arrival_frame(table[0], 1000.0 * end, rate) - truth)


def resident_mb() -> float:
    """Return the resident memory of this process in MB; 0 if the system does not report it."""
    status = Path("/proc/self/status")
    if not status.exists():
        return 0.0
    lines = status.read_text().splitlines()
    return int(next(line for line in lines if line.startswith("VmRSS")).split()[1]) / 1024.0
