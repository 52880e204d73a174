"""The values at the cursor as text: N, m/s², Hz and dB."""

import math

import numpy as np
from numpy.typing import NDArray

from underfoot.floor.contacts import OngoingContact
from underfoot.floor.layout import Floor
from underfoot.quantities import quantity
from underfoot.widgets.recordings.reader import CursorValues, Vibration
from underfoot.widgets.recordings.tracks import RecordingContent, time_text


def readout_text(floor: Floor, values: CursorValues, baseline_n: NDArray[np.floating], time_s: float) -> str:
    """Return one line: time, force of all tiles and of the selected one, its commanded and measured vibration.

    >>> from underfoot.floor.layout import default_floor
    >>> corners = np.array([[100.0, 200.0, 200.0, 100.0], [0.0, 0.0, 0.0, 0.0]])
    >>> values = CursorValues(0.0, 0, corners, {"commanded": Vibration(0.5, -9.03, 200.0)})
    >>> readout_text(default_floor(1, 2), values, np.zeros(3), 1.5)
    '1.500 s  ·  all tiles 600 N  ·  tile t1 600 N  ·  commanded 0.5 m/s² at 200 Hz, −9.0 dB'
    """
    parts = [time_text(time_s)]
    if values.corners_n is None:
        parts.append("no force sample here")
    else:
        loads = values.corners_n.sum(axis=1) - baseline_n[:-1]
        parts.append(f"all tiles {_rounded(float(np.nansum(loads)))} N")
        parts.append(f"tile {floor.tiles[values.tile].id} {_rounded(float(np.nan_to_num(loads[values.tile])))} N")
    parts += [f"{source} {vibration_text(one)}" for source, one in values.vibration.items()]
    return "  ·  ".join(parts)


def contacts_at(content: RecordingContent, time_s: float) -> list[OngoingContact]:
    """Return the contacts at `time_s` of the recording, each with its centroid and person."""
    begun, over = (content.spans_s[:, column] for column in (0, 1))
    found = []
    for place in np.flatnonzero((begun <= time_s) & (time_s <= over)).tolist():
        contact = content.contacts[place]
        number = content.number_of.get(contact.id)
        person = content.steps[number].step.person if number is not None else 0
        if contact.places:
            found.append(OngoingContact(contact.id, *contact.at(time_s), contact.tiles, contact.start_s, person))
    return found


def vibration_text(one: Vibration) -> str:
    """Return peak acceleration, strongest frequency, and level in dB re 1 m/s² as text.

    >>> vibration_text(Vibration(0.0, -math.inf, math.nan))
    'still'
    """
    if not math.isfinite(one.level_db):
        return "still"
    return f"{quantity(one.peak_m_s2, 'm/s^2')} at {one.frequency_hz:.0f} Hz, {one.level_db:.1f} dB".replace("-", "−")


def _rounded(force_n: float) -> str:
    return f"{round(force_n)}".replace("-", "−")
