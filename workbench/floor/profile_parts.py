"""The parts of a profile."""

PARTS = {"fsr": "Forces", "centroid": "Places", "response": "Vibration", "latency": "Latency", "plate": "Stiffness"}
"""What people call the calibration that makes a part, by the part's name in files and commands: in the order in which
somebody who has a new tile makes them."""

InUse = dict[str, dict[str, str]]
"""Calibrations in use: the `identity` of each part, by tile and by name of the part."""


def lines_of(in_use: InUse) -> list[str]:
    """Return the calibrations in use, a line for each tile.

    >>> lines_of({"t1": {"fsr": "2026-05-01 0f3c9a1b2d4e", "response": "2026-05-02 a07be6c51f98"}})
    ['t1: Forces 2026-05-01 0f3c9a1b2d4e, Vibration 2026-05-02 a07be6c51f98']
    """
    return [
        f"{tile}: {', '.join(f'{PARTS.get(kind, kind)} {identity}' for kind, identity in parts.items())}"
        for tile, parts in in_use.items()
    ]
