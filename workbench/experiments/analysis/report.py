"""Findings as text for a terminal, as data for programs, and as a page with plots."""

import html
import math
from collections.abc import Sequence
from pathlib import Path
from textwrap import fill
from typing import Any

from underfoot.drawing.page import facts_table, made_by, page
from underfoot.drawing.svg import svg
from underfoot.experiments.analysis.findings import Findings, Table, cell_text
from underfoot.files import make_folder, write_file

_LINE = 100
"""Characters of a line of text."""


def text_of(findings: Sequence[Findings]) -> str:
    """Format the tables in succession, with their notes and the remarks, which are read without scrolling aside.

    >>> print(text_of([Findings("Rating", remarks=["Left out: " + "somebody, " * 9 + "and others."])]))
    Rating
    <BLANKLINE>
    Left out: somebody, somebody, somebody, somebody, somebody, somebody, somebody, somebody, somebody,
    and others.
    """
    parts: list[str] = []
    for found in findings:
        parts.append(found.title)
        parts += [_lines(table) for table in found.tables]
        parts += [_wrapped(remark) for remark in found.remarks]
    return "\n\n".join(parts)


def data_of(findings: Sequence[Findings]) -> list[dict[str, Any]]:
    """Return findings as JSON data; missing or unbounded values are None."""
    return [
        {
            "title": found.title,
            "tables": [
                {
                    "title": table.title,
                    "columns": list(table.columns),
                    "rows": [[_plain(cell) for cell in row] for row in table.rows],
                    "note": table.note,
                }
                for table in found.tables
            ],
            "remarks": found.remarks,
        }
        for found in findings
    ]


def write_page(path: Path, title: str, findings: Sequence[Findings], facts: Sequence[tuple[str, str]]) -> None:
    """Write a page with all tables and plots, creating its folder. Raises `BadFile` if that fails."""
    make_folder(path.parent)
    body = [facts_table([*facts, *made_by()])]
    for found in findings:
        body.append(f"<h2>{html.escape(found.title)}</h2>")
        body += [svg(drawing) for drawing in found.drawings]
        body += [_table_html(table) for table in found.tables]
        body += [f"<p>{html.escape(remark)}</p>" for remark in found.remarks]
    write_file(path, page(title, body).encode())


def _lines(table: Table) -> str:
    rows = [table.columns, *(tuple(cell_text(cell) for cell in row) for row in table.rows)]
    widths = [max(len(row[k]) for row in rows) for k in range(len(table.columns))]
    lines = ["  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in rows]
    note = [_wrapped(f"({table.note})", "  ")] if table.note else []
    return "\n".join([table.title, *(f"  {line}" for line in lines), *note])


def _wrapped(text: str, indent: str = "") -> str:
    """Return a text in lines; the words of a path stay whole."""
    return fill(
        text,
        _LINE,
        initial_indent=indent,
        subsequent_indent=indent,
        break_long_words=False,
        break_on_hyphens=False,
    )


def _table_html(table: Table) -> str:
    def row(cells: Sequence[str], tag: str) -> str:
        return "<tr>" + "".join(f"<{tag}>{html.escape(cell)}</{tag}>" for cell in cells) + "</tr>"

    rows = [row(table.columns, "th"), *(row([cell_text(cell) for cell in line], "td") for line in table.rows)]
    note = f"<p>{html.escape(table.note)}</p>" if table.note else ""
    return f"<h3>{html.escape(table.title)}</h3><table>{''.join(rows)}</table>{note}"


def _plain(cell: str | float | int) -> str | float | int | None:
    return None if isinstance(cell, float) and not math.isfinite(cell) else cell
