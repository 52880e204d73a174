"""Search for sound cards in a separate process, because PortAudio lists devices only once while a stream is open."""

import time
from multiprocessing.connection import Connection

from underfoot.devices.sound import Card, devices
from underfoot.engine.child_process import ChildProcess

_LOOK_S, _MOST_S = 0.02, 20.0


def run(connection: Connection) -> None:
    """Send the list of present output devices; the main function of the process."""
    connection.send(devices())


class CardSearch:
    """Lists the present sound cards, including ones plugged in since the program started; playback continues."""

    def __init__(self) -> None:
        self._is_given_up = False

    def find(self) -> list[Card]:
        """Wait for the list; empty if the search takes too long or another thread gave it up."""
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
        """Make `find` return at once."""
        self._is_given_up = True
