"""Contacts, steps and forces as streams of the Lab Streaming Layer (`pip install "underfoot[lsl]"`)."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from underfoot.floor.footsteps import Step
from underfoot.floor.layout import Floor
from underfoot.network.live_contacts import LiveContact
from underfoot.network.lsl_library import Channel, lsl_library, outlet
from underfoot.network.session_clock import SessionClock

SIDES = {"left": -1.0, "unknown": 0.0, "right": 1.0}

CONTACT: tuple[Channel, ...] = (("contact", ""), ("x", "m"), ("y", "m"), ("force", "N"), ("person", ""))
STEP: tuple[Channel, ...] = (
    ("step", ""), ("contact", ""), ("person", ""), ("side", "-1 left, 1 right"), ("tile", "place in the floor"),
    ("contact_ms", "ms"), ("peak1_n", "N"), ("valley_n", "N"), ("peak2_n", "N"), ("impulse_ns", "N s"),
    ("loading_kn_s", "kN/s"),
)  # fmt: skip


class LslStreams:
    """Four outlets: `Underfoot live force`, `... contacts`, `... steps` and `... marks`.

    `at_s` are times of the LSL clock, which `clock` returns for those of the session.
    """

    def __init__(self, floor: Floor, force_hz: float) -> None:
        """Raise `BadValue` if the package pylsl is not installed."""
        self.clock = SessionClock(lsl_library().local_clock)
        self._floor = floor
        tiles = [(tile.id, "N") for tile in floor.tiles]
        self._force = outlet("live force", "Force", force_hz, "float32", tiles)
        self._contacts = outlet("live contacts", "Contacts", 0.0, "double64", CONTACT)
        self._steps = outlet("live steps", "Gait", 0.0, "double64", STEP)
        self._marks = outlet("live marks", "Markers", 0.0, "string", [("mark", "")])

    def force(self, force_n: NDArray[np.float64], at_s: float) -> None:
        """Send loads (n, tiles), the last of them at this time."""
        if len(force_n):
            rows = np.ascontiguousarray(force_n, np.float32).tolist()
            self._force.push_chunk(rows, at_s)

    def contacts(self, contacts: Sequence[LiveContact], at_s: float) -> None:
        """Send one sample for each contact, with a common time."""
        for contact in contacts:
            self._contacts.push_sample([contact.id, contact.x_m, contact.y_m, contact.force_n, contact.person], at_s)

    def step(self, step: Step, contact: int, at_s: float) -> None:
        """Send a step that began at this time, of the contact with this sent id."""
        figures = [getattr(step, name) for name, _ in STEP[5:]]
        place = self._floor.index(step.tile)
        sample = [step.step, contact, step.person, SIDES.get(step.side, 0.0), place, *figures]
        self._steps.push_sample([float(value) for value in sample], at_s)

    def mark(self, text: str, at_s: float) -> None:
        """Send a mark, set at this time."""
        self._marks.push_sample([text], at_s)

    def close(self) -> None:
        """End all streams."""
        del self._force, self._contacts, self._steps, self._marks
