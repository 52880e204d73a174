"""Latency of a scene: from the onset of a press to the first frame of vibration, and to the first changed picture."""

import math
import random
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from msgspec.structs import replace
from numpy.typing import NDArray

from underfoot.bench.latency import wait_for
from underfoot.bench.requirements.requirement import Requirement
from underfoot.engine.commands import PressTile
from underfoot.engine.rings import Reader
from underfoot.engine.session import Session
from underfoot.engine.session_memory import ForceReader
from underfoot.engine.target import Target
from underfoot.floor.layout import Floor, default_floor
from underfoot.floor.tracking import ON_N
from underfoot.nodes import REGISTRY
from underfoot.scenes import discover
from underfoot.scenes.cues import nearest_tile
from underfoot.scenes.scene import Scene
from underfoot.scenes.shapes import Lines
from underfoot.scenes.stage import Stage

LISTEN_S, PICTURE_S = 0.005, 1.0 / 60.0
"""Intervals at which a scene reads force samples and is painted, as in the window and `underfoot scene`."""
PRESS_N = 400.0
DOWN_S, UP_S = 0.25, 0.45
"""Duration of a press, and the least pause after it."""
MOST_S = 0.3
"""Longest delay after an onset at which vibration counts as a response to it."""
MOVES = 1e-5
"""Least vibration, of full scale, that counts as one: what came before may not have decayed to exactly zero."""
_QUIET_S = 0.05


@dataclass(frozen=True)
class SceneLatency:
    """Seconds from a contact's onset (`ON_N` on its tile) to the first frame at which its tile moves, one per press.

    `read_s` are to the session frame at which the onset's sample was read: the time before is the engine's, the time
    after the scene's and the way back. `drawn_s` are to the frame of the first picture, of sixty a second, with more
    content than the last one before the press; painting and the display come on top. `cue_s` are those of single
    strikes: from their cause to their frame in the engine.
    """

    felt_s: NDArray[np.float64]
    read_s: NDArray[np.float64]
    drawn_s: NDArray[np.float64]
    cue_s: NDArray[np.float64]
    presses: int

    @property
    def distributions(self) -> dict[str, NDArray[np.float64]]:
        """Return the measurements by name."""
        return {
            "onset to its sample's being read": self.read_s,
            "onset to the first felt frame": self.felt_s,
            "onset to the first changed picture": self.drawn_s,
            "event to its frame": self.cue_s,
        }

    def in_words(self) -> str:
        """Return the distributions, one line each."""
        lines = [f"{self.presses} presses, {self.felt_s.size} felt, {self.drawn_s.size} seen"]
        for name, values in self.distributions.items():
            if values.size:
                low, half, high, most = 1e3 * np.percentile(values, (5, 50, 95, 99))
                lines.append(f"{name}: median {half:.1f} ms, 5 to 95 % {low:.1f} to {high:.1f} ms, 99 % {most:.1f} ms")
        return "\n".join(lines)


def measured(kind: type[Scene], settings: Mapping[str, Any], seconds: float) -> SceneLatency:
    """Press the simulated 2 x 2 floor where a scene wants it, at random times, while it plays without sound.

    Raises `UnderfootError` if the engine does not play.
    """
    target = Target(default_floor(), walker=False)
    scene = kind(target.floor, settings, 1)
    session = Session(target, scene.patch(REGISTRY), REGISTRY)
    try:
        forces, vibration = ForceReader(session.memory.force), Reader(session.memory.vibration)
        session.start()
        wait_for(session, session.memory.vibration)
        stage = Stage(session, scene)
        draws, loads, played, presses = random.Random(1), [], [], 0
        pictures: list[tuple[int, int]] = []
        read: list[int] = []
        began = due = time.perf_counter() + 0.5
        paint_due: float = began
        pressing: PressTile | None = None
        while (now_s := time.perf_counter()) < began + seconds:
            stage.take(session.poll())
            read.append(session.health.frame)
            loads.append(forces.read())
            stage.tick()
            if now_s >= paint_due:
                pictures.append((session.health.frame, _content(scene)))
                played.append(vibration.read())
                paint_due = max(paint_due + PICTURE_S, now_s)
            if now_s >= due:
                press = pressing or _press_at(target.floor, draws.choice(scene.places_m()))
                session.send(replace(press, force_n=0.0) if pressing else press)
                presses += pressing is None
                due += UP_S + 0.1 * draws.random() if pressing else DOWN_S
                pressing = None if pressing else press
            time.sleep(LISTEN_S)
        stage.close()
    finally:
        session.close()
    frames = np.concatenate([frames for frames, _ in loads])
    load_n = np.concatenate([force_n for _, force_n in loads]).sum(axis=2)
    read_at = np.repeat(read, [len(frames) for frames, _ in loads])
    first = next(first for first, samples in played if len(samples))
    moved = np.abs(np.concatenate([samples for _, samples in played])) > MOVES
    rate_hz = float(target.rate)
    read_delay_s = np.array([read_at[sample] - frames[sample] for _, sample in _onsets(load_n)]) / rate_hz
    felt, drawn = (
        _vibration_delays_s(frames, load_n, first, moved, rate_hz),
        _picture_delays_s(frames, load_n, pictures, rate_hz),
    )
    return SceneLatency(felt, read_delay_s, drawn, np.array(stage.latencies_s), presses)


def _press_at(floor: Floor, place_m: tuple[float, float]) -> PressTile:
    """A press on the tile that is nearest to a place: there, or on its edge."""
    tile = floor.tiles[floor.index(nearest_tile(floor, *place_m))]
    half_m = 0.5 * np.array(tile.size_m)
    x_m, y_m = np.clip(tile.to_tile(place_m), -half_m, half_m).tolist()
    return PressTile(tile.id, x_m, y_m, PRESS_N)


def requirements(quick: bool = False, progress: Callable[[str], None] = lambda line: None) -> Iterator[Requirement]:
    """Measure how late the frozen pond responds, felt and seen."""
    progress("scenes: presses on the frozen pond")
    found = measured(discover()["frozen-pond"], {}, seconds=15.0 if quick else 60.0)
    for name, values in found.distributions.items():
        for text, share in (("median", 50), ("95 %", 95)):
            value = 1e3 * float(np.percentile(values, share)) if values.size else np.nan
            yield Requirement("scenes", f"frozen pond, {name}: {text}", value, "ms")


def _content(scene: Scene) -> int:
    """Return the amount of content in a scene's picture; fading makes no difference."""
    return sum(len(shape.ends_m) if isinstance(shape, Lines) else 1 for shape in scene.shapes())


def _onsets(load_n: NDArray[np.float64]) -> Iterator[tuple[int, int]]:
    """Yield tile and sample of each onset."""
    for tile in range(load_n.shape[1]):
        on = load_n[:, tile] >= ON_N
        for sample in np.flatnonzero(on[1:] & ~on[:-1]) + 1:
            yield tile, int(sample)


def _picture_delays_s(
    frames: NDArray[np.float64], load_n: NDArray[np.float64], pictures: Sequence[tuple[int, int]], rate_hz: float
) -> NDArray[np.float64]:
    """Return, for each onset, the delay of the first picture with more content than the last one before. `pictures`
    are the frame and the amount of content of each; fading makes no difference.
    """
    at = np.array([frame for frame, _ in pictures])
    found = []
    for _, sample in _onsets(load_n):
        first = int(np.searchsorted(at, frames[sample], "right"))
        before = pictures[first - 1][1] if first else 0
        answer = next((frame for frame, drawn in pictures[first:] if drawn > before), math.inf)
        if first and answer - frames[sample] < MOST_S * rate_hz:
            found.append((answer - float(frames[sample])) / rate_hz)
    return np.array(found)


def _vibration_delays_s(
    frames: NDArray[np.float64], load_n: NDArray[np.float64], first: int, moved: NDArray[np.bool_], rate_hz: float
) -> NDArray[np.float64]:
    """Return, for each onset on a tile that was still, the delay until it moves; nothing if it does not."""
    found = []
    for tile, sample in _onsets(load_n):
        at = math.ceil(frames[sample]) - first
        if at < 0 or moved[max(at - round(_QUIET_S * rate_hz), 0) : at, tile].any():
            continue
        after = np.flatnonzero(moved[at : at + round(MOST_S * rate_hz), tile])
        if after.size:
            found.append(float(after[0]) / rate_hz)
    return np.array(found)
