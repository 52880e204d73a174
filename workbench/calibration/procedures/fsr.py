"""Calibration of forces (section 4.3.2): sensor after sensor, rising, falling and held loads against a reference."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial, reduce
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from underfoot.calibration.declaration import PRESSING, Calibration, FileMeasurement, MeasurementSetup
from underfoot.calibration.files.measurements import LARGEST_READING, Pairs, read_pairs
from underfoot.calibration.procedure import EMPTY_TILE, Answers, Page, PageProgress, Procedure, Step
from underfoot.calibration.reference import OF_FORCE, require_given, uncertain_by
from underfoot.calibration.result import Result
from underfoot.calibration.rig import PressRequest, Readings
from underfoot.drawing import Drawing
from underfoot.errors import BadFile, BadMeasurement, BadValue
from underfoot.floor.profile_parts import PARTS
from underfoot.kernels import Floats
from underfoot.options import option
from underfoot.parameters import Choice, Count, Number, Numbers, Parameter, ask

if TYPE_CHECKING:
    from underfoot.calibration.science.foot_check import FootCheck
    from underfoot.calibration.science.linearisation import Linearisation, VoltageDivider
    from underfoot.floor.layout import Tile
    from underfoot.floor.profile import Profile

REFERENCES = LOAD_CELL, KNOWN_WEIGHTS = "load cell", "known weights"
DEFAULT_FULL_N = 600.0
_TARE_S, _STEADY_S = 1.0, 1.0
_UNSTEADY_S = 20.0
"""Time after which a weight that has not come to rest is given up."""
_ZERO = 5e-4
"""Share of full scale by which an unloaded load cell is off its zero, and not only noisy."""
_STILL_ON, _NOISE_COUNTS = 0.85, 100.0
"""Share of a weight's change of reading that is left only while it is there, and not by creep (half); and no change."""
_DRIFTS, _LEAST_DRIFT = 5.0, 2.0
"""Drift of an empty sensor from its tare to its first weight, over that from half to half of the tare; least counts."""
_SHARE_ROUNDS, _SHARE_STEP = 8, 0.02
"""Fits, at most, until the shares that other sensors carry change by no more than this."""
_HOLD_SHARE = 0.6
"""Load of a hold, as a share of full scale."""
_FOOT = "foot"
"""Group of the step that checks the force of a foot."""


@dataclass(frozen=True)
class FsrCalibration(Calibration):
    """Calibration of forces, and the options of its command."""

    kind = "fsr"
    name = PARTS[kind]
    title = "Forces: readings to newtons"
    about = (
        "Each sensor is loaded with known forces, rising and falling, and one force is held for a while. The result "
        "turns its readings into newtons. The reference is a load cell, or known weights that are typed in. With a "
        "load cell, a load in the middle then shows how far the force of a foot is off."
    )
    summary = "Linearise force sensing resistors against a reference."
    rig = PRESSING
    file_options = ("pairs",)

    pairs: Path | None = option("CSV of readings with reference forces: time_s,tile,sensor,reading,force_n.", None)
    reference_percent: float | None = option(OF_FORCE.doc, None)
    divider_ohm: float | None = option("Resistor in series with a sensor; also tries the curve R = Rs/F + R0.", None)
    divider_falling: bool = option("The reading falls with force.", False)
    without: tuple[int, ...] = option("Sensor to leave out on a target, 1 to 4, as it gives no signal; repeatable.", ())

    def check(self, target: str) -> None:
        super().check(target)
        if self.divider_ohm is not None and not self.divider_ohm > 0.0:
            raise BadValue(f"--divider-ohm is {self.divider_ohm:g}; allowed: above 0")
        require_given(OF_FORCE, self.reference_percent)
        if wrong := set(self.without) - {1, 2, 3, 4}:
            raise BadValue(f"--without is {min(wrong)}; allowed: a sensor, 1 to 4")

    def procedure(self, setup: MeasurementSetup) -> "FsrProcedure":
        suggested = LOAD_CELL if setup.has_load_cell else KNOWN_WEIGHTS
        return FsrProcedure(setup.tile, self._divider(), suggested, setup.sensors[0])

    def answers(self, has_load_cell: bool) -> Answers:
        if not has_load_cell:
            raise BadValue("--cell is missing; allowed: a load cell, as 9.1:0.05:120; weights are typed in the window")
        return {"reference": LOAD_CELL, "reference_percent": self.reference_percent}

    def skips(self, page: Page) -> bool:
        return page.press is not None and page.press.sensor is not None and page.press.sensor + 1 in self.without

    def from_files(self, floor: Path | None, tile: str) -> FileMeasurement:
        from underfoot.calibration.results.fsr import result_of
        from underfoot.calibration.science.linearisation import linearise

        assert self.pairs is not None
        path, pairs = self.pairs, read_pairs(self.pairs, tile)

        def analyse(profile: "Profile") -> Result:
            try:
                reference = f"pairs of {path.name}{uncertain_by(self.reference_percent, '% of full scale')}"
                return result_of(linearise(pairs, self._divider()), reference)
            except BadValue as error:
                raise BadFile(f"{path}: {error}") from None

        return FileMeasurement(pairs.tile, analyse)

    def _divider(self) -> "VoltageDivider | None":
        from underfoot.calibration.science.linearisation import VoltageDivider

        return None if self.divider_ohm is None else VoltageDivider(self.divider_ohm, falling=self.divider_falling)


@dataclass(frozen=True)
class SensorStep(Step):
    """Step that loads one sensor; `planned_n` is the suggested weight, None with a load cell."""

    sensor: int = 0
    rising: bool = False
    planned_n: float | None = None

    @property
    def is_tare(self) -> bool:
        """Whether nothing lies on the sensor."""
        return self.page.key.endswith("-tare")


class FsrProcedure(Procedure):
    """FSR linearisation of one tile.

    With a load cell (`Readings.force_n`): tare, loadings up and down, and a hold, for each sensor. With known weights:
    each is typed in, put on and waited for, up and down again. The result has the figures of
    `results.fsr.quantities_of`. The first page suggests the `reference`; in the profile a load cell is called `cell`.
    """

    def __init__(
        self, tile: "Tile", divider: "VoltageDivider | None" = None, reference: str = LOAD_CELL, cell: str = LOAD_CELL
    ) -> None:
        self._tile, self._divider, self._cell = tile, divider, cell
        self._reference, self._full_n, self._reference_percent = reference, DEFAULT_FULL_N, OF_FORCE.default
        instruction = f"Tile {tile.id}: choose the reference for the force. Load one sensor at a time."
        super().__init__(Page("setup", "Forces", instruction, questions=_setup_questions(reference)))

    def plan(self, answers: Answers) -> list[Step]:
        """Return the steps of all sensors, with a load cell or with known weights."""
        self._reference, self._reference_percent = answers["reference"], answers["reference_percent"]
        if self._reference == LOAD_CELL:
            self._full_n = answers["full_scale_n"]
            sensors = [self._by_load_cell(j, answers["loadings"], answers["hold_s"]) for j in range(4)]
            return [*(step for steps in sensors for step in steps), self._by_foot(answers["hold_s"])]
        weights = answers["weights_n"]
        for one, two in pairwise(weights):
            if two <= one:
                raise BadMeasurement(
                    f"weights out of order: {two:g} N after {one:g} N; allowed: from the lightest to the heaviest"
                )
        self._full_n = max(weights)
        return [step for j in range(4) for step in self._by_weights(j, weights)]

    def check_answers(self, step: Step, answers: Answers) -> None:
        """Refuse a weight that is lighter than the previous one on the way up, or heavier on the way down."""
        if not isinstance(step, SensorStep) or step.planned_n is None:
            return
        before = [given["weight_n"] for _, _, given in self._step_data_of(step.sensor) if "weight_n" in given]
        if not before:
            return
        given, last = answers["weight_n"], before[-1]
        if (given < last and step.rising) or (given > last and not step.rising):
            way = "up" if step.rising else "down"
            raise BadMeasurement(
                f"weights out of order: {given:g} N after {last:g} N on the way {way}; go back if {last:g} N was wrong"
            )

    @property
    def drawings(self) -> tuple[Drawing, ...]:
        """Return the pairs so far."""
        from underfoot.calibration.results.fsr import pairs_drawing

        return pairs_drawing(self._pairs()) if self._step_data else ()

    def conclude(self) -> Result:
        """Fit curves to all pairs, without the share of each load that other sensors carried, by curves of before."""
        from underfoot.calibration.results.fsr import result_of
        from underfoot.calibration.science.foot_check import forces_over_time
        from underfoot.calibration.science.linearisation import linearise
        from underfoot.calibration.science.load_checks import drift_warnings, noise_warnings, share_warnings
        from underfoot.calibration.science.weight_checks import weight_warnings

        if not self._step_data:
            raise BadMeasurement("every sensor was skipped; go back, and load one at least")
        shares = np.zeros(4)
        for _ in range(_SHARE_ROUNDS):
            found = linearise(self._pairs(shares), self._divider, hysteresis=False)
            known, shares = shares, np.array([self._share_of_others(found, j) for j in range(4)])
            if np.abs(shares - known).max() <= _SHARE_STEP:
                break
        found = linearise(self._pairs(shares), self._divider, hysteresis=self._reference == LOAD_CELL)
        over_time_n = forces_over_time(found.curves, [one.readings for one in self.step_data()])
        found = replace(found, foot=self._foot(found, over_time_n[-1]))
        name = self._cell if self._reference == LOAD_CELL else self._reference
        result = result_of(found, name + uncertain_by(self._reference_percent, "% of full scale"))
        tares = {step.sensor: _empty(data).values for step, data, _ in self._step_data_of_sensors() if step.is_tare}
        unloaded_n = {
            one.step.sensor: np.median(newtons[-len(tares[one.step.sensor]) :], axis=0)
            for one, newtons in zip(self.step_data(), over_time_n, strict=True)
            if isinstance(one.step, SensorStep) and one.step.is_tare
        }
        pressed = [
            ("foot", "time_s,r1,r2,r3,r4,force_n", np.column_stack([one.time_s, one.values, self._load_cell(one)]))
            for one in self._pressed_by_foot()
        ]
        drifts, noise = drift_warnings(unloaded_n, found.full_scale_n), noise_warnings(found.curves, tares)
        values = [readings.values for _, readings, _ in self._step_data_of_sensors()]
        odd = weight_warnings(self._pairs(), values) if self._reference == KNOWN_WEIGHTS else ()
        warnings = (*result.warnings, *share_warnings(shares), *drifts, *noise, *odd)
        return replace(result, warnings=warnings, raw=(*result.raw, *pressed))

    def without_conclusion(self, reason: str) -> Result | None:
        """Return the pairs without curves."""
        from underfoot.calibration.results.fsr import inconclusive

        return inconclusive(self._tile.id, self._pairs(), reason, self.drawings) if self._step_data else None

    # --- pages ---

    def _by_load_cell(self, j: int, loadings: int, hold_s: float) -> list[Step]:
        at, full, held = self._tile.sensors_m[j], self._full_n, _HOLD_SHARE * self._full_n
        steps: list[Step] = []

        def add(
            name: str,
            title: str,
            instruction: str,
            force_n: float,
            take: Callable[[Readings], PageProgress | None],
            hold_s: float,
        ) -> None:
            press = PressRequest(at, force_n, hold_s, j)
            page = Page(f"sensor{j + 1}-{name}", f"Sensor {j + 1}: {title}", instruction, press=press, may_skip=True)
            checked = partial(self._checked, j, take) if steps else take  # the tare is the first
            lets_go = name.startswith(("fall", "release"))
            steps.append(SensorStep(page, checked, j, sensor=j, rising=name.startswith("rise"), lets_go=lets_go))

        add("tare", "nothing on it", EMPTY_TILE, 0.0, partial(self._tare, j), _TARE_S)
        for k in range(loadings):
            count = f"{k + 1} of {loadings}"
            rise = f"Put the load cell over sensor {j + 1} and raise the force slowly to {full:.0f} N."
            add(f"rise{k + 1}", f"rising, {count}", rise, full, partial(self._rise, j), 0.0)
            fall = "Lower the force to 0 N, as slowly as you raised it."
            add(f"fall{k + 1}", f"falling, {count}", fall, 0.0, self._fall, 0.0)
        hold = f"Press with {held:.0f} N and hold the force constant for {hold_s:.0f} s."
        add("hold", "hold", hold, held, partial(self._hold, held, hold_s), hold_s)
        add("release", "release", "Take the load off.", 0.0, self._fall, 0.0)
        return steps

    def _by_foot(self, hold_s: float) -> Step:
        """Return a load in the middle, which all sensors bear."""
        instruction = (
            f"Press in the middle of the tile with {self._full_n:.0f} N, through the load cell, and hold the force "
            f"constant for {hold_s:.0f} s. This shows how far the force of a foot is off, which is the sum of all four."
        )
        press = PressRequest((0.0, 0.0), self._full_n, hold_s)
        page = Page("foot-hold", "All sensors: a load in the middle", instruction, press=press, may_skip=True)
        return Step(page, partial(self._press_middle, hold_s), _FOOT, needs_all=True)

    def _by_weights(self, j: int, weights: Sequence[float]) -> list[Step]:
        at, empty = self._tile.sensors_m[j], PressRequest(self._tile.sensors_m[j], 0.0, _TARE_S, j)
        tare = Page(f"sensor{j + 1}-tare", f"Sensor {j + 1}: nothing on it", EMPTY_TILE, press=empty, may_skip=True)
        steps: list[Step] = [SensorStep(tare, partial(self._tare, j), j, sensor=j, rising=True)]
        for k, weight in enumerate([*weights, *weights[-2::-1]]):
            rising = k < len(weights)
            page = Page(
                f"sensor{j + 1}-weight{k + 1}",
                f"Sensor {j + 1}: weight {k + 1}, {'rising' if rising else 'falling'}",
                f"Put a known weight over sensor {j + 1}, let go of it, and type how heavy it is.",
                questions=(ask("weight_n", Number(weight, 0.0, 5000.0, unit="N", doc="In newtons, or as 5 kg.")),),
                press=PressRequest(at, weight, _STEADY_S, j),
                may_skip=True,
            )
            steps.append(SensorStep(page, partial(self._weigh, j), j, sensor=j, rising=rising, planned_n=weight))
        return steps

    # --- data of each page ---

    def _tare(self, j: int, readings: Readings) -> PageProgress | None:
        seen = readings.last(_TARE_S)
        if seen is None:
            return PageProgress("Stand clear.", np.ptp(readings.time_s) / _TARE_S)
        if seen.trend(j) > 0.02 * LARGEST_READING:
            return PageProgress("The reading changes; stand clear.", 0.5, (("reading", float(seen.values[-1, j]), ""),))
        if seen.force_n is not None and abs(float(np.median(seen.force_n))) > 0.01 * self._full_n:
            return PageProgress(
                "The load cell is loaded; take it off.", 0.5, (("force", float(seen.force_n[-1]), "N"),)
            )
        weighed = [step.sensor for step, _, given in self._step_data_of_sensors() if given.get("weight_n", 0.0) > 0.0]
        if weighed:
            last = weighed[-1]
            change = abs(float(np.median(seen.values[:, last])) - float(self._rest_readings()[last]))
            if change > max(_STILL_ON * self._weights(last)[-1][0], _NOISE_COUNTS):
                return PageProgress(f"The weight over sensor {last + 1} is still on it; take it off.", 0.5)
        return None

    def _checked(
        self, j: int, take: Callable[[Readings], PageProgress | None], readings: Readings
    ) -> PageProgress | None:
        """Take a page's measurement as `take` does; refuse it at once if the load cell cannot be right."""
        from underfoot.calibration.science.load_checks import require_cell

        progress = take(readings)
        if progress is None:
            require_cell(j, readings.values[:, j], self._load_cell(readings), self._full_n)
        return progress

    def _rise(self, j: int, readings: Readings) -> PageProgress | None:
        from underfoot.calibration.science.load_checks import require_response, require_within_scale
        from underfoot.calibration.science.load_progress import rise_progress

        force = self._load_cell(readings)
        require_within_scale(force, self._full_n)
        require_response(j, self._rest_readings(), readings.values, force, self._full_n)
        return rise_progress(readings.time_s, force, float(readings.values[-1, j]), self._full_n)

    def _fall(self, readings: Readings) -> PageProgress | None:
        from underfoot.calibration.science.load_progress import fall_progress

        return fall_progress(readings.time_s, self._load_cell(readings), self._full_n)

    def _hold(self, held: float, hold_s: float, readings: Readings) -> PageProgress | None:
        from underfoot.calibration.science.load_progress import hold_progress

        return hold_progress(readings.time_s, self._load_cell(readings), held, hold_s)

    def _press_middle(self, hold_s: float, readings: Readings) -> PageProgress | None:
        from underfoot.calibration.science.foot_check import require_shared
        from underfoot.calibration.science.load_checks import require_within_scale

        require_within_scale(self._load_cell(readings), self._full_n)
        progress = self._hold(self._full_n, hold_s, readings)
        if progress is None:
            require_shared(np.abs(readings.values[-1] - self._rest_readings()))
        return progress

    def _weigh(self, j: int, readings: Readings) -> PageProgress | None:
        from underfoot.calibration.science.load_checks import require_weight

        shown = (("reading", float(readings.values[-1, j]), ""),)
        seen = readings.last(2.0 * _STEADY_S)
        if seen is None:
            ready = float(np.ptp(readings.time_s)) / (2.0 * _STEADY_S)
            return PageProgress("Wait until the reading is steady.", ready, shown)
        moves = seen.trend(j)
        rest, medians = self._rest_readings(), np.median(seen.values, axis=0)
        change = abs(float(medians[j] - rest[j]))
        if moves > 0.03 * change + 40.0:
            if np.ptp(readings.time_s) > _UNSTEADY_S:
                raise BadMeasurement(
                    f"the load is not steady: the reading changes by {moves:.0f} counts; let go of the weight"
                )
            return PageProgress("The reading changes; wait until it is steady.", 0.5, shown)
        given, weights = float(self._answers[self._at]["weight_n"]), self._weights(j)
        before = weights[-1] if weights else (self._drift(j), 0.0)
        ways = [np.sign(sum(moved for moved, _ in self._moved(k))) for k in range(4)]
        require_weight(j, given, medians, rest, self._full_n, before, self._apparent_load_n(j, change), ways)
        return None

    def _load_cell(self, readings: Readings) -> Floats:
        if readings.force_n is None:
            raise BadMeasurement("there is no load cell among the readings; choose known weights as the reference")
        return readings.force_n

    def _apparent_load_n(self, j: int, change: float) -> float | None:
        """Return the load that a change of reading suggests, by the sensor's weights so far, else by another's."""
        from underfoot.calibration.science.load_checks import apparent_load_n

        sensors = [j, *(k for k in range(4) if k != j)]
        weights = next((found for k in sensors if len(found := self._weights(k)) >= 3), None)
        return None if weights is None else apparent_load_n(change, weights)

    # --- evaluation ---

    def _step_data_of(self, j: int) -> list[tuple[SensorStep, Readings, Answers]]:
        """Return the data that the steps of a sensor have taken so far, in order."""
        return [one for one in self._step_data_of_sensors() if one[0].sensor == j]

    def _step_data_of_sensors(self) -> list[tuple[SensorStep, Readings, Answers]]:
        return [(step, readings, given) for step, readings, given in self.step_data() if isinstance(step, SensorStep)]

    def _weights(self, j: int) -> list[tuple[float, float]]:
        """Return change of reading and newtons of the weights that a sensor has carried."""
        return [(abs(moved), weight_n) for moved, weight_n in self._moved(j) if moved != 0.0]

    def _moved(self, j: int) -> list[tuple[float, float]]:
        """Return how far each weight has moved the sensor's reading, up or down, and its newtons."""
        rest = float(self._rest_readings()[j])
        return [
            (_steady_reading(readings, j) - rest, float(answers["weight_n"]))
            for _, readings, answers in self._step_data_of(j)
            if answers.get("weight_n", 0.0) > 0.0
        ]

    def _rest_readings(self) -> Floats:
        """Return the readings (4,) at the latest tare; NaN before the first."""
        tares = [readings for step, readings, _ in self._step_data_of_sensors() if step.is_tare]
        return np.asarray(np.median(_empty(tares[-1]).values, axis=0)) if tares else np.full(4, np.nan)

    def _drift(self, j: int) -> float:
        """Return by how much the reading of an empty sensor may move until its first weight, by what it did before."""
        tare = next(readings for step, readings, _ in self._step_data_of(j) if step.is_tare)
        halves = np.array_split(_empty(tare).values[:, j], 2)
        return max(_DRIFTS * abs(float(np.median(halves[1]) - np.median(halves[0]))), _LEAST_DRIFT)

    def _pairs(self, shares: Sequence[float] | Floats = (0.0, 0.0, 0.0, 0.0)) -> Pairs:
        """Return all pairs of readings and reference, one per sample, or per weight.

        Of a load over a sensor the others carry its share of `shares` (4,), which is subtracted from the reference.
        """
        columns: list[tuple[Floats, Floats, Floats, Floats]] = []
        zero_n = 0.0
        for step, readings, answers in self._step_data_of_sensors():
            j = step.sensor
            if step.is_tare:
                zero_n = self._zero_n(readings, zero_n)
            if self._reference != LOAD_CELL:
                time_s, value = readings.time_s[-1:], np.array([_steady_reading(readings, j)])
                force = np.array([float(answers.get("weight_n", 0.0)) * (1.0 - shares[j])])
            elif step.is_tare:
                seen = _empty(readings)
                time_s, value, force = seen.time_s, seen.values[:, j], np.zeros(seen.time_s.size)
            else:
                time_s, value = readings.time_s, readings.values[:, j]
                force = (self._load_cell(readings) - zero_n) * (1.0 - shares[j])
            columns.append((time_s, np.full(time_s.size, j), value, force))
        return Pairs(self._tile.id, *(np.concatenate(one) for one in zip(*columns, strict=True)))

    def _zero_n(self, tare: Readings, known_n: float) -> float:
        """Return the force that the unloaded load cell gives, 0 if that is noise; the known one where it changes.

        It then is the end of the load before.
        """
        force = _empty(tare).force_n
        if force is None:
            return known_n
        before, zero_n = (float(np.median(part)) for part in np.array_split(force[force.size // 2 :], 2))
        if abs(zero_n - before) > _ZERO * self._full_n:
            return known_n
        return zero_n if abs(zero_n) > _ZERO * self._full_n else 0.0

    def _pressed_by_foot(self) -> list[Readings]:
        return [data.readings for data in self.step_data() if data.step.group == _FOOT]

    def _foot(self, found: "Linearisation", over_time_n: Floats) -> "FootCheck | None":
        """Return how far the sum of all sensors (n, 4) was off in the middle, the last page; None if it was skipped."""
        from underfoot.calibration.science.foot_check import check_foot

        pressed = self._pressed_by_foot()
        if not pressed or len(found.calibrated) < 4:
            return None
        tare = next(readings for step, readings, _ in reversed(self._step_data_of_sensors()) if step.is_tare)
        force_n = self._load_cell(pressed[0]) - self._zero_n(tare, 0.0)
        return check_foot(found.curves, found.full_scale_n, over_time_n, force_n, self._reference_percent)

    def _share_of_others(self, found: "Linearisation", j: int) -> float:
        """Return the share of the loads over sensor `j` that the other sensors carry, by the curves `found`."""
        from underfoot.calibration.science.load_checks import share_of_others

        loaded = [(readings, given) for step, readings, given in self._step_data_of(j) if not step.is_tare]
        if not loaded:
            return 0.0
        if self._reference != LOAD_CELL:
            steady = [(readings.last(_STEADY_S) or readings, given["weight_n"]) for readings, given in loaded]
            loaded = [(replace(seen, force_n=np.full(seen.time_s.size, n)), {}) for seen, n in steady]
        seen = reduce(Readings.followed_by, (readings for readings, _ in loaded))
        return share_of_others(found.curves, j, seen.time_s[::10], seen.values[::10], self._load_cell(seen)[::10])


def _setup_questions(reference: str) -> tuple[Parameter, ...]:
    """Return the parameters of the first page."""
    weights = (25.0, 50.0, 100.0, 200.0, 300.0, 450.0, 600.0)
    doc = "Known weights, from the lightest to the heaviest, in newtons or as 5 kg."
    compared = "What the sensors are compared with. Weights show no creep, so that footsteps read less than they are."
    full = Number(DEFAULT_FULL_N, 5.0, 5000.0, unit="N", scale="log", doc="Largest force, with a load cell.")
    often = "How often each sensor is loaded, with a load cell."
    return (
        ask("reference", Choice(reference, options=REFERENCES, doc=compared)),
        OF_FORCE,
        ask("full_scale_n", full),
        ask("loadings", Count(3, low=1, high=20, label="Loadings of each sensor", doc=often)),
        ask("hold_s", Number(10.0, 2.0, 100.0, unit="s", doc="How long a force is held, to measure creep.")),
        ask("weights_n", Numbers(weights, 0.1, 5000.0, least=3, most=40, unit="N", label="Known weights, N", doc=doc)),
    )


def _empty(tare: Readings) -> Readings:
    """Return the readings of the empty tile: those of the page's end, before which something may be on it."""
    return tare.last(_TARE_S) or tare


def _steady_reading(readings: Readings, j: int) -> float:
    seen = readings.last(_STEADY_S) or readings
    return float(np.mean(seen.values[:, j]))
