"""Report of a calibration: a page for a paper's appendix, with its raw data."""

import html
import json
import math
from pathlib import Path

from underfoot.calibration.files.measurements import table
from underfoot.calibration.result import Result
from underfoot.calibration.results.drift import drift
from underfoot.calibration.results.labels import label_of, title_of, unit_of
from underfoot.drawing.page import facts_table, made_by, page
from underfoot.drawing.svg import svg
from underfoot.files import make_folder, write_file
from underfoot.floor.profile import Profile
from underfoot.quantities import number, pretty_text, pretty_unit, quantity

_DIGITS = 4
"""Significant digits of a figure: one more than a rounded value needs. The JSON has six."""
_MOST_EARLIER = 5
"""Earlier calibrations that a page has room for."""


def write_report(result: Result, folder: Path, profile: Profile, operator: str = "") -> Path:
    """Write `<kind>.html`, its raw data and its figures to `folder`, made if missing; return the path of the page.

    `profile` is the one with this result. `operator` is the person who measured, by default the account's name.
    `BadFile` if the folder cannot be written.
    """
    # All is made before the first file is written: whoever interrupts what takes long leaves no half of a report.
    made = {f"{result.kind}-{name}.csv": table(header, rows, profile.tile) for name, header, rows in result.raw}
    made[f"{result.kind}.json"] = json.dumps({"tile": profile.tile, **figures(result)}, indent=1).encode() + b"\n"
    made[f"{result.kind}.html"] = page(title_of(result.kind, profile.tile), _body(result, profile, operator)).encode()
    make_folder(folder)
    for name, data in made.items():
        write_file(folder / name, data)
    return folder / f"{result.kind}.html"


def figures(result: Result) -> dict[str, object]:
    """Return a result for programs: kind, whether it is good, verdict, warnings, and all figures by name."""
    return {
        "kind": result.kind,
        "good": result.good,
        "verdict": result.verdict,
        "warnings": list(result.warnings),
        **{name: float(f"{value:.6g}") for name, value in result.figures.items()},
    }


def _body(result: Result, profile: Profile, operator: str) -> list[str]:
    """Return the page's elements: verdict, facts, warnings, drawings, figures, method and raw data."""
    part = profile.part(result.kind)
    facts = [
        ("tile", f"{profile.tile}, simulated" if result.is_simulated else profile.tile),
        ("serial number", profile.serial or "not given"),
        ("reference", pretty_text(part.reference) if part is not None else ""),
        ("conditions", result.conditions or "not given"),
        ("calibration", part.identity if part is not None else ""),
        *made_by(operator),
    ]
    body = [f"<p><b>{_prose(result.verdict)}</b></p>", facts_table(facts)]
    body += [f"<p>{_prose(warning)}</p>" for warning in result.warnings]
    body += [svg(drawing) for drawing in result.drawings]
    body.append("<h2>Figures</h2><table>")
    body += [
        f"<tr><td>{html.escape(label_of(name))}</td><td>{number(value, _DIGITS)}</td>"
        f"<th>{html.escape(pretty_unit(unit))}</th></tr>"
        for name, value, unit in result.quantities
    ]
    body.append("</table>")
    body += _compared(result.kind, profile)
    body.append(f"<h2>Method</h2><p>{_prose(result.method)}</p>")
    files = ", ".join(f'<a href="{result.kind}-{name}.csv">{result.kind}-{name}.csv</a>' for name, _, _ in result.raw)
    body.append(f"<h2>Raw data</h2><p>{files}</p>")
    return body


def _prose(text: str) -> str:
    """Return prose as HTML, with units as the drawings have them."""
    return html.escape(pretty_text(text))


def _compared(kind: str, profile: Profile) -> list[str]:
    """Return the figures of this part beside those of the last ones before it, by days; nothing for the first."""
    earlier = [getattr(one, kind) for one in profile.earlier if one.kind == kind][-_MOST_EARLIER:]
    now = profile.part(kind)
    if not earlier or now is None:
        return []
    parts = [*sorted(earlier, key=lambda part: part.made), now]
    rows = [f"<tr><th></th>{''.join(f'<th>{part.made}</th>' for part in parts)}</tr>"]
    for name in dict.fromkeys(name for part in reversed(parts) for name in part.measured):
        unit = unit_of(name, now.error_unit)
        values = [part.measured.get(name, math.nan) for part in parts]
        cells = "".join(f"<td>{html.escape(quantity(x, unit)) if math.isfinite(x) else '–'}</td>" for x in values)
        rows.append(f"<tr><td>{html.escape(label_of(name))}</td>{cells}</tr>")
    changed = drift(now, parts[-2])
    told = [f"<p>{_prose(changed)}</p>"] if changed else []
    return ["<h2>Compared with the ones before</h2>", *told, "<table>", *rows, "</table>"]
