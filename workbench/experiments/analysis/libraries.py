"""statsmodels, imported where it is used; one line says how to install it where it is missing."""

from importlib import import_module
from typing import Any

from underfoot.errors import BadValue


def statsmodels(module: str) -> Any:
    """A module of statsmodels, such as "stats.anova"; `BadValue` where the package is not installed."""
    try:
        return import_module(f"statsmodels.{module}")
    except ModuleNotFoundError:
        raise BadValue('the analysis needs the package statsmodels: pip install "underfoot[analysis]"') from None
