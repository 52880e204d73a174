"""The methods, one file each in this folder; `METHODS` holds them by kind."""

import importlib
import inspect
import pkgutil

from underfoot.experiments.method import Method


def discover() -> dict[str, type[Method]]:
    """Return every method that the modules of this folder declare, by its kind.

    >>> "staircases" in discover()
    True
    """
    found: dict[str, type[Method]] = {}
    for module in pkgutil.iter_modules(__path__):
        for value in vars(importlib.import_module(f"{__name__}.{module.name}")).values():
            if isinstance(value, type) and issubclass(value, Method) and not inspect.isabstract(value):
                found[value.kind] = value
    return found


METHODS = discover()
"""Every method by its kind."""
