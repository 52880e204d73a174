"""The methods, one file each in this folder; `METHODS` holds them by kind."""

import inspect

from underfoot.experiments.method import Method
from underfoot.plugins import values_in

METHODS = {
    value.kind: value
    for value in values_in(__name__)
    if isinstance(value, type) and issubclass(value, Method) and not inspect.isabstract(value)
}
"""Every method by its kind."""
