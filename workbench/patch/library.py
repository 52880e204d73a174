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
    return {path.stem: path for path in sorted((presets_folder() / kind).glob("*.json"))}
