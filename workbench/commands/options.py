"""One record of options in place of an argument for each."""

from collections.abc import Callable
from functools import wraps
from typing import Any, TypeVar

Options = TypeVar("Options")


def grouped(kind: type[Options]) -> Callable[[Callable[[Options], None]], Callable[..., None]]:
    """Let click call a function with one dataclass `kind`, whose fields bear the names of the options.

    >>> from dataclasses import dataclass
    >>> @dataclass(frozen=True)
    ... class Options:
    ...     seconds: float
    ...     block: int
    >>> @grouped(Options)
    ... def play(options: Options) -> None:
    ...     print(options.seconds)
    >>> play(block=64, seconds=0.5)
    0.5
    """

    def wrap(command: Callable[[Options], None]) -> Callable[..., None]:
        @wraps(command)
        def run(**given: Any) -> None:
            command(kind(**given))

        return run

    return wrap
