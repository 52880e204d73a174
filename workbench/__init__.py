"""Underfoot: a workbench for vibrotactile floors. Only `underfoot.widgets` imports Qt.

The names below are for scripts (docs/scripting.md). Each is imported at its first use: `import underfoot` alone loads
nothing.

>>> open_patch("gravel")
<Patch 'Gravel underfoot': 15 nodes, 16 wires>
"""

from typing import TYPE_CHECKING

from underfoot.version import __version__

if TYPE_CHECKING:  # for editors and type checkers; same as `_PLACES`
    from underfoot.drawing.picture import Picture as Picture
    from underfoot.engine.offline import render as render
    from underfoot.engine.render import Rendered as Rendered
    from underfoot.errors import UnderfootError as UnderfootError
    from underfoot.floor.layout import Floor as Floor
    from underfoot.floor.layout import Tile as Tile
    from underfoot.floor.layout import default_floor as default_floor
    from underfoot.floor.profile import Profile as Profile
    from underfoot.models.fibre_bundle.bundle import FibreBundle as FibreBundle
    from underfoot.models.stick_slip.oscillator import BlockOnBelt as BlockOnBelt
    from underfoot.models.stick_slip.slip_distribution import SlipDistribution as SlipDistribution
    from underfoot.patch.patch import Patch as Patch
    from underfoot.patch.preset_files import open_patch as open_patch
    from underfoot.records.forces import Forces as Forces
    from underfoot.records.forces import read_forces as read_forces
    from underfoot.records.forces import walk as walk
    from underfoot.records.recording import Recording as Recording
    from underfoot.records.tables import Table as Table

_PLACES = {
    "BlockOnBelt": "models.stick_slip.oscillator",
    "FibreBundle": "models.fibre_bundle.bundle",
    "Floor": "floor.layout",
    "Forces": "records.forces",
    "Patch": "patch.patch",
    "Picture": "drawing.picture",
    "Profile": "floor.profile",
    "Recording": "records.recording",
    "Rendered": "engine.render",
    "SlipDistribution": "models.stick_slip.slip_distribution",
    "Table": "records.tables",
    "Tile": "floor.layout",
    "UnderfootError": "errors",
    "default_floor": "floor.layout",
    "open_patch": "patch.preset_files",
    "read_forces": "records.forces",
    "render": "engine.offline",
    "walk": "records.forces",
}
"""Module of each public name."""

__all__ = ["__version__", *_PLACES]


def __getattr__(name: str) -> object:
    if name not in _PLACES:
        raise AttributeError(f"module 'underfoot' has no attribute {name!r}")
    from importlib import import_module

    value = getattr(import_module(f"underfoot.{_PLACES[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *_PLACES})
