"""A simulated variable stiffness plate, in this process or on a pseudo-terminal, with the real one's protocol."""

import math
import os
import threading
import time
from collections.abc import Callable
from contextlib import suppress

from underfoot.errors import DeviceError


class SimulatedServo:
    """The servo's side of the line: what is written to it, and what it replies; an open serial port for `Plate`.

    `moves` has every move that was begun: start, end, and duration in seconds.
    """

    def __init__(self, clock: Callable[[], float] = time.perf_counter) -> None:
        self._clock = clock
        self.moves: list[tuple[float, float, float]] = []
        self._from, self._to, self._began, self._takes = 0.0, 0.0, 0.0, 0.0
        self.is_moving = False
        self._written, self._replies = b"", b""

    @property
    def position(self) -> float:
        """Present position, 0 to 1."""
        if not self.is_moving or self._takes <= 0.0:
            return self._to
        along = min((self._clock() - self._began) / self._takes, 1.0)
        return self._from + (self._to - self._from) * along

    @property
    def in_waiting(self) -> int:
        """Number of bytes to read."""
        if self.is_moving and self._clock() - self._began >= self._takes:
            self.is_moving = False
            self._say(f"AT {self._to:.4f}")
        return len(self._replies)

    def read(self, count: int) -> bytes:
        """Take up to so many bytes of its replies."""
        taken, self._replies = self._replies[:count], self._replies[count:]
        return taken

    def write(self, data: bytes) -> None:
        """Send it bytes: it obeys every whole line."""
        *lines, self._written = (self._written + data).split(b"\n")
        for line in lines:
            self._obey(line.decode("ascii", "replace").split())

    def close(self) -> None:
        """Do nothing: a simulated servo holds no resource."""

    def _obey(self, text: list[str]) -> None:
        match text:
            case ["MOVE", position, seconds]:
                try:
                    to, takes = float(position), float(seconds)
                except ValueError:
                    self._say("ERR MOVE takes a position and seconds")
                    return
                if not 0.0 <= to <= 1.0:
                    self._say(f"ERR position {to:g} is not within 0 to 1")
                    return
                if not 0.0 <= takes < math.inf:  # a servo that never arrives, or has arrived before
                    self._say(f"ERR {takes:g} seconds are no duration")
                    return
                self._from, self._to, self._takes = self.position, to, takes
                self._began, self.is_moving = self._clock(), True
                self.moves.append((self._from, to, takes))
                self._say("MOVING")
            case ["HOLD"]:
                self._to, self.is_moving = self.position, False
                self._say(f"AT {self._to:.4f}")
            case []:
                pass
            case _:
                self._say(f"ERR {' '.join(text)}")

    def _say(self, text: str) -> None:
        self._replies += f"{text}\n".encode()


class EmulatedPlate:
    """A plate at the serial port `name`, in a thread, until `close`."""

    def __init__(self) -> None:
        try:
            import tty

            self._master, self._slave = os.openpty()
        except (ImportError, OSError) as error:
            raise DeviceError(f"there is no pseudo-terminal for the plate: {error}") from None
        tty.setraw(self._slave)
        os.set_blocking(self._master, False)
        self.name = os.ttyname(self._slave)
        self.servo = SimulatedServo()
        self._ends = threading.Event()
        self._thread = threading.Thread(target=self._run, name="emulated plate", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Remove the plate."""
        self._ends.set()
        self._thread.join()
        for end in (self._master, self._slave):
            os.close(end)

    def _run(self) -> None:
        while not self._ends.wait(0.005):
            try:
                self.servo.write(os.read(self._master, 4096))
            except BlockingIOError:
                pass
            except OSError:
                return
            if waiting := self.servo.in_waiting:
                with suppress(BlockingIOError):  # nobody reads
                    os.write(self._master, self.servo.read(waiting))
