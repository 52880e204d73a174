"""Readable positions in JSON documents for error messages: the line, and the value there."""

import json
import re
from collections.abc import Iterator
from pathlib import Path

from msgspec import Struct

from underfoot.errors import BadFile
from underfoot.files import read_file

_PLACED = re.compile(r"(?P<file>.+?): \$(?P<path>(?:\.[^\s.:\[\]]+|\[\d+\])+)(?P<says>.*)", re.DOTALL)
_BROKEN = re.compile(r"(?P<file>.+?)(?P<says> is not JSON: .*line (?P<line>\d+) column \d+).*", re.DOTALL)
_STEP = re.compile(r"\.([^\s.:\[\]]+)|\[(\d+)\]")
_TOKEN = re.compile(r'"(?:[^"\\]|\\.)*"|[{}\[\],:]|[^\s{}\[\],:"]+')
_AROUND = 2
"""Number of lines shown before and after the one in question."""


class FilePlace(Struct, frozen=True):
    """Position in a file, and the error there. `line` counts from 1, and is 0 if unknown."""

    file: str
    line: int
    says: str
    """The value and what is allowed, without file and line."""
    in_words: str
    """The complete message in one line."""

    def excerpt(self) -> list[tuple[int, str]]:
        """Return the lines around the position with their numbers; none if the line is unknown."""
        lines = _text(self.file).splitlines()
        first = max(self.line - _AROUND, 1)
        return [(k, lines[k - 1]) for k in range(first, min(self.line + _AROUND, len(lines)) + 1)] if self.line else []


def file_place(message: str) -> FilePlace | None:
    """Return the position that an error message names; None for a message of another kind.

    >>> file_place("gone.json: $.tiles[0].size_m[1] is 'wide'; allowed: a number").in_words
    "gone.json: tiles #1, size_m #2 is 'wide'; allowed: a number"
    >>> file_place("t1 is no tile")
    """
    broken = _BROKEN.fullmatch(message)
    if broken is not None:
        return FilePlace(broken["file"], int(broken["line"]), f"it{broken['says']}", message)
    found = _PLACED.fullmatch(message)
    if found is None:
        return None
    steps = tuple(key or int(number) for key, number in _STEP.findall(found["path"]))
    text = "".join(f" #{step + 1}" if isinstance(step, int) else f", {step}" for step in steps)
    says, line = f"{text.lstrip(', ')}{found['says']}", _line_of(_text(found["file"]), steps)
    return FilePlace(found["file"], line, says, f"{found['file']}{f', line {line}' if line else ''}: {says}")


def place_in(path: Path, message: str) -> FilePlace:
    """Return the position that an error of reading a file names, or else the whole file.

    >>> place_in(Path("a.png"), "a.png is not JSON: it is not UTF-8 text").says
    'It is not JSON: it is not UTF-8 text'
    """
    says = message.removeprefix(str(path)).removeprefix(":").strip()
    says = f"It {says}" if message.startswith(f"{path} ") else says
    return file_place(message) or FilePlace(str(path), 0, says, message)


def readable(message: str) -> str:
    """Return an error message for the user: a position in a document is given by its line and in words.

    >>> readable("gone.json: $.version is 9; allowed: 1")
    'gone.json: version is 9; allowed: 1'
    """
    place = file_place(message)
    return message if place is None else place.in_words


def _text(file: str) -> str:
    """Return the text of a file; "" if it cannot be read."""
    try:
        return read_file(file).decode("utf-8-sig")
    except (BadFile, ValueError):
        return ""


def _line_of(text: str, steps: tuple[str | int, ...]) -> int:
    """Return the line of the value at these steps, or of the innermost existing one around it; 0 for an empty text."""
    line, deepest, begin = 0, -1, 0
    for path, at in _values(text):
        if len(path) > deepest and path == steps[: len(path)]:
            line, deepest, begin = line + text.count("\n", begin, at) + (not line), len(path), at
        if deepest == len(steps):
            break
    return line


def _key(word: str) -> str:
    """Return the name of a key; unchanged if it is not JSON."""
    try:
        return str(json.loads(word))
    except ValueError:
        return word


def _values(text: str) -> Iterator[tuple[tuple[str | int, ...], int]]:
    """Yield the steps to every value of a JSON text, and its start."""
    steps: list[str | int] = []
    is_key = False
    for token in _TOKEN.finditer(text):
        word = token[0]
        if word in "}]":
            del steps[-1:]
            is_key = False
        elif word == "," and steps and isinstance(steps[-1], int):
            steps[-1] += 1
        elif word in ",:":
            is_key = word == ","
        elif is_key and steps:
            steps[-1] = _key(word)
        else:
            yield tuple(steps), token.start()
            if word in "{[":
                steps.append("" if word == "{" else 0)
                is_key = word == "{"
