"""The options of a command as one record: a dataclass."""

from collections.abc import Callable, Mapping
from functools import wraps
from pathlib import Path
from typing import TypeVar

import click

from underfoot.commands.files import FILE, OUTPUT, FileOrPreset
from underfoot.errors import BadValue
from underfoot.options import Option, options_of

Options = TypeVar("Options")


FIGURES_AS_JSON = click.option("--json", "as_json", is_flag=True, help="Print all figures as JSON.")
"""The option of every command whose result is figures."""


def click_parameters(owner: type) -> list[click.Parameter]:
    """Return the click parameters for the options that a dataclass declares."""
    return [
        click.Option(
            [one.flag, one.name],
            type=_type_of(one),
            is_flag=one.type is bool,
            default=one.default,
            show_default=one.type is int and one.default is not None,
            help=one.doc,
        )
        for one in options_of(owner)
    ]


def _type_of(one: Option) -> click.Path | type:
    if one.presets:
        return FileOrPreset(one.presets)
    if one.is_written:
        return OUTPUT
    return FILE if one.type is Path else one.type


def chosen(owner: type[Options], given: Mapping[str, object]) -> Options:
    """Return the dataclass with its own options' values, out of the values of all options of a command."""
    return owner(**{one.name: given[one.name] for one in options_of(owner)})


def takes_options(kind: type[Options]) -> Callable[[Callable[[Options], None]], Callable[..., None]]:
    """Let click call a function with one dataclass `kind`, whose fields bear the names of the options.

    >>> from dataclasses import dataclass
    >>> @dataclass(frozen=True)
    ... class Options:
    ...     seconds: float
    ...     block: int
    >>> @takes_options(Options)
    ... def play(options: Options) -> None:
    ...     print(options.seconds)
    >>> play(block=64, seconds=0.5)
    0.5
    """

    def wrap(command: Callable[[Options], None]) -> Callable[..., None]:
        @wraps(command)
        def run(**given: object) -> None:
            command(kind(**given))

        return run

    return wrap


SECONDS = click.option("--seconds", type=float, help="Stop after this long.")
"""The option of every command that otherwise goes on until Ctrl-C."""


def require_seconds(seconds: float | None) -> None:
    """Raise `BadValue` for a `--seconds` that is given and not above 0.

    >>> require_seconds(-1.0)
    Traceback (most recent call last):
    underfoot.errors.BadValue: --seconds is -1; allowed: above 0
    """
    if seconds is not None and not seconds > 0.0:
        raise BadValue(f"--seconds is {seconds:g}; allowed: above 0")
