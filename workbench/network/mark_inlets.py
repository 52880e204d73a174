"""Inlets of marks besides OSC: marker streams of the Lab Streaming Layer, and a serial line.

An inlet has its own thread, and passes on each mark's text with its time by `time.perf_counter`. `problem` is its
present problem, or "".
"""

import math
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from typing import TYPE_CHECKING, Any

from underfoot.devices.transports.serial import opening
from underfoot.errors import DeviceError
from underfoot.network.lsl_library import lsl_library

if TYPE_CHECKING:
    from serial import Serial

Take = Callable[[str, float], None]
"""Receives the text of a mark, and its time by `time.perf_counter`."""

KIND = "Markers"
"""Type of LSL streams whose samples are marks."""
OURS = "underfoot"
"""Beginning of the source names of Underfoot's own streams."""
BAUD = 115_200
"""Of serial lines of marks, and of triggers."""
MOST_STREAMS = 16
LINE_ENDS_S = 0.05
"""Time after which text on a serial line without an end of line is a mark."""
_LOOK_S, _SEARCH_S, _AGAIN_S, _RELEASE_S = 0.01, 0.5, 1.0, 1.0
_CLOCK_S = 5.0
"""Longest wait for a sender's clock; then its marks have the time of their arrival."""
_LATEST_S, _EARLIEST_S = 600.0, 10.0
"""How late a mark may come, and how early: LSL keeps the last six minutes while a network is away. One whose stamp is
further off, as of a sender that stamps by another clock, has the time of its arrival."""
_LONGEST_LINE = 1000
_UNANSWERED = "does not answer, as behind a firewall; its marks, if any come, count as they arrive"


class LslMarks:
    """Every LSL stream on this network of type "Markers"; numbers, as some send, become digits."""

    def __init__(self, take: Take) -> None:
        """Raise `BadValue` if the package pylsl is not installed."""
        self._lsl, self._take = lsl_library(), take
        self._off: dict[tuple[str, ...], str] = {}
        self.streams: dict[tuple[str, ...], tuple[Any, float]] = {}
        """The inlets, and since when they wait for an answer, by what identifies a stream even after its sender is
        restarted.
        """
        self._end = threading.Event()
        self._thread = threading.Thread(target=self._run, name="marks by LSL", daemon=True)
        self._thread.start()

    @property
    def problem(self) -> str:
        """The streams that do not answer, or whose stamps cannot be, as far as they are there, in one line; "" without
        any.
        """
        before_s, there = time.perf_counter() - _CLOCK_S, self.streams.copy()
        silent = {one: f"{_name(one)} {_UNANSWERED}" for one, (_, since_s) in there.items() if since_s < before_s}
        return "; ".join(line for one, line in {**self._off, **silent}.items() if one in there)

    def close(self) -> None:
        """Stop listening."""
        self._end.set()
        self._thread.join()

    def _run(self) -> None:
        resolver = self._lsl.ContinuousResolver("type", KIND)
        searched_s = -_SEARCH_S
        while not self._end.wait(_LOOK_S):
            now_s = time.perf_counter()
            if now_s - searched_s >= _SEARCH_S:
                searched_s = now_s
                self._open(resolver.results())
            for source in list(self.streams):
                try:
                    self._pull(source)
                except RuntimeError:  # it ended without a source id, or before its clock was known
                    del self.streams[source]
        self.streams.clear()

    def _pull(self, source: tuple[str, ...]) -> None:
        """Take the marks that came, once the sender's clock is known.

        The library's own correction would wait for it, with the marks of all other streams, and lose the one it is for.
        """
        inlet, since_s = self.streams[source]
        try:
            correction_s = inlet.time_correction(timeout=0.0)
        except self._lsl.util.TimeoutError:
            correction_s = math.nan
        now_s = time.perf_counter()
        waits_since_s = min(since_s, now_s) if math.isnan(correction_s) else math.inf
        self.streams[source] = inlet, waits_since_s
        if now_s - _CLOCK_S < waits_since_s <= now_s:
            return
        ahead_s = now_s - self._lsl.local_clock() + correction_s
        for text, lsl_s in _samples(inlet):
            ago_s = 0.0 if math.isnan(ahead_s) or lsl_s is None else now_s - (lsl_s + ahead_s)
            if -_EARLIEST_S < ago_s < _LATEST_S:
                self._off.pop(source, None)
            else:
                line = f"marks of {_name(source)} are stamped {-ago_s:+.4g} s from now; they count as they arrive"
                self._off.setdefault(source, line)  # whatever the next ones say: each new line is told
                ago_s = 0.0
            self._take(text, now_s - ago_s)

    def _open(self, found: list[Any]) -> None:
        """Open new streams. Their times are converted to this computer's clock.

        An inlet finds its stream again by the source id: another inlet for a sender that was started again would take
        each mark twice.
        """
        for info in found:
            source = _source(info)
            if source in self.streams or info.source_id().startswith(OURS):
                continue
            if len(self.streams) >= MOST_STREAMS:
                there = {_source(other) for other in found}
                self.streams = {source: inlet for source, inlet in self.streams.items() if source in there}
            if len(self.streams) < MOST_STREAMS:
                inlet = self._lsl.StreamInlet(info)
                with suppress(RuntimeError):  # it is not open at once: to wait would hold up the marks of others
                    inlet.open_stream(timeout=0.0)
                self.streams[source] = inlet, time.perf_counter()


def _samples(inlet: Any) -> Iterator[tuple[str, float | None]]:  # noqa: ANN401 - pylsl has no types
    """Take the samples that have come, one by one: text, and time by the sender's clock.

    pylsl refuses text that is not in UTF-8, as of a sender that writes Latin-1, together with its time.
    """
    for _ in range(inlet.samples_available()):  # of a stream that has ended, one could be waited for without end
        try:
            sample, lsl_s = inlet.pull_sample(timeout=0.0)
        except UnicodeDecodeError as error:
            yield error.object.decode("latin-1"), None
            continue
        if sample is None:
            return
        yield str(sample[0]), lsl_s


def _name(source: tuple[str, ...]) -> str:
    """Return the name of a stream for a person."""
    return f"stream {source[1]!r}" if len(source) > 1 else "a stream"


def _source(info: Any) -> tuple[str, ...]:  # noqa: ANN401 - pylsl has no types
    """Return what stays when a stream's sender is started again; without a source id its own number, which does not."""
    id = info.source_id()
    return (id, info.name(), info.hostname()) if id else (info.uid(),)


class SerialMarks:
    """A serial line at 115,200 baud: each line of text is a mark, and so is a single byte, as triggers send them."""

    def __init__(self, port: str, take: Take) -> None:
        """Begin to read; `problem` tells of a port that cannot be opened or is lost, which is tried again each second.

        The thread opens it, because an adapter that hangs holds up who does for seconds.
        """
        self._name, self._take = port, take
        self.problem = ""
        self._end = threading.Event()
        self._thread = threading.Thread(target=self._run, name="marks by a serial line", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Release the port; one that hangs is left to the thread."""
        self._end.set()
        self._thread.join(_RELEASE_S)

    def _run(self) -> None:
        from serial import Serial

        refusal = f"marks cannot be read from {self._name}"
        while not self._end.is_set():
            try:
                with opening(refusal), Serial(self._name, BAUD, timeout=LINE_ENDS_S, exclusive=True) as port:
                    self.problem = ""
                    self._read(port)
            except DeviceError as error:
                self.problem = str(error)
            self._end.wait(_AGAIN_S)

    def _read(self, port: "Serial") -> None:
        """Take marks until told to end; raise what pyserial does where the port is gone."""
        text, at_s, was_silent = b"", 0.0, True
        while not self._end.is_set():
            came = port.read(max(port.in_waiting, 1))
            if came:  # a mark without an end of line is known later
                at_s = time.perf_counter()
            is_alone, was_silent = was_silent and came in (b"\r", b"\n"), not came
            marks, text = ([], came) if is_alone else split_marks(text + came, is_over=not came)
            for mark in marks:
                self._take(mark, at_s)


def split_marks(came: bytes, is_over: bool) -> tuple[list[str], bytes]:
    """Split bytes of a serial line into marks; return them with the incomplete rest, which is empty if it `is_over`.

    >>> split_marks(b"begin\\r\\nwal", False)
    (['begin'], b'wal')
    >>> list(map(len, split_marks(b"a" * 2500, True)[0]))
    [1000, 1000, 500]
    >>> split_marks(b"\\x05", False), split_marks(b"A", True), split_marks(b"\\r", True)
    ((['trigger 5'], b''), (['trigger 65'], b''), (['trigger 13'], b''))
    """
    if is_over and len(came) == 1:
        return [f"trigger {came[0]}"], b""
    found, text = list[str](), b""
    for value in came:
        if value in b"\r\n" or len(text) >= _LONGEST_LINE:
            found, text = [*found, text.decode(errors="replace").strip()], b""
        if value in b"\r\n":
            continue
        if value < 32 and value != 9:
            found.append(f"trigger {value}")
        else:
            text += bytes([value])
    if is_over and text:
        found.append(text.decode(errors="replace").strip())
        text = b""
    return [mark for mark in found if mark], text
