"""Self-contained HTML page in the colours of the plots.

On a screen it is dark, or light if the reader's system is; on paper it is light.
"""

import getpass
import html
from collections.abc import Iterable, Sequence
from datetime import date

from underfoot.drawing.look import palette
from underfoot.version import __version__


def page(title: str, body: Sequence[str]) -> str:
    """Return a page with this title, also its heading, around `body`, pieces of HTML with dark pictures."""
    return "\n".join(
        [
            f'<!doctype html><html lang="en"><meta charset="utf-8"><title>{html.escape(title)}</title>',
            f'<meta name="viewport" content="width=device-width"><style>{_STYLE}</style>',
            f"<h1>{html.escape(title)}</h1>",
            *body,
            "</html>\n",
        ]
    )


def facts_table(facts: Iterable[tuple[str, str]]) -> str:
    """Return facts about the subject of a page as a table: a name and a text per row.

    >>> facts_table([("tile", "A1")])
    '<table class="facts"><tr><th>tile</th><td>A1</td></tr></table>'
    """
    rows = "".join(f"<tr><th>{html.escape(name)}</th><td>{html.escape(text)}</td></tr>" for name, text in facts)
    return f'<table class="facts">{rows}</table>'


def made_by(operator: str = "") -> list[tuple[str, str]]:
    """Return the facts of every report: operator (by default this account's name), date, and program version."""
    if not operator:
        try:
            operator = getpass.getuser()
        except (KeyError, OSError):  # an account without a name, as in a container
            operator = "not given"
    return [("operator", operator), ("date", date.today().isoformat()), ("software", f"Underfoot {__version__}")]


def _colours(name: str) -> str:
    """Return the colours of a page."""
    return "".join(f"--{role}:{palette(name)[role]};" for role in ("ground", "line", "text", "muted", "vibration"))


def _light_pictures() -> str:
    """Return rules that give a dark picture its light colours: style rules override attributes."""
    pairs = {dark: palette("light")[name] for name, dark in palette("dark").items()}
    return "".join(
        f'svg [{one}="{dark}"]{{{one}:{light}}}'
        for dark, light in pairs.items()
        for one in ("stroke", "fill", "stop-color")
    )


_STYLE = (
    f":root{{{_colours('dark')}color-scheme:dark light}}"
    "body{background:var(--ground);color:var(--text);font:15px/1.45 system-ui,sans-serif;max-width:1320px;"
    "margin:32px auto;padding:0 24px}"
    "h1{font-size:24px}h2{font-size:18px;margin-top:32px}h3{font-size:15px;margin:24px 0 4px}"
    "a{color:var(--vibration)}p{max-width:76ch}"
    "svg{max-width:100%;height:auto;margin:8px 8px 8px 0}"
    "table{border-collapse:collapse;font-variant-numeric:tabular-nums}"
    "td,th{text-align:left;vertical-align:top;padding:3px 24px 3px 0;border-bottom:1px solid var(--line)}"
    "th{color:var(--muted);font-weight:normal}.facts td,.facts th{border:0;padding-bottom:0}"
    f"@media (prefers-color-scheme:light){{:root{{{_colours('light')}}}{_light_pictures()}}}"
    f"@media print{{@page{{margin:16mm}}:root{{{_colours('light')}}}{_light_pictures()}"
    "body{margin:0;padding:0;max-width:none;font-size:10pt}svg,table,figure{break-inside:avoid}"
    "h2,h3{break-after:avoid}a{color:inherit}}"
)
