"""Syntacts: its exported JSON, a tree of signals (Pezent and others 2020)."""

from pathlib import Path

from underfoot.errors import BadFile, BadValue
from underfoot.exchange.foreign import read_json
from underfoot.exchange.format import Format, Imported
from underfoot.exchange.patches import Channel, coarsened, patch_of
from underfoot.exchange.syntacts_signals import field_of, voices_of

DEEPEST = 600
"""Levels of lists and objects: a nested signal takes some seven."""


def read(path: Path) -> Imported:
    """Read a signal as a patch: a tone or noise for each oscillation in it."""
    if path.suffix.lower() == ".sig":
        raise BadFile(f"{path} is Syntacts' binary form; allowed: its JSON (Export, .json)")
    raw = read_json(path, DEEPEST)
    lost: dict[str, None] = {}
    try:
        channels = [Channel(voices_of(field_of(raw, "value0"), lost))]
        patch = patch_of(channels, path.stem)
    except BadValue as error:
        raise BadFile(f"{path} cannot be made a patch: {error}") from None
    return Imported(patch, (*lost, *coarsened(channels)))


FORMAT = Format("syntacts", "Syntacts", (".json", ".sig"), read=read, begins=(b'"value0"',))
