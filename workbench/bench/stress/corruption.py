"""Damage to bytes as caused by disks, editors, scripts and attackers."""

import json
import sqlite3
from contextlib import closing, suppress
from copy import deepcopy
from pathlib import Path
from typing import Any

import numpy as np

ODD_VALUES: tuple[Any, ...] = (
    None, True, 0, -1, 1e308, -1e308, 5e-324, float("nan"), float("inf"), 10**400, 2**63, 2**31, "", "nan", "-1",
    "\ud800", "\0", "é" * 300, "../../etc/passwd", "/dev/zero", [], {}, [[]], [1.0] * 1000, {"a": {"a": {}}},
)  # fmt: skip
"""Replacements for values of a document."""
_CELLS = (
    "",
    "nan",
    "inf",
    "1e308",
    "-1",
    "1,5",
    '"',
    "\0",
    "x" * 300,
    "2024-01-01",
    "0x10",
    "1_0",
    "٣",
    "#",
    ";",
    "\n",
)
_IN_TABLES: tuple[Any, ...] = (
    None, 0, -1, 1, 2**40, 2**63 - 1, 1e308, float("nan"), "", "x", "[]", "{}", "null", "[" * 5000, b"", b"\xff" * 7,
)  # fmt: skip


def corrupt_bytes(data: bytes, rng: np.random.Generator) -> bytes:
    """Return data with flipped bits, with pieces removed, doubled, moved or overwritten, or truncated."""
    changed = bytearray(data)
    for _ in range(int(rng.integers(1, 4))):
        size = len(changed)
        at, length = int(rng.integers(0, max(size, 1))), int(rng.integers(1, 200))
        match int(rng.integers(0, 7)):
            case 0:
                del changed[at:]
            case 1:
                del changed[at : at + length]
            case 2:
                changed[at:at] = changed[at : at + length]
            case 3:
                changed[at : at + length] = bytes(min(length, size - at))
            case 4:
                changed[at:at] = rng.bytes(length)
            case _:
                for place in rng.integers(0, max(size, 1), 8):
                    if place < len(changed):
                        changed[place] ^= 1 << int(rng.integers(8))
    return bytes(changed)


def corrupt_head(data: bytes, rng: np.random.Generator) -> bytes:
    """Return data with the same damage in the first 64 bytes, which usually hold the header."""
    return corrupt_bytes(data[:64], rng) + data[64:]


def corrupt_document(data: bytes, rng: np.random.Generator) -> bytes:
    """Return a JSON document with values changed, missing or doubled."""
    document = json.loads(data)
    for _ in range(int(rng.integers(1, 3))):
        places = list(_places(document))
        if not places:
            break
        holder, key = places[int(rng.integers(len(places)))]
        match int(rng.integers(0, 8)):
            case 0:
                del holder[key]
            case 1 if isinstance(holder, list):
                holder.append(deepcopy(holder[key]))
            case 2 if isinstance(holder, dict):
                holder[str(ODD_VALUES[int(rng.integers(len(ODD_VALUES)))])] = deepcopy(holder[key])
            case 3 if isinstance(holder[key], int | float) and abs(holder[key]) < 1e200:
                holder[key] = float(holder[key]) * float(10.0 ** rng.integers(-12, 12)) * float(rng.choice([-1, 1]))
            case _:
                holder[key] = deepcopy(ODD_VALUES[int(rng.integers(len(ODD_VALUES)))])
    return json.dumps(document, ensure_ascii=bool(rng.integers(2))).encode(errors="surrogatepass")


def corrupt_table(data: bytes, rng: np.random.Generator) -> bytes:
    """Return a CSV with cells changed, and lines missing, doubled or swapped."""
    lines = data.decode().splitlines()
    for _ in range(int(rng.integers(1, 4))):
        at, other = (int(place) for place in rng.integers(0, len(lines), 2))
        match int(rng.integers(0, 6)):
            case 0 if len(lines) > 1:
                del lines[at]
            case 1:
                lines.insert(at, lines[other])
            case 2:
                lines[at], lines[other] = lines[other], lines[at]
            case _:
                cells = lines[at].split(",")
                cells[int(rng.integers(len(cells)))] = _CELLS[int(rng.integers(len(_CELLS)))]
                lines[at] = ",".join(cells)
    return "\n".join(lines).encode()


def corrupt_database(path: Path, rng: np.random.Generator) -> None:
    """Damage an SQLite file in place: change cells, delete rows or tables."""
    with closing(sqlite3.connect(path, isolation_level=None)) as base, suppress(sqlite3.Error):
        base.execute("pragma synchronous = off")  # no need to flush to disk
        for _ in range(int(rng.integers(1, 3))):
            named = base.execute("select name from sqlite_master where type = 'table' order by name")
            tables = [name for (name,) in named]
            if not tables:
                return
            table = tables[int(rng.integers(len(tables)))]
            columns = [row[1] for row in base.execute(f"pragma table_info({table})")]
            column = columns[int(rng.integers(len(columns)))]
            value = _IN_TABLES[int(rng.integers(len(_IN_TABLES)))]
            at = int(rng.integers(8))
            one = f"{column} = (select {column} from {table} limit 1 offset {at})"
            with suppress(sqlite3.Error):  # SQLite's constraints refuse some changes
                match int(rng.integers(0, 8)):
                    case 0:
                        base.execute(f"drop table {table}")
                    case 1:
                        base.execute(f"delete from {table} where {one}")
                    case 2:
                        base.execute(f"alter table {table} rename column {column} to gone")
                    case 3:
                        base.execute(f"pragma user_version = {int(rng.integers(-2, 4))}")
                    case _:
                        base.execute(f"update {table} set {column} = ? where {one}", (value,))


def _places(value: object) -> list[tuple[Any, Any]]:
    """Return every value of a document as its container and its key there."""
    found: list[tuple[Any, Any]] = []
    if isinstance(value, dict):
        items: list[tuple[Any, Any]] = list(value.items())
    elif isinstance(value, list):
        items = list(enumerate(value))
    else:
        return found
    for key, inside in items:
        found.append((value, key))
        found += _places(inside)
    return found
