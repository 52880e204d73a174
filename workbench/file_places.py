"""Errors that name a place in a JSON document, as a person reads them: the line, and what stands there."""

import json
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from underfoot.documents import LARGEST

_PLACED = re.compile(r"(?P<file>.+?): \$(?P<path>(?:\.[^\s.:\[\]]+|\[\d+\])+)(?P<says>.*)", re.DOTALL)
_BROKEN = re.compile(r"(?P<file>.+?)(?P<says> is not JSON: .*line (?P<line>\d+) column \d+).*", re.DOTALL)
_STEP = re.compile(r"\.([^\s.:\[\]]+)|\[(\d+)\]")
_TOKEN = re.compile(r'"(?:[^"\\]|\\.)*"|[{}\[\],:]|[^\s{}\[\],:"]+')
_AROUND = 2
"""So many lines are shown before and after the one that is meant."""


@dataclass(frozen=True)
class FilePlace:
    """A place in a file, and what is wrong there. `line` counts from 1, and is 0 where the file cannot say it."""

    file: str
    line: int
    says: str
    """What stands there and what is allowed, without the file and the line."""
    in_words: str
    """All of it in one line."""

    def excerpt(self) -> list[tuple[int, str]]:
        """The lines around the place, each with its number; none where the line is not known."""
        lines = _text(self.file).splitlines()
        first = max(self.line - _AROUND, 1)
        return [(k, lines[k - 1]) for k in range(first, min(self.line + _AROUND, len(lines)) + 1)] if self.line else []


def file_place(message: str) -> FilePlace | None:
    """The place that an error's line tells of; None for one of another kind.

    >>> file_place("gone.json: $.tiles[0].size_m[1] is 'wide'; allowed: a number").in_words
    "gone.json: tiles #1, size_m #2 is 'wide'; allowed: a number"
    >>> file_place("t1 is no tile")
    """
    broken = _BROKEN.fullmatch(message)
    if broken is not None:
        return FilePlace(broken["file"], int(broken["line"]), broken["says"].strip(), message)
    found = _PLACED.fullmatch(message)
    if found is None:
        return None
    steps = tuple(key or int(number) for key, number in _STEP.findall(found["path"]))
    words = "".join(f" #{step + 1}" if isinstance(step, int) else f", {step}" for step in steps)
    says, line = f"{words.lstrip(', ')}{found['says']}", _line_of(_text(found["file"]), steps)
    return FilePlace(found["file"], line, says, f"{found['file']}{f', line {line}' if line else ''}: {says}")


def readable(message: str) -> str:
    """An error's line for a person: a place in a document is told by its line and in words.

    >>> readable("gone.json: $.version is 9; allowed: 1")
    'gone.json: version is 9; allowed: 1'
    """
    place = file_place(message)
    return message if place is None else place.in_words


def _text(file: str) -> str:
    """What is in a file; "" where that cannot be read."""
    try:
        with Path(file).open(encoding="utf-8-sig") as opened:
            return opened.read(LARGEST)
    except (OSError, ValueError):
        return ""


def _line_of(text: str, steps: tuple[str | int, ...]) -> int:
    """The line of the value at these steps, or of the innermost one around it that is there; 0 of an empty text."""
    line, deepest, begin = 0, -1, 0
    for path, at in _values(text):
        if len(path) > deepest and path == steps[: len(path)]:
            line, deepest, begin = line + text.count("\n", begin, at) + (not line), len(path), at
        if deepest == len(steps):
            break
    return line


def _key(word: str) -> str:
    """What a key is called; as it stands where that is no JSON."""
    try:
        return str(json.loads(word))
    except ValueError:
        return word


def _values(text: str) -> Iterator[tuple[tuple[str | int, ...], int]]:
    """The steps to every value of a JSON text, and where each begins."""
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
