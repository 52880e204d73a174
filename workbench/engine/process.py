"""The engine's process: one thread takes commands, the output callback (or the clock) runs the loop."""

import gc
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from multiprocessing.connection import Connection

from msgspec.structs import replace

from underfoot.clock import next_span
from underfoot.devices.device_floor import DeviceFloor
from underfoot.devices.outputs import CardChannels, card_channels
from underfoot.devices.simulated_floor import SimulatedFloor
from underfoot.devices.sound import drop_library_messages
from underfoot.engine.accelerometer_reader import reader_of
from underfoot.engine.block_runner import BlockRunner
from underfoot.engine.child_process import leave_to_session
from underfoot.engine.command_listener import CommandListener
from underfoot.engine.commands import Level, Play
from underfoot.engine.engine_supervisor import STALL_S
from underfoot.engine.kernel_loading import KernelParts, load_common_kernels
from underfoot.engine.loop import Loop, LoopOptions
from underfoot.engine.pacing import Pacer
from underfoot.engine.reports import NO_ANSWER, EngineStopped, Notice, OutputChanged, PatchRefused, Started
from underfoot.engine.requests import Setup, StandBy
from underfoot.engine.session_memory import SessionMemory
from underfoot.engine.status import Field
from underfoot.engine.target import plates_of, source_of
from underfoot.errors import UnderfootError
from underfoot.floor.tile_parameters import simulation
from underfoot.nodes import REGISTRY
from underfoot.patch.patch import Patch

SWITCH_S = 0.0002
"""Interval in seconds at which a thread of this process must release the interpreter."""


def run(connection: Connection) -> None:
    """Wait for the `Setup` and play until the connection ends or `Quit` arrives; the main function of the process."""
    leave_to_session("SIGINT", "SIGHUP")
    try:
        load_common_kernels()  # so that an engine on standby takes over sooner
        gc.freeze()  # keep the collector from scanning existing objects before the first sound
        rehearsed = None
        while isinstance(message := connection.recv(), StandBy):
            rehearsed = _rehearse(message.setup)
        leave_to_session("SIGTERM")  # from now on it plays, and ends in a ramp
        if message.target.sound is not None:
            drop_library_messages()
        Engine(connection, message, rehearsed).run()
    except UnderfootError as error:
        connection.send(EngineStopped(f"the engine stopped: {error}"))
    except (EOFError, OSError):
        return  # the supervisor died


class Engine:
    """The loop, its pacer, and the thread that listens to the supervisor."""

    def __init__(self, connection: Connection, setup: Setup, rehearsed: Setup | None = None) -> None:
        """Create the engine; `rehearsed` is the setup whose kernels are already loaded."""
        self._connection, self._setup = connection, setup
        target = setup.target
        patch = Patch.loads(setup.patch, REGISTRY)
        channels, sound_channel, outputs = target.floor.channels, None, 0
        cards: tuple[CardChannels, ...] = ()
        if target.sound is not None:
            behind = max(channels) + 1
            with _waiting_reported(connection):
                cards = card_channels(target.sound, behind + 2)
            most = cards[-1].first + cards[-1].count
            channels = tuple(channel if channel < most else -1 for channel in channels)
            # Open only the needed pairs of channels: a sound server mixes channels that its card lacks into the others.
            has_sound = any(REGISTRY[node.type].to_sound for node in patch.nodes)
            outputs = _outputs(cards, max(*channels, behind if has_sound and behind < most else -1) + 1)
            sound_channel = behind if behind < outputs else -1  # also for a later patch, where it is open anyway
        options = replace(_options(setup, channels, sound_channel), outputs=outputs)
        try:
            if rehearsed is None or (rehearsed.patch, rehearsed.target) != (setup.patch, target):
                KernelParts(patch, target, options).load(connection.send)
        except UnderfootError as error:
            connection.send(PatchRefused.because(error))
            patch = Patch()
        passed_s = 0.0 if setup.since is None else time.perf_counter() - setup.since
        frame = next_span(setup.frame + round(passed_s * target.rate))
        self.memory = SessionMemory.open(setup.memory)  # after what is refused: then nothing would release it
        self.memory.skip(frame)
        self.loop = Loop(patch, REGISTRY, source_of(target, frame), replace(options, frame=frame))
        self.runner = BlockRunner(self.loop, self.memory)
        card = cards[0].output.name if cards else ""
        self.runner.accelerometers = reader_of(
            target.accelerometers, self.loop.source, self.memory, target.rate, target.block, card
        )
        width = self.loop.out.shape[1]
        used = [replace(card, count=min(card.count, width - card.first)) for card in cards if card.first < width]
        self.pacer = Pacer(self.runner, target, used, self._notify)
        self.listener = CommandListener(connection, self.runner, self.pacer)
        if isinstance(self.loop.source, SimulatedFloor):
            self.listener.notices.extend(map(Notice, self.loop.source.notices))

    def begin(self) -> tuple[float, bool]:
        """Set the level, dB, and play if that is wanted, both as of now: kernels took a while to load."""
        level_db, playing = self.memory.status.get(Field.LEVEL_DB), bool(self.memory.status.get(Field.PLAYING))
        self.loop.send(Level(level_db))
        if playing:
            self.loop.send(Play(True))
        return level_db, playing

    def run(self) -> None:
        """Play until the supervisor sends `Quit` or is gone."""
        with _waiting_reported(self._connection):
            notice = self.pacer.open()
        gc.collect()
        gc.freeze()
        gc.disable()
        sys.setswitchinterval(SWITCH_S)
        source = self.loop.source
        if isinstance(source, DeviceFloor):
            source.start()
        self.memory.status.put(Field.RUNNING, 1.0)
        channels = tuple(self.loop.channels)
        begun = *self.begin(), self.pacer.silence
        self._connection.send(Started(self.pacer.where, notice, channels, *begun))
        self.listener.start()
        self.pacer.run()
        self.memory.status.put(Field.RUNNING, 0.0)
        self.pacer.close()
        if isinstance(source, DeviceFloor):
            source.close()

    def _notify(self, notice: Notice) -> None:
        self.listener.notices.append(notice)


@contextmanager
def _waiting_reported(connection: Connection) -> Iterator[None]:
    """In this block, report a sound card that does not answer for `STALL_S`: its server may hang."""
    report = threading.Timer(STALL_S, lambda: connection.send(OutputChanged(NO_ANSWER, "", NO_ANSWER)))
    report.start()
    try:
        yield
    finally:
        report.cancel()
        report.join()  # before anything else is sent


def _rehearse(setup: Setup) -> Setup | None:
    """Load the kernels of another engine's setup; return it, or None if it cannot be played."""
    options = _options(setup, setup.target.floor.channels, None)
    try:
        KernelParts(Patch.loads(setup.patch, REGISTRY), setup.target, options).load(lambda progress: None)
    except UnderfootError:
        return None  # the engine that takes over reports it
    return setup


def _outputs(cards: tuple[CardChannels, ...], needed: int) -> int:
    """Return how many of the floor's channels are open where it needs `needed`: on the last card, more of them."""
    last = next((card for card in reversed(cards) if card.first < needed), cards[0])
    return last.first + last.opened(needed)


def _options(setup: Setup, channels: tuple[int, ...], sound_channel: int | None) -> LoopOptions:
    """Return the loop options of a setup on these channels."""
    target = setup.target
    return LoopOptions(
        rate_hz=target.rate,
        block=target.block,
        channels=channels,
        sound_channel=sound_channel,
        scopes=setup.scopes,
        folder=setup.folder,
        equalisers=setup.equalisers,
        plates=plates_of(target),
        simulation=simulation(target.simulation)[0],
        measures=bool(target.accelerometers),
    )
