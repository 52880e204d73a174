"""A TCP connection to a listening hub or a tile on Wi-Fi: one stream of the frames or lines of its tiles."""

import os
import socket
from collections.abc import Sequence
from contextlib import suppress
from typing import Self

from underfoot.devices.transport import (
    READ_TIMEOUT_S,
    Sender,
    Transport,
    address_text,
    host_and_port,
    listening_reason,
    reason,
)
from underfoot.errors import DeviceError, TakenAway

CONNECT_TIMEOUT_S = 1.0
"""Seconds to wait for a hub's answer."""
SEND_TIMEOUT_S = 0.5
"""Seconds after which the emulator drops a reader that takes nothing."""
_READ_BYTES = 1 << 18
_KEEPALIVE = (("TCP_KEEPIDLE", 2), ("TCP_KEEPALIVE", 2), ("TCP_KEEPINTVL", 1), ("TCP_KEEPCNT", 3))
"""Seconds without data, by its name here and on macOS; seconds between probes; probes."""


class TcpSender(Sender):
    """Listens at `host` (empty: this machine only) and `port`, and sends to the client that connected last."""

    option, option_value = "tcp", "[HOST:]PORT"
    help = "To whoever connects to this port, from this machine alone by default."
    powers_tiles = False

    def __init__(self, host: str, port: int) -> None:
        self.name = address_text(host or "127.0.0.1", port)
        self._at = host or "127.0.0.1", port
        self._listener: socket.socket | None = None
        self._reader: socket.socket | None = None
        self.plug()

    @classmethod
    def of(cls, value: str) -> Self:
        """Create the sender that listens at `HOST:PORT`, `:PORT` or `PORT`."""
        return cls(*host_and_port(value))

    def send(self, data: bytes, ends: Sequence[int]) -> bool:
        """Send to the reader; without one, the data is lost."""
        self._accept()
        if self._reader is None:
            return False
        try:
            self._reader.sendall(data)
        except OSError:  # it is gone, or takes nothing
            self._drop_reader()
            return False
        return True

    def unplug(self) -> None:
        """Close the connection, and refuse others."""
        self._accept()
        self._drop_reader()
        if self._listener is not None:
            self._listener.close()
            self._listener = None

    def plug(self) -> None:
        """Listen again; raise `DeviceError` if that fails."""
        self.unplug()
        try:
            self._listener = socket.socket(socket.AF_INET6 if ":" in self._at[0] else socket.AF_INET)
            if os.name == "posix":  # elsewhere it would allow two listeners
                self._listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            self._listener.bind(self._at)
            self._listener.listen()
            self._listener.setblocking(False)
        except (OSError, ValueError) as error:
            self.close()
            raise DeviceError(f"tcp:{self.name} cannot be listened at: {listening_reason(error)}") from None

    def close(self) -> None:
        """Stop sending and listening."""
        self.unplug()

    def _accept(self) -> None:
        """Accept waiting connections. Each replaces the previous one, which may be dead without notice."""
        while self._listener is not None:
            try:
                reader, _ = self._listener.accept()
            except OSError:
                return
            self._drop_reader()
            reader.settimeout(SEND_TIMEOUT_S)
            reader.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)  # otherwise samples wait for earlier ones
            self._reader = reader

    def _drop_reader(self) -> None:
        if self._reader is not None:
            self._reader.close()
            self._reader = None


class TcpTransport(Transport):
    """Connects to the hub at `host` (empty: this machine) and `port`."""

    scheme, address_form = "tcp", "HOST:PORT"
    help = "a hub that listens at this address"
    label = "TCP"
    title = "Tiles over TCP"
    dialog_help = "HOST:PORT of the hub to connect to. One to try: underfoot emulate --tcp 9001"
    sender = TcpSender

    def __init__(self, host: str, port: int) -> None:
        self.host, self.port = host, port
        self.name = f"tcp:{address_text(host, port)}"
        self._socket: socket.socket | None = None
        self._data = memoryview(bytearray(_READ_BYTES))

    @classmethod
    def of(cls, address: str) -> Self:
        """Create the transport from the hub at `HOST:PORT`, or on this machine at `:PORT` or `PORT`."""
        return cls(*host_and_port(address))

    @classmethod
    def suggestions(cls) -> list[str]:
        """Return the emulator's address, as an example."""
        return ["127.0.0.1:9001"]

    @property
    def devices(self) -> frozenset[str]:
        """The hub, which listens to whoever connected last."""
        return frozenset({address_text("127.0.0.1" if self.host in ("", "localhost") else self.host, self.port)})

    def open(self) -> None:
        """Connect; raise `DeviceError` if nobody answers."""
        try:
            self._socket = socket.create_connection((self.host or "127.0.0.1", self.port), CONNECT_TIMEOUT_S)
        except (OSError, ValueError) as error:
            raise DeviceError(f"{self.name} cannot be connected to: {reason(error)}") from None
        self._socket.settimeout(READ_TIMEOUT_S)
        # A pure reader never learns that a hub has lost power, unless the system probes it.
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
        for name, value in _KEEPALIVE:
            with suppress(AttributeError, OSError):  # not every system supports it
                self._socket.setsockopt(socket.IPPROTO_TCP, getattr(socket, name), value)

    def read(self) -> memoryview:
        """Return the bytes received, after at most a tenth of a second; `DeviceError` if the connection has ended."""
        if self._socket is None:
            raise DeviceError(f"{self.name} is not open")
        try:
            count = self._socket.recv_into(self._data)
        except TimeoutError as error:
            if error.errno is not None:  # from the system: keepalive was not answered
                raise DeviceError(f"{self.name} went away: {reason(error)}") from None
            return self._data[:0]
        except OSError as error:
            raise DeviceError(f"{self.name} went away: {reason(error)}") from None
        if not count:
            raise TakenAway(f"{self.name} went away: the connection was closed, perhaps for another program")
        return self._data[:count]

    def close(self) -> None:
        """Close the connection."""
        if self._socket is not None:
            self._socket.close()
            self._socket = None
