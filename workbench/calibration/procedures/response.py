"""The wizard of section 4.5: sweeps through the shaker, heard by an accelerometer, and an equaliser, measured again."""

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from underfoot.calibration.procedures.pressing import Step, Wizard
from underfoot.calibration.procedures.procedure import Page, Refused, Result, Sound, ask
from underfoot.calibration.science import sweep
from underfoot.calibration.science.response import TONE_HZ, Findings, Tones, loads_drawn, result_of
from underfoot.calibration.science.sweep import Measured
from underfoot.clock import RATE_HZ
from underfoot.drawing import Drawing
from underfoot.errors import BadValue
from underfoot.floor.layout import Tile
from underfoot.models.filtering import cascade, equaliser
from underfoot.parameters import Count, Number

Array = NDArray[np.float64]

LOUDEST = 0.45
"""The highest peak that is played: its mean square stays under the limit of the safety stage."""
SENSITIVITY = 100.0
"""m/s^2 a full-scale input, unless said otherwise: the simulated accelerometer's range."""
SWEEP_HZ = (10.0, 2000.0)

_QUIET_S, _GAP_S = 1.0, 0.6
_TONE_S, _TONE_GAP_S = 0.5, 0.2
_TONE_DB = tuple(range(-30, 1, 3))
_LOUD_NOISE = 0.05


class FrequencyResponse(Wizard):
    """Frequency response and equaliser of one tile, at `rate_hz`.

    The noise floor, sweeps with nothing on the tile, with somebody standing on it and with a foot on a corner, tones at
    300 Hz of rising level, and the sweep once more through the equaliser that was designed meanwhile. What a bench
    records is of full scale; what that is in m/s^2, the first page asks.

    >>> from underfoot.floor.layout import default_floor
    >>> FrequencyResponse(default_floor().tiles[0]).page.key
    'setup'
    """

    kind = "response"
    title = "Frequency response and equaliser"

    def __init__(self, tile: Tile, rate_hz: int = RATE_HZ) -> None:
        self._rate = rate_hz
        self._answered: dict[str, Any] = {}
        self._heard: dict[str, Any] = {}
        self._through: tuple[Array, float] | None = None
        super().__init__(
            Page(
                "setup",
                "Frequency response",
                f"Tile {tile.id}: fix the accelerometer on the plate, halfway from its middle to an edge, and plug it "
                "into the input. Nobody stands on the tile.",
                asks=(
                    ask(
                        "sensitivity",
                        Number(
                            SENSITIVITY,
                            1e-3,
                            1e6,
                            unit="m/s^2",
                            scale="log",
                            doc="Acceleration at which the input is at full scale, by the accelerometer's data sheet.",
                        ),
                    ),
                    ask("order", Count(14, low=2, high=equaliser.MOST_ORDER, doc="Order of the equaliser, even.")),
                    ask("level", Number(0.25, 0.01, LOUDEST, unit="of full scale", doc="How loud to play.")),
                    ask("sweep_s", Number(4.0, 0.5, 30.0, unit="s", doc="Length of a sweep.")),
                    ask("passes", Count(3, low=1, high=20, doc="Sweeps for each load.")),
                ),
            )
        )

    def plan(self, answers: dict[str, Any]) -> list[Step]:
        if answers["order"] % 2:
            raise BadValue(f"order is {answers['order']}; allowed: even numbers 2 to {equaliser.MOST_ORDER}")
        self._answered = answers
        one = sweep.exponential(*SWEEP_HZ, answers["sweep_s"], self._rate, answers["level"])
        swept = sweep.train(one, answers["passes"], self._rate, _GAP_S)
        silence, tones = np.zeros(round(_QUIET_S * self._rate)), _tones(answers["level"], self._rate)
        return [
            self._sound("quiet", "Noise floor", "Stand clear. One second of silence is recorded.", silence),
            self._sound("none", "Nothing on it", "Stand clear. The tile plays sweeps.", swept),
            *self._loaded("standing", "Stand on it", "Stand still in the middle of the tile on one foot.", swept),
            *self._loaded("corner", "A foot on a corner", "Put one foot on a corner, half your weight on it.", swept),
            Step(Page("leave", "Step off", "Leave the tile, and go on.")),
            self._sound("tones", "Distortion", f"Stand clear. Tones at {TONE_HZ:g} Hz get louder.", tones),
            self._sound("again", "Once more", "Stand clear. The sweeps go through the equaliser.", swept),
        ]

    @property
    def page(self) -> Page:
        page = super().page
        if page.key != "again" or page.sound is None:
            return page
        return replace(page, sound=replace(page.sound, signal=self._equalised()[0]))

    @property
    def drawings(self) -> tuple[Drawing, ...]:
        if self._result is not None:
            return self._result.drawings
        loads = self._loads()
        return (loads_drawn(loads, self._answered["sensitivity"]),) if loads else ()

    def answer(self, values: Mapping[str, Any]) -> None:
        if self.page.sound is not None:
            raise BadValue(f"{self.page.title}: this page takes a recording, not an answer")
        super().answer(values)

    def hear(self, recorded: NDArray[np.float64]) -> None:
        page = self.page
        if page.sound is None:
            raise BadValue(f"{page.title}: this page takes no recording")
        heard = np.asarray(recorded, dtype=np.float64)
        if heard.ndim != 1 or not np.isfinite(heard).all():
            raise Refused(f"{page.title}: the recording is not one channel of finite samples")
        if heard.size < page.sound.signal.size:
            raise Refused(
                f"{page.title}: the recording lasts {heard.size / self._rate:.2f} s, "
                f"the sound {page.sound.signal.size / self._rate:.2f} s"
            )
        self._heard[page.key] = self._taken_from(page.key, page.sound.signal, heard)
        self._go_on()

    def back(self) -> None:
        super().back()
        keys = [step.page.key for step in self._steps]
        for later in keys[self._at :]:
            self._heard.pop(later, None)
        self._through = None

    def concluded(self) -> Result:
        loads = self._loads()
        return result_of(
            Findings(
                loads,
                self._answered["sensitivity"],
                self._rate,
                self._answered["order"],
                tones=self._heard["tones"],
                again=self._heard["again"],
                noise=self._heard["quiet"],
            )
        )

    def _sound(self, key: str, title: str, do: str, signal: Array) -> Step:
        return Step(Page(key, title, do, sound=Sound(signal, self._rate, "none")), tags={"group": key})

    def _loaded(self, load: str, title: str, do: str, signal: Array) -> list[Step]:
        """A page to get into place, and the sweeps; who is alone, or has no such load, leaves both out."""
        place = Page(f"{load}-place", title, f"{do} Then go on.", may_skip=True)
        sound = Sound(signal, self._rate, load)
        sounding = Page(load, title, "Stand still. The tile plays sweeps.", sound=sound, may_skip=True)
        return [Step(page, tags={"group": load}) for page in (place, sounding)]

    def _taken_from(self, key: str, played: Array, heard: Array) -> Any:
        if key == "quiet":
            sweep.refuse_clipping(heard)
            noise = float(np.std(heard))
            if noise > _LOUD_NOISE:
                raise Refused(
                    f"silence is recorded at {noise:.2g} of full scale: hum, or another signal, on this input?"
                )
            return noise
        if key == "tones":
            sweep.refuse_silence(heard)
            sweep.refuse_clipping(heard)
            return self._over_level(heard)
        if key == "again":
            plain = self._steps_sound("none")
            return sweep.measure(plain, heard / self._equalised()[1], self._rate)
        return sweep.measure(played, heard, self._rate)

    def _steps_sound(self, key: str) -> Array:
        sound = next(step.page.sound for step in self._steps if step.page.key == key)
        assert sound is not None
        return sound.signal

    def _loads(self) -> dict[str, Measured]:
        return {load: self._heard[load] for load in ("none", "standing", "corner") if load in self._heard}

    def _equalised(self) -> tuple[Array, float]:
        """The sweeps through the equaliser, and how much they had to be turned down for it."""
        if self._through is None:
            free = self._heard["none"]
            sections = equaliser.design(free.frequencies_hz, free.magnitude, self._rate, self._answered["order"])
            filtered = through(sections, self._steps_sound("none"))
            down = min(1.0, LOUDEST / float(np.abs(filtered).max()))
            self._through = down * filtered, down
        return self._through

    def _over_level(self, heard: Array) -> Tones:
        late = self._heard["none"].latency_s
        drive, acceleration, thd = [], [], []
        for k, db in enumerate(_TONE_DB):
            # The middle of each tone, when it rings evenly.
            begin = round((late + _GAP_S + k * (_TONE_S + _TONE_GAP_S) + 0.4 * _TONE_S) * self._rate)
            amplitudes = sweep.harmonics(heard[begin : begin + round(0.5 * _TONE_S * self._rate)], TONE_HZ, self._rate)
            drive.append(self._answered["level"] * 10.0 ** (db / 20.0))
            acceleration.append(self._answered["sensitivity"] * amplitudes[0])
            thd.append(math.sqrt(float(np.sum(amplitudes[1:] ** 2))) / max(float(amplitudes[0]), 1e-300))
        return Tones(np.array(drive), np.array(acceleration), np.array(thd))


def through(sections: Array, signal: Array) -> Array:
    """A signal after an equaliser.

    >>> through(np.array([[0.5, 0.0, 0.0, 1.0, 0.0, 0.0]]), np.ones(2))
    array([0.5, 0.5])
    """
    out = np.zeros(signal.size)
    cascade.run(np.zeros(cascade.STATE), cascade.tuning(sections), np.ascontiguousarray(signal), out, signal.size)
    return out


def _tones(level: float, rate_hz: float) -> Array:
    """Tones of rising level, each faded in and out, with silence before, between and behind."""
    frames, gap = round(_TONE_S * rate_hz), np.zeros(round(_TONE_GAP_S * rate_hz))
    time_s = np.arange(frames) / rate_hz
    fade = np.clip(np.minimum(time_s, time_s[::-1]) / 0.05, 0.0, 1.0)
    tone = np.sin(2.0 * math.pi * TONE_HZ * time_s) * 0.5 * (1.0 - np.cos(math.pi * fade))
    parts = [np.zeros(round(_GAP_S * rate_hz))]
    for db in _TONE_DB:
        parts += [level * 10.0 ** (db / 20.0) * tone, gap]
    return np.concatenate(parts)
