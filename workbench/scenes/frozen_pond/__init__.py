"""The frozen pond (thesis 5.5): cracks that are seen, heard and felt, from one process."""

import math
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from underfoot.floor.contacts import OngoingContact
from underfoot.floor.layout import Floor
from underfoot.layouts import Memory
from underfoot.models import elasto_plastic
from underfoot.models.elasto_plastic import Ground
from underfoot.models.signals.events import event_list
from underfoot.models.signals.random import stream_key
from underfoot.parameters import Count, Number
from underfoot.quantities import counted
from underfoot.scenes.cues import Cue, Strike
from underfoot.scenes.frozen_pond.cracks import Cracks
from underfoot.scenes.moments import MOMENT_S, Moment
from underfoot.scenes.scene import Scene
from underfoot.scenes.shapes import Disc, Lines, Polygon, Shape

RATE_HZ = 1000.0
"""Rate of the ice model: that of the tiles' samples."""
FRESH_S = 0.25
"""Time for which a new crack is bright."""
MOST_FRESH = 250
"""Most lines that are bright at once."""
ICE, GLOW, FRESH, LIGHT = "#0b2a3d", "#30586b", "#ffffff", "#9fe3f5"
AGES = "#264658", "#416273", "#658898", "#a4cad7"
"""Colours of cracks, the oldest first: they sink into the ice before they close."""
YOUNGER = 0.5, 0.25, 0.06
"""Shares of the most lines that are younger than each age but the last."""


class FrozenPond(Scene):
    """Each slip of the ice is a strike on the nearest tile, and makes the cracks grow."""

    title = "Frozen pond"
    doc = (
        "Ice that cracks under the feet. A load makes the sheet slip again and again (5.4); each slip sets an energy "
        "free, which is felt and heard as one blow on the tile, and seen as one growth of the cracks."
    )
    threshold_n = Number(
        100.0, 10.0, 1000.0, unit="N", scale="log", label="Threshold", doc="force at which the ice slips: thin ice 30"
    )
    spread = Number(0.4, 0.0, 0.9, doc="how much thresholds vary, of their mean")
    gamma = Number(1.5, 0.0, 4.0, doc="exponent of the distribution of energies: the larger, the fewer large cracks")
    growth_m_per_j = Number(
        6.0, 0.1, 100.0, unit="m/J", scale="log", label="Growth", doc="how far a crack runs for its energy"
    )
    turn = Number(0.35, 0.0, 2.0, doc="standard deviation of a crack's turn from line to line")
    spacing_m = Number(0.12, 0.02, 1.0, unit="m", label="Spacing", doc="nearer to a seed no other one begins")
    most_lines = Count(2000, 100, 4000, doc="of more lines the oldest close again; from the next start on")

    def __init__(self, floor: Floor, given: Mapping[str, Any] | None = None, seed: int = 1) -> None:
        self._coefficients = elasto_plastic.COEFFICIENTS.zeros()
        super().__init__(floor, given, seed)
        low, high = floor.bounds_m()
        self.cracks = Cracks((low[0], low[1]), (high[0], high[1]), self.given["most_lines"])
        self.slips = 0
        self._feet: dict[int, _Foot] = {}
        self._contacts: tuple[OngoingContact, ...] = ()
        self._grown: list[tuple[float, int]] = []  # time, and number of lines before
        self._events = event_list(room=_SAMPLES)
        self._displacement = np.zeros(_SAMPLES)
        self._design()

    def change(self, name: str, value: object) -> None:
        super().change(name, value)
        self._design()

    def step(self, moment: Moment) -> Iterable[Cue]:
        self._contacts = moment.contacts
        self._grown = [(at_s, count) for at_s, count in self._grown if at_s > moment.time_s - FRESH_S]
        standing = {contact.id for contact in moment.contacts}
        self._feet = {id: foot for id, foot in self._feet.items() if id in standing}
        first = round(moment.began_s * RATE_HZ)
        slips = [
            (time_s, energy_j, contact)
            for contact in moment.contacts
            for time_s, energy_j in self._slip(contact, first)
        ]
        for time_s, energy_j, contact in sorted(slips, key=lambda slip: slip[0]):
            at_m = contact.x_m, contact.y_m
            before = self.cracks.count
            self.cracks.grow(
                at_m,
                self.given["growth_m_per_j"] * energy_j,
                self.given["spacing_m"],
                self.given["turn"],
                self.draws,
            )
            self._grown.append((moment.time_s, before))
            self.slips += 1
            yield Strike("crack", *at_m, min(math.sqrt(energy_j / MOST_J), 1.0), time_s)

    def shapes(self) -> Iterable[Shape]:
        for tile in self.floor.tiles:
            yield Polygon(tile.corners_m(), ICE)
        fresh_m = self.cracks.latest_m(self._grown[0][1] if self._grown else self.cracks.count)[-MOST_FRESH:]
        yield Lines(fresh_m, GLOW, 0.014)
        lines_m = self.cracks.lines_m
        cuts = [max(len(lines_m) - round(share * self.cracks.most), 0) for share in YOUNGER]
        for aged_m, colour in zip(np.split(lines_m, cuts), AGES, strict=True):
            yield Lines(aged_m, colour, 0.0025)
        for contact in self._contacts:
            radius_m = 0.06 + 0.08 * min(contact.force_n / 700.0, 1.0)
            for share in np.linspace(1.0, 0.05, 20):  # each edge fainter than can be seen
                yield Disc(contact.x_m, contact.y_m, share * radius_m, LIGHT, 0.02)
        yield Lines(fresh_m, FRESH, 0.004)

    @property
    def state(self) -> str:
        seeds, lines = counted(len(self.cracks.seeds), "seed"), counted(self.cracks.count, "line")
        return f"{counted(self.slips, 'slip')}, {seeds}, {lines}"

    def _slip(self, contact: OngoingContact, first: int) -> Iterable[tuple[float, float]]:
        """Return time and energy of the slips under a contact in one moment; its force is linear over the moment."""
        foot = self._feet.setdefault(contact.id, _Foot(self.seed, contact.id))
        force_n = np.linspace(foot.force_n, contact.force_n, _SAMPLES + 1)[1:]
        foot.force_n = contact.force_n
        events, moved = self._events, self._displacement
        events.count = 0.0
        elasto_plastic.run(force_n, foot.key, first, self._coefficients, foot.ice, moved, events, moved[:0])
        for k in range(len(events)):
            yield events.time[k] / RATE_HZ, float(events.strength[k])

    def _design(self) -> None:
        given = self.given
        ground = Ground(
            threshold_n=given["threshold_n"],
            spread=given["spread"],
            gamma=given["gamma"],
            least_j=LEAST_J,
            most_j=MOST_J,
        )
        elasto_plastic.design(ground.parameters(), MOST_J, MOST_J, 1.0, RATE_HZ, self._coefficients)


LEAST_J, MOST_J = 2e-4, 2e-2
"""Range of the energies of slips; the largest gives a strike of strength 1."""
_SAMPLES = round(MOMENT_S * RATE_HZ)


class _Foot:
    """The ice under one contact: intact when it begins, worn while it lasts."""

    def __init__(self, seed: int, contact: int) -> None:
        self.key = stream_key(seed, "pond", contact)
        self.ice: Memory = elasto_plastic.STATE.zeros()
        self.force_n = 0.0
