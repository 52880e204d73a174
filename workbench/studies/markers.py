"""Marks for other recorders: LSL streams, and a trigger over a serial line, to align EEG or motion capture.

LSL is the Lab Streaming Layer (`pip install "underfoot[lsl]"`): a stream of markers in words, and one of forces. A
serial trigger sends one byte for each mark.
"""

from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
from numpy.typing import NDArray

from underfoot.errors import BadValue, DeviceError
from underfoot.floor.layout import Floor

if TYPE_CHECKING:
    from underfoot.experiments.study import Entry, Page

BEGIN, ONSET, END, ANSWER, STOP = "begin", "onset", "end", "answer", "stop"
BYTES = {BEGIN: 1, ONSET: 2, END: 3, ANSWER: 4, STOP: 5}
"""What a serial trigger sends: of a presentation its beginning (a key, or the first force), the onset of vibration and
its end; an answer; a stop."""
BAUD = 115_200


def place_of(page: "Page | Entry") -> str:
    """What a mark says of where in the study it was."""
    return page.stage if page.trial is None else f"{page.stage}.{page.trial.number}"


class Markers(Protocol):
    """Whoever wants to know what happens in a study."""

    def mark(self, what: str, text: str, ago_s: float) -> None:
        """Something happened so long ago; `words` say of which trial."""
        ...

    def forces(self, force_n: NDArray[np.float64]) -> None:
        """Force samples, [sample, tile], as they come."""
        ...

    def close(self) -> None:
        """Let go of everything."""
        ...


class LslMarkers:
    """Two LSL streams: `Underfoot markers` (text, as it happens) and `Underfoot force` (newtons a tile)."""

    def __init__(self, floor: Floor, force_hz: float) -> None:
        """`BadValue` where the package pylsl is not installed."""
        self._lsl = lsl_library()
        markers = self._lsl.StreamInfo("Underfoot markers", "Markers", 1, 0, "string", "underfoot-markers")
        force = self._lsl.StreamInfo(
            "Underfoot force", "Force", len(floor.tiles), force_hz, "float32", "underfoot-force"
        )
        channels = force.desc().append_child("channels")
        for tile in floor.tiles:
            channel = channels.append_child("channel")
            for key, value in (("label", tile.id), ("unit", "newtons"), ("type", "Force")):
                channel.append_child_value(key, value)
        self._markers, self._force = self._lsl.StreamOutlet(markers), self._lsl.StreamOutlet(force)

    def mark(self, what: str, text: str, ago_s: float) -> None:
        """Push a marker, `begin main.12`, with the time at which it happened."""
        self._markers.push_sample([f"{what} {text}".strip()], self._lsl.local_clock() - ago_s)

    def forces(self, force_n: NDArray[np.float64]) -> None:
        """Push samples."""
        if len(force_n):
            self._force.push_chunk(np.ascontiguousarray(force_n, np.float32).tolist())

    def close(self) -> None:
        """End both streams."""
        del self._markers, self._force


class SerialTrigger:
    """A serial port to which each mark is a byte of `BYTES`. An onset comes late: it is known once it was played."""

    def __init__(self, port: str) -> None:
        """`DeviceError` where the port cannot be opened."""
        import serial

        try:
            self._port = serial.Serial(port, BAUD, write_timeout=0.1)
        except (OSError, ValueError) as error:
            raise DeviceError(f"the trigger {port} cannot be opened: {error}") from None

    def mark(self, what: str, text: str, ago_s: float) -> None:
        """Send the byte of a mark; a port that has gone away is no reason to end a study."""
        try:
            self._port.write(bytes([BYTES[what]]))
        except OSError:
            return

    def forces(self, force_n: NDArray[np.float64]) -> None:
        """Nothing: a trigger has one byte."""

    def close(self) -> None:
        """Let the port go."""
        self._port.close()


def lsl_library() -> Any:
    """The package pylsl; `BadValue` where it is not installed."""
    try:
        import pylsl
    except (ImportError, RuntimeError):
        raise BadValue('LSL needs the package pylsl: pip install "underfoot[lsl]"') from None
    return pylsl
