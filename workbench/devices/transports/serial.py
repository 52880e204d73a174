"""A serial port, through pyserial: USB, a real UART, or a pseudo-terminal."""

import errno
import os
import re
import select
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Self

from underfoot.devices.transport import READ_TIMEOUT_S, Sender, Transport
from underfoot.errors import BadValue, DeviceError, in_one_line, require

if TYPE_CHECKING:
    from serial import Serial

_BAUD = 1_000_000
"""Default baud rate: exact on common microcontrollers, and four times what a tile at 1 kHz needs; ignored by native
USB.
"""
LASTING_NAMES = Path("/dev/serial/by-id")
"""Folder of links to the ports by the boards behind them, where the system makes such (udev)."""
_PATIENCE_S = 0.05
_TAKEN = "another program has it, or Underfoot itself, as for a plate or a trigger"
_UNPLUGGED = re.compile("returned no data|(ClearCommError|GetOverlappedResult|ReadFile|WriteFile) failed")
"""What pyserial says of a port that is always ready but returns nothing, and on Windows of one that is gone."""


class PtySender(Sender):
    """A pseudo-terminal with a fixed name, as a real port keeps when it is plugged in again."""

    option, option_value = "pty", ""
    help = "Use a pseudo-terminal, and print its name."
    powers_tiles = True

    def __init__(self) -> None:
        try:
            import tty
        except ImportError:
            raise DeviceError("there are no pseudo-terminals on this system; use another transport") from None
        import tempfile

        self._set_raw = tty.setraw
        self._folder = tempfile.TemporaryDirectory(prefix="underfoot-")
        self.name = str(Path(self._folder.name) / "tile")
        self._ends: tuple[int, int] | None = None
        self._flows = True
        self.plug()

    @classmethod
    def of(cls, value: str) -> Self:
        """Create a pseudo-terminal; the value is empty."""
        return cls()

    def send(self, data: bytes, ends: Sequence[int]) -> bool:
        """Send, waiting briefly for a slow reader; without a reader the data is lost, as on a wire."""
        if self._ends is None:
            return False
        rest = memoryview(data)
        while rest:
            try:
                rest = rest[os.write(self._ends[0], rest) :]
            except BlockingIOError:
                if not (self._flows and select.select([], [self._ends[0]], [], _PATIENCE_S)[1]):
                    self._flows = False
                    return False
            except OSError:
                return False
        self._flows = True
        return True

    def unplug(self) -> None:
        """Remove the port and its name."""
        if self._ends is not None:
            Path(self.name).unlink()
            for end in self._ends:
                os.close(end)
            self._ends = None

    def plug(self) -> None:
        """Open a new pseudo-terminal under the same name."""
        self.unplug()
        try:
            self._ends = os.openpty()
        except OSError as error:
            raise DeviceError(f"no pseudo-terminal: {error}") from None
        self._set_raw(self._ends[1])
        os.set_blocking(self._ends[0], False)
        os.symlink(os.ttyname(self._ends[1]), self.name)

    def close(self) -> None:
        """Remove the port for good."""
        self.unplug()
        self._folder.cleanup()


class SerialTransport(Transport):
    """The port at `path`, opened exclusively.

    >>> SerialTransport.of("/dev/ttyUSB0@115200").baud
    115200
    """

    scheme, address_form = "serial", "PORT[@BAUD]"
    help = "a serial port"
    label = "Serial port"
    title = "Tiles on a serial port"
    dialog_help = (
        "A port, or PORT@BAUD for another rate than 1,000,000 baud. `underfoot emulate --pty` names one to try."
    )
    sender = PtySender
    doubt = "is the baud rate right?"

    def __init__(self, path: str, baud: int = _BAUD) -> None:
        require(bool(path), "port", path, "a port's name, as /dev/ttyACM0 or COM3")
        require(50 <= baud <= 20_000_000, "baud", baud, "50 to 20000000")
        import serial  # here: not all commands need a port; and not in `open`, when a session is already running

        self._pyserial = serial
        self.path, self.baud = path, baud
        self.name = f"serial:{path}"
        self._serial: Serial | None = None

    @classmethod
    def of(cls, address: str) -> Self:
        """Parse `PORT` or `PORT@BAUD`."""
        path, at, baud = address.rpartition("@")
        if not at:
            return cls(address)
        if not baud.isdecimal():
            raise BadValue(f"port is {address!r}; allowed: PORT or PORT@BAUD, as /dev/ttyUSB0@115200")
        return cls(path, int(baud))

    @classmethod
    def suggestions(cls) -> list[str]:
        """Return the serial ports of this machine, by names that a board keeps when it is plugged in again, if it has
        one: its number may then be another.
        """
        from serial.tools.list_ports import comports

        lasting = {os.path.realpath(link): str(link) for link in _files_in(LASTING_NAMES)}
        return sorted(lasting.get(os.path.realpath(port.device), port.device) for port in comports())

    @property
    def device(self) -> str:
        """The port behind links, at any rate."""
        return os.path.realpath(self.path)

    def open(self) -> None:
        """Open it and drop the old contents of its buffer; raise `DeviceError` if it is missing."""
        try:
            with opening(f"{self.name} cannot be opened"):
                self._serial = self._pyserial.Serial(self.path, self.baud, timeout=READ_TIMEOUT_S, exclusive=True)
                if sys.platform == "linux":  # pyserial supports it only there
                    with suppress(ValueError):  # chips without that timer refuse
                        self._serial.set_low_latency_mode(True)  # 1 ms instead of 16 on FTDI chips
                self._serial.reset_input_buffer()
        except DeviceError:
            self.close()
            raise

    def read(self) -> bytes:
        """Return the bytes received, after at most a tenth of a second; raise `DeviceError` if the port is gone."""
        port = self._serial
        if port is None:
            raise DeviceError(f"{self.name} is not open")
        try:
            first = port.read(max(1, port.in_waiting))  # requesting more would wait for it
            return first + port.read(port.in_waiting)  # otherwise the rest would wait until the next read
        except (OSError, TypeError) as error:
            raise DeviceError(f"{self.name} went away: {port_reason(error)}") from None

    def close(self) -> None:
        """Release the port."""
        if self._serial is not None:
            with suppress(OSError):
                self._serial.close()
            self._serial = None


def _files_in(folder: Path) -> list[Path]:
    try:
        return sorted(folder.iterdir())
    except OSError:
        return []


@contextmanager
def opening(refusal: str) -> Iterator[None]:
    """Raise `DeviceError`, the refusal with the reason, where pyserial cannot open a port in this block.

    If the port goes away meanwhile, pyserial passes on an error of `termios`, a module that not all systems have.
    """
    try:
        yield
    except (OSError, ValueError) as error:
        raise DeviceError(f"{refusal}: {port_reason(error)}") from None
    except Exception as error:
        if type(error).__module__ != "termios":
            raise
        raise DeviceError(f"{refusal}: {port_reason(OSError(*error.args))}") from None


def port_reason(error: Exception) -> str:
    """Return in words why a serial port cannot be opened, read or written to.

    >>> port_reason(OSError("could not open port 'COM9': FileNotFoundError(2, 'No such file', None, 2)"))
    'there is no such port'
    >>> port_reason(OSError("ClearCommError failed (PermissionError(13, 'No such command', None, 22))"))
    'it was unplugged'
    """
    text = in_one_line(error)
    known = {
        errno.ENOENT: "there is no such port",
        errno.EIO: "it was unplugged",
        errno.EACCES: "it may not be opened; is the user in the group dialout?" if sys.platform == "linux" else _TAKEN,
        errno.EBUSY: _TAKEN,
        errno.EAGAIN: _TAKEN,  # it is locked
        errno.EISDIR: "it is a folder",
        errno.ENOTTY: "it is no serial port",
    }
    if _UNPLUGGED.search(text):
        return known[errno.EIO]
    # Where pyserial passes a system's error on, in words only.
    told = re.search(r"\[Errno (\d+)\]|configure port: \((\d+),|open port .*Error\((\d+),", text)
    return known.get(getattr(error, "errno", None) or (int(told[told.lastindex or 0]) if told else 0), text)
