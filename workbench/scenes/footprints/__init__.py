"""Footprints: a trail of steps that fades, counted, with the length of each: for rehabilitation and play."""

import math
from collections import deque
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from underfoot.floor.contacts import OngoingContact
from underfoot.floor.footsteps import Step
from underfoot.floor.layout import Floor
from underfoot.nodes import REGISTRY
from underfoot.parameters import Choice, Number
from underfoot.patch import preset_files
from underfoot.patch.patch import Patch
from underfoot.quantities import counted
from underfoot.scenes.cues import Cue, Play, Say
from underfoot.scenes.moments import Moment
from underfoot.scenes.scene import Scene
from underfoot.scenes.shapes import Disc, Lines, Polygon, Shape, Text

GROUNDS = {"silent": "", "gravel": "gravel", "snow": "snow", "sand": "material-sand-dry", "leaves": "material-leaves"}
LEFT, RIGHT, EITHER, WORDS = "#3fc1c9", "#f0a63c", "#7ed491", "#dfe5ec"
MOST_PRINTS = 60
APART_S = 0.3
"""Longest time between the beginnings of a print and of its step, which is of feet as they turned out to be."""
BALL = 0.22
"""Distance of the ball's centre from the sole's, as a share of its length."""
SOLE_M = (0.29, 0.105)
"""Length and width of a drawn sole."""
SOLE = (
    ((50, -12), (47, -36), (36, -50), (22, -49), (-4, -24), (-7, 2), (-4, 34), (10, 46), (24, 50), (37, 41), (46, 20)),
    ((-17, -24), (-30, -33), (-42, -29), (-49, -8), (-49, 14), (-42, 33), (-30, 37), (-17, 34), (-13, 5)),
)
"""Corners of a left shoe's sole and heel, which are rounded: to the toes and outwards, in % of its length and width."""
WORDS_M = (0.12, 0.035)
"""Space for the text of a step length."""


@dataclass
class Print:
    """One footprint: path of the centre of pressure, the tiles that it was on and, when known, the step."""

    contact: OngoingContact
    first_m: tuple[float, float]
    sum_m: NDArray[np.float64]
    tiles: frozenset[int]
    count: int = 1
    ended_s: float = math.inf
    step: Step | None = None

    @property
    def at_m(self) -> NDArray[np.float64]:
        """The mean place of the contact."""
        return self.sum_m / self.count

    def follow(self, contact: OngoingContact) -> None:
        """Add the contact's present place."""
        self.contact = contact
        self.tiles |= set(contact.tiles)
        self.sum_m = self.sum_m + np.array([contact.x_m, contact.y_m])
        self.count += 1


class Footprints(Scene):
    """A disc when a foot comes down; a sole with side and step length when these are known."""

    title = "Footprints"
    doc = (
        "A trail of footprints that fades. A print is there as the foot comes down, and becomes a left or right sole "
        "with the length of its step a second later. Steps are counted; the ground can be gravel, snow, sand or leaves."
    )
    fades_s = Number(
        8.0,
        0.5,
        120.0,
        unit="s",
        scale="log",
        label="Fades after",
        doc=f"how long a print is seen after its foot; of more than {MOST_PRINTS} the oldest go",
    )
    ground = Choice("silent", options=tuple(GROUNDS), doc="what the floor feels like")
    gain = Number(1.0, 0.0, 1.0, scale="gain", doc="of the ground")

    def __init__(self, floor: Floor, given: Mapping[str, Any] | None = None, seed: int = 1) -> None:
        super().__init__(floor, given, seed)
        self.prints: deque[Print] = deque(maxlen=MOST_PRINTS)
        self.steps = 0
        self.lengths_mm: list[float] = []
        self._now_s = 0.0
        self._played: tuple[str, float] = ("silent", 1.0)

    def step(self, moment: Moment) -> Iterable[Cue]:
        self._now_s = moment.time_s
        wanted = (self.given["ground"], self.given["gain"])
        if wanted != self._played:
            self._played = wanted
            yield Play(_ground(wanted[0]), gain=wanted[1])
        standing = {one.contact.id: one for one in self.prints if one.ended_s == math.inf}
        for contact in moment.contacts:
            if contact.id in standing:
                standing[contact.id].follow(contact)
            else:
                here = (contact.x_m, contact.y_m)
                self.prints.append(Print(contact, here, np.array(here), frozenset(contact.tiles)))
        for contact in moment.up:
            if contact.id in standing:
                standing[contact.id].ended_s = moment.time_s
        while self.prints and self._now_s - self.prints[0].ended_s > self.given["fades_s"]:
            self.prints.popleft()
        for step in moment.steps:
            yield from self._count(step)

    def shapes(self) -> Iterable[Shape]:
        for one in self.prints:
            yield from _shapes_of(one, self._opacity(one))
        yield from self._lengths()
        low, high = self.floor.bounds_m()
        yield Text(0.5 * (low[0] + high[0]), high[1] - 0.035, counted(self.steps, "step"), 0.03, WORDS)

    def _lengths(self) -> Iterable[Shape]:
        """Return texts with the length of each step; of two that overlap, only the later one."""
        places: list[tuple[float, float]] = []
        for one in reversed(self.prints):
            if one.step is None or not math.isfinite(one.step.heading_deg + one.step.step_length_mm):
                continue
            (x, y), heading_rad = one.at_m.tolist(), math.radians(one.step.heading_deg)
            x, y = x + BALL * SOLE_M[0] * math.cos(heading_rad), y + BALL * SOLE_M[0] * math.sin(heading_rad)
            if all(abs(x - other[0]) > WORDS_M[0] or abs(y - other[1]) > WORDS_M[1] for other in places):
                places.append((x, y))
                yield Text(x, y, f"{0.1 * one.step.step_length_mm:.0f} cm", 0.018, "#ffffff", self._opacity(one))

    def _opacity(self, one: Print) -> float:
        """Return 1 while the foot stands, then ever less: a print is behind the new ones at once, and gone slowly."""
        return max(1.0 - max(self._now_s - one.ended_s, 0.0) / self.given["fades_s"], 0.0) ** 2

    @property
    def state(self) -> str:
        lengths = self.lengths_mm
        mean = f", mean length {sum(lengths) / len(lengths):.0f} mm" if lengths else ""
        return f"{counted(self.steps, 'step')}{mean}"

    def _count(self, step: Step) -> Iterable[Cue]:
        self.steps += 1
        length = ""
        if math.isfinite(step.step_length_mm):
            self.lengths_mm.append(step.step_length_mm)
            del self.lengths_mm[:-1000]
            length = f", {step.step_length_mm:.0f} mm"
        tile = self.floor.index(step.tile)
        there = [one for one in self.prints if one.step is None and tile in one.tiles]
        nearest = min(there, key=lambda one: abs(one.contact.start_s - step.start_s), default=None)
        if nearest is not None and abs(nearest.contact.start_s - step.start_s) < APART_S:
            nearest.step = step
        yield Say(f"step {step.step}, {step.side}{length}")


def _ground(name: str) -> Patch | None:
    """Return the preset of a ground; None for none."""
    return Patch.load(preset_files.patches()[GROUNDS[name]], REGISTRY) if GROUNDS[name] else None


def _shapes_of(one: Print, opacity: float) -> Iterable[Shape]:
    x, y = one.at_m.tolist()
    step = one.step
    if step is None or not math.isfinite(step.heading_deg):
        yield Disc(x, y, 0.045, EITHER, 0.25 * opacity)
        yield Disc(x, y, 0.045, EITHER, opacity, rim_m=0.004)
        yield Lines(np.array([[one.first_m, (one.contact.x_m, one.contact.y_m)]]), WORDS, 0.006, 0.6 * opacity)
        return
    colour = {"left": LEFT, "right": RIGHT}.get(step.side, EITHER)
    heading_rad = math.radians(step.heading_deg)
    turn = np.array([[math.cos(heading_rad), math.sin(heading_rad)], [-math.sin(heading_rad), math.cos(heading_rad)]])
    for part in _ROUNDED:
        yield Polygon(part * (1.0, -1.0 if step.side == "right" else 1.0) @ turn + (x, y), colour, 0.85 * opacity)


def _rounded(corners: ArrayLike) -> NDArray[np.float64]:
    """Return a closed outline without its corners, in metres: each is cut at a quarter of its sides (Chaikin)."""
    points = 0.01 * np.array(corners) * SOLE_M
    for _ in range(2):
        after = np.roll(points, -1, axis=0)
        points = np.stack([0.75 * points + 0.25 * after, 0.25 * points + 0.75 * after], axis=1).reshape(-1, 2)
    return points


_ROUNDED = tuple(_rounded(corners) for corners in SOLE)
