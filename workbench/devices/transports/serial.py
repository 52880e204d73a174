"""A serial port, through pyserial: USB, a real UART, or a pseudo-terminal."""

from contextlib import suppress

import serial

from underfoot.errors import BadValue, DeviceError, require

BAUD = 1_000_000
"""Exact on the usual microcontrollers, and four times what a tile at 1 kHz needs; boards with USB of their own do not
care."""
_WAIT_S = 0.1


class SerialPort:
    """The port at `path`, opened by nobody else.

    >>> SerialPort.named("/dev/ttyUSB0@115200").baud
    115200
    """

    def __init__(self, path: str, baud: int = BAUD) -> None:
        require(bool(path), "port", path, "a port's name, as /dev/ttyACM0 or COM3")
        require(50 <= baud <= 20_000_000, "baud", baud, "50 to 20000000")
        self.path, self.baud = path, baud
        self.name = f"serial:{path}"
        self._serial: serial.Serial | None = None

    @staticmethod
    def named(text: str) -> "SerialPort":
        """The port of `PORT` or `PORT@BAUD`."""
        path, at, baud = text.rpartition("@")
        if not at:
            return SerialPort(text)
        if not baud.isdecimal():
            raise BadValue(f"port is {text!r}; allowed: PORT or PORT@BAUD, as /dev/ttyUSB0@115200")
        return SerialPort(path, int(baud))

    def open(self) -> None:
        """Open it and drop what lies in its buffer, which is of before; `DeviceError` where it is not there."""
        try:
            self._serial = serial.Serial(self.path, self.baud, timeout=_WAIT_S, exclusive=True)
            with suppress(OSError, ValueError, AttributeError, NotImplementedError):
                self._serial.set_low_latency_mode(True)  # 1 ms instead of 16 on FTDI chips; others refuse
            self._serial.reset_input_buffer()
        except (OSError, ValueError) as error:
            self.close()
            raise DeviceError(f"{self.name} cannot be opened: {_reason(error)}") from None

    def read(self) -> bytes:
        """What came, at the latest after a tenth of a second; `DeviceError` where the port has gone away."""
        port = self._serial
        if port is None:
            raise DeviceError(f"{self.name} is not open")
        try:
            return port.read(max(1, port.in_waiting))  # to ask for more would wait for it
        except (OSError, TypeError) as error:
            raise DeviceError(f"{self.name} went away: {_reason(error)}") from None

    def close(self) -> None:
        """Let go of it."""
        if self._serial is not None:
            with suppress(OSError):
                self._serial.close()
            self._serial = None


def _reason(error: Exception) -> str:
    text = " ".join(str(error).split())
    known = {
        2: "there is no such port",
        5: "it was unplugged",
        13: "it may not be opened; is the user in the group dialout?",
        16: "another program has it",
    }
    if "returned no data" in text:  # how pyserial says that it is ready for ever and never gives anything
        return known[5]
    return known.get(getattr(error, "errno", None) or 0, text)
