"""The transports to tiles, one file each; `TRANSPORTS` finds them all."""

import inspect
from collections.abc import Mapping
from typing import TypeGuard

from underfoot.arguments import choice
from underfoot.devices.force_source import WITHOUT_HARDWARE
from underfoot.devices.transport import Sender, Transport, made
from underfoot.plugins import TRANSPORTS as ENTRY_POINTS
from underfoot.plugins import add_declared, require_declared, values_in


def discover() -> dict[str, type[Transport]]:
    """Return every transport that the modules of this folder and plug-ins declare, by its scheme.

    >>> "udp" in discover()
    True
    """
    found = {value.scheme: value for value in values_in(__name__) if _is_transport(value)}
    add_declared(found, ENTRY_POINTS, _is_transport, lambda transport: transport.scheme)
    return found


def _is_transport(value: object) -> TypeGuard[type[Transport]]:
    if not (isinstance(value, type) and issubclass(value, Transport) and not inspect.isabstract(value)):
        return False
    require_declared(value, Transport)
    require_declared(value.sender, Sender)
    if value.scheme in WITHOUT_HARDWARE:
        raise TypeError(f"there is a target {value.scheme} already")
    return True


TRANSPORTS: Mapping[str, type[Transport]] = discover()
"""Every transport by its scheme, which is also the kind of its targets."""


def target_forms(described: bool = False) -> str:
    """Return the text form of each transport's targets; if `described`, with descriptions.

    >>> "udp:HOST:PORT" in target_forms().split(", ")
    True
    """
    forms = [(f"{scheme}:{found.address_form}", found.help) for scheme, found in TRANSPORTS.items()]
    return ", ".join(f"{form} ({help})" if described else form for form, help in forms)


def split_target(text: str) -> tuple[str, str] | None:
    """Split a target into scheme and address; None for a target that uses no transport.

    >>> split_target("udp:127.0.0.1:9000"), split_target("walk.csv")
    (('udp', '127.0.0.1:9000'), None)
    """
    scheme, colon, address = text.partition(":")
    return (scheme, address) if colon and scheme in TRANSPORTS else None


def transport_of(scheme: str, address: str) -> Transport:
    """Create the transport of a scheme and an address, not open yet; raise `BadValue` if there is none."""
    choice("transport", scheme, TRANSPORTS)
    return made(scheme, TRANSPORTS[scheme].of, address)
