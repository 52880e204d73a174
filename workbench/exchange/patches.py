"""Construction of a patch that plays an imported vibration once at each footfall."""

import sys
from collections.abc import Sequence
from dataclasses import dataclass
from math import pi, sin
from pathlib import Path

from underfoot.errors import BadValue
from underfoot.exchange.full_scale import FULL_M_S2
from underfoot.exchange.voices import AMPLITUDE, FREQUENCY, TIME, Voice, simplify_points
from underfoot.kernels import Floats
from underfoot.models.signals.waveshaping import peak_bound
from underfoot.nodes import REGISTRY
from underfoot.patch.patch import Patch

STEP_PX, ROW_PX = 240.0, 192.0
"""Distance between nodes along the wires, and across."""
PARTIALS = 16
"""Number of partials of a wave other than a sine."""
MOST_VOICES = 64
_MIX = ("a", "b", "c", "d")
_LOWEST_HZ, _HIGHEST_HZ = 1.0, 5000.0  # of a tone
_MOST_POINTS = 4000


@dataclass(frozen=True)
class Channel:
    """The voices of one channel; `tiles` selects the tiles that play it."""

    voices: Sequence[Voice]
    tiles: str = "all"


def patch_of(channels: Sequence[Channel], title: str, full_m_s2: float = FULL_M_S2) -> Patch:
    """Return a patch of tones that follow breakpoint envelopes from each footfall on, and are added.

    Amplitudes of the voices are relative to `full_m_s2`. Raises `BadValue` if there is nothing to play.
    """
    voices = sum(len(channel.voices) for channel in channels)
    if not voices:
        raise BadValue("there is no vibration in it")
    if voices > MOST_VOICES:
        raise BadValue(f"it has {voices} oscillations at once; allowed: at most {MOST_VOICES}")
    patch, start = _with_footfall(Patch(title=title[:200]))
    row = 0
    for channel in channels:
        outputs = []
        for voice in channel.voices:
            patch, output = _with_voice(patch, voice, start, full_m_s2, row * ROW_PX)
            outputs.append(output)
            row += 1
        if outputs:
            patch, output, column = _mixed(patch, outputs, (row - len(outputs)) * ROW_PX)
            patch = _with_output(patch, output, channel.tiles, column, (row - len(outputs)) * ROW_PX)
    return patch


def coarsened(channels: Sequence[Channel]) -> tuple[str, ...]:
    """Return one line about curves that have more points than a node can have; nothing if there are none."""
    longest = max((len(_within_tolerance(voice.points)) for one in channels for voice in one.voices), default=0)
    if longest <= _MOST_POINTS:
        return ()
    return (f"detail of the curves: one has {longest} points; a node has at most {_MOST_POINTS}",)


def player_of(file: Path, title: str) -> Patch:
    """Return a patch that plays a sound file from each footfall on."""
    patch, start = _with_footfall(Patch(title=title[:200]))
    patch = patch.add(
        "wav-player", REGISTRY, (2 * STEP_PX, 0.0), file=str(file), mode="at events", amplitude=FULL_M_S2
    ).connect(start, "wav-player.start", REGISTRY)
    return _with_output(patch, "wav-player.out", "all", 3 * STEP_PX, 0.0)


def _with_footfall(patch: Patch) -> tuple[Patch, str]:
    patch = patch.add("tile-force", REGISTRY).add("footfall", REGISTRY, (STEP_PX, 0.0))
    return patch.connect("tile-force.force", "footfall.force", REGISTRY), "footfall.onset"


def _with_voice(patch: Patch, voice: Voice, start: str, full_m_s2: float, y: float) -> tuple[Patch, str]:
    harmonics, gain = _harmonics(voice)
    points = _points(voice, gain * full_m_s2)
    patch = patch.add("breakpoints", REGISTRY, (2 * STEP_PX, y), points=points)
    curve = patch.nodes[-1].id
    patch = patch.connect(start, f"{curve}.start", REGISTRY)
    if voice.wave == "noise":
        patch = patch.add("noise", REGISTRY, (3 * STEP_PX, y))
    else:
        patch = patch.add("tone", REGISTRY, (3 * STEP_PX, y), harmonics=harmonics)
    source = patch.nodes[-1].id
    if voice.wave != "noise":
        patch = patch.connect(f"{curve}.frequency", f"{source}.frequency", REGISTRY)
    return patch.connect(f"{curve}.out", f"{source}.amplitude", REGISTRY), f"{source}.out"


def _points(voice: Voice, factor: float) -> list[tuple[float, float, float]]:
    """Return the voice's points for the node: in m/s^2, and within its ranges."""
    points = voice.points.copy()
    points[:, AMPLITUDE] = points[:, AMPLITUDE].clip(0.0) * factor
    if points[:, AMPLITUDE].max() > 100.0:
        raise BadValue(f"it asks for {points[:, AMPLITUDE].max():.3g} m/s^2; allowed: at most 100")
    points[:, FREQUENCY] = points[:, FREQUENCY].clip(_LOWEST_HZ, _HIGHEST_HZ)
    points = _within_tolerance(points, _MOST_POINTS)
    if not 0.0 <= points[:, TIME].min() <= points[:, TIME].max() <= 3600.0:
        raise BadValue(f"it lasts until {points[:, TIME].max():.6g} s; allowed: 0 to 3600 s")
    return [(round(t, 6), round(a, 6), round(f, 3)) for t, a, f in points.tolist()]


def _within_tolerance(points: Floats, most: int = sys.maxsize) -> Floats:
    """Thin out more points than a node has: to 0.1 % of the largest amplitude and 0.5 Hz, and to at most `most`."""
    if len(points) <= _MOST_POINTS:
        return points
    return simplify_points(points, 1e-3 * points[:, AMPLITUDE].max(), 0.5, most)


def _harmonics(voice: Voice) -> tuple[list[float], float]:
    """Return the harmonics of a wave, and the ratio of the tone's amplitude to the wave's.

    Fourier series of waves between -1 and 1; a tone's amplitude is the bound of its sum.
    """
    numbers = range(1, PARTIALS + 1)
    if voice.wave == "sine":
        return [1.0], 1.0
    if voice.wave == "noise":
        return [], 3.0**-0.5  # uniform between -1 and 1: the RMS, by which noise is specified
    if voice.wave == "saw":
        series = [2.0 / (pi * k) for k in numbers]
    elif voice.wave == "triangle":
        series = [0.0 if k % 2 == 0 else 8.0 * (-1) ** ((k - 1) // 2) / (pi * k) ** 2 for k in numbers]
    else:
        series = _rectangle(voice.duty)
    return [round(a, 6) for a in series], peak_bound(series)


def _rectangle(duty: float) -> list[float]:
    """Return the harmonics of a rectangle that is high for a share `duty` of its period; a half gives the square."""
    return [4.0 / (pi * k) * abs(sin(pi * k * duty)) for k in range(1, PARTIALS + 1)]


def _mixed(patch: Patch, outputs: list[str], y: float) -> tuple[Patch, str, float]:
    """Add nodes that sum these outputs, four at a time; return patch, sum, and the next node's position."""
    column = 4 * STEP_PX
    while len(outputs) > 1:
        added = []
        for at in range(0, len(outputs), len(_MIX)):
            patch = patch.add("mix", REGISTRY, (column, y + 0.25 * at * ROW_PX))
            mix = patch.nodes[-1].id
            for port, output in zip(_MIX, outputs[at : at + len(_MIX)], strict=False):
                patch = patch.connect(output, f"{mix}.{port}", REGISTRY)
            added.append(f"{mix}.out")
        outputs, column = added, column + STEP_PX
    return patch, outputs[0], column


def _with_output(patch: Patch, output: str, tiles: str, x: float, y: float) -> Patch:
    patch = patch.add("tile-output", REGISTRY, (x, y), tiles=tiles)
    return patch.connect(output, f"{patch.nodes[-1].id}.acceleration", REGISTRY)
