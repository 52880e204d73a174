"""What a session of a study is made with: program, computer, where force comes from and where vibration goes."""

import platform
import re
from typing import TYPE_CHECKING

from underfoot.quantities import counted
from underfoot.version import __version__

if TYPE_CHECKING:
    from underfoot.engine.target import Target


COLUMNS = ("software", "python", "system", "target", "floor", "profiles", "sound")
"""What a session is made with, by its names in a session file."""


def set_up_of(target: "Target") -> dict[str, str]:
    """Return what a session on a target is made with, by `COLUMNS`, without folders.

    >>> from underfoot.engine.target import Target
    >>> from underfoot.floor.layout import default_floor
    >>> made = set_up_of(Target(default_floor(), "serial", "/dev/ttyACM0", sound=""))
    >>> made["target"], made["sound"], made["floor"]
    ('serial:ttyACM0', 'default', '2 x 2 tiles')
    """
    return {
        "target": _without_folders(f"{target.kind}:{target.source or target.simulation}").rstrip(":"),
        "floor": target.floor.title or counted(len(target.floor.tiles), "tile"),
        "profiles": _without_folders(target.profiles),
        "sound": "none" if target.sound is None else target.sound or "default",
        "software": f"Underfoot {__version__}",
        "python": platform.python_version(),
        "system": platform.platform(),
    }


def _without_folders(text: str) -> str:
    """Return a target or a file by its name: the session may be shared.

    >>> _without_folders("serial:/dev/ttyUSB0"), _without_folders("study/profiles/"), _without_folders("udp:[::1]:9000")
    ('serial:ttyUSB0', 'profiles', 'udp:[::1]:9000')
    >>> _without_folders("C:\\\\study\\\\profiles"), _without_folders("simulator:C:\\\\study\\\\soft.json")
    ('profiles', 'simulator:soft.json')
    """
    return re.sub(r"(?:\b[A-Za-z]:)?[^:]*[/\\]", "", text.rstrip("/\\"))
