"""Network plan: destinations of output, and sources of input."""

from collections.abc import Collection, Mapping

from msgspec import Struct

from underfoot.errors import require
from underfoot.network.addresses import LOOPBACK, Address

OFF = "off"
FLAGS = ("lsl", "lsl_marks")
"""Ways without an address."""
TUIO_PORT, LISTEN_PORT, SEND_PORT = 3333, 9700, 9701
"""The port that TUIO clients expect; and those of Underfoot's own messages, which nothing else is known to use."""


class NetworkPlan(Struct, frozen=True):
    """Ways of output and input.

    Where contacts go as TUIO 1.1 and 2.0, where cues come in, where Underfoot's own messages go; None for nowhere.

    Marks come in by cues, and on a serial port `serial_marks`, or as streams of LSL, `lsl_marks`.

    >>> NetworkPlan.of(tuio="localhost:3333", listen="off").tuio
    Address(host='127.0.0.1', port=3333)
    """

    tuio: Address | None = None
    tuio2: Address | None = None
    listen: Address | None = None
    send: Address | None = None
    lsl: bool = False
    serial_marks: str = ""
    lsl_marks: bool = False

    @staticmethod
    def of(*, lsl: bool = False, serial_marks: str = OFF, lsl_marks: bool = False, **addresses: str) -> "NetworkPlan":
        """Parse a plan: HOST:PORT or "off" for `tuio`, `tuio2`, `listen` and `send`; a serial port or "off" for marks.

        Raises `BadValue` for anything else.
        """
        port = "" if serial_marks == OFF else serial_marks
        ways = {name: None if text == OFF else Address.parse(text, name) for name, text in addresses.items()}
        return NetworkPlan(**ways, lsl=lsl, serial_marks=port, lsl_marks=lsl_marks)

    @staticmethod
    def chosen(addresses: Mapping[str, str], on: Collection[str]) -> "NetworkPlan":
        """Return the plan with the ways that are `on`, by their names; these may include `FLAGS`."""
        require("serial_marks" not in on or bool(addresses["serial_marks"]), "serial port", "", "as /dev/ttyUSB0, COM3")
        ways = {name: text if name in on else OFF for name, text in addresses.items()}
        return NetworkPlan.of(**ways, lsl="lsl" in on, lsl_marks="lsl_marks" in on)

    @property
    def is_anything(self) -> bool:
        """Return whether the plan has any way."""
        return self != NetworkPlan()

    def warnings(self) -> list[str]:
        """Return warnings to show first: a line for each way that leaves this computer."""
        away = [str(to) for to in (self.tuio, self.tuio2, self.send) if to is not None and not to.is_loopback]
        said = []
        if self.listen is not None and not self.listen.is_loopback:
            said.append(
                f"cues are taken at {self.listen}, without a password: whoever is on that network can play on this "
                "floor, change what it plays, and silence it"
            )
        if away:
            said.append(
                f"contacts are sent to {', '.join(dict.fromkeys(away))}, not encrypted: whoever is on that network "
                "can see where people stand"
            )
        return said


def loopback(port: int) -> str:
    """Return an address on this computer, as text."""
    return f"{LOOPBACK}:{port}"
