"""What a linearisation looks like: curve, residuals, hysteresis, creep, and the candidates."""

import numpy as np

from underfoot.calibration.files.tables import Pairs
from underfoot.calibration.science.linearisation import Linearisation, SensorFit
from underfoot.calibration.science.sensor_figures import creep_runs, held_s
from underfoot.drawing import Drawing, Series, series

_DOTS = 250
_LOADED_N = 1.0


def drawings_of(found: Linearisation) -> tuple[Drawing, ...]:
    """Curves and residuals of every sensor, then hysteresis, creep and the candidates of all."""
    fits = [(j, sensor) for j, sensor in enumerate(found.sensors) if sensor.recording is not None]
    every: list[Drawing] = []
    for j, sensor in fits:
        every += [_curve(j, sensor), _residuals(j, sensor)]
    every += [_creep(fits), _candidates(fits)]
    return tuple(drawing for drawing in every if drawing.series)


def taken_so_far(pairs: Pairs) -> tuple[Drawing, ...]:
    """The pairs themselves, a colour each sensor; nothing before the first load."""
    if pairs.force_n.max(initial=0.0) < _LOADED_N:
        return ()
    colours = ("force", "vibration", "events", "contact")
    shown = []
    for j in range(4):
        mine = np.flatnonzero(pairs.sensor == j)
        mine = mine[:: max(1, mine.size // _DOTS)]
        if mine.size:
            shown.append(series(f"sensor {j + 1}", pairs.force_n[mine], pairs.reading[mine], "dots", colours[j]))
    return (Drawing("Taken so far", "force, N", "reading, counts", tuple(shown)),)


def _curve(j: int, sensor: SensorFit) -> Drawing:
    recording, curve = sensor.recording, sensor.curve
    assert recording is not None
    x = np.linspace(curve.readings[0], curve.readings[-1], 400)
    shown: list[Series] = []
    for way, name, colour in ((0, "rising", "force"), (1, "falling", "events"), (2, "resting", "contact")):
        mine = np.flatnonzero(recording.direction == way)
        mine = mine[:: max(1, mine.size // _DOTS)]
        if mine.size:
            shown.append(series(name, recording.reading(recording.x[mine]), recording.force_n[mine], "dots", colour))
    shown.append(series(curve.family, x, curve.force(x), "line", "vibration"))
    return Drawing(f"Sensor {j + 1}: curve", "reading, counts", "force, N", tuple(shown))


def _residuals(j: int, sensor: SensorFit) -> Drawing:
    recording, held = sensor.recording, sensor.estimate_n
    assert recording is not None
    assert held is not None
    assert sensor.seen is not None
    force, way = recording.force_n[sensor.seen], recording.direction[sensor.seen]
    error = 100.0 * (held - force) / recording.full_scale_n
    shown = []
    for k, name, colour in ((0, "rising", "force"), (1, "falling", "events"), (2, "resting", "contact")):
        mine = np.flatnonzero(way == k)
        mine = mine[:: max(1, mine.size // _DOTS)]
        if mine.size:
            shown.append(series(name, force[mine], error[mine], "dots", colour))
    return Drawing(f"Sensor {j + 1}: held-out error", "force, N", "error, % of full scale", tuple(shown))


def _creep(fits: list[tuple[int, SensorFit]]) -> Drawing:
    shown = []
    colours = ("force", "vibration", "events", "contact")
    for j, sensor in fits:
        recording = sensor.recording
        assert recording is not None
        runs = creep_runs(recording)
        if not runs:
            continue
        run = max(runs, key=lambda r: float(recording.time_s[r.stop - 1] - recording.time_s[r.start]))
        since = held_s(recording, run)
        later = since >= 0.05
        ratio = sensor.curve.force(recording.reading(recording.x[run]))[later] / recording.force_n[run][later]
        shown.append(series(f"sensor {j + 1}", since[later], ratio, "line", colours[j]))
    return Drawing("Creep: force by the curve over the true one", "time held, s", "ratio", tuple(shown), x_log=True)


def _candidates(fits: list[tuple[int, SensorFit]]) -> Drawing:
    """Held-out error of the candidates, in their order."""
    shown = []
    colours = ("force", "vibration", "events", "contact")
    names = [name for name, _ in fits[0][1].tried] if fits else []
    for j, sensor in fits:
        errors = dict(sensor.tried)
        places = [k + 1.0 for k, name in enumerate(names) if name in errors]
        shown.append(series(f"sensor {j + 1}", places, [errors[n] for n in names if n in errors], "line", colours[j]))
    return Drawing("Held-out error of the candidates", ", ".join(names), "% of full scale", tuple(shown))
