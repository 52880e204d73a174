"""What the target chooser offers."""

from pathlib import Path

from underfoot.devices.transports import TRANSPORTS
from underfoot.patch import library
from underfoot.widgets.transport import Choices


def choices() -> Choices:
    """Floors and tiles to choose among. Keys are a kind, and what is chosen of it where that is not asked for."""
    return (
        ("simulator 2 2", "Simulated floor  2 × 2"),
        ("simulator 6 6", "Simulated floor  6 × 6"),
        ("floor", "Simulated floor from a file…"),
        (
            (
                ("simulation ideal", "Ideal sensors"),
                *((f"simulation {name}", words_of(Path(name))) for name in library.simulations()),
                ("", ""),
                ("simulation", "Open…"),
            ),
            "Simulated tile",
        ),
        ("", ""),
        ("recording", "Open a recording…"),
        ("forces", "Play recorded forces from a file…"),
        ("", ""),
        *((scheme, f"{transport.title}…") for scheme, transport in TRANSPORTS.items()),
    )


def words_of(path: Path) -> str:
    """A file's name, for the person.

    >>> words_of(Path("presets/plywood-tile.json"))
    'Plywood tile'
    """
    return path.stem.replace("-", " ").replace("_", " ").capitalize()
