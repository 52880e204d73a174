"""What a transport is: a connection over which the bytes of tiles come, and the emulator's end of it."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from underfoot.errors import BadValue


class Sender(ABC):
    """The emulator's end of a transport: sends what hardware would send. Open from its construction to `close`."""

    option: ClassVar[str]
    """The option of `underfoot emulate` that chooses it, without dashes."""
    option_value: ClassVar[str]
    """What the option takes, as its help names it; "" for none."""
    help: ClassVar[str]
    """One line for the option."""
    powers_tiles: ClassVar[bool]
    """Whether unplugging takes the power of the tiles with it, so that they restart when they are plugged in again."""
    name: str
    """The address at which the transport reads what is sent."""

    @classmethod
    @abstractmethod
    def of(cls, value: str) -> Self:
        """The sender that the value of its option asks for; `BadValue` or `DeviceError` where that cannot be."""

    @abstractmethod
    def send(self, data: bytes, ends: Sequence[int]) -> bool:
        """Send bytes, of which frames end at `ends`; whether all went out."""

    @abstractmethod
    def unplug(self) -> None:
        """Take the connection away, as if its plug were pulled."""

    @abstractmethod
    def plug(self) -> None:
        """Put it back."""

    @abstractmethod
    def close(self) -> None:
        """Send no more, and let go of everything."""


class Transport(ABC):
    """A connection over which the bytes of tiles come. What a subclass declares is all that the program knows of it.

    A subclass in a file of `transports` is found by itself: targets, commands, the emulator, and the window's menu and
    dialog have it then.
    """

    scheme: ClassVar[str]
    """What stands before the colon of a target."""
    address_form: ClassVar[str]
    """What stands behind it, as help names it."""
    help: ClassVar[str]
    """What it is, in a few words, for the help of commands."""
    label: ClassVar[str]
    """What the window calls it, before an address."""
    title: ClassVar[str]
    """What the window's menu and dialog call it."""
    dialog_help: ClassVar[str]
    """What can be typed into the dialog, for the person."""
    sender: ClassVar[type[Sender]]
    """The emulator's end."""
    name: str
    """The target, as the person named it."""
    senders: NDArray[np.int64] | None = None
    """Where, in what `read` gave last, the bytes of each sender end, and its number: (n, 2). None for only one."""

    @classmethod
    @abstractmethod
    def of(cls, address: str) -> Self:
        """The transport of an address, not open yet; `BadValue` where it is none."""

    @classmethod
    @abstractmethod
    def suggestions(cls) -> list[str]:
        """Addresses that the dialog offers, the likeliest first."""

    @abstractmethod
    def open(self) -> None:
        """Open it; `DeviceError` where that cannot be."""

    @abstractmethod
    def read(self) -> bytes | memoryview:
        """What came, at the latest after a tenth of a second; `DeviceError` where it has gone away."""

    def sender_name(self, number: int) -> str:
        """What a person calls a sender by its number in `senders`."""
        return self.name

    @abstractmethod
    def close(self) -> None:
        """Close it; nothing happens where it is not open."""


READ_TIMEOUT_S = 0.1
"""How long `Transport.read` waits for something to come."""


def host_and_port(text: str) -> tuple[str, int]:
    """Host and port of `HOST:PORT`, `:PORT` or `PORT`; an IPv6 host in brackets.

    >>> host_and_port("127.0.0.1:9000"), host_and_port(":9000"), host_and_port("9000"), host_and_port("[::1]:9000")
    (('127.0.0.1', 9000), ('', 9000), ('', 9000), ('::1', 9000))
    """
    host, _, port = text.rpartition(":")
    if not port.isdecimal() or not 0 < int(port) < 65536:
        raise BadValue(f"address is {text!r}; allowed: HOST:PORT with a port of 1 to 65535")
    return host.strip("[]"), int(port)


def reason(error: OSError | ValueError | OverflowError) -> str:
    """What went wrong with an address or a connection, in the system's words; `ValueError` is of a host's name."""
    if isinstance(error, ValueError):
        return "there can be no host of this name"
    return str(getattr(error, "strerror", None) or error).lower()
