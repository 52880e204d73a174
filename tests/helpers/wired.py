"""Both ends of a transport, on this machine."""

import socket
import sys

import pytest

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


def free_port():
    """Return a free port of this machine."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as one, socket.socket() as other:
        one.bind(("127.0.0.1", 0))
        other.bind(one.getsockname())
        return one.getsockname()[1]


def ends(scheme):
    """Return an emulator's sender, and the transport that reads what it sends."""
    transport = TRANSPORTS[scheme]
    sender = transport.sender.of(f"127.0.0.1:{free_port()}" if transport.sender.option_value else "")
    return sender, transport.of(sender.name)
