"""Reports from the engine, the compiler and the supervisor to the user of a session. Plain frozen data."""

from pathlib import Path
from typing import Literal

import numpy as np
from msgspec import Struct, field
from numpy.typing import NDArray

from underfoot.drawing import Drawing
from underfoot.engine.commands import Command

SOUND_CARD = "sound card"
"""The output in `Started` if a sound card plays."""
NOTHING = "nothing"
"""The output in `OutputChanged` if no engine plays any more."""
NO_ANSWER = "the sound card and its server do not answer; nothing plays until they do"
"""What is said, and shown of the tiles, while a sound card's server hangs."""


class Started(Struct, frozen=True):
    """The engine has started: the output in words, and the reason if it is not the requested one; `silence` as in
    `OutputChanged`.
    """

    where: str
    notice: str = ""
    channels: tuple[int, ...] = ()
    level_db: float = 0.0
    playing: bool = True
    silence: str = ""


class CommandApplied(Struct, frozen=True):
    """A command took effect at this session frame. With the force samples, this suffices for a replay."""

    frame: int
    command: Command


class Fault(Struct, frozen=True):
    """A node made a value that is not finite; its output was silenced."""

    node: str
    tile: str
    frame: int


class Costs(Struct, frozen=True):
    """Each node's cost (share of the block time) and number of awake tiles, twice a second.

    `left_out` are the nodes that are not run, because they reach no output that plays.
    """

    share: dict[str, float]
    awake: dict[str, int]
    left_out: tuple[str, ...] = ()


class SensorFaults(Struct, frozen=True):
    """What is wrong with sensors of hardware, by tile and number (1 to 4), twice a second; and which of its tiles, or
    whether all of them, send nothing, "" for none.
    """

    faults: dict[tuple[str, int], str]
    silence: str = ""

    @property
    def in_words(self) -> str:
        """All of it in a line; "" for nothing.

        >>> SensorFaults({("t1", 3): "sensor 3 is dead"}, "nothing comes from t2").in_words
        'nothing comes from t2; tile t1: sensor 3 is dead'
        """
        of_sensors = (f"tile {tile}: {what}" for (tile, _), what in self.faults.items())
        return "; ".join(filter(None, (self.silence, *of_sensors)))


class ProcessDied(Struct, frozen=True):
    """A process ended that should not have; unless that happens too often, it is started again."""

    process: str
    reason: str
    is_restarted: bool = True


class Notice(Struct, frozen=True):
    """A line for the person: a device that is not there, a tile without a channel."""

    text: str


class RecordingFile(Struct, frozen=True):
    """What has become of a recording's file: it is there, it is whole, or it ends early, for the reason in a `Notice`.

    A recording that ended before its first sample is whole, and leaves no file.
    """

    path: Path
    state: Literal["begun", "whole", "cut"]


class PatchRefused(Notice, frozen=True):
    """A patch cannot be played; the previous one continues."""

    @classmethod
    def because(cls, error: Exception | str) -> "PatchRefused":
        """Return the report with the error's reason."""
        return cls(f"the patch is not played: {error}")


class EngineStopped(Notice, frozen=True):
    """The engine ended itself: its target cannot be played."""


class OutputChanged(Notice, frozen=True):
    """A sound card does not answer, has disappeared or returned, or cannot be reopened after a panic; or no engine
    plays any more. `silence` says which cards do not play that should, "" for none.
    """

    where: str
    silence: str = ""


class Compiling(Struct, frozen=True):
    """Kernels are being compiled, or plates computed: how many of how many parts are ready."""

    ready: int
    total: int


class Compiled(Struct, frozen=True):
    """The kernels of the patch of this ticket are in the cache; or why they are not."""

    ticket: int
    error: str = ""


MEASURED = "measured"
"""The name of the tile's response, m/s^2, among the signals of an output's preview."""

COMMANDED = "commanded"
"""The name of the whole commanded acceleration, m/s^2, among the signals of a tile output's preview."""


class Preview(Struct, frozen=True):
    """The response of a patch to one step on one tile: force in N, and the frames of each requested output."""

    ticket: int
    rate_hz: float
    force_n: NDArray[np.float32]
    signals: dict[str, NDArray[np.float32]]
    error: str = ""
    events: dict[str, NDArray[np.float64]] = field(default_factory=dict)
    headroom_db: float | None = None
    """Margin of the tile's drive below the limiter at full level, in dB, if the node plays and is not silent."""


class Outlines(Struct, frozen=True):
    """The responses of several nodes to one step on one tile, in few points, by "node.port"."""

    ticket: int
    signals: dict[str, NDArray[np.floating]]
    events: dict[str, NDArray[np.floating]]


class Distributions(Struct, frozen=True):
    """The distributions of a node, drawn; follows the `Preview` of the same ticket. `error` says why there are none."""

    ticket: int
    drawings: tuple[Drawing, ...]
    error: str = ""


class ErrorCurveDrawn(Struct, frozen=True):
    """Run time as a function of error of a node, as far as it has been measured."""

    ticket: int
    drawing: Drawing
    description: str
    left: int = 0
    error: str = ""


Report = (
    ErrorCurveDrawn
    | Distributions
    | Started
    | CommandApplied
    | Fault
    | Costs
    | SensorFaults
    | ProcessDied
    | Notice
    | RecordingFile
    | Compiling
    | Preview
    | Outlines
)


class Health(Struct, frozen=True):
    """The state of the engine, which can be read at any time."""

    running: bool
    load: float
    """Share of the time a block may take, a mean over half a second."""
    worst: float
    """The largest share since the start."""
    xruns: int
    lost: int
    """Force samples that did not arrive."""
    latency_s: float
    """From a force sample's arrival to the first output frame that depends on it: the block, and the hold."""
    hold_s: float
    """The part of it for which samples of hardware are held back, because some arrive late."""
    stream_latency_s: float
    """Latency of the output stream: by the card's clock, else half of a measured round trip, else as requested."""
    round_trip_s: float
    """The round trip of the card, as calibration or its own inputs measured it; 0 where it is not known."""
    frame: int
    """Session frames played."""
    peak: float
    """Largest sample of the last tenth of a second, of full scale."""
    awake: int
    """Tiles for which something is awake."""
    cards_delay_s: float = 0.0
    """Delay of further sound cards re the first; 0 without any."""
    cards_offset_s: float = 0.0
    """The largest current deviation from that delay."""
    cards_drift_ppm: float = 0.0
    """Deviation of that card's clock rate from the first card's."""
    jumps: int = 0
    """Number of changes of delay between the card's inputs and outputs, which show that frames were lost silently."""
    clock_trip_s: float = 0.0
    """The round trip by the card's clock, which stamps blocks as they come in and leave; 0 where it does not."""


def given_up(process: str, reason: str, *, patch_waits: bool) -> Notice:
    """Return the report of a process that is not started again."""
    line = f"the {process} fails again and again; it is not started any more: {reason}"
    if process == "engine":
        return OutputChanged(line, NOTHING, "the engine has failed; choose the target again")
    if process == "compiler" and patch_waits:
        return PatchRefused.because(f"the compiler fails again and again, the last time with {reason}")
    return Notice(line)
