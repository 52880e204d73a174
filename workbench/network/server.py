"""Sockets and their thread: contacts are sent 60 times a second, cues are received.

The owner of the session passes news on (`show`, `send_...`), takes received cues (`cues`), and answers them
(`answer_...`); none of this waits. Input is limited to `MOST_BYTES` per datagram, `MOST_DATAGRAMS_S` datagrams read per
second (the system drops others), and `MOST_CUES_S` cues. Anything that is not a cue is counted and dropped.
"""

import math
import select
import socket
import threading
import time
import traceback
from collections import deque
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import msgspec
import numpy as np
from numpy.typing import NDArray

from underfoot.devices.transport import bind_alone, listening_reason, reason
from underfoot.engine.reports import Health
from underfoot.errors import BadValue, DeviceError
from underfoot.floor.contacts import SILENT_S, OngoingContact
from underfoot.floor.footsteps import Step
from underfoot.floor.layout import Floor
from underfoot.network.addresses import Address
from underfoot.network.cues import (
    LONGEST_TEXT,
    NO_NUMBER,
    Cue,
    HelloCue,
    MarkCue,
    PanicCue,
    SetCue,
    cue_of,
    number_of,
)
from underfoot.network.live_contacts import LiveContacts
from underfoot.network.lsl import LslStreams
from underfoot.network.mark_inlets import LslMarks, SerialMarks
from underfoot.network.osc import Argument, Double, Long, Message, message, read
from underfoot.network.plan import NetworkPlan
from underfoot.network.tuio import contact_messages, cursor_frame, pointer_frame
from underfoot.patch import preset_files
from underfoot.version import __version__

NAME = "underfoot"
SOURCE = f"{NAME}@{socket.gethostname()}"
"""Who sends, as TUIO has it: a program, and its computer."""
FRAME_HZ, IDLE_S = 60.0, 1.0
"""Rate at which contacts are sent, and interval of messages that there are none."""
LASTING_S = 1.0
"""Time for which nothing can be sent to an address until that is a problem: a busy system refuses single datagrams."""
MOST_BYTES, MOST_DATAGRAMS_S, MOST_CUES_S, MOST_MARKS_S = 2048, 2000.0, 200.0, 200.0
_BURST_S = 0.25  # length of a burst at each rate
_COSTS = {HelloCue: 10.0, PanicCue: 0.0, SetCue: 0.2}
"""Of `MOST_CUES_S`, by kind: the answer to hello is long; sixteen faders at 60 Hz send a thousand sets a second."""
_LONGEST_HELLO, _REASON = 60_000, 300
_WAITING = 4096  # of cues, and of answers: a window that is held up for a second takes all that faders sent
_SEND_BUFFER = 1 << 18  # macOS sends no datagram that is longer than this, by itself 9216 bytes
_LARGEST_INT = 0x7FFFFFFF

Sender = tuple[str, int]


@dataclass
class Counts:
    """Numbers of datagrams sent, cues received, and messages refused, with the reason of the last refusal."""

    sent: int = 0
    received: int = 0
    refused: int = 0
    reason: str = ""


@dataclass(frozen=True)
class Received:
    """A cue, and its sender: None for a mark of an inlet, which gets no answer, and has its time `at_s` by
    `time.perf_counter`."""

    cue: Cue
    sender: Sender | None
    at_s: float | None = None

    @property
    def number(self) -> int:
        """The sender's number for it."""
        return int(getattr(self.cue, "number", NO_NUMBER))


class _Shown(NamedTuple):
    """The contacts of the sample at the session's `time_s`, which came at `since_s`; `stamp_s` is LSL's."""

    since_s: float
    time_s: float
    stamp_s: float | None
    contacts: Sequence[OngoingContact]


class NetworkServer:
    """Carries out a `NetworkPlan`. `DeviceError` if a UDP port is not available; `problem` says what else is not."""

    def __init__(
        self,
        plan: NetworkPlan,
        floor: Floor,
        rate_hz: float,
        force_hz: float,
        before: "NetworkServer | None" = None,
    ) -> None:
        """`rate_hz` is session frames per second. Ids, frames and counts continue those of a server `before`."""
        self.plan = plan
        self.counts: Counts = before.counts if before else Counts()
        self._rate_hz = rate_hz
        self._live: LiveContacts = LiveContacts(floor, before._live.last_id if before else 0)
        self._sequence: int = before._sequence if before else 0
        self._hello = message(f"/{NAME}/hello", NAME, __version__, self._about(floor, force_hz))
        self._shown = _Shown(-math.inf, 0.0, None, ())
        self.floor_trouble: str = before.floor_trouble if before else ""
        """What is wrong with the floor's tiles, which is sent with the health."""
        self._jobs: deque[Callable[[], object]] = deque(maxlen=_WAITING)
        self._panics: deque[Received] = deque(maxlen=_WAITING)  # what else comes pushes none of them out
        self._cues: deque[Received] = deque(maxlen=_WAITING)
        self._was_empty, self._sent_s = False, -math.inf
        self._reads, self._acts = _Allowance(MOST_DATAGRAMS_S), _Allowance(MOST_CUES_S)
        self._ended, self._released = False, threading.Event()
        self._problem = self._bug = ""
        self._failing: dict[str, tuple[float, float, str]] = {}  # of what: since when, until when, and why
        self._lsl: LslStreams | None = None
        self._inlets: list[LslMarks | SerialMarks] = []
        self._listening = _bound(plan.listen) if plan.listen is not None else None
        if plan.serial_marks:
            self._inlets.append(SerialMarks(plan.serial_marks, partial(self._take_mark, _Allowance(MOST_MARKS_S))))
        self._out = _udp()
        self._out.setsockopt(socket.SOL_SOCKET, socket.SO_BROADCAST, 1)  # an address may be that of a whole network
        self._wake, self._woken = socket.socketpair()
        self._wake.setblocking(False)
        self._thread = threading.Thread(target=self._run, args=(floor, force_hz), name="network", daemon=True)
        self._thread.start()

    def close(self, *, wait: bool = True) -> None:
        """Send that there are no contacts, and release the ports; with `wait`, wait for the end of LSL streams too."""
        if not self._ended:
            self._ended = True
            self._do(_nothing)
        self._released.wait()
        if wait or not (self.plan.lsl or self.plan.lsl_marks):
            self._thread.join()

    @property
    def problem(self) -> str:
        """Parts of the plan that fail, with reasons; "" if none."""
        failing = tuple(self._failing.items())
        unsent = (f"{what}: {why}" for what, (since_s, last_s, why) in failing if last_s - since_s > LASTING_S)
        return "; ".join(filter(None, (self._problem, self._bug, *unsent, *(inlet.problem for inlet in self._inlets))))

    # --- output ---

    def show(self, time_s: float, ago_s: float, contacts: Sequence[OngoingContact]) -> None:
        """Set the contacts of the sample at the session's `time_s`, `ago_s` ago; they hold for `SILENT_S`."""
        stamp_s = None if self._lsl is None else self._lsl.clock.at(time_s, ago_s)
        self._shown = _Shown(time.perf_counter(), time_s, stamp_s, contacts)

    def send_force(self, time_s: float, ago_s: float, load_n: NDArray[np.float64]) -> None:
        """Send loads (n, tiles) by LSL; the last one is of the session's `time_s`, `ago_s` ago."""
        if self._lsl is not None:
            self._do(partial(self._lsl.force, load_n, self._lsl.clock.at(time_s, ago_s)))

    def send_step(self, step: Step, ago_s: float) -> None:
        """Send a step, which began `ago_s` ago."""
        contact = self._live.sent_id(step.contact)
        figures = (step.contact_ms, step.peak1_n, step.valley_n, step.peak2_n, step.impulse_ns, step.loading_kn_s)
        self._queue_message(
            "step", step.step, contact, step.person, step.tile, step.side, Double(step.start_s), *map(float, figures)
        )
        if self._lsl is not None:
            at_s = self._lsl.clock.at(step.start_s, ago_s)
            self._do(partial(self._lsl.step, step, contact, at_s))

    def send_health(self, health: Health, why_silent: str) -> None:
        """Send the state of the engine; call it once or twice a second. A count stops at the largest number."""
        xruns, lost = (min(count, _LARGEST_INT) for count in (health.xruns, health.lost))
        self._queue_message(
            "health", health.running, Long(health.frame), float(health.load), xruns, lost,
            float(health.latency_s), float(health.stream_latency_s), why_silent, self.floor_trouble[:_REASON],
        )  # fmt: skip

    def send_mark(self, text: str, frame: int, ago_s: float) -> None:
        """Send a mark, which was set at a session frame, `ago_s` ago."""
        self._queue_message("mark", text, Long(frame), Double(frame / self._rate_hz))
        if self._lsl is not None:
            at_s = self._lsl.clock.at(frame / self._rate_hz, ago_s)
            self._do(partial(self._lsl.mark, text, at_s))

    def answer_played(self, received: Received, frame: int, ago_s: float) -> None:
        """Answer a cue: it is played from this session frame on, `ago_s` ago."""
        time_s = Double(frame / self._rate_hz)
        self._answer(received.sender, "played", received.number, Long(frame), time_s, float(ago_s))

    def answer_refused(self, received: Received, reason: str) -> None:
        """Answer a cue that is not carried out."""
        self._refuse(reason)
        self._answer(received.sender, "refused", received.number, received.cue.address, reason[:_REASON])

    def cues(self) -> list[Received]:
        """Return the cues received since the last call, panics first."""
        return [waiting.popleft() for waiting in (self._panics, self._cues) for _ in range(len(waiting))]

    def _queue_message(self, name: str, *arguments: Argument) -> None:
        if self.plan.send is not None:
            self._do(partial(self._send, message(f"/{NAME}/{name}", *arguments), self.plan.send))

    def _answer(self, sender: Sender | None, name: str, *arguments: Argument) -> None:
        if sender is not None:
            self._do(partial(self._send_answer, message(f"/{NAME}/{name}", *arguments), sender))

    def _do(self, job: Callable[[], object]) -> None:
        """Run a job in the thread."""
        self._jobs.append(job)
        with suppress(OSError):  # enough bytes wait to wake it, or it has ended
            self._wake.send(b"\0")

    # --- the thread ---

    def _run(self, floor: Floor, force_hz: float) -> None:
        try:  # in the thread, because it takes longer than a frame
            if self.plan.lsl:
                self._lsl = LslStreams(floor, force_hz)
            if self.plan.lsl_marks:
                self._inlets.append(LslMarks(partial(self._take_mark, _Allowance(MOST_MARKS_S))))
        except (BadValue, RuntimeError) as error:
            self._problem = str(error)
        try:
            self._serve_sockets()
            self._attempt(partial(self._send_frame, math.inf))
        finally:
            for one in (self._listening, self._out, self._wake, self._woken):
                if one is not None:
                    one.close()
            self._close_inlets(SerialMarks)
            self._released.set()
            self._close_inlets(LslMarks)
            if self._lsl is not None:
                self._lsl.close()

    def _serve_sockets(self) -> None:
        due_s = time.perf_counter()
        while not self._ended:
            now_s = time.perf_counter()
            if now_s >= due_s:
                self._attempt(partial(self._send_frame, now_s))
                due_s = max(due_s + 1.0 / FRAME_HZ, now_s)
            sources = [self._woken]
            if self._listening is not None and self._reads.left >= 1.0:
                sources.append(self._listening)
            ready, _, _ = select.select(sources, [], [], max(due_s - now_s, 0.0))
            if self._woken in ready:
                self._woken.recv(4096)
            if self._listening in ready:
                self._attempt(self._receive)
            while self._jobs:
                self._attempt(self._jobs.popleft())

    def _attempt(self, job: Callable[[], object]) -> None:
        """Do a job. One that a bug ends is told, with the first traceback, and keeps nothing else from going on."""
        try:
            job()
        except Exception as error:
            if not self._bug:
                traceback.print_exc()
            why = f"{type(error).__name__}: {error}"
            self._bug = f"an error of the program kept something from being sent or taken: {why}"

    def _send_frame(self, now_s: float) -> None:
        """Send the present contacts; if there are none, only every `IDLE_S`."""
        shown = self._shown
        contacts = self._live.update(shown.time_s, shown.contacts if now_s - shown.since_s < SILENT_S else ())
        if not contacts and self._was_empty and now_s - self._sent_s < IDLE_S:
            return
        self._was_empty, self._sent_s = not contacts, now_s
        self._sequence = self._sequence % _LARGEST_INT + 1
        plan = self.plan
        if plan.tuio is not None:
            self._send(cursor_frame(contacts, self._sequence, SOURCE), plan.tuio)
        if plan.tuio2 is not None:
            frame = pointer_frame(contacts, self._sequence, SOURCE, time.time(), self._live.size_m)
            self._send(frame, plan.tuio2)
        if plan.send is not None:
            self._send(contact_messages(contacts, shown.time_s), plan.send)
        if self._lsl is not None and shown.stamp_s is not None:
            self._lsl.contacts(contacts, shown.stamp_s)

    def _send(self, datagram: bytes, to: Address) -> None:
        why = self._send_by(self._out, datagram, (to.host, to.port))
        self._note(f"nothing can be sent to {to}", why)

    def _send_answer(self, datagram: bytes, sender: Sender) -> None:
        why = self._send_by(self._listening or self._out, datagram, sender)
        self._note("cues cannot be answered", why and f"{sender[0]}:{sender[1]}: {why}")

    def _send_by(self, way: socket.socket, datagram: bytes, to: Sender) -> str:
        """Send a datagram; return why that is not possible, or ""."""
        try:
            way.sendto(datagram, to)
        except OSError as error:  # no route, or no buffer space; the next frame replaces this one
            return reason(error)
        self.counts.sent += 1
        return ""

    def _note(self, what: str, why: str) -> None:
        """Note what cannot be sent, or, without a reason, that it can."""
        if why:
            now_s = time.perf_counter()
            since_s, *_ = self._failing.get(what, (now_s,))
            self._failing[what] = (since_s, now_s, why)
        else:
            self._failing.pop(what, None)

    # --- input ---

    def _receive(self) -> None:
        """Read waiting datagrams, within the limit."""
        listening = self._listening
        while listening is not None and self._reads.spends(1.0):
            try:
                datagram, sender = listening.recvfrom(MOST_BYTES + 1)
            except BlockingIOError:
                return
            except OSError:  # an answer was not delivered or, on some systems, the datagram is too long
                self._refuse("a datagram could not be read")
                return
            self._take(datagram, sender)

    def _take(self, datagram: bytes, sender: Sender) -> None:
        if len(datagram) > MOST_BYTES:
            self._refuse(f"a datagram is longer than {MOST_BYTES} bytes")
            return
        try:
            messages = read(datagram)
        except BadValue as error:
            self._refuse(str(error))
            return
        for one in messages:
            self._take_message(one, sender)

    def _take_message(self, one: Message, sender: Sender) -> None:
        try:
            cue = cue_of(one)
        except BadValue as error:
            self._refuse(str(error))
            if self._acts.spends(1.0):
                self._answer(sender, "refused", number_of(one), one.address[:_REASON], str(error)[:_REASON])
            return
        if not self._acts.spends(_COSTS.get(type(cue), 1.0)):
            self._refuse(f"more than {MOST_CUES_S:g} cues came in a second")
            return
        self.counts.received += 1
        if isinstance(cue, HelloCue):
            self._send_answer(self._hello, sender)
        else:
            (self._panics if isinstance(cue, PanicCue) else self._cues).append(Received(cue, sender))

    def _close_inlets(self, kind: type[LslMarks | SerialMarks]) -> None:
        for inlet in self._inlets:
            if isinstance(inlet, kind):
                inlet.close()

    def _take_mark(self, allowance: "_Allowance", text: str, at_s: float) -> None:
        """Receive a mark from an inlet."""
        if not allowance.spends(1.0):
            self._refuse(f"more than {MOST_MARKS_S:g} marks came in a second")
            return
        self.counts.received += 1
        self._cues.append(Received(MarkCue(text[:LONGEST_TEXT]), None, at_s))

    def _refuse(self, reason: str) -> None:
        self.counts.refused += 1
        self.counts.reason = reason

    def _about(self, floor: Floor, force_hz: float) -> str:
        """Return the description for clients as JSON, without the tiles if these do not fit into a datagram."""
        plan = self.plan
        ways = {name: getattr(plan, name) for name in ("tuio", "tuio2", "listen", "send")}
        about = {
            "rate_hz": self._rate_hz,
            "force_hz": force_hz,
            "ways": {name: str(way) for name, way in ways.items() if way is not None},
            "lsl": plan.lsl,
            "box_m": self._live.size_m,
            "floor": floor.title,
            "tiles": [
                {"id": tile.id, "centre_m": tile.centre_m, "size_m": tile.size_m, "rotation_deg": tile.rotation_deg}
                for tile in floor.tiles
            ],
            "presets": list(preset_files.patches()),
        }
        text = msgspec.json.encode(about)
        if len(text) > _LONGEST_HELLO:
            text = msgspec.json.encode({**about, "tiles": None})
        return text.decode()


class _Allowance:
    """A rate limit, with bursts of up to a quarter of a second."""

    def __init__(self, rate_s: float) -> None:
        self._rate_s, self._left, self._at_s = rate_s, rate_s * _BURST_S, time.perf_counter()

    @property
    def left(self) -> float:
        """The amount available now."""
        now_s = time.perf_counter()
        self._left = min(self._left + (now_s - self._at_s) * self._rate_s, self._rate_s * _BURST_S)
        self._at_s = now_s
        return self._left

    def spends(self, cost: float) -> bool:
        """Spend an amount if it is available; return whether it was."""
        if self.left < cost:
            return False
        self._left -= cost
        return True


def _nothing() -> None:
    """Do nothing: a job that only wakes the thread."""


def _udp() -> socket.socket:
    made = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    made.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, _SEND_BUFFER)
    made.setblocking(False)
    return made


def _bound(address: Address) -> socket.socket:
    made = _udp()
    try:
        bind_alone(made, address.host, address.port)
    except OSError as error:
        made.close()
        raise DeviceError(f"cues cannot be taken at {address}: {listening_reason(error)}") from None
    return made
