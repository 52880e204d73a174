"""Changes of the session's target: floor, simulated tile, recording, hardware or sound device."""

from pathlib import Path

from msgspec.structs import replace

from underfoot.devices.accelerometers import accelerometers_of
from underfoot.devices.transports import transport_of
from underfoot.engine.target import require_source
from underfoot.floor.layout import Floor, default_floor
from underfoot.floor.tile_parameters import TileParameters
from underfoot.records.force_files import floor_of
from underfoot.widgets.session.controller import SessionController
from underfoot.widgets.session.settings import Settings
from underfoot.widgets.session.target_settings import make_target


class TargetSelection:
    """Sets the session's target, and keeps it in the settings for the next start."""

    def __init__(self, controller: SessionController, settings: Settings) -> None:
        self._controller, self._settings = controller, settings

    def set_floor(self, rows: int, columns: int) -> None:
        """Use a simulated floor of this many tiles."""
        self._settings.rows, self._settings.columns = rows, columns
        self._set_target("simulator", "", default_floor(rows, columns))

    def use_floor(self, path: Path) -> None:
        """Use a simulated floor as in a file; raise `BadFile` if it cannot be read."""
        self._set_target("simulator", str(path), Floor.load(path))

    def use_simulation(self, path: Path | None) -> None:
        """Simulate tiles with the parameters in this file, such as those of their sensors; None for ideal tiles.

        A simulated floor is kept; otherwise the last simulated one is used. Raises `BadFile` if the file cannot be
        read.
        """
        if path is not None:
            TileParameters.load(path)
        self._settings.simulation = "" if path is None else str(path)
        target = self._controller.target
        if target.kind == "simulator":
            self._settings.kind = "simulator"
            self._controller.set_target(make_target(self._settings, "simulator", "", target.floor))
        else:
            self._set_target("simulator", "", default_floor(self._settings.rows, self._settings.columns))

    def use_forces(self, path: Path) -> None:
        """Play back the forces in a file: a CSV with its floor, a recording, or force plates in a C3D file.

        Raises `BadFile` if one cannot be read.
        """
        self._set_target("replay", str(path), floor_of(path))

    def require_transport(self, scheme: str, address: str) -> None:
        """Raise `UnderfootError` if hardware on a transport cannot be opened. May wait for it, in any thread."""
        present = self._controller.target
        wanted = transport_of(scheme, address)
        if scheme != present.kind or wanted.devices.isdisjoint(transport_of(scheme, present.source).devices):
            require_source(make_target(self._settings, scheme, address, present.floor))  # the session has no other open

    def use_transport(self, scheme: str, address: str) -> None:
        """Use hardware on a transport, with the layout of the present floor.

        It is not kept in the settings: at the next start it may be absent.
        """
        self._controller.set_target(make_target(self._settings, scheme, address, self._controller.target.floor))

    def set_sound(self, sound: str | None, rate_hz: int, block: int, accelerometers: str = "") -> None:
        """Use this sound device (None: none, "": the default one), at this rate and block size in frames.

        `accelerometers` on its inputs are in the form that `accelerometers_of` parses.
        """
        self._settings.sound, self._settings.rate, self._settings.block = sound, rate_hz, block
        self._settings.accelerometers = accelerometers
        target = self._controller.target
        heard = accelerometers_of(accelerometers, target.floor)
        changed = replace(target, sound=sound, rate=rate_hz, block=block, accelerometers=heard, round_trip_frames=0)
        self._controller.set_target(changed)

    def _set_target(self, kind: str, source: str, floor: Floor) -> None:
        self._settings.kind, self._settings.source = kind, source
        self._controller.set_target(make_target(self._settings, kind, source, floor))
