"""Supervision of the recorders: one writes the present recording, and earlier ones may still be closing their files."""

from pathlib import Path

from underfoot.engine.recorder import Recorder, RecordMessage
from underfoot.engine.reports import RecordingFile
from underfoot.engine.rings import Ring

RECORDER_END_S = 120.0
"""Time limit for a recorder to close its file; one that died on a busy machine restarts within it."""


class RecorderSupervisor:
    """At most one recording that goes on, and those that were ended until their files are whole."""

    def __init__(self, rings: dict[str, Ring]) -> None:
        """Create it without a recording; the keys of `rings` are the names of the tables."""
        self._rings = rings
        self._recorder: Recorder | None = None
        self._ending: list[Recorder] = []
        self._files: list[RecordingFile] = []

    @property
    def pids(self) -> dict[str, int]:
        """The process id of the present recording's process by name; empty without a recording."""
        return {"recorder": self._recorder.pid} if self._recorder is not None else {}

    @property
    def path(self) -> Path | None:
        """The file that is being recorded to."""
        return self._recorder.path if self._recorder is not None else None

    @property
    def awaits_file(self) -> bool:
        """Whether there is a recording whose file does not exist yet."""
        return self._recorder is not None and not self._recorder.has_begun

    def begin(self, path: Path, about: dict[str, str]) -> None:
        """Record to a new file from now on; the recording before was ended."""
        self._recorder = Recorder(path, about, self._rings)

    def send(self, message: RecordMessage) -> None:
        """Record this, if there is a recording."""
        if self._recorder is not None:
            self._recorder.send(message)

    def end(self, frame: int) -> None:
        """End the recording, if there is one, before a session frame, without waiting for its file."""
        if self._recorder is not None:
            self._recorder.end(frame)
            self._ending.append(self._recorder)
            self._recorder = None

    def wait(self) -> list[str]:
        """Wait until the files of ended recordings are whole; return what kept them from that, one line each."""
        said: list[str] = []
        while self._ending:
            recorder = self._ending.pop()
            recorder.has_ended(RECORDER_END_S)
            said += self._close(recorder)
        return said

    def receive(self) -> list[str]:
        """Return the recorders' notices, one line each."""
        awaited = [one for one in (self._recorder, *self._ending) if one is not None and not one.has_begun]
        said = self._recorder.receive() if self._recorder is not None else []
        ended = [one for one in self._ending if one.has_ended()]
        self._files += [RecordingFile(one.path, "begun") for one in awaited if one.has_begun]
        for recorder in ended:
            said += self._close(recorder)
            self._ending.remove(recorder)
        return said

    def take_files(self) -> list[RecordingFile]:
        """Return what has become of the files of recordings since the last call."""
        files, self._files = self._files, []
        return files

    @property
    def has_died(self) -> bool:
        """Whether the present recording's process has ended."""
        return self._recorder is not None and self._recorder.has_died

    def reap(self) -> str:
        """Release a process that died, and return the reason; "" if it has reported that itself."""
        assert self._recorder is not None
        return self._recorder.reap()

    def restart(self) -> None:
        """Restart the process that died; it continues its file."""
        assert self._recorder is not None
        self._recorder.restart()

    def give_up(self) -> None:
        """Leave the file as the process that died has left it; there is no recording any more."""
        assert self._recorder is not None
        self._files.append(RecordingFile(self._recorder.path, "cut"))
        self._recorder = None

    def _close(self, recorder: Recorder) -> list[str]:
        """Note what has become of the file of a recorder that has ended; return its notices."""
        self._files.append(RecordingFile(recorder.path, "cut" if recorder.last_notices else "whole"))
        return recorder.last_notices
