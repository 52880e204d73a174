"""Latency of the sound card: clicks from an output, looped back to an input, or to the accelerometer on the tile."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from underfoot.calibration.declaration import SHAKING, Calibration, FileMeasurement, MeasurementSetup, named_tile
from underfoot.calibration.procedure import Answers, Page, Procedure, Step
from underfoot.calibration.result import Result
from underfoot.calibration.rig import Sound
from underfoot.clock import RATE_HZ
from underfoot.errors import BadFile, BadMeasurement
from underfoot.floor.profile_parts import PARTS
from underfoot.kernels import Floats
from underfoot.options import option
from underfoot.parameters import Count, Number, ask
from underfoot.quantities import counted

if TYPE_CHECKING:
    from underfoot.calibration.science.clicks import ClickDelays
    from underfoot.floor.layout import Tile

LOUDEST = 0.9
FEWEST = 20
"""Clicks of a measurement."""


@dataclass(frozen=True)
class LatencyCalibration(Calibration):
    """Measurement of the round trip, and the options of its command."""

    kind = "latency"
    name = PARTS[kind]
    title = "Latency: from the program to the tile and back"
    about = (
        "A thousand clicks are played and recorded: the output looped to the input by a cable, or the shaker heard by "
        "its accelerometer. With the result, what is measured stands at the moment at which it was asked for, and the "
        "latency that is shown is a measured one."
    )
    summary = "Measure the round-trip latency of the sound card."
    rig = SHAKING
    file_options = ("played", "recorded")

    played: Path | None = option("WAV of the clicks as they were played.", None)
    recorded: Path | None = option("WAV of the recorded clicks, from the same moment, at the same rate.", None)
    clicks: int = option("Number of clicks that a target plays.", 1000)
    block: int = option("Frames per block of the sound device, as in the engine.", 128)
    level: float | None = option("Level on a target, in full scale: 0.01 to 0.9.", None)

    def procedure(self, setup: MeasurementSetup) -> "LatencyProcedure":
        return LatencyProcedure(setup.tile, setup.rate_hz, setup.block)

    def answers(self, has_load_cell: bool) -> Answers:
        level = {} if self.level is None else {"level": self.level}
        return {"clicks": self.clicks, "block": self.block, **level}

    def from_files(self, floor: Path | None, tile: str) -> FileMeasurement:
        return FileMeasurement(named_tile(floor, tile), lambda profile: self._analyse_files())

    def _analyse_files(self) -> Result:
        from underfoot.calibration.files.recordings import read_wav
        from underfoot.calibration.results.latency import result_of
        from underfoot.calibration.science.clicks import click_delays, click_onsets

        assert self.played is not None
        assert self.recorded is not None
        (played, rate_hz), (recording, recorded_hz) = read_wav(self.played), read_wav(self.recorded)
        if rate_hz != recorded_hz:
            raise BadFile(f"{self.recorded} is at {recorded_hz} Hz, {self.played} at {rate_hz}; allowed: one rate")
        sent, received = (one[:, int(abs(one).max(axis=0).argmax())] for one in (played, recording))
        onsets = click_onsets(sent, rate_hz)
        if len(onsets) < FEWEST:
            raise BadFile(f"{self.played} has {counted(len(onsets), 'click')}; allowed: {FEWEST} or more")
        return result_of(click_delays(sent, onsets, received, rate_hz), rate_hz, self.block)


class LatencyProcedure(Procedure):
    """Round trip of a sound card at `rate_hz`. The first page suggests the `block`: another one's has no use there.

    >>> from underfoot.floor.layout import default_floor
    >>> LatencyProcedure(default_floor().tiles[0]).page.key
    'setup'
    """

    def __init__(self, tile: "Tile", rate_hz: int = RATE_HZ, block: int = 128) -> None:
        self._tile, self._rate_hz = tile, rate_hz
        self._seed, self._block = 1, 0
        self._onsets = np.zeros(0, np.int64)
        self._found: ClickDelays | None = None
        instruction = (
            f"Tile {tile.id}: loop its output to the input with a cable, or fix the accelerometer to the plate. "
            "Nobody stands on the tile."
        )
        questions = (
            ask("clicks", Count(1000, low=FEWEST, high=5000, doc="How many clicks: some 40 a second.")),
            ask("block", Count(block, low=16, high=4096, unit="frames", doc="A block, as set under Audio.")),
            ask("level", Number(0.5, 0.01, LOUDEST, unit="of full scale", doc="How loud to play.")),
        )
        super().__init__(Page("setup", "Latency", instruction, questions=questions))

    def plan(self, answers: Answers) -> list[Step]:
        """Return a single page: the clicks."""
        from underfoot.calibration.science.clicks import click_train

        train, self._onsets = click_train(answers["clicks"], self._rate_hz, answers["level"], self._seed)
        self._block = answers["block"]
        sound = Sound(train, self._rate_hz, "none", self._block)
        return [Step(Page("clicks", "Clicks", "Stand clear. The output plays clicks.", sound=sound), hear=self._clicks)]

    def _clicks(self, played: Floats, recording: Floats) -> None:
        """Measure the delay of each click."""
        from underfoot.calibration.science.clicks import click_delays

        self._found = click_delays(played, self._onsets, recording, self._rate_hz)

    def conclude(self) -> Result:
        """Return figures and verdict."""
        from underfoot.calibration.results.latency import result_of

        if self._found is None:
            raise BadMeasurement("no clicks were recorded")
        return result_of(self._found, self._rate_hz, self._block, self._tile.id)
