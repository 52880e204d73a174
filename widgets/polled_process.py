"""A process beside the window, whose messages a timer takes."""

from PySide6.QtCore import QObject, QTimer, Signal

from underfoot.engine.child_process import ChildProcess

POLL_MS = 100


class PolledProcess(QObject):
    """Runs a process of `module`, one at a time; by default one that does what is begun, and answers."""

    received = Signal(list)
    """Its messages since the last look."""
    ended = Signal(str)
    """It has ended by itself: how, if it failed, else "". Not sent after `stop`."""

    def __init__(self, name: str, parent: QObject, module: str = "underfoot.engine.one_answer") -> None:
        super().__init__(parent)
        self._name, self._module = name, module
        self._process: ChildProcess | None = None
        self._timer = QTimer(self, interval=POLL_MS)
        self._timer.timeout.connect(self._poll)

    @property
    def is_running(self) -> bool:
        """Whether there is a process."""
        return self._process is not None

    def begin(self, request: object) -> None:
        """Start a process with this request, for `one_answer` what it is to do."""
        self._process = ChildProcess(self._name, self._module, request)
        self._timer.start()

    def send(self, message: object) -> None:
        """Send the process a message, if there is one."""
        if self._process is not None:
            self._process.send(message)

    def stop(self, within_s: float = 0.0) -> None:
        """End the process, if there is one; kill it if it still runs after this time."""
        self._timer.stop()
        process, self._process = self._process, None
        if process is not None:
            process.end(within_s)

    def _poll(self) -> None:
        process = self._process
        if process is None:
            return
        is_over = not process.is_alive  # asked first: what it sent before it ended is then received
        if messages := process.receive():
            self.received.emit(messages)
        if is_over and process is self._process:
            self._timer.stop()
            self._process = None
            self.ended.emit(process.reap())
