"""Markers for other recorders, for synchronisation with EEG or motion capture: LSL streams, and a serial trigger.

LSL is the Lab Streaming Layer (`pip install "underfoot[lsl]"`): one stream of text markers, and one of forces. A serial
trigger sends one byte for each marker.
"""

from contextlib import suppress
from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import NDArray

from underfoot.devices.transports.serial import opening, port_reason
from underfoot.errors import DeviceError
from underfoot.floor.layout import Floor
from underfoot.network.lsl_library import lsl_library, outlet
from underfoot.network.mark_inlets import BAUD
from underfoot.network.session_clock import SessionClock

if TYPE_CHECKING:
    from serial import Serial

    from underfoot.experiments.study import Entry, Page

BEGIN, ONSET, END, ANSWER, STOP = "begin", "onset", "end", "answer", "stop"
BYTES = {BEGIN: 1, ONSET: 2, END: 3, ANSWER: 4, STOP: 5}
"""Bytes of a serial trigger: the beginning of a presentation (a key, or the first force), the onset of vibration, and
the end of a presentation; an answer; a stop.
"""


def place_of(page: "Page | Entry") -> str:
    """Return the place in the study for a marker's text."""
    return page.stage if page.trial is None else f"{page.stage}.{page.trial.number}"


class Markers(Protocol):
    """A receiver of a study's events and forces; `problem` is why markers do not reach it now, or ""."""

    problem: str

    def mark(self, what: str, text: str, time_s: float | None = None, ago_s: float = 0.0) -> None:
        """Receive a marker for an event of now, or of the session's `time_s`, `ago_s` ago; `text` names the trial."""
        ...

    def forces(self, time_s: float, ago_s: float, force_n: NDArray[np.float64]) -> None:
        """Receive new force samples in N, [sample, tile]; the last one is of the session's `time_s`, `ago_s` ago."""
        ...

    def close(self) -> None:
        """Release all resources."""
        ...


class LslMarkers:
    """Two LSL streams: `Underfoot markers` (text, as it happens) and `Underfoot force` (newtons a tile)."""

    problem = ""

    def __init__(self, floor: Floor, force_hz: float) -> None:
        """Open the streams; raise `BadValue` if the package pylsl is not installed."""
        self._lsl = lsl_library()
        self._clock = SessionClock(self._lsl.local_clock)
        self._markers = outlet("markers", "Markers", 0.0, "string", [("marker", "")])
        self._force = outlet("force", "Force", force_hz, "float32", [(tile.id, "newtons") for tile in floor.tiles])

    def mark(self, what: str, text: str, time_s: float | None = None, ago_s: float = 0.0) -> None:
        """Push a marker, such as `begin main.12`, with the time of its event, which is that of the forces."""
        at_s = self._lsl.local_clock() if time_s is None else self._clock.at(time_s, ago_s)
        self._markers.push_sample([f"{what} {text}".strip()], at_s)

    def forces(self, time_s: float, ago_s: float, force_n: NDArray[np.float64]) -> None:
        """Push force samples in N, [sample, tile], with the time of the last."""
        if len(force_n):
            rows = np.ascontiguousarray(force_n, np.float32).tolist()
            self._force.push_chunk(rows, self._clock.at(time_s, ago_s))

    def close(self) -> None:
        """End both streams."""
        del self._markers, self._force


class SerialTrigger:
    """A serial port to which each marker is sent as a byte of `BYTES`.

    An onset is sent late, because it is known only after it was played.
    """

    def __init__(self, port: str) -> None:
        """Open the port; raise `DeviceError` if that fails."""
        import serial

        self._serial, self._name, self.problem = serial, port, ""
        self._port = self._opened()

    def mark(self, what: str, text: str, time_s: float | None = None, ago_s: float = 0.0) -> None:
        """Send the byte of a marker; a port that was unplugged is opened again, and does not end the study."""
        byte = bytes([BYTES[what]])
        try:
            self._port.write(byte)
            self.problem = ""
        except OSError as error:
            self.problem = self.problem or f"no markers reach the trigger {self._name}: {port_reason(error)}"
            if not isinstance(error, self._serial.SerialTimeoutException):
                self._send_again(byte)

    def _send_again(self, byte: bytes) -> None:
        """Open the port again and send a byte, if it is there: it may have been unplugged only for a while."""
        with suppress(OSError, DeviceError):
            self._port.close()  # while it is open, the system gives another name to what is plugged in
            self._port = self._opened()
            self._port.write(byte)
            self.problem = ""

    def _opened(self) -> "Serial":
        with opening(f"the trigger {self._name} cannot be opened"):
            return self._serial.Serial(self._name, BAUD, write_timeout=0.1, exclusive=True)

    def forces(self, time_s: float, ago_s: float, force_n: NDArray[np.float64]) -> None:
        """Do nothing, because a trigger has only bytes for markers."""

    def close(self) -> None:
        """Close the port."""
        self._port.close()
