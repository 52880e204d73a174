"""An emulated variable stiffness plate on a pseudo-terminal, with the real one's timing and replies."""

import os
import threading
import time
from contextlib import suppress

from underfoot.errors import DeviceError


class EmulatedPlate:
    """A plate at the serial port `name`, in a thread, until `close`.

    `moves` has every move that was begun: start, end, and duration in seconds.
    """

    def __init__(self) -> None:
        try:
            import tty

            self._master, self._slave = os.openpty()
        except (ImportError, OSError) as error:
            raise DeviceError(f"there is no pseudo-terminal for the plate: {error}") from None
        tty.setraw(self._slave)
        os.set_blocking(self._master, False)
        self.name = os.ttyname(self._slave)
        self.moves: list[tuple[float, float, float]] = []
        self._from, self._to, self._began, self._takes = 0.0, 0.0, 0.0, 0.0
        self._is_moving = False
        self._ends = threading.Event()
        self._thread = threading.Thread(target=self._run, name="emulated plate", daemon=True)
        self._thread.start()

    @property
    def is_moving(self) -> bool:
        """Whether it is moving."""
        return self._is_moving

    @property
    def position(self) -> float:
        """Present position of the servo, 0 to 1."""
        if not self._is_moving or self._takes <= 0.0:
            return self._to
        along = min((time.monotonic() - self._began) / self._takes, 1.0)
        return self._from + (self._to - self._from) * along

    def close(self) -> None:
        """Remove the plate."""
        self._ends.set()
        self._thread.join()
        for end in (self._master, self._slave):
            os.close(end)

    def _run(self) -> None:
        text = b""
        while not self._ends.wait(0.005):
            try:
                text += os.read(self._master, 4096)
            except BlockingIOError:
                pass
            except OSError:
                return
            *lines, text = text.split(b"\n")
            for line in lines:
                self._obey(line.decode("ascii", "replace").split())
            if self._is_moving and time.monotonic() - self._began >= self._takes:
                self._is_moving = False
                self._say(f"AT {self._to:.4f}")

    def _obey(self, words: list[str]) -> None:
        match words:
            case ["MOVE", position, seconds]:
                try:
                    to, takes = float(position), float(seconds)
                except ValueError:
                    self._say("ERR MOVE takes a position and seconds")
                    return
                if not 0.0 <= to <= 1.0:
                    self._say(f"ERR position {to:g} is not within 0 to 1")
                    return
                self._from, self._to, self._takes = self.position, to, takes
                self._began, self._is_moving = time.monotonic(), True
                self.moves.append((self._from, to, takes))
                self._say("MOVING")
            case ["HOLD"]:
                self._to, self._is_moving = self.position, False
                self._say(f"AT {self._to:.4f}")
            case []:
                pass
            case _:
                self._say(f"ERR {' '.join(words)}")

    def _say(self, text: str) -> None:
        with suppress(BlockingIOError):  # nobody reads
            os.write(self._master, f"{text}\n".encode())
