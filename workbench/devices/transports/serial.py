"""A serial port, through pyserial: USB, a real UART, or a pseudo-terminal."""

import errno
import os
import re
import select
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from itertools import accumulate
from pathlib import Path
from typing import TYPE_CHECKING, Self

from underfoot.devices.framing.wire_format import FRAME_BYTES
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
_LOOK_S, _AGAIN_S = 0.0005, 1.0
"""Of several ports: pause in which nothing has come, and time after which one that is gone is opened again."""
_NAMED = 5  # of ports that cannot be opened
_LONGEST_BYTES = 4096  # without the end of a frame or line
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


class _Port:
    """The port at `path`, which is opened exclusively."""

    def __init__(self, path: str, baud: int) -> None:
        import serial  # here: not all commands need a port; and not in `open`, when a session is already running

        self._pyserial = serial
        self._path, self._baud = path, baud
        self.name = f"serial:{path}"
        self._serial: Serial | None = None
        self._rest, self._is_joined, self._again_s = b"", False, 0.0

    def open(self) -> None:
        """Open it and drop the old contents of its buffer; raise `DeviceError` if it is missing."""
        self._rest, self._is_joined = b"", False
        try:
            with opening(f"{self.name} cannot be opened"):
                self._serial = self._pyserial.Serial(self._path, self._baud, timeout=READ_TIMEOUT_S, exclusive=True)
                if sys.platform == "linux":  # pyserial supports it only there
                    with suppress(ValueError):  # chips without that timer refuse
                        self._serial.set_low_latency_mode(True)  # 1 ms instead of 16 on FTDI chips
                self._serial.reset_input_buffer()
        except DeviceError:
            self.close()
            raise

    def read(self, least: int) -> bytes:
        """Return the bytes received, after at most a tenth of a second until there are so many; raise `DeviceError` if
        the port is gone.
        """
        port = self._serial
        if port is None:
            raise DeviceError(f"{self.name} is not open")
        try:
            return port.read(least) + port.read(port.in_waiting)  # requesting more would wait for it
        except (OSError, TypeError) as error:
            raise DeviceError(f"{self.name} went away: {port_reason(error)}") from None

    def read_whole(self, now_s: float) -> bytes:
        """Return the whole frames or lines received, the first one since it was opened left out: it may be a part.

        If it is gone it is closed, with a `DeviceError`; one that is closed is opened again, each `_AGAIN_S`.
        """
        if self._serial is None:
            if now_s < self._again_s:
                return b""
            self._again_s = now_s + _AGAIN_S
            self.open()
        try:
            came = self._rest + self.read(0)
        except DeviceError:
            self.close()
            raise
        end = _end_of_frames(came)
        self._rest = came[end:]
        begin = 0 if self._is_joined or not end else came.index(came[end - 1]) + 1
        self._is_joined |= end > 0
        return came[begin:end]

    @property
    def is_open(self) -> bool:
        """Whether it is open."""
        return self._serial is not None

    def close(self) -> None:
        """Release the port."""
        if self._serial is not None:
            with suppress(OSError):
                self._serial.close()
            self._serial = None


def _end_of_frames(data: bytes) -> int:
    """Return where the last frame or line ends in `data`; 0 if none does.

    >>> [_end_of_frames(data) for data in (b"frame\\0par", b"0,1,1000,1,2,3,4\\n0,2,2000,", b"\\npart of frame")]
    [6, 17, 0]
    >>> [_end_of_frames(b"?" * count) for count in (4096, 4097)]
    [0, 4097]
    """
    if zero := data.rfind(0) + 1:
        return zero
    if len(data) < FRAME_BYTES:  # which may be a part of a frame, and its newline a number
        return 0
    return data.rfind(10) + 1 or len(data) * (len(data) > _LONGEST_BYTES)


class SerialTransport(Transport):
    """The ports of `paths`, with commas between, opened exclusively. Each is a sender of its own.

    One has to be there when it is opened; those that are missing, or go away later, are opened while others are read.

    >>> SerialTransport.of("/dev/ttyUSB0,/dev/ttyUSB1@115200").name
    'serial:/dev/ttyUSB0,/dev/ttyUSB1'
    """

    scheme, address_form = "serial", "PORT[,PORT...][@BAUD]"
    help = "a serial port, or several"
    label = "Serial port"
    title = "Tiles on a serial port"
    dialog_help = (
        "A port, or several with commas between; PORT@BAUD for another rate than 1,000,000 baud. "
        "One to try is named by: underfoot emulate --pty"
    )
    sender = PtySender
    doubt = "is the baud rate right?"
    boot_s = 2.5  # an Arduino is reset by its opening, and its bootloader waits for a sketch: 1.6 s of an Uno

    def __init__(self, paths: str, baud: int = _BAUD) -> None:
        self._paths = tuple(path.strip() for path in paths.split(","))
        require(all(self._paths), "port", paths, "a port's name, as /dev/ttyACM0 or COM3, or several")
        require(len({*self._paths}) == len(self._paths), "port", paths, "each port once")
        require(50 <= baud <= 20_000_000, "baud", baud, "50 to 20000000")
        self.name = f"serial:{paths}"
        self._ports = tuple(_Port(path, baud) for path in self._paths)
        self._missing: list[str] = []

    @classmethod
    def of(cls, address: str) -> Self:
        """Parse `PORT` or `PORT@BAUD`, or several ports."""
        paths, at, baud = address.rpartition("@")
        if not at:
            return cls(address)
        if not baud.isdecimal():
            raise BadValue(f"port is {address!r}; allowed: PORT or PORT@BAUD, as /dev/ttyUSB0@115200")
        return cls(paths, int(baud))

    @classmethod
    def suggestions(cls) -> list[str]:
        """Return the serial ports of this machine, by names that a board keeps when it is plugged in again, if it has
        one: its number may then be another.
        """
        from serial.tools.list_ports import comports

        lasting = {os.path.realpath(link): str(link) for link in _files_in(LASTING_NAMES)}
        return sorted(lasting.get(os.path.realpath(port.device), port.device) for port in comports())

    @property
    def devices(self) -> frozenset[str]:
        """The ports behind links, at any rate."""
        return frozenset(map(os.path.realpath, self._paths))

    def open(self) -> None:
        """Open it and drop the old contents of its buffer; raise `DeviceError` if none of its ports opens."""
        failures = list[DeviceError]()
        for port in self._ports:
            try:
                port.open()
            except DeviceError as error:
                failures.append(error)
        more = [f"and {len(failures) - _NAMED} more"] if len(failures) > _NAMED else []
        why = "; ".join([*map(str, failures[:_NAMED]), *more])
        if len(failures) == len(self._ports):
            raise DeviceError(why)
        self._missing = [f"{why}; waiting for it"] if failures else []

    def read(self) -> bytes:
        """Return the bytes received, after at most a tenth of a second; raise `DeviceError` if the port is gone."""
        if len(self._ports) == 1:
            return self._ports[0].read(1)
        self.lost, self._missing = self._missing, []
        until_s = time.perf_counter() + READ_TIMEOUT_S
        while not any(pieces := self._pieces()) and time.perf_counter() < until_s:
            time.sleep(_LOOK_S)
        self.senders = [(end, number) for number, end in enumerate(accumulate(map(len, pieces)))]
        return b"".join(pieces)

    def _pieces(self) -> list[bytes]:
        """Return what came over each of several ports; raise `DeviceError` if all are gone."""
        pieces, failure = list[bytes](), None
        for port in self._ports:
            was_open = port.is_open
            try:
                pieces.append(port.read_whole(time.perf_counter()))
            except DeviceError as error:
                pieces.append(b"")
                failure = error
                if was_open:
                    self.lost = [*self.lost, f"{error}; waiting for it"]
        if failure is not None and not any(port.is_open for port in self._ports):
            raise failure
        return pieces

    def sender_name(self, number: int) -> str:
        """Return the name of one of the ports."""
        return self._ports[number].name

    def close(self) -> None:
        """Release the ports."""
        for port in self._ports:
            port.close()


def _files_in(folder: Path) -> list[Path]:
    try:
        return sorted(folder.iterdir())
    except OSError:
        return []


@contextmanager
def opening(refusal: str) -> Iterator[None]:
    """Raise `DeviceError`, the refusal with the reason, where pyserial cannot open or read a port in this block.

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
