"""Tables as spreadsheets and other programs write them: CSV with commas, semicolons or tabs between cells.

Between semicolons, tabs and other marks a number can have a decimal comma, as in French or German; it gets a point.
"""

import csv
import io
import re
from pathlib import Path

from msgspec import Struct

from underfoot.errors import BadFile
from underfoot.files import read_large_file
from underfoot.quantities import counted

_DECIMAL_COMMA = re.compile(r"\s*[+-]?\d*,\d+(e[+-]?\d+)?\s*", re.IGNORECASE)
_DECLARED = re.compile(r'\s*"?sep=(.)"?\s*', re.IGNORECASE)
"""The first line that Excel writes, and reads, to say what is between cells."""


class CsvTable(Struct, frozen=True):
    """The cells of the first line, which is the number `head` of the file, and the number and cells of the others."""

    names: list[str]
    rows: list[tuple[int, list[str]]]
    head: int = 1


def table_text(path: str | Path, data: bytes, what: str, older: str = "") -> str:
    """Return the text of a table in UTF-8, in Excel's UTF-16, or else in an `older` coding, if one is named.

    `BadFile` says that it is not `what` if it is no text.

    >>> table_text("a.csv", "time_s".encode("utf-16"), "a table")
    'time_s'
    """
    if data.startswith(b"PK\x03\x04"):
        raise BadFile(f"{path} is a workbook or another archive; save its sheet as CSV")
    is_wide = data[:2] in (b"\xff\xfe", b"\xfe\xff")
    try:
        text = data.decode("utf-16" if is_wide else "utf-8-sig")
    except UnicodeDecodeError:
        text = data.decode(older) if older and not is_wide else "\0"
    if "\0" in text:  # in no text; of gigabytes of them, a parser of tables makes many times as much
        raise BadFile(f"{path} is not {what}: it is not UTF-8 text; save it as CSV, UTF-8")
    return text


def delimiter_of(first: str, head: str) -> tuple[str, bool]:
    """Return what is between cells, and whether the `first` line only says so; `head` is the one with the names.

    >>> delimiter_of('time_s;"a, b, c"', ""), delimiter_of("sep=|", "time_s|a")
    ((';', False), ('|', True))
    """
    declared = _DECLARED.fullmatch(first)
    if declared and head:
        return declared[1], True
    return max(",;\t", key="".join(first.split('"')[::2]).count), False


def read_csv_table(path: str | Path, what: str, remark: str = "") -> CsvTable:
    """Read a table of any size, without empty lines, and those that begin with a `remark`.

    `BadFile` says that it is not `what`, or names the line with another number of cells than the first.
    """
    lines = table_text(path, read_large_file(path), what).splitlines(keepends=True)
    if remark:
        lines = ["\n" if line.lstrip('"').startswith(remark) else line for line in lines]  # which keep their numbers
    filled = (line for line in lines if line.strip())
    delimiter, is_said = delimiter_of(next(filled, "").rstrip("\r\n"), next(filled, ""))
    text = io.StringIO("".join(lines), newline="")
    reader = csv.reader(text, strict=True, skipinitialspace=True, delimiter=delimiter)
    try:
        rows = [(reader.line_num, cells) for cells in reader if any(map(str.strip, cells))][is_said:]
    except csv.Error as error:
        raise BadFile(f"{path} is not {what}: line {reader.line_num}: {error}") from None
    head, names = rows[0] if rows else (1, [])
    while names and not names[-1].strip():  # spreadsheets write columns that were empty or emptied, too
        names.pop()
    for number, cells in rows:
        if len(cells) < len(names) or any(map(str.strip, cells[len(names) :])):
            there = counted(len(cells), "column")
            raise BadFile(f"{path}: line {number} has {there}; allowed: {len(names)} as in line {head}")
        del cells[len(names) :]
    if delimiter != ",":
        rows = [(number, [_pointed(cell) for cell in cells]) for number, cells in rows]
    return CsvTable(names, rows[1:], head)


def _pointed(cell: str) -> str:
    return cell.replace(",", ".") if _DECIMAL_COMMA.fullmatch(cell) else cell
