"""Addresses of datagrams, HOST:PORT."""

import ipaddress

from msgspec import Struct

from underfoot.errors import BadValue

LOOPBACK = "127.0.0.1"
_FORM = "HOST:PORT, HOST an IPv4 address or localhost, PORT 1 to 65535"


class Address(Struct, frozen=True):
    """IPv4 address and UDP port. Names of other computers are not resolved, which can take seconds.

    >>> Address.parse("localhost:3333", "--tuio")
    Address(host='127.0.0.1', port=3333)
    >>> Address.parse("3333", "--tuio")
    Traceback (most recent call last):
    underfoot.errors.BadValue: --tuio is '3333'; allowed: HOST:PORT, HOST an IPv4 address or localhost, PORT 1 to 65535
    """

    host: str
    port: int

    @staticmethod
    def parse(text: str, name: str, least_port: int = 1) -> "Address":
        """Parse an address; `BadValue` names it `name`."""
        host, _, port = text.strip().rpartition(":")
        try:
            found = str(ipaddress.IPv4Address(LOOPBACK if host == "localhost" else host))
        except ValueError:
            found = ""
        if not found or not port.isascii() or not port.isdigit() or not least_port <= int(port) <= 65535:
            raise BadValue(f"{name} is {text!r}; allowed: {_FORM}")
        return Address(found, int(port))

    @property
    def is_loopback(self) -> bool:
        """Return whether only this computer reaches it."""
        return ipaddress.IPv4Address(self.host).is_loopback

    def __str__(self) -> str:
        return f"{self.host}:{self.port}"
