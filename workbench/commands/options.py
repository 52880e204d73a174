"""The options of a command as records: dataclasses that declare them."""

from collections.abc import Callable, Mapping
from functools import wraps
from pathlib import Path
from typing import Any, TypeVar

import click

from underfoot.commands.files import FILE, OUTPUT, FileOrPreset
from underfoot.errors import BadValue
from underfoot.options import Option, option, options_of

Options = TypeVar("Options")


def click_parameters(owner: type) -> list[click.Parameter]:
    """Return the click parameters for the options and arguments that a dataclass declares."""
    return [
        click.Option([*one.flag.split(), one.name], **_settings(one))
        if one.flag
        else click.Argument([one.name], **_settings(one))
        for one in options_of(owner)
    ]


def _settings(one: Option) -> dict[str, Any]:
    """Return what click takes for an option or an argument besides its names."""
    settings: dict[str, Any] = {"type": _type_of(one)}
    if not one.flag:
        settings |= {"nargs": -1 if one.is_several else 1, "required": not one.is_optional}
    else:
        settings |= {"help": one.doc, "is_flag": one.type is bool, "multiple": one.is_several}
        settings |= {"default": one.default, "show_default": one.type is int and one.default is not None}
    return settings | dict(one.more)


def _type_of(one: Option) -> click.Path | type:
    if one.presets:
        return FileOrPreset(one.presets, one.type)
    if one.is_written:
        return OUTPUT
    return FILE if one.type is Path else one.type


def chosen(owner: type[Options], given: Mapping[str, object]) -> Options:
    """Return the dataclass with its own options' values, out of the values of all options of a command."""
    return owner(**{one.name: given[one.name] for one in options_of(owner)})


def command(*kinds: type, help: str | None = None) -> Callable[[Callable[..., None]], click.Command]:
    """Make a click command of a function that takes a record of options of each of the dataclasses `kinds`.

    Its help is the function's docstring, if no other is given.

    >>> from dataclasses import dataclass
    >>> @dataclass(frozen=True)
    ... class PlayOptions:
    ...     block: int = option("Frames per block.", 64)
    >>> @command(PlayOptions)
    ... def play(options: PlayOptions) -> None:
    ...     print(options.block)
    >>> play(["--block", "7"], standalone_mode=False)
    7
    """

    def wrap(run: Callable[..., None]) -> click.Command:
        @wraps(run)
        def called(**given: object) -> None:
            run(*(chosen(kind, given) for kind in kinds))

        parameters = [one for kind in kinds for one in click_parameters(kind)]
        return click.command(params=parameters, help=help)(called)

    return wrap


SECONDS: float | None = option("Stop after this long.")
"""The option of every command that otherwise goes on until Ctrl-C."""

FIGURES_AS_JSON: bool = option("Print all figures as JSON.", False, "--json")
"""The option of every command whose result is figures."""


def require_seconds(seconds: float | None) -> None:
    """Raise `BadValue` for a `--seconds` that is given and not above 0.

    >>> require_seconds(-1.0)
    Traceback (most recent call last):
    underfoot.errors.BadValue: --seconds is -1; allowed: above 0
    """
    if seconds is not None and not seconds > 0.0:
        raise BadValue(f"--seconds is {seconds:g}; allowed: above 0")


def require_only(options: object, mode: str, used: str) -> None:
    """Raise `BadValue` for an option that is given, and of which nothing would come.

    `mode` says what is done instead of all else, and may be the option that chooses it; `used` are the options that
    count then.

    >>> from dataclasses import dataclass
    >>> @dataclass(frozen=True)
    ... class PlayOptions:
    ...     file: str | None = option("What to play.")
    ...     list: bool = option("List what there is.", False)
    >>> require_only(PlayOptions(list=True), "--list", "")
    >>> require_only(PlayOptions("a.wav", list=True), "--list", "")
    Traceback (most recent call last):
    underfoot.errors.BadValue: --file is given with --list; allowed: --list alone
    """
    flags = {one.flag.split()[-1]: one for one in options_of(type(options)) if one.flag}
    allowed = used.split()
    assert flags.keys() >= set(allowed), allowed
    for flag, one in flags.items():
        if flag not in (mode, *allowed) and getattr(options, one.name) != one.default:
            raise BadValue(f"{flag} is given with {mode}; allowed: {', '.join(allowed) or f'{mode} alone'}")


def two_numbers(flag: str, text: str, allowed: str) -> tuple[float, float]:
    """Return the numbers on both sides of a colon; raise `BadValue` for another text.

    >>> two_numbers("--modulus", "1:220", "LOW:HIGH, as 5:50")
    (1.0, 220.0)
    """
    first, _, second = text.partition(":")
    try:
        return float(first), float(second)
    except ValueError:
        raise BadValue(f"{flag} is {text!r}; allowed: {allowed}") from None
