"""A UDP port that receives tiles' datagrams. Each holds whole frames or lines, one or more, of any tiles."""

import ipaddress
import socket
from collections.abc import Sequence
from contextlib import suppress
from typing import Self

from underfoot.devices.transport import (
    READ_TIMEOUT_S,
    Sender,
    Transport,
    address_text,
    bind_alone,
    host_and_port,
    listening_reason,
    reason,
)
from underfoot.errors import BadValue, DeviceError

DATAGRAM_BYTES = 1400
"""Largest datagram of the emulator in bytes: what an Ethernet frame carries."""
LEAST_PORT = 1024
"""Least port to listen at: those below are for the system's own services."""
_BUFFER_BYTES = 1 << 18
_LARGEST_BYTES = 1 << 16
_SYSTEM_BUFFER_BYTES = 1 << 22
MOST_NAMES = 256
"""Most addresses that are remembered by name."""


class UdpSender(Sender):
    """Sends datagrams of whole frames to `host` (empty: this machine) and `port`."""

    option, option_value = "udp", "[HOST:]PORT"
    help = "Datagrams to this port, of this machine by default."
    powers_tiles = False

    def __init__(self, host: str, port: int) -> None:
        self.name = address_text(host, port)
        try:
            self._to = socket.getaddrinfo(host or "127.0.0.1", port, type=socket.SOCK_DGRAM)[0]
            self._socket = socket.socket(self._to[0], socket.SOCK_DGRAM)
        except (OSError, ValueError) as error:
            raise DeviceError(f"udp:{self.name} cannot be sent to: {reason(error)}") from None
        self._is_plugged = True

    @classmethod
    def of(cls, value: str) -> Self:
        """Create the sender to `HOST:PORT`, `:PORT` or `PORT`."""
        return cls(*host_and_port(value))

    def send(self, data: bytes, ends: Sequence[int]) -> bool:
        """Send datagrams of whole frames, as many frames in each as fit."""
        if not self._is_plugged:
            return False
        begin = end = 0
        for place in (*ends, None):
            if place is None or (place - begin > DATAGRAM_BYTES and end > begin):
                with suppress(OSError):  # nobody listens, as is allowed
                    self._socket.sendto(data[begin:end], self._to[4])
                begin = end
            end = end if place is None else place
        return True

    def unplug(self) -> None:
        """Drop datagrams from now on."""
        self._is_plugged = False

    def plug(self) -> None:
        """Send datagrams again."""
        self._is_plugged = True

    def close(self) -> None:
        """Close the socket."""
        self._socket.close()


class UdpTransport(Transport):
    """Listens at `host` (empty: every address of this machine) and `port`.

    Anybody on the network can send to it. Each source address is a sender of its own, and a tile belongs to one sender
    at a time (`framing.parser`).
    """

    scheme, address_form = "udp", "HOST:PORT"
    help = "datagrams received at this address"
    label = "UDP"
    title = "Tiles over UDP"
    dialog_help = "HOST:PORT to listen at. 0.0.0.0 listens to all networks of this computer."
    sender = UdpSender

    def __init__(self, host: str, port: int) -> None:
        self.host, self.port = host, port
        self.name = f"udp:{address_text(host, port)}"
        self._socket: socket.socket | None = None
        self._data = memoryview(bytearray(_BUFFER_BYTES))
        self._names: dict[int, str] = {}

    @classmethod
    def of(cls, address: str) -> Self:
        """Create the transport that receives at `HOST:PORT`, `:PORT` or `PORT`."""
        host, port = host_and_port(address, LEAST_PORT)
        if _is_group(host):
            raise BadValue(f"address is {address!r}, of a group; allowed: an address of this computer, as 0.0.0.0:9000")
        return cls(host, port)

    @classmethod
    def suggestions(cls) -> list[str]:
        """Return the address that stands for all network interfaces of this machine."""
        return ["0.0.0.0:9000"]

    @property
    def devices(self) -> frozenset[str]:
        """The port: who listens to it at all addresses has it at each."""
        return frozenset({str(self.port)})

    def open(self) -> None:
        """Listen; raise `DeviceError` if that fails."""
        try:
            family = socket.AF_INET6 if ":" in self.host else socket.AF_INET
            self._socket = socket.socket(family, socket.SOCK_DGRAM)
            self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, _SYSTEM_BUFFER_BYTES)
            bind_alone(self._socket, self.host, self.port)
        except (OSError, ValueError, OverflowError) as error:
            self.close()
            raise DeviceError(f"{self.name} cannot be listened at: {listening_reason(error)}") from None

    def read(self) -> memoryview:
        """Return the datagrams received, each followed by a zero, so that a partial frame ends with its datagram."""
        if self._socket is None:
            raise DeviceError(f"{self.name} is not open")
        at = 0
        ends: list[tuple[int, int]] = []
        self._socket.settimeout(READ_TIMEOUT_S)
        try:
            while at + _LARGEST_BYTES < _BUFFER_BYTES:
                count, address = self._socket.recvfrom_into(self._data[at:])
                at += count
                self._data[at] = 0
                at += 1
                ends.append((at, self._number(address)))
                self._socket.settimeout(0.0)
        except (TimeoutError, BlockingIOError, ConnectionResetError):
            pass  # no more datagrams; or an unreachable port that was written to from here, which does not matter
        except OSError as error:
            raise DeviceError(f"{self.name} went away: {reason(error)}") from None
        self.senders = [*ends, (_BUFFER_BYTES, 0)]
        return self._data[:at]

    def sender_name(self, number: int) -> str:
        """Return address and port, if remembered; their number is limited."""
        return self._names.get(number, "another address")

    def _number(self, address: tuple[str, int]) -> int:
        """Return a number for an address that is stable, and that nobody else can choose."""
        number = hash(address[:2])
        if number not in self._names:
            if len(self._names) == MOST_NAMES:
                del self._names[next(iter(self._names))]  # the oldest: a board that is started anew has another port
            self._names[number] = address_text(*address[:2])
        return number

    def close(self) -> None:
        """Stop listening."""
        if self._socket is not None:
            self._socket.close()
            self._socket = None


def _is_group(host: str) -> bool:
    """Return whether a host is the address of a multicast group, which would have to be joined.

    >>> _is_group("239.1.2.3"), _is_group("127.0.0.1"), _is_group("floor.local")
    (True, False, False)
    """
    try:
        return ipaddress.ip_address(host).is_multicast
    except ValueError:
        return False
