"""The acceleration at full scale of a file, whose format has amplitudes from 0 to 1: stated in its description."""

import math
import re

FULL_M_S2 = 5.0
"""Acceleration of full scale if the file does not state it: that of a new tone."""
_SCALE = re.compile(r"1 is ([0-9.eE+-]+) m/s\^2")


def scale_in_words(full_m_s2: float) -> str:
    """Return the description with which our files state their scale.

    >>> scale_from_words(scale_in_words(7.25)), scale_from_words("of another program")
    (7.25, 5.0)
    """
    return f"1 is {full_m_s2:.6g} m/s^2"


def scale_from_words(description: str) -> float:
    """Return the scale in m/s^2 stated in a description, or `FULL_M_S2`."""
    found = _SCALE.search(description)
    try:
        value = float(found[1]) if found else FULL_M_S2
    except ValueError:
        return FULL_M_S2
    return value if 0.0 < value < math.inf else FULL_M_S2
