"""Settings that the window keeps between starts."""

import base64
from pathlib import Path
from typing import Annotated

import msgspec
from msgspec.structs import replace

from underfoot.devices.outputs import outputs_of
from underfoot.documents import placed, plain_json
from underfoot.engine.commands import SILENT_DB
from underfoot.errors import BadFile, BadValue
from underfoot.files import read_file, write_file
from underfoot.network.plan import LISTEN_PORT, SEND_PORT, TUIO_PORT, loopback
from underfoot.widgets.controls.true_scale import Placement

DEFAULT_ADDRESSES = {
    "tuio": loopback(TUIO_PORT),
    "tuio2": loopback(TUIO_PORT),
    "send": loopback(SEND_PORT),
    "listen": loopback(LISTEN_PORT),
    "serial_marks": "",
}
"""Connections to other programs, each with its default address on this computer, and the serial port for marks."""

LOW_LEVEL_DB = -30.0
"""Output level of the very first start."""


THEMES = {"dark": "Dark", "light": "Light", "system": "As the system"}
"""Names of the colour themes."""
TEXT_SIZES = (100, 115, 130, 150)
"""Percent. Everything scales with the text."""
RECENT_FILES = 8


class Settings(msgspec.Struct):
    """Settings of the window: the last target, sound device, level, and layout.

    `simulation` is the file of the simulated tiles' parameters, "" for ideal ones. `sound` is "" for the default
    device, None for no sound, else a device's name; `accelerometers` are on its inputs. `references` are the
    calibrations' references on hardware, `conditions` the note that goes with their results, of the day
    `conditions_on`. `projector_at` is the position of a tile's centre on the floor, in metres right of and above the
    screen's, `projector_turn` degrees to the left. `stars` are the files of starred presets. `network_addresses` are
    the chosen ones of `DEFAULT_ADDRESSES`, and `network_on` the active ones, also of `plan.FLAGS`. `recordings` are
    files and folders of recordings besides the folder recorded to. `outside_files` are files that the user allowed
    patches in other folders to read. `run_code` has the SHA-256 of each custom node's file that the user has agreed to
    run. `calibrated_plate` is the stiffness plate that was calibrated last, PORT:FILE. `study_equipment` is the
    equipment of studies besides the floor, by the fields of `studies.equipment.EquipmentChoice`; with `study_lapses`
    their psychometric curves have a lapse rate. `theme` is one of `THEMES`, `text_size` one of `TEXT_SIZES`, in
    percent; `splitters` are splitter positions by name, and `workspace` is the one last shown.

    >>> import tempfile
    >>> folder = Path(tempfile.mkdtemp())
    >>> settings = Settings.load(folder)
    >>> settings.level_db
    -30.0
    >>> settings.level_db = -12.0
    >>> settings.save(folder)
    >>> Settings.load(folder).level_db
    -12.0
    """

    kind: str = "simulator"
    source: str = ""
    rows: int = 2
    columns: int = 2
    simulation: str = ""
    sound: str | None = ""
    rate: Annotated[int, msgspec.Meta(ge=8000, le=192_000)] = 48_000
    block: Annotated[int, msgspec.Meta(ge=8, le=8192)] = 128
    accelerometers: str = ""
    level_db: Annotated[float, msgspec.Meta(ge=SILENT_DB, le=0.0)] = LOW_LEVEL_DB
    folder: str = ""
    references: dict[str, str] = {}
    conditions: str = ""
    conditions_on: str = ""
    projector_scale: float = 1.0
    projector_at: tuple[float, float] = (0.0, 0.0)
    projector_turn: float = 0.0
    network_addresses: dict[str, str] = {}
    network_on: list[str] = []
    calibrated_plate: str = ""
    study_equipment: dict[str, str | bool | None] = {}
    study_lapses: bool = False
    theme: str = "dark"
    text_size: Annotated[int, msgspec.Meta(ge=TEXT_SIZES[0], le=TEXT_SIZES[-1])] = 100
    geometry: str = ""
    splitters: dict[str, str] = {}
    workspace: str = ""
    recent: list[str] = []
    stars: list[str] = []
    first_steps_done: bool = False
    recordings: list[str] = []
    outside_files: list[str] = []
    run_code: list[str] = []

    @staticmethod
    def load(folder: Path) -> "Settings":
        """Load the settings in `folder`; the defaults if there are none, or they cannot be read."""
        return Settings.read(folder)[0] or Settings()

    @staticmethod
    def read(folder: Path) -> "tuple[Settings | None, list[str]]":
        """Return the settings in `folder`, and a line for each that has its default because it is not allowed.

        None if there are none, or if the file cannot be read: then the line says why.
        """
        path = file_in(folder)
        if not path.exists():
            return None, []
        try:
            raw = plain_json(read_file(path), str(path))
        except BadFile as error:
            return None, [str(error)]
        if not isinstance(raw, dict):
            return None, [f"{path} is not an object of settings"]
        made, refused = Settings(), []
        for name in filter(raw.__contains__, Settings.__struct_fields__):
            try:
                value = getattr(msgspec.convert({name: raw[name]}, Settings), name)
                if name == "sound" and value is not None:
                    outputs_of(value)
                setattr(made, name, value)
            except msgspec.ValidationError as error:
                refused.append(f"{path}: {placed(error, raw)}; {getattr(made, name)!r} is used")
            except BadValue as error:
                refused.append(f"{path}: $.{name}: {error}; {getattr(made, name)!r} is used")
        return made, refused

    def save(self, folder: Path) -> None:
        """Save the settings in `folder`, creating it if needed."""
        folder.mkdir(parents=True, exist_ok=True)
        write_file(file_in(folder), msgspec.json.format(msgspec.json.encode(self), indent=1))

    def copy(self) -> "Settings":
        """Return a copy that shares no list with these settings."""
        return msgspec.json.decode(msgspec.json.encode(self), type=Settings)

    def added_to(self, there: "Settings", before: "Settings") -> "Settings":
        """Return the settings `there`, with what was changed in these since they were those `before`.

        >>> both, mine, theirs = Settings(recent=["a"]), Settings(recent=["b", "a"], level_db=-3.0), Settings()
        >>> theirs.recent, theirs.theme = ["c", "a"], "light"
        >>> made = mine.added_to(theirs, both)
        >>> made.recent, made.level_db, made.theme
        (['b', 'c', 'a'], -3.0, 'light')
        """
        names = Settings.__struct_fields__
        merged = {name: _merged(*(getattr(one, name) for one in (before, self, there))) for name in names}
        made = replace(there, **merged)
        del made.recent[RECENT_FILES:]
        return made

    def remember_file(self, path: Path) -> None:
        """Put a file at the head of the recent ones."""
        self.folder = str(path.parent)
        self.recent = [str(path), *(known for known in self.recent if known != str(path))][:RECENT_FILES]

    def forget_file(self, path: Path) -> None:
        """Remove a file that is gone from the recent ones."""
        self.recent = [known for known in self.recent if known != str(path)]

    @property
    def placement(self) -> Placement:
        """The placement of a projector's picture."""
        return Placement(self.projector_scale, self.projector_at, self.projector_turn)

    @placement.setter
    def placement(self, placement: Placement) -> None:
        self.projector_scale, self.projector_at, self.projector_turn = (
            placement.scale, placement.at_m, placement.turn_deg,
        )  # fmt: skip

    @property
    def window_bytes(self) -> bytes:
        """Return the window's geometry as saved by Qt."""
        try:
            return base64.b64decode(self.geometry, validate=True)
        except ValueError:
            return b""

    @window_bytes.setter
    def window_bytes(self, data: bytes) -> None:
        self.geometry = base64.b64encode(data).decode()


def file_in(folder: Path) -> Path:
    """Return the file of the settings in a folder."""
    return folder / "settings.json"


def _merged(before: object, mine: object, theirs: object) -> object:
    """Return a value of another window with this window's changes; lists and tables by their parts."""
    if mine == before:
        return theirs
    if isinstance(before, list) and isinstance(mine, list) and isinstance(theirs, list):
        new = [one for one in mine if one not in before]
        others = [one for one in theirs if one not in before and one not in mine]
        return [*new, *others, *(one for one in mine if one in theirs and one not in new)]
    if isinstance(before, dict) and isinstance(mine, dict) and isinstance(theirs, dict):
        kept = {name: value for name, value in theirs.items() if name in mine or name not in before}
        return kept | {name: value for name, value in mine.items() if before.get(name) != value}
    return mine
