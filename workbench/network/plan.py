"""What is sent where, and what is listened to."""

from dataclasses import dataclass

from underfoot.network.addresses import LOOPBACK, Address

OFF = "off"
TUIO_PORT, LISTEN_PORT, SEND_PORT = 3333, 9700, 9701
"""The port that TUIO clients expect; and those of Underfoot's own messages, which nothing else is known to use."""


@dataclass(frozen=True)
class NetworkPlan:
    """Where contacts go as TUIO 1.1 and 2.0, where cues come in, where Underfoot's own messages go; None for nowhere.

    >>> NetworkPlan.of(tuio="localhost:3333", listen="off")
    NetworkPlan(tuio=Address(host='127.0.0.1', port=3333), tuio2=None, listen=None, send=None, lsl=False)
    """

    tuio: Address | None = None
    tuio2: Address | None = None
    listen: Address | None = None
    send: Address | None = None
    lsl: bool = False

    @staticmethod
    def of(tuio: str = OFF, tuio2: str = OFF, listen: str = OFF, send: str = OFF, lsl: bool = False) -> "NetworkPlan":
        """The plan that these texts say: HOST:PORT, or "off". `BadValue` for anything else."""
        return NetworkPlan(
            _address(tuio, "tuio"), _address(tuio2, "tuio2"), _address(listen, "listen"), _address(send, "send"), lsl
        )

    @property
    def is_anything(self) -> bool:
        """Whether there is anything to do."""
        return self != NetworkPlan()

    def warnings(self) -> list[str]:
        """What a person is to know before this begins: a line for each way that leaves this computer."""
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


def _address(text: str, name: str) -> Address | None:
    return None if text == OFF else Address.parse(text, name)


def loopback(port: int) -> str:
    """An address on this computer, as text."""
    return f"{LOOPBACK}:{port}"
