"""The formats: each is one file here that declares a `Format`. `FORMATS` finds them all."""

from pathlib import Path

from underfoot.arguments import choice
from underfoot.errors import BadValue
from underfoot.exchange.format import Format
from underfoot.plugins import values_in

FORMATS = {value.name: value for value in values_in(__name__) if isinstance(value, Format)}
"""Every format by its name."""

READ = tuple(one for one in FORMATS.values() if one.read is not None)
WRITTEN = tuple(one for one in FORMATS.values() if one.write is not None)


def to_write(path: Path, name: str) -> Format:
    """Return the format of a file to write: the one of this name, or for "" the one of the path's suffix."""
    return _one(path, name, WRITTEN, "written")


def to_read(path: Path, name: str = "") -> Format:
    """Return the format of a file to read. If several share the suffix, the one that matches the file's beginning."""
    return _one(path, name, READ, "read")


def _one(path: Path, name: str, formats: tuple[Format, ...], done: str) -> Format:
    known = {one.name: one for one in formats}
    if name:
        choice("--format", name, known)
        return known[name]
    fitting = [one for one in formats if path.suffix.lower() in one.suffixes]
    if len(fitting) > 1:
        names = " or ".join(one.name for one in fitting)
        fitting = [one for one in fitting if one.matches(path)]
        if not fitting:
            raise BadValue(f"{path} does not look like {names}; say which it is with --format")
    if fitting:
        return fitting[0]
    suffixes = ", ".join(sorted({suffix or "a folder" for one in formats for suffix in one.suffixes}))
    raise BadValue(f"{path} is of no format that can be {done}; allowed: {suffixes}")
