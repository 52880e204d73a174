"""The interface of transports, which carry the bytes of tiles, and of the emulator's end of them."""

import errno
import re
import socket
import sys
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from typing import ClassVar, Self, TypeVar

from underfoot.errors import BadValue, DeviceError, UnderfootError, kind_and_words

T = TypeVar("T")


class Sender(ABC):
    """The emulator's end of a transport, which sends as hardware would. Open from construction to `close`."""

    option: ClassVar[str]
    """Option of `underfoot emulate` that selects it, without dashes."""
    option_value: ClassVar[str]
    """Value of the option, as its help names it; "" for none."""
    help: ClassVar[str]
    """Help of the option, one line."""
    powers_tiles: ClassVar[bool]
    """Whether unplugging cuts the power of the tiles, so that they restart when plugged in again."""
    name: str
    """Address at which the transport reads the data sent."""

    @classmethod
    @abstractmethod
    def of(cls, value: str) -> Self:
        """Create the sender of an option's value; raise `BadValue` or `DeviceError` if that fails."""

    @abstractmethod
    def send(self, data: bytes, ends: Sequence[int]) -> bool:
        """Send bytes, in which frames end at `ends`; return whether all were sent."""

    @abstractmethod
    def unplug(self) -> None:
        """Interrupt the connection, as if its plug were pulled."""

    @abstractmethod
    def plug(self) -> None:
        """Restore the connection."""

    @abstractmethod
    def close(self) -> None:
        """Stop sending, and release everything."""


class Transport(ABC):
    """A connection that carries the bytes of tiles. The program knows only what a subclass declares.

    A subclass in a file of `transports` is discovered: targets, commands, the emulator, and the window's menu and
    dialog then offer it.
    """

    scheme: ClassVar[str]
    """Part of a target before the colon."""
    address_form: ClassVar[str]
    """Part of a target after the colon, as help names it."""
    help: ClassVar[str]
    """Short description for the help of commands."""
    label: ClassVar[str]
    """Name in the window, before an address."""
    title: ClassVar[str]
    """Name in the window's menu and dialog."""
    dialog_help: ClassVar[str]
    """Hint in the dialog on what to enter."""
    sender: ClassVar[type[Sender]]
    """The emulator's end."""
    doubt: ClassVar[str] = "does something else send there, or a hub read its own line wrongly?"
    """What to look for where bytes come, but are no frames."""
    boot_s: ClassVar[float] = 0.0
    """Seconds for which no frame may come once it is open, as of a board that begins anew then."""
    name: str
    """The target, as the user wrote it."""
    senders: Sequence[tuple[int, int]] | None = None
    """Of the last `read`, the end of each sender's bytes, and the sender's number; None for a single sender."""
    lost: Sequence[str] = ()
    """Of the last `read`, a line for each of several devices that went away meanwhile, while others are read."""

    @classmethod
    @abstractmethod
    def of(cls, address: str) -> Self:
        """Create the transport of an address, not open yet; raise `BadValue` for an invalid one."""

    @classmethod
    @abstractmethod
    def suggestions(cls) -> list[str]:
        """Return addresses that the dialog offers, the likeliest first."""

    @property
    def devices(self) -> frozenset[str]:
        """What only one can have open, in the same words for each way of writing its address."""
        return frozenset({self.name})

    @abstractmethod
    def open(self) -> None:
        """Open it; raise `DeviceError` if that fails."""

    @abstractmethod
    def read(self) -> bytes | memoryview:
        """Return the bytes received, after at most a tenth of a second; raise `DeviceError` if it is gone."""

    def sender_name(self, number: int) -> str:
        """Return the display name of a sender by its number in `senders`."""
        return self.name

    @abstractmethod
    def close(self) -> None:
        """Close it; does nothing if it is not open."""


READ_TIMEOUT_S = 0.1
"""Timeout of `Transport.read` in seconds."""


def made(name: str, of: Callable[[str], T], text: str) -> T:
    """Create a transport or sender by its `of`. A plug-in's can raise anything: an error of others is a `BadValue`."""
    try:
        return of(text)
    except UnderfootError:
        raise
    except (Exception, SystemExit) as error:
        raise BadValue(f"{name} is {text!r}: {kind_and_words(error)}") from error


def asked(end: Transport | Sender, call: Callable[[], T]) -> T:
    """Call `open`, `send` or another of these methods. A plug-in's can raise anything: any error is a `DeviceError`."""
    try:
        return call()
    except DeviceError:
        raise
    except (Exception, SystemExit) as error:
        raise DeviceError(f"{end.name}: {kind_and_words(error)}") from error


def host_and_port(text: str, least_port: int = 1) -> tuple[str, int]:
    """Parse `HOST:PORT`, `:PORT` or `PORT` into host and port; an IPv6 host is in brackets.

    >>> host_and_port("127.0.0.1:9000"), host_and_port(":9000"), host_and_port("9000"), host_and_port("[::1]:9000")
    (('127.0.0.1', 9000), ('', 9000), ('', 9000), ('::1', 9000))
    """
    found = _HOST_AND_PORT.fullmatch(text)
    if found is None or not least_port <= int(found["port"]) < 65536:
        raise BadValue(f"address is {text!r}; allowed: HOST:PORT with a port of {least_port} to 65535")
    return found["ipv6"] or found["host"] or "", int(found["port"])


def address_text(host: str, port: int) -> str:
    """Return the text of host and port: the inverse of `host_and_port`.

    >>> address_text("127.0.0.1", 9000), address_text("", 9000), address_text("::1", 9000)
    ('127.0.0.1:9000', ':9000', '[::1]:9000')
    """
    return f"[{host}]:{port}" if ":" in host else f"{host}:{port}"


_HOST_AND_PORT = re.compile(r"((\[(?P<ipv6>[^\[\]]+)\]|(?P<host>[^\[\]:]*)):)?(?P<port>[0-9]+)")


def bind_alone(datagrams: socket.socket, host: str, port: int) -> None:
    """Bind a UDP socket; `OSError` if another one has the port.

    Windows would otherwise let one listen at all addresses and another one at a single address, where it takes all.
    """
    if sys.platform == "win32":
        datagrams.setsockopt(socket.SOL_SOCKET, socket.SO_EXCLUSIVEADDRUSE, 1)
    datagrams.bind((host, port))


def reason(error: OSError | ValueError | OverflowError) -> str:
    """Return the cause of an address or connection error in the system's words; `ValueError` is about a host's name."""
    if isinstance(error, ValueError):
        return "there can be no host of this name"
    return str(getattr(error, "strerror", None) or error).lower()


def listening_reason(error: OSError | ValueError | OverflowError) -> str:
    """Return why nobody can listen at an address of this computer, and what to choose."""
    match getattr(error, "errno", None):
        case errno.EADDRINUSE:
            return "another program listens there, perhaps a second Underfoot; choose another port"
        case errno.EADDRNOTAVAIL:
            return "this computer has no such address; choose one of its own, or 0.0.0.0 for all of them"
        case errno.EACCES:
            return f"{reason(error)}; choose another port"
    return reason(error)
