"""What the window remembers between starts."""

import base64
from pathlib import Path

import msgspec

from underfoot.errors import UnderfootError
from underfoot.files import read_file, write_file
from underfoot.network.plan import LISTEN_PORT, SEND_PORT, TUIO_PORT, loopback

WAYS = {
    "tuio": loopback(TUIO_PORT),
    "tuio2": loopback(TUIO_PORT),
    "send": loopback(SEND_PORT),
    "listen": loopback(LISTEN_PORT),
    "serial_marks": "",
}
"""The ways to other programs, each with its address on this computer, and the serial port that marks come from."""

LOW_LEVEL_DB = -30.0
"""The output level of the very first start."""


THEMES = {"dark": "Dark", "light": "Light", "system": "As the system"}
"""The colours that the window may have, in words."""
TEXT_SIZES = (100, 115, 130, 150)
"""Percent. Everything grows with the text."""


class Settings(msgspec.Struct):
    """What the window remembers: the last target, sound device, level, and where things stood.

    `simulation` is the file of what simulated tiles are made of, "" for ideal ones. `sound` is "" for the default
    device, None for no sound, else a device's name; `accelerometers` are on its inputs. `references` are what each
    calibration is measured against on hardware. `projector_at` is where a tile's middle is shown on the floor, in
    metres right of and above the screen's. `stars` are the files of presets with a star. `network_addresses` are those
    of `WAYS` that were chosen, and `network_on` those that are used, and of `plan.FLAGS`. `recordings` are files and
    folders of recordings beside the one that is recorded to. `outside_files` may be read by patches in other folders:
    the person said so. `run_code` has the SHA-256 of each file of a node that the person has agreed to run.
    `study_equipment` is what studies use beside the floor, by the fields of
    `studies.equipment.EquipmentChoice`. `theme` is one of `THEMES`, `text_size` one of `TEXT_SIZES`, in percent;
    `splitters` are where the parts of workspaces meet, by the splitters' names, and `workspace` is the one that was on
    the screen.

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
    rate: int = 48_000
    block: int = 128
    accelerometers: str = ""
    level_db: float = LOW_LEVEL_DB
    folder: str = ""
    references: dict[str, str] = {}
    projector_scale: float = 1.0
    projector_at: tuple[float, float] = (0.0, 0.0)
    network_addresses: dict[str, str] = {}
    network_on: list[str] = []
    study_equipment: dict[str, str | bool | None] = {}
    theme: str = "dark"
    text_size: int = 100
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
        """The settings kept in `folder`; the defaults where there are none, or none that can be read."""
        try:
            return msgspec.json.decode(read_file(folder / "settings.json"), type=Settings)
        except (UnderfootError, msgspec.DecodeError, UnicodeDecodeError):
            return Settings()

    def save(self, folder: Path) -> None:
        """Keep the settings in `folder`, which is made where it is missing."""
        folder.mkdir(parents=True, exist_ok=True)
        write_file(folder / "settings.json", msgspec.json.format(msgspec.json.encode(self), indent=1))

    def remember_file(self, path: Path) -> None:
        """Put a file at the head of the recent ones."""
        self.folder = str(path.parent)
        self.recent = [str(path), *(known for known in self.recent if known != str(path))][:8]

    @property
    def window_bytes(self) -> bytes:
        """Size and place of the window, as Qt wrote them."""
        try:
            return base64.b64decode(self.geometry, validate=True)
        except ValueError:
            return b""

    @window_bytes.setter
    def window_bytes(self, data: bytes) -> None:
        self.geometry = base64.b64encode(data).decode()
