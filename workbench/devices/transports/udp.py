"""A UDP port at which tiles' datagrams arrive. Each holds whole frames or lines, one or many, of any tiles."""

import socket
from collections.abc import Sequence
from contextlib import suppress
from typing import Self

import numpy as np

from underfoot.devices.transport import READ_TIMEOUT_S, Sender, Transport, host_and_port, reason
from underfoot.errors import DeviceError

DATAGRAM_BYTES = 1400
"""Bytes that a datagram of the emulator holds at most: what an Ethernet frame carries."""
_BUFFER_BYTES = 1 << 18
_LARGEST_BYTES = 1 << 16
_SYSTEM_BUFFER_BYTES = 1 << 22
_MOST_NAMES = 256


class UdpSender(Sender):
    """Datagrams to `host` (empty: this machine) and `port`, each of whole frames."""

    option, option_value = "udp", "[HOST:]PORT"
    help = "Datagrams to this port, of this machine by default."
    powers_tiles = False

    def __init__(self, host: str, port: int) -> None:
        self.name = f"{host}:{port}"
        try:
            self._to = socket.getaddrinfo(host or "127.0.0.1", port, type=socket.SOCK_DGRAM)[0]
            self._socket = socket.socket(self._to[0], socket.SOCK_DGRAM)
        except (OSError, ValueError) as error:
            raise DeviceError(f"udp:{self.name} cannot be sent to: {reason(error)}") from None
        self._is_plugged = True

    @classmethod
    def of(cls, value: str) -> Self:
        """To the address `HOST:PORT`, `:PORT` or `PORT`."""
        return cls(*host_and_port(value))

    def send(self, data: bytes, ends: Sequence[int]) -> bool:
        """Send datagrams that end where frames end, as many frames in each as it holds."""
        if not self._is_plugged:
            return False
        begin = end = 0
        for place in (*ends, None):
            if place is None or (place - begin > DATAGRAM_BYTES and end > begin):
                with suppress(OSError):  # nobody listens, which a tile does not mind
                    self._socket.sendto(data[begin:end], self._to[4])
                begin = end
            end = end if place is None else place
        return True

    def unplug(self) -> None:
        """Let no datagrams through."""
        self._is_plugged = False

    def plug(self) -> None:
        """Let datagrams through again."""
        self._is_plugged = True

    def close(self) -> None:
        """Send no more."""
        self._socket.close()


class UdpTransport(Transport):
    """Listens at `host` (empty: at every address of this machine) and `port`.

    Anybody on the network can send to it. Each address that datagrams come from is a sender of its own, and a tile
    belongs to one sender at a time (`framing.parser`).
    """

    scheme, address_form = "udp", "HOST:PORT"
    help = "datagrams received at this address"
    label = "UDP"
    title = "Tiles over UDP"
    dialog_help = "HOST:PORT to listen at. 0.0.0.0 listens to all networks of this computer."
    sender = UdpSender

    def __init__(self, host: str, port: int) -> None:
        self.host, self.port = host, port
        self.name = f"udp:{host}:{port}"
        self._socket: socket.socket | None = None
        self._data = memoryview(bytearray(_BUFFER_BYTES))
        self._names: dict[int, str] = {}

    @classmethod
    def of(cls, address: str) -> Self:
        """The port of `HOST:PORT`, `:PORT` or `PORT`."""
        return cls(*host_and_port(address))

    @classmethod
    def suggestions(cls) -> list[str]:
        """All networks of this machine."""
        return ["0.0.0.0:9000"]

    def open(self) -> None:
        """Listen; `DeviceError` where that cannot be."""
        try:
            family = socket.AF_INET6 if ":" in self.host else socket.AF_INET
            self._socket = socket.socket(family, socket.SOCK_DGRAM)
            self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, _SYSTEM_BUFFER_BYTES)
            self._socket.bind((self.host, self.port))
        except (OSError, ValueError, OverflowError) as error:
            self.close()
            raise DeviceError(f"{self.name} cannot be listened at: {reason(error)}") from None

    def read(self) -> memoryview:
        """The datagrams that came, a zero behind each, so that a piece of a frame ends with its datagram."""
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
            pass  # that was all; or a port that was written to from here is not there, which nobody minds
        except OSError as error:
            raise DeviceError(f"{self.name} went away: {reason(error)}") from None
        self.senders = np.array([*ends, (_BUFFER_BYTES, 0)], np.int64)
        return self._data[:at]

    def sender_name(self, number: int) -> str:
        """Address and port, while it is known; there may be any number of them."""
        return self._names.get(number, "another address")

    def _number(self, address: tuple[str, int]) -> int:
        """A number for an address, the same whenever it is heard, that nobody else can choose for theirs."""
        number = hash(address[:2])
        if number not in self._names and len(self._names) < _MOST_NAMES:
            self._names[number] = f"{address[0]}:{address[1]}"
        return number

    def close(self) -> None:
        """Stop listening."""
        if self._socket is not None:
            self._socket.close()
            self._socket = None
