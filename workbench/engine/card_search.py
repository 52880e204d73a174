"""Looks for sound cards in a process of its own: PortAudio looks once, and again only where no stream is open."""

import time
from multiprocessing.connection import Connection

from underfoot.devices.sound import Card, devices
from underfoot.engine.child_process import ChildProcess

_LOOK_S, _MOST_S = 0.02, 20.0


def run(connection: Connection) -> None:
    """The process's main function: sends the list of output devices that there are now."""
    connection.send(devices())


class CardSearch:
    """Finds the cards that there are now, also those plugged in since the program started; whatever plays goes on."""

    def __init__(self) -> None:
        self._is_given_up = False

    def find(self) -> list[Card]:
        """Wait for the list; none where the search takes too long, or was given up by another thread."""
        process = ChildProcess("card search", __name__)
        end, found = time.monotonic() + _MOST_S, list[list[Card]]()
        while not (found or self._is_given_up) and process.is_alive and time.monotonic() < end:
            time.sleep(_LOOK_S)
            found = process.receive()
        found = found or process.receive()
        process.kill()
        process.end(0.0)
        return found[0] if found else []

    def give_up(self) -> None:
        """Let `find` come back at once."""
        self._is_given_up = True
