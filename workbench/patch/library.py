"""Presets on disk: patches, floors, simulated tiles and protocols to begin with."""

from pathlib import Path

from underfoot import presets


def presets_folder() -> Path:
    """The folder of presets, in a checkout as in an installed wheel.

    >>> (presets_folder() / "patches" / "gravel.json").is_file()
    True
    """
    return Path(presets.__file__).parent


def patches() -> dict[str, Path]:
    """The patches' files by name, in alphabetical order.

    >>> "gravel" in patches()
    True
    """
    return _files("patches")


FAMILIES = {"material": "Materials", "stimulus": "Thesis stimuli", "tacton": "Tactons"}
"""What the first word of a patch's name says it belongs to, and how that is called."""


def families() -> dict[str, dict[str, Path]]:
    """The patches by the name of their family, "" for those without one; each under what tells it from the others.

    >>> list(families()), list(families()["Tactons"])[-2:]
    (['', 'Materials', 'Thesis stimuli', 'Tactons'], ['WS7', 'WS8'])
    """
    found: dict[str, dict[str, Path]] = {"": {}, **{name: {} for name in FAMILIES.values()}}
    for name, path in patches().items():
        first, _, rest = name.partition("-")
        family = FAMILIES.get(first, "")
        found[family][_words(rest if family else name)] = path
    return found


def _words(name: str) -> str:
    """A name as people read it: codes such as ws1 and td in capitals."""
    first, *others = name.split("-")
    is_code = len(first) <= 2 or first[-1].isdigit()
    return " ".join([first.upper() if is_code else first.capitalize(), *others])


def floors() -> dict[str, Path]:
    """The floors' files by name, in alphabetical order.

    >>> "tiles-2x2" in floors()
    True
    """
    return _files("floors")


def simulations() -> dict[str, Path]:
    """What simulated tiles are made of, and who walks on them: the files by name, in alphabetical order.

    >>> "thesis-tile" in simulations()
    True
    """
    return _files("simulations")


def protocols() -> dict[str, Path]:
    """The protocols of studies: the files by name, in alphabetical order.

    >>> "detection-threshold" in protocols()
    True
    """
    return _files("protocols")


def _files(kind: str) -> dict[str, Path]:
    found = (presets_folder() / kind).glob("*.json")
    return {path.stem: path for path in sorted(found, key=lambda path: path.stem)}
