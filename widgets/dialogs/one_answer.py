"""A process beside the window that is given one request, answers once, and can be stopped before."""

from PySide6.QtCore import QObject, QTimer, Signal

from underfoot.engine.child_process import ChildProcess

_POLL_MS = 50


class OneAnswer(QObject):
    """Starts a process of `module` for each request, one at a time, and passes its answer on.

    `died` is what is said instead if the process ends without one.
    """

    ended = Signal(object)
    """The answer, or a line that says why there is none; the process is gone by then. Not sent after `stop`."""

    def __init__(self, name: str, module: str, died: str, parent: QObject) -> None:
        super().__init__(parent)
        self._name, self._module, self._died = name, module, died
        self._process: ChildProcess | None = None
        self._timer = QTimer(self, interval=_POLL_MS)
        self._timer.timeout.connect(self._poll)

    @property
    def is_awaited(self) -> bool:
        """Whether a process is at work."""
        return self._process is not None

    def begin(self, request: object) -> None:
        """Start a process with this request."""
        self._process = ChildProcess(self._name, self._module, request)
        self._timer.start()

    def stop(self) -> None:
        """Kill the process, if there is one."""
        self._timer.stop()
        process, self._process = self._process, None
        if process is not None:
            process.kill()
            process.end(0.0)

    def _poll(self) -> None:
        process = self._process
        if process is None:
            return
        alive = process.is_alive  # asked first: what it sent before it ended is then received
        answers = process.receive()
        if answers or not alive:
            self.stop()
            self.ended.emit(answers[0] if answers else self._died)
