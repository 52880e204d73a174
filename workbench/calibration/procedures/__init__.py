"""Calibration procedures, one per file. `CALIBRATIONS` collects them."""

from underfoot.calibration.declaration import Calibration
from underfoot.floor.profile_parts import PARTS
from underfoot.plugins import values_in


def discover() -> dict[str, type[Calibration]]:
    """Return every calibration declared by this package's modules, by kind, in the order of a profile's parts.

    >>> list(discover())
    ['fsr', 'centroid', 'response', 'latency', 'plate']
    """
    found = {
        value.kind: value
        for value in values_in(__name__)
        if isinstance(value, type) and issubclass(value, Calibration) and value is not Calibration
    }
    return {kind: found[kind] for kind in (*PARTS, *found) if kind in found}


CALIBRATIONS = discover()
