"""The variable stiffness plate (thesis 6.3): a plate on foam whose stiffness a servo sets, over a serial line.

The protocol is lines of text. `MOVE position seconds` moves the servo to a position, 0 to 1, in this time whatever the
distance, so that the sound does not reveal the distance; the reply is `MOVING`, and `AT position` on arrival. `HOLD`
stops it where it is; the reply is `AT position`. `ERR words` reports an error.
"""

import re
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

import msgspec
import numpy as np

from underfoot.devices.emulation.plate import SimulatedServo
from underfoot.devices.transports.serial import LASTING_NAMES, opening
from underfoot.documents import identity_of, read_document, write_document
from underfoot.errors import BadValue, DeviceError, require
from underfoot.files import read_file, write_file

if TYPE_CHECKING:
    import serial

MOVE_S = 4.0
"""Duration of every move in seconds (thesis 6.3.6)."""
LATE_S = 2.0
"""Seconds after which a servo that should have arrived is considered lost."""
_BAUD = 115_200
SIMULATED = "simulated"
"""The port of a plate that is simulated."""
FORMAT, VERSION = "underfoot-plate", 1
_PORT_AND_FILE = re.compile(
    # A name that a board keeps may contain its network address, and ends in an interface or a port.
    rf"(?P<port>{re.escape(str(LASTING_NAMES))}/.+?-(if[0-9a-f]{{2}}|port\d+)|[^:]*)(:(?P<file>.*))?",
    re.DOTALL,
)


class PlateCalibration(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Stiffness in N/mm at positions of the servo, both rising; interpolated linearly in its logarithm.

    `error` is the mean relative error of the fitted lines; None if it is not known.
    """

    positions: tuple[float, ...]
    stiffness_n_mm: tuple[float, ...]
    error: float | None = None
    made: str = ""

    def __post_init__(self) -> None:
        positions, stiffness = np.array(self.positions), np.array(self.stiffness_n_mm)
        same = len(positions) == len(stiffness) >= 2
        require(same, "stiffness_n_mm", len(stiffness), f"two or more, as many as positions, {len(positions)}")
        rising = bool((np.diff(positions) > 0.0).all() and positions[0] >= 0.0 and positions[-1] <= 1.0)
        require(rising, "positions", list(self.positions), "rising, from 0 to 1")
        good = bool((np.diff(stiffness) > 0.0).all() and stiffness[0] > 0.0 and np.isfinite(stiffness).all())
        require(good, "stiffness_n_mm", list(self.stiffness_n_mm), "above 0 and rising with the position")

    def position(self, stiffness_n_mm: float) -> float:
        """Return the servo position of a stiffness; raise `BadValue` outside the calibrated range.

        >>> round(PlateCalibration(positions=(0.0, 1.0), stiffness_n_mm=(40.0, 160.0)).position(80.0), 6)
        0.5
        """
        low, high = self.stiffness_n_mm[0], self.stiffness_n_mm[-1]
        require(low <= stiffness_n_mm <= high, "stiffness", stiffness_n_mm, f"{low:g} to {high:g} N/mm")
        return float(np.interp(np.log(stiffness_n_mm), np.log(self.stiffness_n_mm), self.positions))

    def stiffness(self, position: float) -> float:
        """Return the stiffness at a position, N/mm; beyond the calibrated ones, that of the nearest.

        >>> round(SIMULATED_CALIBRATION.stiffness(0.5), 6)
        80.0
        """
        return float(np.exp(np.interp(position, self.positions, np.log(self.stiffness_n_mm))))

    @property
    def identity(self) -> str:
        """Its day and a digest (`identity_of`), as of a tile's calibration."""
        return identity_of(self, self.made)

    @staticmethod
    def load(path: str | Path) -> "PlateCalibration":
        """Load a calibration; raise `BadFile` if the file is not one."""
        return read_document(read_file(path), str(path), FORMAT, VERSION, PlateCalibration)

    def save(self, path: str | Path) -> None:
        """Write the calibration to a file, atomically."""
        write_file(path, write_document(FORMAT, VERSION, self) + b"\n")


SIMULATED_CALIBRATION = PlateCalibration(positions=(0.0, 1.0), stiffness_n_mm=(40.0, 160.0))
"""A simulated plate's own: the thesis's range (6.3.6)."""


class PlateServo:
    """The servo of a plate at a serial port, or of a simulated one.

    `request_position` sets the position; `poll` drives it there without waiting.

    It never moves under a load: a requested move waits until nobody is on the plate, and a move in progress is held
    when somebody steps on, and then repeated.
    """

    def __init__(self, port: str, move_s: float = MOVE_S, clock: Callable[[], float] = time.perf_counter) -> None:
        self._move_s, self._clock = move_s, clock
        self._line = _opened(port, clock)
        self._port, self._text = port, b""
        self._position = 0.0
        self._is_requested = self._is_moving = False
        self._due = 0.0

    def request_position(self, position: float) -> None:
        """Request a position, 0 to 1. Takes the same time if the servo is already there."""
        self._position, self._is_requested = position, True

    def poll(self, is_loaded: bool) -> bool:
        """Continue the move; return whether the plate has arrived. Raises `DeviceError` if it is lost."""
        for line in self._lines():
            word, _, rest = line.partition(" ")
            if word == "ERR":
                raise DeviceError(f"the plate at {self._port} says: {rest}")
            if word == "AT" and self._is_moving and abs(_number(rest) - self._position) < 1e-3:
                self._is_moving = False
        if is_loaded and self._is_moving:
            self._write("HOLD")
            self._is_moving, self._is_requested = False, True
        if self._is_requested and not is_loaded:
            self._write(f"MOVE {self._position:.4f} {self._move_s:.3f}")
            self._is_requested, self._is_moving = False, True
            self._due = self._clock() + self._move_s + LATE_S
        if self._is_moving and self._clock() > self._due:
            raise DeviceError(f"the plate at {self._port} does not arrive; is it plugged in, and free to move?")
        return not (self._is_requested or self._is_moving)

    def close(self) -> None:
        """Stop it, and close the port."""
        with suppress(DeviceError):
            self._write("HOLD")
        self._line.close()

    def _lines(self) -> Sequence[str]:
        try:
            self._text += self._line.read(self._line.in_waiting or 0)
        except (OSError, TypeError) as error:
            raise DeviceError(f"the plate at {self._port} went away: {error}") from None
        *lines, self._text = self._text.split(b"\n")
        return [line.decode("ascii", "replace").strip() for line in lines]

    def _write(self, text: str) -> None:
        try:
            self._line.write(f"{text}\n".encode())
        except OSError as error:
            raise DeviceError(f"the plate at {self._port} went away: {error}") from None


class Plate(PlateServo):
    """A plate with its calibration: `request_stiffness` sets the stiffness."""

    def __init__(
        self,
        port: str,
        calibration: PlateCalibration,
        move_s: float = MOVE_S,
        clock: Callable[[], float] = time.perf_counter,
    ) -> None:
        super().__init__(port, move_s, clock)
        self.calibration = calibration
        self.wanted_n_mm = 0.0
        """The stiffness that was requested last, N/mm; 0 before."""

    def request_stiffness(self, stiffness_n_mm: float) -> None:
        """Request a stiffness. Takes the same time if the plate already has it. Raise `BadValue` outside the range."""
        self.request_position(self.calibration.position(stiffness_n_mm))
        self.wanted_n_mm = stiffness_n_mm


def plate_of(text: str) -> Plate:
    """Open the plate of `PORT:FILE`, a serial port and a calibration file, or of `simulated`.

    Raises `BadValue`, `BadFile` or `DeviceError`.
    """
    return Plate(split_plate(text)[0], calibration_of(text))


def calibration_of(text: str) -> PlateCalibration:
    """Load the calibration of a plate; a simulated one needs no file.

    >>> calibration_of("simulated").stiffness_n_mm
    (40.0, 160.0)
    """
    path = split_plate(text)[1]
    return PlateCalibration.load(path) if path else SIMULATED_CALIBRATION


def split_plate(text: str) -> tuple[str, str]:
    """Split `PORT:FILE` into port and calibration file; a drive letter is part of the file, a simulated one needs none.

    >>> split_plate("/dev/ttyACM0:plate.json"), split_plate("COM3:C:/plate.json"), split_plate("simulated")
    (('/dev/ttyACM0', 'plate.json'), ('COM3', 'C:/plate.json'), ('simulated', ''))
    >>> split_plate("/dev/serial/by-id/usb-Espressif_34:85:18:AA-if00:plate.json")[1]
    'plate.json'
    """
    match = _PORT_AND_FILE.fullmatch(text)
    port, path = match.group("port", "file") if match is not None else ("", "")
    if not port or not (path or port == SIMULATED):
        raise BadValue(f"plate is {text!r}; allowed: PORT:FILE, as /dev/ttyACM0:plate.json, or {SIMULATED}")
    return port, path or ""


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return -1.0


def _opened(port: str, clock: Callable[[], float]) -> "serial.Serial | SimulatedServo":
    import serial

    if port == SIMULATED:
        return SimulatedServo(clock)
    with opening(f"the plate at {port} cannot be opened"):
        return serial.Serial(port, _BAUD, timeout=0.0, write_timeout=1.0, exclusive=True)
