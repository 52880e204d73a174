"""A UDP port at which tiles' datagrams arrive. Each holds whole frames or lines, one or many, of any tiles."""

import socket

from underfoot.errors import BadValue, DeviceError

_WAIT_S = 0.1
_ROOM = 1 << 18
_LARGEST = 1 << 16
_KEPT = 1 << 22


class UdpPort:
    """Listens at `host` (empty: at every address of this machine) and `port`."""

    def __init__(self, host: str, port: int) -> None:
        self.host, self.port = host, port
        self.name = f"udp:{host}:{port}"
        self._socket: socket.socket | None = None
        self._data = memoryview(bytearray(_ROOM))

    @staticmethod
    def named(text: str) -> "UdpPort":
        """The port of `HOST:PORT`, `:PORT` or `PORT`."""
        return UdpPort(*address(text))

    def open(self) -> None:
        """Listen; `DeviceError` where that cannot be."""
        try:
            family = socket.AF_INET6 if ":" in self.host else socket.AF_INET
            self._socket = socket.socket(family, socket.SOCK_DGRAM)
            self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, _KEPT)
            self._socket.bind((self.host, self.port))
        except (OSError, OverflowError) as error:
            self.close()
            reason = getattr(error, "strerror", None) or str(error)
            raise DeviceError(f"{self.name} cannot be listened at: {reason.lower()}") from None

    def read(self) -> memoryview:
        """The datagrams that came, a zero behind each, so that a piece of a frame ends with its datagram."""
        if self._socket is None:
            raise DeviceError(f"{self.name} is not open")
        at = 0
        self._socket.settimeout(_WAIT_S)
        try:
            while at + _LARGEST < _ROOM:
                at += self._socket.recv_into(self._data[at:])
                self._data[at] = 0
                at += 1
                self._socket.settimeout(0.0)
        except (TimeoutError, BlockingIOError, ConnectionResetError):
            pass  # that was all; or a port that was written to from here is not there, which nobody minds
        except OSError as error:
            raise DeviceError(f"{self.name} went away: {(error.strerror or str(error)).lower()}") from None
        return self._data[:at]

    def close(self) -> None:
        """Stop listening."""
        if self._socket is not None:
            self._socket.close()
            self._socket = None


def address(text: str) -> tuple[str, int]:
    """Host and port of `HOST:PORT`, `:PORT` or `PORT`; an IPv6 host in brackets.

    >>> address("127.0.0.1:9000"), address(":9000"), address("9000"), address("[::1]:9000")
    (('127.0.0.1', 9000), ('', 9000), ('', 9000), ('::1', 9000))
    """
    host, _, port = text.rpartition(":")
    if not port.isdecimal() or not 0 < int(port) < 65536:
        raise BadValue(f"address is {text!r}; allowed: HOST:PORT with a port of 1 to 65535")
    return host.strip("[]"), int(port)
