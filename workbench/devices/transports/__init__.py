"""The transports to tiles, one file each; `TRANSPORTS` finds them all."""

import importlib
import inspect
import pkgutil
from collections.abc import Mapping
from typing import TypeGuard

from underfoot.devices.transport import Sender, Transport
from underfoot.errors import BadValue
from underfoot.plugins import TRANSPORTS as ENTRY_POINTS
from underfoot.plugins import declared, refuse


def discover() -> dict[str, type[Transport]]:
    """Return every transport that the modules of this folder and plug-ins declare, by its scheme.

    >>> "udp" in discover()
    True
    """
    found: dict[str, type[Transport]] = {}
    for module in pkgutil.iter_modules(__path__):
        for value in vars(importlib.import_module(f"{__name__}.{module.name}")).values():
            if _is_transport(value):
                found[value.scheme] = value
    for name, value in declared(ENTRY_POINTS):
        try:
            if _is_transport(value) and found.setdefault(value.scheme, value) is not value:
                refuse(name, f"there is a transport {value.scheme} already")
        except TypeError as error:
            refuse(name, str(error))
    return found


def _is_transport(value: object) -> TypeGuard[type[Transport]]:
    if not (isinstance(value, type) and issubclass(value, Transport) and not inspect.isabstract(value)):
        return False
    _require_declared(value, Transport)
    _require_declared(value.sender, Sender)
    return True


def _require_declared(found: type, base: type) -> None:
    missing = [name for name in inspect.get_annotations(base) if name != "name" and not hasattr(found, name)]
    if missing:
        raise TypeError(f"{found.__qualname__} does not declare {', '.join(missing)}")


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
    if scheme not in TRANSPORTS:
        raise BadValue(f"transport is {scheme!r}; allowed: {', '.join(TRANSPORTS)}")
    return TRANSPORTS[scheme].of(address)
