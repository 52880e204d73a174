"""Import of statsmodels on first use, with an error that says how to install it."""

from importlib import import_module
from types import ModuleType

from underfoot.errors import BadValue


def statsmodels(module: str) -> ModuleType:
    """Import a module of statsmodels, such as "stats.anova"; raise `BadValue` if the package is not installed."""
    try:
        return import_module(f"statsmodels.{module}")
    except ModuleNotFoundError:
        raise BadValue('the analysis needs the package statsmodels: pip install "underfoot[analysis]"') from None
