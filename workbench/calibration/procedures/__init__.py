"""Calibration procedures, one per file. `CALIBRATIONS` collects them."""

import importlib
import pkgutil

from underfoot.calibration.declaration import Calibration


def discover() -> dict[str, type[Calibration]]:
    """Return every calibration declared by this package's modules, by kind, each after the one that it requires.

    >>> list(discover())
    ['fsr', 'centroid', 'latency', 'plate', 'response']
    """
    found = {}
    for module in pkgutil.iter_modules(__path__):
        for value in vars(importlib.import_module(f"{__name__}.{module.name}")).values():
            if isinstance(value, type) and issubclass(value, Calibration) and value is not Calibration:
                found[value.kind] = value
    ordered: dict[str, type[Calibration]] = {}
    for kind in sorted(found):
        if found[kind].requires:
            ordered.setdefault(found[kind].requires, found[found[kind].requires])
        ordered.setdefault(kind, found[kind])
    return ordered


CALIBRATIONS = discover()
