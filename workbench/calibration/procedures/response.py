"""Calibration of vibration (section 4.5): sweeps through the shaker into an accelerometer, and an equaliser."""

from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from underfoot.calibration.declaration import SHAKING, Calibration, FileMeasurement, MeasurementSetup, named_tile
from underfoot.calibration.procedure import Answers, Page, Procedure, Step
from underfoot.calibration.reference import OF_ACCELERATION, require_given
from underfoot.calibration.result import Result
from underfoot.calibration.rig import Sound
from underfoot.clock import RATE_HZ
from underfoot.drawing import Drawing
from underfoot.errors import BadFile, BadMeasurement, BadValue
from underfoot.floor.layout import LOADS, Tile
from underfoot.floor.profile_parts import PARTS
from underfoot.kernels import Floats
from underfoot.options import option
from underfoot.parameters import Choice, Count, Number, Parameter, ask

if TYPE_CHECKING:
    from underfoot.calibration.science.tones import DistortionOverLevel
    from underfoot.calibration.science.transfer_function import SweepMeasurement


LOUDEST = 0.45
"""Largest peak that is played: its mean square stays below the limit of the safety stage."""
SENSITIVITY = 100.0
"""Default m/s^2 at full scale of the input: the range of the simulated accelerometer."""
SWEEP_HZ = (10.0, 2000.0)

_PLACES = {
    "standing": ("Stand on it", "Stand still in the middle of the tile, on one foot."),
    "corner": ("A foot on a corner", "Put one foot on a corner, half your weight on it."),
}
"""Title and instruction of the page before the sweeps under each load."""

_QUIET_S, _GAP_S = 1.0, 0.6
_LOUD_NOISE = 0.05
"""Largest RMS of recorded silence, in full scale."""


@dataclass(frozen=True)
class ResponseCalibration(Calibration):
    """Calibration of the frequency response, and the options of its command."""

    kind = "response"
    name = PARTS[kind]
    title = "Vibration: what the shaker makes of a signal"
    about = (
        "A sweep is played through the shaker and recorded by an accelerometer, with nothing on the tile, with a "
        "person, and with a foot on a corner. With the result, stimuli in m/s² play at that level, and an equaliser "
        "flattens the response under the load of your choice."
    )
    summary = "Measure how a tile responds to its shaker, and design its equaliser."
    rig = SHAKING
    file_options = ("sweep", "recorded")

    sweep: Path | None = option("WAV of the sweep as it was played: one pass, or several with silence between.", None)
    recorded: Path | None = option("WAV of the accelerometer's recording, at the same rate.", None)
    channel: int | None = option("Channel of --recorded, from 0; by default the one that holds the sweep.", None)
    sensitivity: float | None = option(
        "m/s^2 at full scale of the input; by default 1 for files, 100 on a target.", None
    )
    reference_percent: float | None = option(OF_ACCELERATION.doc, None)
    order: int = option("Order of the equaliser: even, 2 to 24.", 14)
    level: float | None = option("Level on a target, in full scale: 0.01 to 0.45.", None)
    load: str = option(
        "Load that the equaliser is designed for, and that files were measured under: none, standing, corner.", "none"
    )
    no_loads: bool = option("Leave out the sweeps under other loads.", False)

    def check(self, target: str) -> None:
        from underfoot.models.filtering.equaliser import MOST_ORDER

        super().check(target)
        if self.sensitivity is not None and not 0.0 < self.sensitivity < 1e9:
            raise BadValue(f"--sensitivity is {self.sensitivity:g}; allowed: above 0, below 1e9 m/s^2")
        if self.order % 2 or not 2 <= self.order <= MOST_ORDER:
            raise BadValue(f"--order is {self.order}; allowed: even numbers 2 to {MOST_ORDER}")
        require_given(OF_ACCELERATION, self.reference_percent)
        if self.load not in LOADS:
            raise BadValue(f"--load is {self.load}; allowed: {', '.join(LOADS)}")

    def procedure(self, setup: MeasurementSetup) -> "ResponseProcedure":
        return ResponseProcedure(setup.tile, setup.rate_hz, setup.full_scale_m_s2 or SENSITIVITY)

    def answers(self, has_load_cell: bool) -> Answers:
        names = ("order", "sensitivity", "reference_percent", "level", "load")
        return {name: getattr(self, name) for name in names}

    def skips(self, page: Page) -> bool:
        return self.no_loads

    def from_files(self, floor: Path | None, tile: str) -> FileMeasurement:
        return FileMeasurement(named_tile(floor, tile), lambda profile: self._analyse_files())

    def _analyse_files(self) -> Result:
        from underfoot.calibration.files.recordings import measure_files
        from underfoot.calibration.results.response import result_of
        from underfoot.calibration.science.response import ResponseMeasurements

        assert self.sweep is not None
        assert self.recorded is not None
        found, rate_hz = measure_files(self.sweep, self.recorded, self.channel)
        try:
            sensitivity = self.sensitivity or 1.0
            measured = ResponseMeasurements(
                {self.load: found},
                sensitivity,
                rate_hz,
                self.order,
                load=self.load,
                reference_percent=self.reference_percent,
            )
            result = result_of(measured)
        except BadValue as error:
            raise BadFile(f"{self.sweep} and {self.recorded}: {error}") from None
        if self.sensitivity is None:
            unknown = "no --sensitivity was given: recorded samples count as m/s^2"
            result = replace(result, warnings=(*result.warnings, unknown))
        return result


class ResponseProcedure(Procedure):
    """Frequency response and equaliser of one tile, at `rate_hz`.

    The noise floor, sweeps with nothing on the tile, with a person standing on it and with a foot on a corner, tones at
    300 Hz of rising level, and a sweep through the equaliser designed from these, under the load that it is for.
    Recordings of a rig are in full scale; the first page asks for the sensitivity in m/s^2, of which it suggests the
    given one, and for that load.

    >>> from underfoot.floor.layout import default_floor
    >>> ResponseProcedure(default_floor().tiles[0]).page.key
    'setup'
    """

    def __init__(self, tile: Tile, rate_hz: int = RATE_HZ, sensitivity: float = SENSITIVITY) -> None:
        self._tile, self._rate_hz = tile, rate_hz
        self._settings: Answers = {}
        self._noise: float | None = None
        self._noise_drawn: tuple[Drawing, ...] = ()
        self._measured: dict[str, SweepMeasurement] = {}
        self._tones: DistortionOverLevel | None = None
        self._equalised_sweeps: tuple[Floats, float] | None = None
        instruction = (
            f"Tile {tile.id}: fix the accelerometer on the plate, halfway from its middle to an edge, and plug it "
            "into the input. Nobody stands on the tile."
        )
        super().__init__(Page("setup", "Vibration", instruction, questions=_setup_questions(sensitivity)))

    def plan(self, answers: Answers) -> list[Step]:
        """Return the sounds, and for each load a page to get into place."""
        from underfoot.calibration.science.sweep import exponential, train
        from underfoot.calibration.science.tones import TONE_HZ, tone_series
        from underfoot.models.filtering.equaliser import MOST_ORDER

        if answers["order"] % 2:
            raise BadValue(f"order is {answers['order']}; allowed: even numbers 2 to {MOST_ORDER}")
        self._settings = answers
        one = exponential(*SWEEP_HZ, answers["sweep_s"], self._rate_hz, answers["level"])
        swept = train(one, answers["passes"], self._rate_hz, _GAP_S)
        silence = np.zeros(round(_QUIET_S * self._rate_hz))
        tones = tone_series(answers["level"], self._rate_hz, _GAP_S)
        tones_page = f"Stand clear. Tones at {TONE_HZ:g} Hz are played, each louder than the one before."
        return [
            self._sound("quiet", "Noise floor", "Stand clear. One second of silence is recorded.", silence),
            self._sound("none", "Nothing on it", "Stand clear. The tile plays sweeps.", swept),
            *self._loaded("standing", swept),
            *self._loaded("corner", swept),
            Step(Page("leave", "Step off", "Step off the tile, and continue.")),
            self._sound("tones", "Distortion", tones_page, tones),
            *self._once_more(swept),
        ]

    @property
    def page(self) -> Page:
        """Return the present page; the last sweeps are known only with the equaliser."""
        page = super().page
        if page.key != "again" or page.sound is None:
            return page
        return replace(page, sound=replace(page.sound, signal=self._equalised()[0]))

    @property
    def drawings(self) -> tuple[Drawing, ...]:
        """Return the responses so far, or the noise before there are any."""
        from underfoot.calibration.results.response import loads_drawn

        loads = self._loads()
        return (loads_drawn(loads, self._settings["sensitivity"]),) if loads else self._noise_drawn

    def back(self) -> None:
        """Return to the previous page, and discard the data taken since."""
        super().back()
        for step in self._steps[self._at :]:
            self._measured.pop(step.page.key, None)
            if step.page.key == "quiet":
                self._noise_drawn = ()
        self._equalised_sweeps = None

    def conclude(self) -> Result:
        """Return equaliser, distortion and verdict."""
        from underfoot.calibration.results.response import result_of
        from underfoot.calibration.science.response import ResponseMeasurements

        assert self._noise is not None
        return result_of(
            ResponseMeasurements(
                self._loads(),
                self._settings["sensitivity"],
                self._rate_hz,
                self._settings["order"],
                tones=self._tones,
                again=self._measured["again"],
                noise=self._noise,
                load=self._settings["load"],
                reference_percent=self._settings["reference_percent"],
            ),
            self._tile.id,
        )

    def without_conclusion(self, reason: str) -> Result | None:
        """Return the responses so far."""
        from underfoot.calibration.results.response import inconclusive

        if not self._measured:
            return None
        sensitivity, tile = self._settings["sensitivity"], self._tile.id
        return inconclusive(self._measured, sensitivity, self._tones, reason, self.drawings, tile)

    def _sound(self, key: str, title: str, instruction: str, signal: Floats) -> Step:
        return self._sounding(Page(key, title, instruction, sound=Sound(signal, self._rate_hz, "none")), key)

    def _sounding(self, page: Page, group: str) -> Step:
        return Step(page, group=group, hear=partial(self._hear, page.key))

    def _loaded(self, load: str, signal: Floats) -> list[Step]:
        """Return a page to get into place, and the sweeps; both can be skipped, unless the equaliser is for this load.

        One person alone may have to.
        """
        title, instruction = _PLACES[load]
        may_skip = load != self._settings["load"]
        place = Page(f"{load}-place", title, f"{instruction} Then continue.", may_skip=may_skip)
        sound = Sound(signal, self._rate_hz, load)
        sounding = Page(load, title, "Stand still. The tile plays sweeps.", sound=sound, may_skip=may_skip)
        return [Step(place, group=load), self._sounding(sounding, load)]

    def _once_more(self, signal: Floats) -> list[Step]:
        """Return the sweeps through the equaliser, under its load, and a page to get into place for them."""
        load = self._settings["load"]
        stand = "Stand clear." if load == "none" else "Stand still."
        sound = Sound(signal, self._rate_hz, load)
        again = Page("again", "Once more", f"{stand} The sweeps are played through the equaliser.", sound=sound)
        steps = [self._sounding(again, "again")]
        if load == "none":
            return steps
        return [Step(Page(f"{load}-place", "Once more", f"{_PLACES[load][1]} Then continue."), group="again"), *steps]

    def _hear(self, key: str, played: Floats, recording: Floats) -> None:
        """Evaluate the recording of a page."""
        from underfoot.calibration.science.recording_checks import (
            require_noise,
            require_not_clipped,
            require_not_silent,
        )
        from underfoot.calibration.science.tones import distortion_over_level
        from underfoot.calibration.science.transfer_function import measure

        match key:
            case "quiet":
                from underfoot.calibration.results.response import noise_drawn

                require_noise(recording)
                require_not_clipped(recording)
                self._noise = _noise_floor(recording)
                self._noise_drawn = (noise_drawn(recording, self._rate_hz, self._settings["sensitivity"]),)
            case "tones":
                require_not_silent(recording)
                require_not_clipped(recording)
                begins_s = self._measured["none"].latency_s + _GAP_S
                level, sensitivity = self._settings["level"], self._settings["sensitivity"]
                self._tones = distortion_over_level(recording, level, self._rate_hz, begins_s, sensitivity)
            case "again":
                self._measured[key] = measure(self._sweeps(), recording / self._equalised()[1], self._rate_hz)
            case _:
                self._measured[key] = measure(played, recording, self._rate_hz)

    def _loads(self) -> "dict[str, SweepMeasurement]":
        return {load: self._measured[load] for load in LOADS if load in self._measured}

    def _sweeps(self) -> Floats:
        """Return the sweeps as played without the equaliser."""
        sound = next(step.page.sound for step in self._steps if step.page.key == "none")
        assert sound is not None
        return sound.signal

    def _equalised(self) -> tuple[Floats, float]:
        """Return the sweeps through the equaliser, and the factor by which they were attenuated for it."""
        if self._equalised_sweeps is None:
            from underfoot.calibration.science.response import equalise
            from underfoot.models.filtering import equaliser

            basis = self._measured[self._settings["load"]]
            order = self._settings["order"]
            sections = equaliser.design(basis.frequencies_hz, basis.magnitude, self._rate_hz, order)
            filtered = equalise(sections, self._sweeps())
            down = min(1.0, LOUDEST / float(np.abs(filtered).max()))
            self._equalised_sweeps = down * filtered, down
        return self._equalised_sweeps


def _setup_questions(sensitivity: float) -> tuple[Parameter, ...]:
    """Return the parameters of the first page."""
    from underfoot.models.filtering.equaliser import MOST_ORDER

    doc = "Acceleration at which the input is at full scale, by the accelerometer's data sheet."
    load_doc = (
        "What is on the tile where the equaliser is to be flat: nobody, a person in its middle, or a foot on a corner."
    )
    return (
        ask(
            "sensitivity",
            Number(sensitivity, 1e-3, 1e6, unit="m/s^2", scale="log", label="Full scale of the input", doc=doc),
        ),
        OF_ACCELERATION,
        ask(
            "order",
            Count(14, low=2, high=MOST_ORDER, label="Order of the equaliser", doc="Order of the equaliser, even."),
        ),
        ask("level", Number(0.25, 0.01, LOUDEST, unit="of full scale", doc="How loud to play.")),
        ask("sweep_s", Number(4.0, 0.5, 30.0, unit="s", label="Length of a sweep", doc="From 10 Hz to 2 kHz.")),
        ask("passes", Count(3, low=1, high=20, label="Sweeps for each load", doc="How often it is played.")),
        ask("load", Choice("none", label="Load that the equaliser is for", options=LOADS, doc=load_doc)),
    )


def _noise_floor(recording: Floats) -> float:
    """Return the RMS of recorded silence, in full scale."""
    noise = float(np.std(recording))
    if noise > _LOUD_NOISE:
        raise BadMeasurement(
            f"silence is recorded at {noise:.2g} of full scale: hum, or another signal, on this input?"
        )
    return noise
