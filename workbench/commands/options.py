"""The options of a command as records: dataclasses that declare them."""

from collections.abc import Callable
from functools import wraps
from pathlib import Path
from typing import Any

import click

from underfoot.commands.files import FILE, OUTPUT, FileOrPreset
from underfoot.errors import BadValue
from underfoot.options import Option, option, options_of


def command(
    *kinds: type, name: str | None = None, help: str | None = None
) -> Callable[[Callable[..., None]], click.Command]:
    """Make a click command of a function that takes a record of options of each of the dataclasses `kinds`.

    Its name is the function's, and its help the docstring, if no other is given.

    >>> from dataclasses import dataclass
    >>> @dataclass(frozen=True)
    ... class PlayOptions:
    ...     block: int = option("Frames per block.", 64)
    >>> @command(PlayOptions)
    ... def play(options: PlayOptions) -> None:
    ...     print(options.block)
    >>> play(["--block", "7"], standalone_mode=False)
    7
    >>> print(play.get_help(click.Context(play)).splitlines()[3])
      --block INTEGER  Frames per block.  [default: 64]
    """
    options = {kind: options_of(kind) for kind in kinds}

    def wrap(run: Callable[..., None]) -> click.Command:
        @wraps(run)
        def called(**given: object) -> None:
            run(*(kind(**{one.name: given[one.name] for one in of}) for kind, of in options.items()))

        parameters = [_parameter(one) for of in options.values() for one in of]
        return click.command(name, params=parameters, help=help)(called)

    return wrap


def _parameter(one: Option) -> click.Parameter:
    """Return the click parameter for an option or an argument."""
    settings: dict[str, Any] = {"type": _type_of(one)}
    if not one.flag:
        settings |= {"nargs": -1 if one.is_several else 1, "required": not one.is_optional}
        return click.Argument([one.name], **settings | dict(one.more))
    settings |= {"help": one.doc, "is_flag": one.type is bool, "multiple": one.is_several}
    settings |= {"default": one.default, "show_default": one.type is int and one.default is not None}
    return click.Option([*one.flag.split(), one.name], **settings | dict(one.more))


def _type_of(one: Option) -> click.Path | type:
    if one.presets:
        return FileOrPreset(one.presets, one.type)
    if one.is_written:
        return OUTPUT
    return FILE if one.type is Path else one.type


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
