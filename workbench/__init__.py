"""Underfoot: a workbench for vibrotactile floors. Nothing here imports Qt, but for `underfoot.widgets`."""

__version__ = "0.1.0"
