"""The library of the Lab Streaming Layer (`pip install "underfoot[lsl]"`), and its outlets."""

import os
import socket
from collections.abc import Sequence
from types import ModuleType
from typing import TYPE_CHECKING

from underfoot.errors import BadValue

if TYPE_CHECKING:
    from pylsl import StreamOutlet

Channel = tuple[str, str]
"""Label and unit."""

_CONFIGURABLE = 118
"""Version of the library from which on a program can configure it: 1.18."""


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


def outlet(name: str, kind: str, rate_hz: float, format: str, channels: Sequence[Channel]) -> "StreamOutlet":
    """Return an outlet, `Underfoot NAME`, with its channels described; of a rate of 0 if it is irregular.

    By its source id an inlet finds a stream again that ended: without the computer's name it would go on with that of
    another floor on the network.
    """
    lsl, source = lsl_library(), f"underfoot-{name.replace(' ', '-')}-{socket.gethostname()}"
    info = lsl.StreamInfo(f"Underfoot {name}", kind, len(channels), rate_hz, format, source)
    described = info.desc().append_child("channels")
    for label, unit in channels:
        channel = described.append_child("channel")
        for key, value in (("label", label), ("unit", unit), ("type", kind)):
            channel.append_child_value(key, value)
    return lsl.StreamOutlet(info)


def _lsl_configurations() -> tuple[str, ...]:
    """Return where the library looks for its configuration, which may be of a whole laboratory's network."""
    name = "lsl_api.cfg"
    folders = (".", os.path.expanduser("~/lsl_api"), "/etc/lsl_api")
    return os.environ.get("LSLAPICFG", ""), *(os.path.join(folder, name) for folder in folders)
