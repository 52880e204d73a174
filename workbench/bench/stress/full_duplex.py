"""Full duplex for five minutes: a sound card's inputs record its outputs, and each sample is aligned to its command.

The card is a PulseAudio null sink, whose monitor is the input. On a busy machine PulseAudio drops frames silently.
"""

import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from underfoot.bench.stress.null_sinks import is_possible, playing_on_null_sinks
from underfoot.bench.stress.outcome import Effort, Outcome, Progress
from underfoot.clock import RATE_HZ
from underfoot.devices.accelerometers import Accelerometer
from underfoot.engine.commands import Level, Play
from underfoot.engine.reports import Health
from underfoot.engine.session import Session
from underfoot.engine.target import Target
from underfoot.floor.layout import default_floor
from underfoot.nodes import REGISTRY
from underfoot.patch import preset_files
from underfoot.patch.patch import Patch
from underfoot.records.recording import Recording

USUAL_S, PATCH, PEOPLE = 300.0, "material-snow-fresh", "people=2"
LEAST_ALIGNED = 0.99
"""The share of what was heard that is asked to stand at the very frame at which it was played."""
_FULL_SCALE_M_S2, _BUFFER_S, _TICK_S, _WAIT_S = 20.0, 0.08, 0.02, 120.0
_STRETCH = RATE_HZ // 10
_SAME = 1e-6


def run(effort: Effort, progress: Progress) -> Iterator[Outcome]:
    """Yield the result of five minutes, or `seconds`, of two people on four tiles; nothing without PulseAudio."""
    if not is_possible():
        progress("stress: full_duplex needs PulseAudio")
        return
    with tempfile.TemporaryDirectory() as made:
        path = Path(made) / "session.underfoot"
        with playing_on_null_sinks(Path(made), {"duplex": 4}):
            health = _played(path, effort.length_s(USUAL_S), progress)
        with Recording(path) as recording:
            yield _judged(recording, health)


def _played(path: Path, seconds: float, progress: Progress) -> Health:
    """Run a session that plays and records; return its final state."""
    floor = default_floor()
    inputs = tuple(Accelerometer(name, k, _FULL_SCALE_M_S2) for k, name in enumerate(floor.ids))
    target = Target(floor, sound="", latency_s=_BUFFER_S, accelerometers=inputs, simulation=PEOPLE)
    session = Session(target, Patch.load(preset_files.patches()[PATCH], REGISTRY), REGISTRY)
    try:
        session.record(path)
        session.start()
        for command in (Level(0.0), Play(True)):
            session.send(command)
        end, next_report_s = time.perf_counter() + _WAIT_S + 2.0 * seconds, 0.0
        while session.health.frame < seconds * RATE_HZ and time.perf_counter() < end:
            session.poll()
            time.sleep(_TICK_S)
            if session.health.frame >= next_report_s * RATE_HZ:
                progress(
                    f"stress: {next_report_s:.0f} s played, {session.health.xruns} xruns, {session.health.jumps} jumps"
                )
                next_report_s += 30.0
        health = session.health
        session.stop_recording()
    finally:
        session.close()
    return health


def _judged(recording: Recording, health: Health) -> Outcome:
    begin, played = recording.vibration()
    first, measured = recording.acceleration("measured")
    gaps = recording.gaps("measured")
    measured_fs = measured / np.float32(_FULL_SCALE_M_S2)
    commanded_fs = played[first - begin : first - begin + len(measured_fs)]
    measured_fs = measured_fs[: len(commanded_fs)]
    known = np.ones(len(measured_fs), bool)
    for gap in gaps:
        known[gap.first - first : gap.first + gap.count - first] = False
    sounding = known & (np.abs(commanded_fs).max(axis=1) > _SAME)
    same = np.abs(measured_fs - commanded_fs).max(axis=1) <= _SAME
    share = float(same[sounding].mean()) if sounding.any() else 0.0
    off = [bool((sounding & ~same)[at : at + _STRETCH].sum() > 0.5 * _STRETCH) for at in range(0, len(same), _STRETCH)]
    lost = sum(gap.count for gap in gaps)
    found = (
        f"{100.0 * share:.2f} % of {sounding.sum() / RATE_HZ:.0f} s that sound are at their very frame, "
        f"{sum(off)} tenths of a second are not; aligned anew {health.jumps} times; "
        f"{len(gaps)} gaps, {lost} frames; {health.xruns} xruns; drift {_drift(commanded_fs, measured_fs, sounding)}; "
        f"round trip {1e3 * health.round_trip_s:.1f} ms, by the card's clock {1e3 * health.clock_trip_s:.1f} ms, "
        f"of which {1e3 * health.stream_latency_s:.1f} ms are shown"
    )
    return Outcome("commanded and measured, a null sink", len(measured_fs), found, share >= LEAST_ALIGNED)


def _drift(commanded_fs: NDArray[np.float32], measured_fs: NDArray[np.float32], sounding: NDArray[np.bool_]) -> str:
    """Return the change of delay between the first and the last audible tenth of a second, in frames, as text."""
    total = sounding.cumsum()
    whole = np.flatnonzero(total[_STRETCH:] - total[:-_STRETCH] == _STRETCH)
    if not whole.size:
        return "not to be told"
    places = []
    for at in (int(whole[0]) + 1, int(whole[-1]) + 1):
        first = max(at - _STRETCH, 0)
        around = commanded_fs[first : at + 2 * _STRETCH]
        tile = int(np.argmax((commanded_fs[at : at + _STRETCH] ** 2).sum(axis=0)))
        found = np.correlate(around[:, tile], measured_fs[at : at + _STRETCH, tile], "valid")
        places.append(int(np.argmax(found)) + first - at)
    return f"{places[1] - places[0]} frames"
