"""Both ends of a transport, on this machine."""

import sys

import pytest
from free_ports import free_port

from underfoot.devices.transports import TRANSPORTS

EVERY_TRANSPORT = pytest.mark.parametrize(
    "scheme",
    [
        pytest.param(scheme, marks=pytest.mark.skipif(sys.platform == "win32", reason="there are no pseudo-terminals"))
        if scheme == "serial"
        else scheme
        for scheme in TRANSPORTS
    ],
)


def ends(scheme):
    """Return an emulator's sender, and the transport that reads what it sends."""
    transport = TRANSPORTS[scheme]
    sender = transport.sender.of(f"127.0.0.1:{free_port()}" if transport.sender.option_value else "")
    return sender, transport.of(sender.name)
