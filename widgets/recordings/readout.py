"""What there is at the cursor, in words: newtons, m/s², hertz and decibels."""

import math

import numpy as np
from numpy.typing import NDArray

from underfoot.floor.contacts import OngoingContact
from underfoot.floor.layout import Floor
from underfoot.quantities import quantity
from underfoot.widgets.recordings.lanes import Content, time_in_words
from underfoot.widgets.recordings.reader import Moment, Vibration


def readout_of(floor: Floor, moment: Moment, rest_n: NDArray[np.floating], time_s: float) -> str:
    """One line: time, force of all tiles and of the chosen one, what that was asked and did.

    >>> from underfoot.floor.layout import default_floor
    >>> corners = np.array([[100.0, 200.0, 200.0, 100.0], [0.0, 0.0, 0.0, 0.0]])
    >>> moment = Moment(0.0, 0, corners, {"commanded": Vibration(0.5, -9.03, 200.0)})
    >>> readout_of(default_floor(1, 2), moment, np.zeros(3), 1.5)
    '1.500 s  ·  all tiles 600 N  ·  tile t1 600 N  ·  commanded 0.5 m/s² at 200 Hz, −9.0 dB'
    """
    parts = [time_in_words(time_s)]
    if moment.corners_n is None:
        parts.append("no force sample here")
    else:
        loads = moment.corners_n.sum(axis=1) - rest_n[:-1]
        parts.append(f"all tiles {_rounded(float(np.nansum(loads)))} N")
        parts.append(f"tile {floor.tiles[moment.tile].id} {_rounded(float(np.nan_to_num(loads[moment.tile])))} N")
    parts += [f"{source} {vibration_in_words(one)}" for source, one in moment.vibration.items()]
    return "  ·  ".join(parts)


def contacts_at(content: Content, time_s: float) -> list[OngoingContact]:
    """The contacts at a second of the recording, each where it presses, with its person."""
    begun, over = (content.spans_s[:, column] for column in (0, 1))
    found = []
    for place in np.flatnonzero((begun <= time_s) & (time_s <= over)).tolist():
        contact = content.contacts[place]
        number = content.number_of.get(contact.id)
        person = content.steps[number].step.person if number is not None else 0
        if contact.places:
            found.append(OngoingContact(contact.id, *contact.at(time_s), contact.tiles, contact.start_s, person))
    return found


def vibration_in_words(one: Vibration) -> str:
    """Largest acceleration, strongest frequency, and level in dB of 1 m/s².

    >>> vibration_in_words(Vibration(0.0, -math.inf, math.nan))
    'still'
    """
    if not math.isfinite(one.level_db):
        return "still"
    return f"{quantity(one.peak_m_s2, 'm/s^2')} at {one.frequency_hz:.0f} Hz, {one.level_db:.1f} dB".replace("-", "−")


def _rounded(force_n: float) -> str:
    return f"{round(force_n)}".replace("-", "−")
