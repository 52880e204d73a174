"""A page of HTML in the colours of the plots, that needs no other file."""

import html
from collections.abc import Sequence

from underfoot.drawing.look import GROUND, MUTED, TEXT


def page(title: str, body: Sequence[str]) -> str:
    """A page with this title, which is also its heading, around `body`: pieces of HTML."""
    return "\n".join(
        [
            f'<!doctype html><html lang="en"><meta charset="utf-8"><title>{html.escape(title)}</title>',
            f"<style>body{{background:{GROUND};color:{TEXT};font-family:sans-serif;margin:24px}}svg{{margin:8px}}"
            f"td,th{{text-align:left;padding:2px 16px 2px 0}}th{{color:{MUTED};font-weight:normal}}</style>",
            f"<h1>{html.escape(title)}</h1>",
            *body,
            "</html>\n",
        ]
    )
