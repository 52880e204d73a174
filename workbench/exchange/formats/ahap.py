"""AHAP 1.0, of Apple's Core Haptics: events with parameters, and curves that scale all of them."""

import json
from pathlib import Path
from typing import Annotated, Any

import msgspec
import numpy as np

from underfoot.errors import BadFile
from underfoot.exchange.clip import BURST_S, bursts, clip_of, written_report
from underfoot.exchange.foreign import Seconds, convert, read_json, unread
from underfoot.exchange.format import Export, Format, Imported
from underfoot.exchange.full_scale import scale_from_words, scale_in_words
from underfoot.exchange.patches import Channel, coarsened, patch_of
from underfoot.exchange.voices import AMPLITUDE, FREQUENCY, HOP_S, Voice, simplify_points
from underfoot.files import write_file
from underfoot.kernels import Floats

LOW_HZ, HIGH_HZ = 65.0, 300.0
"""Frequencies of sharpness 0 and 1, as in the reference encoder of MPEG haptics."""
LONGEST_S, CURVE_POINTS = 30.0, 16
"""Longest continuous event, and most points of a curve."""
DEFAULTS = {"HapticIntensity": 1.0, "HapticSharpness": 0.5, "AttackTime": 0.0, "DecayTime": 0.0, "ReleaseTime": 0.0}
"""Defaults of an event's parameters; Sustained is 1."""
LEAST_IMPACT, SHARE_FELT, ATTACK_S, REBOUND = 0.1, 0.1, 8e-3, 0.1
"""Criteria of an impact: least peak, share of the peak at which it begins and ends, longest rise, and largest rebound
as a share of the peak.
"""
SHORTEST_S, LONGEST_IMPACT_S = 12e-3, 30e-3
"""Range of an impact's length, around the 22 ms of a transient, whose length cannot be set. For those 22 ms nothing
else is felt, neither before the impact nor from its beginning on.
"""
_FINE_S = 5e-3
_SILENT = frozenset(("Version", "Created"))
_CURVES = {"HapticIntensityControl": 1.0, "HapticSharpnessControl": 0.0}
_MOST = 20_000

Value = Annotated[float, msgspec.Meta(ge=-1.0, le=30.0)]


class Parameter(msgspec.Struct, frozen=True, rename="pascal"):
    """A parameter of an event."""

    parameter_value: Value
    parameter_id: str = msgspec.field(name="ParameterID")


class Event(msgspec.Struct, frozen=True, rename="pascal"):
    """A haptic event."""

    time: Seconds
    event_type: str
    event_duration: Seconds | None = None
    event_parameters: Annotated[list[Parameter], msgspec.Meta(max_length=64)] = []


class Point(msgspec.Struct, frozen=True, rename="pascal"):
    """A point of a curve, its time relative to the curve's."""

    time: Annotated[float, msgspec.Meta(ge=-3600.0, le=3600.0)]
    parameter_value: Annotated[float, msgspec.Meta(ge=-1.0, le=1.0)]


class Curve(msgspec.Struct, frozen=True, rename="pascal"):
    """A curve that changes a parameter of all events."""

    time: Seconds
    parameter_curve_control_points: Annotated[list[Point], msgspec.Meta(min_length=1, max_length=_MOST)]
    parameter_id: str = msgspec.field(name="ParameterID")


class Entry(msgspec.Struct, frozen=True, rename="pascal"):
    """One entry of the pattern."""

    event: Event | None = None
    parameter_curve: Curve | None = None


class Metadata(msgspec.Struct, frozen=True, rename="pascal"):
    """The metadata that are kept."""

    project: str = ""
    description: str = ""


class Ahap(msgspec.Struct, frozen=True, rename="pascal"):
    """A whole file."""

    pattern: Annotated[list[Entry], msgspec.Meta(max_length=_MOST)]
    metadata: Metadata = Metadata()


def write(export: Export, path: Path) -> tuple[str, ...]:
    """Write the tile that moves most: transients for short impacts, continuous events for the rest.

    Curves of intensity and sharpness modulate both.
    """
    clip = clip_of(export)
    points, impacts = clip.points.copy(), _impacts(clip.points)
    for first, last in impacts:
        # A transient takes its strength from the curves at its beginning, so they are constant there.
        points[first:last, 1:] = points[first + int(points[first:last, AMPLITUDE].argmax()), 1:]
    points[:, AMPLITUDE] = np.sqrt(points[:, AMPLITUDE].clip(0.0, 1.0))
    points[:, FREQUENCY] = ((points[:, FREQUENCY] - LOW_HZ) / (HIGH_HZ - LOW_HZ)).clip(0.0, 1.0)
    pattern = [_event("HapticTransient", float(points[first, 0])) for first, _ in impacts]
    for rest in _rests(points[:, 0], impacts):
        pattern += [_event("HapticContinuous", at, length_s) for at, length_s in _pieces(*rest)]
    points = simplify_points(points, 0.01, 0.02)
    pattern += _curves("HapticIntensityControl", points[:, [0, AMPLITUDE]])
    pattern += _curves("HapticSharpnessControl", points[:, [0, FREQUENCY]])
    description = f"{scale_in_words(clip.full_m_s2)}; sharpness 0 to 1 is {LOW_HZ:g} to {HIGH_HZ:g} Hz"
    metadata = {"Project": export.patch.title, "Created": "Underfoot", "Description": description}
    document = {"Version": 1.0, "Metadata": metadata, "Pattern": pattern}
    write_file(path, json.dumps(document, indent=1).encode())
    said = f"short impacts as transients: {len(impacts)}; how long each is, and how it falls, is the player's"
    return (
        *written_report(export, clip, _voices(convert(document, path, Ahap), path)[0]),
        *([said] if impacts else []),
    )


def _impacts(points: Floats) -> list[tuple[int, int]]:
    """Find short impacts: the index of the first point of each, and one after its last.

    Each is one isolated hump of the envelope, where that is above a tenth of its peak: a transient would mask anything
    near it, such as neighbouring grains of gravel. No further is looked than one is long.
    """
    amplitude, apart, longest = points[:, AMPLITUDE], round(BURST_S / HOP_S), round(LONGEST_IMPACT_S / HOP_S)
    found: list[tuple[int, int]] = []
    beside = np.pad(amplitude, 1)
    is_peak = (amplitude >= LEAST_IMPACT) & (amplitude >= np.maximum(beside[:-2], beside[2:]))
    for top in np.flatnonzero(is_peak).tolist():
        begin = max(top - longest, 0)
        around = amplitude[begin : top + longest + 1]
        quiet = begin + np.flatnonzero(around < SHARE_FELT * amplitude[top])
        first = int(quiet[quiet < top].max(initial=begin - 1)) + 1
        last = int(quiet[quiet > top].min(initial=begin + around.size))
        hump = amplitude[first:last]
        is_top = top == first + int(hump.argmax()) and (top - first) * HOP_S <= ATTACK_S
        falls = np.diff(hump[top - first :]).max(initial=0.0) <= REBOUND * amplitude[top]
        near = np.concatenate([amplitude[max(first - apart, 0) : first], amplitude[last : first + apart]])
        is_alone = near.max(initial=0.0) < SHARE_FELT * amplitude[top]
        if is_top and is_alone and falls and SHORTEST_S <= hump.size * HOP_S <= LONGEST_IMPACT_S:
            found.append((first, last))
    return found


def _rests(time_s: Floats, impacts: list[tuple[int, int]]) -> list[tuple[float, float]]:
    """Return beginning and end of the intervals between impacts."""
    edges = [0.0, *(float(time_s[min(at, time_s.size - 1)]) for impact in impacts for at in impact)]
    edges.append(max(float(time_s[-1]), HOP_S))
    return [(start, end) for start, end in zip(edges[::2], edges[1::2], strict=True) if end > start]


def _pieces(start_s: float, end_s: float) -> list[tuple[float, float]]:
    """Return beginning and length of the events that fill an interval, of which none is too long for a player.

    >>> _pieces(1.0, 62.5)
    [(1.0, 30.0), (31.0, 30.0), (61.0, 1.5)]
    """
    return [(at, min(LONGEST_S, end_s - at)) for at in np.arange(start_s, end_s, LONGEST_S).tolist()]


def _event(kind: str, time_s: float, duration_s: float | None = None) -> dict[str, Any]:
    parameters = [_parameter("HapticIntensity", 1.0), _parameter("HapticSharpness", 0.0)]
    length = {} if duration_s is None else {"EventDuration": round(duration_s, 6)}
    return {"Event": {"Time": round(time_s, 6), "EventType": kind, **length, "EventParameters": parameters}}


def _parameter(name: str, value: float) -> dict[str, Any]:
    return {"ParameterID": name, "ParameterValue": value}


def _curves(name: str, points: Floats) -> list[dict[str, Any]]:
    """Split points into curves of at most `CURVE_POINTS`, each from the previous one's last point, in its own time."""
    found = []
    for first in range(0, max(len(points) - 1, 1), CURVE_POINTS - 1):
        part = points[first : first + CURVE_POINTS]
        start = round(float(part[0, 0]), 6)
        controls = [{"Time": round(t - start, 6), "ParameterValue": round(v, 5)} for t, v in part.tolist()]
        curve = {"ParameterID": name, "Time": start, "ParameterCurveControlPoints": controls}
        found.append({"ParameterCurve": curve})
    return found


def read(path: Path) -> Imported:
    """Read a file as a patch: a tone for the continuous events, and one for the transients."""
    raw = read_json(path)
    document = convert(raw, path, Ahap)
    voices, lost = _voices(document, path)
    full_m_s2 = scale_from_words(document.metadata.description)
    channels = [Channel(voices)]
    patch = patch_of(channels, document.metadata.project or path.stem, full_m_s2)
    return Imported(patch, (*lost, *coarsened(channels), *unread(raw, Ahap, _SILENT)))


def _voices(document: Ahap, path: Path) -> tuple[list[Voice], tuple[str, ...]]:
    """Return the voices, with overlapping events in separate voices; and what is left out."""
    curves = {name: _curve(document, name, otherwise) for name, otherwise in _CURVES.items()}
    lost: dict[str, None] = {}
    transients: list[tuple[float, float, float]] = []
    lanes: list[list[Floats]] = []
    for number, entry in enumerate(document.pattern):
        if entry.parameter_curve and entry.parameter_curve.parameter_id not in _CURVES:
            lost[f"curves of {entry.parameter_curve.parameter_id}"] = None
        event = entry.event
        if event is None:
            continue
        given = {held.parameter_id: held.parameter_value for held in event.event_parameters}
        known = {*DEFAULTS, "Sustained"}
        lost.update({f"event parameter {name}": None for name in given if name not in known})
        if event.event_type == "HapticTransient":
            amplitude, frequency = _felt(np.array([event.time]), given, curves)
            transients.append((event.time, float(amplitude[0]), float(frequency[0])))
        elif event.event_type == "HapticContinuous":
            if not event.event_duration:
                raise BadFile(f"{path}: $.Pattern[{number}].Event.EventDuration is missing or 0; allowed: above 0")
            points = _continuous(event, given, curves)
            free = [lane for lane in lanes if lane[-1][-1, 0] <= points[0, 0]]
            (free[0] if free else lanes.append([]) or lanes[-1]).append(points)  # type: ignore[func-returns-value]
        else:
            lost[f"events of type {event.event_type}"] = None
    voices = [Voice(np.concatenate(lane)) for lane in lanes]
    return voices + ([bursts(transients)] if transients else []), tuple(lost)


def _curve(document: Ahap, name: str, otherwise: float) -> Floats:
    """Join all curves of a parameter, points [point, 2]: `otherwise` before the first, constant after each."""
    curves = [
        e.parameter_curve for e in document.pattern if e.parameter_curve and e.parameter_curve.parameter_id == name
    ]
    rows = [(-1.0, otherwise)]
    for curve in sorted(curves, key=lambda curve: curve.time):
        points = sorted((curve.time + one.time, one.parameter_value) for one in curve.parameter_curve_control_points)
        rows.append((points[0][0], rows[-1][1]))
        rows += points
    times = np.maximum.accumulate([time for time, _ in rows])
    return np.column_stack([times, [value for _, value in rows]])


def _felt(time_s: Floats, given: dict[str, float], curves: dict[str, Floats]) -> tuple[Floats, Floats]:
    """Return amplitude and frequency of an event at these times: amplitude is intensity squared."""
    intensity, sharpness = (given.get(name, DEFAULTS[name]) for name in ("HapticIntensity", "HapticSharpness"))
    loud = intensity * _at(curves["HapticIntensityControl"], time_s)
    sharp = sharpness + _at(curves["HapticSharpnessControl"], time_s)
    return loud.clip(0.0, 1.0) ** 2, LOW_HZ + sharp.clip(0.0, 1.0) * (HIGH_HZ - LOW_HZ)


def _at(curve: Floats, time_s: Floats) -> Floats:
    return np.interp(time_s, curve[:, 0], curve[:, 1])


def _continuous(event: Event, given: dict[str, float], curves: dict[str, Floats]) -> Floats:
    """Return the points of a continuous event, dense enough for linear interpolation of the square."""
    attack, decay, release = (given.get(name, 0.0) for name in ("AttackTime", "DecayTime", "ReleaseTime"))
    begin, end = event.time, event.time + (event.event_duration or 0.0)
    sustained = given.get("Sustained", 1.0) >= 0.5
    last = end + max(release, 0.0) if sustained else end
    corners = [begin, begin + attack, begin + attack + decay, end, last, *(t for c in curves.values() for t in c[:, 0])]
    grid = np.arange(begin, last, max(_FINE_S, (last - begin) / _MOST))
    times = np.unique(np.concatenate([grid, [t for t in corners if begin <= t <= last]]))
    amplitude, frequency = _felt(times, given, curves)
    if attack > 0.0:
        amplitude *= ((times - begin) / attack).clip(0.0, 1.0)
    if not sustained:
        amplitude *= 1.0 - ((times - begin - attack) / max(decay, HOP_S)).clip(0.0, 1.0)
    elif release > 0.0:
        amplitude *= 1.0 - ((times - end) / release).clip(0.0, 1.0)
    edges = np.array([[begin, 0.0, frequency[0]], [last, 0.0, frequency[-1]]])
    inner = simplify_points(np.column_stack([times, amplitude, frequency]), 0.002, 0.5)
    return np.concatenate([edges[:1], inner, edges[1:]])


FORMAT = Format(
    "ahap",
    "Apple Core Haptics",
    (".ahap",),
    frozenset(("title", "range")),
    write,
    read,
    note="one tile; short impacts as transients, without their length; "
    f"frequencies {LOW_HZ:g} to {HIGH_HZ:g} Hz as sharpness",
)
