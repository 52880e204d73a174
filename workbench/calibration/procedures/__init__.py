"""Calibration procedures, one per file. `CALIBRATIONS` collects them."""

from underfoot.calibration.declaration import Calibration
from underfoot.plugins import values_in


def discover() -> dict[str, type[Calibration]]:
    """Return every calibration declared by this package's modules, by kind, each after the one that it requires.

    >>> list(discover())
    ['fsr', 'centroid', 'latency', 'plate', 'response']
    """
    found = {
        value.kind: value
        for value in values_in(__name__)
        if isinstance(value, type) and issubclass(value, Calibration) and value is not Calibration
    }
    ordered: dict[str, type[Calibration]] = {}
    for kind in sorted(found):
        if found[kind].requires:
            ordered.setdefault(found[kind].requires, found[found[kind].requires])
        ordered.setdefault(kind, found[kind])
    return ordered


CALIBRATIONS = discover()
