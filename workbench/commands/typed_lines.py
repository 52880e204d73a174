"""Lines that are typed, without waiting for them."""

import queue
import sys
import threading
from types import TracebackType


class TypedLines:
    """Standard input, read by a thread: `next` gives a line once there is one. `ended` once there will be none."""

    def __init__(self) -> None:
        self._lines: queue.SimpleQueue[str | None] = queue.SimpleQueue()
        self.ended = False

    def __enter__(self) -> "TypedLines":
        threading.Thread(target=self._read, name="typed lines", daemon=True).start()
        return self

    def __exit__(self, kind: type | None, error: BaseException | None, trace: TracebackType | None) -> None:
        """Leave the thread, which may wait for a line forever, to end with the process."""

    def next(self) -> str | None:
        """Return the next line without its line end; None if none has been typed yet."""
        try:
            line = self._lines.get_nowait()
        except queue.Empty:
            return None
        self.ended = self.ended or line is None
        return line

    def _read(self) -> None:
        for line in sys.stdin:
            self._lines.put(line.rstrip("\n"))
        self._lines.put(None)
