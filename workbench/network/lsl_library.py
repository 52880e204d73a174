"""The library of the Lab Streaming Layer (`pip install "underfoot[lsl]"`), and the ids of streams."""

import os
import socket
from types import ModuleType

from underfoot.errors import BadValue

_CONFIGURABLE = 118
"""Version of the library from which on a program can configure it: 1.18."""


def source_id(stream: str) -> str:
    """Return the source id of a stream of this computer.

    By its id an inlet finds a stream again that ended: without the computer's name it would go on with that of another
    floor on the network.
    """
    return f"underfoot-{stream}-{socket.gethostname()}"


def lsl_library() -> ModuleType:
    """Return the package pylsl; raise `BadValue` if it is not installed.

    Its library then writes only errors to the terminal, unless a configuration of its own, or its age, says otherwise.
    """
    try:
        import pylsl
        from pylsl import library_version
    except (ImportError, RuntimeError):
        raise BadValue('LSL needs the package pylsl: pip install "underfoot[lsl]"') from None
    configurations = [name for name in _lsl_configurations() if os.path.isfile(name)]
    if not configurations and library_version() >= _CONFIGURABLE:
        pylsl.set_config_content("[log]\nlevel = -2\n")
    return pylsl


def _lsl_configurations() -> tuple[str, ...]:
    """Return where the library looks for its configuration, which may be of a whole laboratory's network."""
    name = "lsl_api.cfg"
    folders = (".", os.path.expanduser("~/lsl_api"), "/etc/lsl_api")
    return os.environ.get("LSLAPICFG", ""), *(os.path.join(folder, name) for folder in folders)
