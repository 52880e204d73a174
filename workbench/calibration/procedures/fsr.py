"""The wizard of section 4.3.2: sensor after sensor, rising, falling and resting loads against a reference."""

from collections.abc import Callable
from functools import partial
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from underfoot.calibration.drawings import drawings_of, taken_so_far
from underfoot.calibration.files.tables import PAIR_HEADER, Pairs
from underfoot.calibration.procedures.pressing import Step, Wizard, last
from underfoot.calibration.procedures.procedure import Live, Page, Press, Readings, Refused, Result, ask
from underfoot.calibration.science.linearisation import Divider, Linearisation, linearise
from underfoot.drawing import Drawing
from underfoot.errors import BadValue
from underfoot.floor.layout import Tile
from underfoot.parameters import Choice, Count, Number, Numbers

REFERENCES = ("load cell", "known weights")
DEFAULT_FULL_N = 600.0
_REST_S, _STEADY_S = 1.0, 1.0
_NEAR = 0.96
"""A load this close to what was asked is there."""
_STEPS = 20
_COVERED = 0.8
_HOLD_BAND = 0.12
_MOST_ELSEWHERE = 0.1
_RAILS = (0.0, 65535.0)

Values = NDArray[np.float64]


class FsrProcedure(Wizard):
    """FSR linearisation of one tile. Its result has the figures of `linearisation.Linearisation`, averaged over
    sensors.

    With a load cell (`Readings.force_n`): tare, three loadings up and down, and a hold, each sensor. With known
    weights: each is typed, put on and waited for, up and down again.
    """

    kind = "fsr"
    title = "FSR linearisation"

    def __init__(self, tile: Tile, divider: Divider | None = None) -> None:
        self._tile, self._divider = tile, divider
        self._full = DEFAULT_FULL_N
        self._reference = REFERENCES[0]
        self.linearisation: Linearisation | None = None
        super().__init__(
            Page(
                "setup",
                "FSR linearisation",
                f"Tile {tile.id}: say what force is measured against. The load goes over one sensor at a time.",
                asks=(
                    ask("reference", Choice(REFERENCES[0], options=REFERENCES, doc="What force is measured against.")),
                    ask(
                        "full_scale_n",
                        Number(DEFAULT_FULL_N, 5.0, 5000.0, unit="N", scale="log", doc="Largest load on the cell."),
                    ),
                    ask("loadings", Count(3, low=1, high=20, doc="How often to go up and down, with a load cell.")),
                    ask("hold_s", Number(10.0, 2.0, 100.0, unit="s", doc="How long to hold a load, for creep.")),
                    ask(
                        "weights_n",
                        Numbers(
                            (25.0, 50.0, 100.0, 200.0, 300.0, 450.0, 600.0), 0.1, 5000.0, least=3, most=40, unit="N",
                            doc="Known weights, from the lightest to the heaviest.",
                        ),
                    ),
                ),
            )
        )  # fmt: skip

    def plan(self, answers: dict[str, Any]) -> list[Step]:
        self._reference = answers["reference"]
        if self._reference == REFERENCES[0]:
            self._full = answers["full_scale_n"]
            return [step for j in range(4) for step in self._by_load_cell(j, answers["loadings"], answers["hold_s"])]
        weights = answers["weights_n"]
        for one, two in pairwise(weights):
            if two <= one:
                raise Refused(f"weights out of order: {two:g} N after {one:g} N; from the lightest to the heaviest")
        self._full = max(weights)
        return [step for j in range(4) for step in self._by_weights(j, weights)]

    def accepted(self, answers: dict[str, Any]) -> None:
        tags = self._steps[self._at].tags
        if "planned_n" not in tags:
            return
        before = self._weights_on(tags["sensor"])
        if not before:
            return
        given, then = answers["weight_n"], before[-1]
        if (given < then and tags["rising"]) or (given > then and not tags["rising"]):
            way = "up" if tags["rising"] else "down"
            raise Refused(f"weights out of order: {given:g} N after {then:g} N on the way {way}")

    @property
    def drawings(self) -> tuple[Drawing, ...]:
        if self._result is not None:
            return self._result.drawings
        return taken_so_far(self._pairs()) if self._taken else ()

    def concluded(self) -> Result:
        try:
            found = linearise(self._pairs(), self._divider, memories=False)
            if self._reference == REFERENCES[0]:
                found = linearise(self._pairs(found), self._divider)
        except BadValue as error:
            raise Refused(str(error)) from None
        self.linearisation = found
        return result_of(found, self._reference)

    def _by_load_cell(self, j: int, loadings: int, hold_s: float) -> list[Step]:
        at, full = self._tile.sensors_m[j], self._full
        steps = []

        def page(name: str, title: str, do: str, force_n: float, take: Callable[..., Live | None], hold: float) -> None:
            press = Press(at, force_n, hold, j)
            shown = Page(f"sensor{j + 1}-{name}", f"Sensor {j + 1}: {title}", do, press=press, may_skip=True)
            steps.append(Step(shown, take, {"group": j, "sensor": j, "rising": name.startswith("rise")}))

        page(
            "tare",
            "nothing on it",
            "Take everything off the tile and stand clear.",
            0.0,
            partial(self._rest, j),
            _REST_S,
        )
        for k in range(loadings):
            count = f"{k + 1} of {loadings}"
            page(
                f"rise{k + 1}", f"rising, {count}", f"Put the load cell over sensor {j + 1} and press slowly up to "
                f"{full:.0f} N.", full, partial(self._rise, j), 0.0,
            )  # fmt: skip
            page(f"fall{k + 1}", f"falling, {count}", "Let go as slowly.", 0.0, partial(self._fall, j), 0.0)
        held = 0.6 * full
        page("hold", "hold", f"Press {held:.0f} N and hold it still for {hold_s:.0f} s.", held,
             partial(self._hold, j, held, hold_s), hold_s)  # fmt: skip
        page("release", "let go", "Let go.", 0.0, partial(self._fall, j), 0.0)
        return steps

    def _by_weights(self, j: int, weights: tuple[float, ...]) -> list[Step]:
        at = self._tile.sensors_m[j]
        tare = Page(
            f"sensor{j + 1}-tare", f"Sensor {j + 1}: nothing on it", "Take everything off the tile and stand clear.",
            press=Press(at, 0.0, _REST_S, j), may_skip=True,
        )  # fmt: skip
        steps = [Step(tare, partial(self._rest, j), {"group": j, "sensor": j, "rising": True})]
        for k, weight in enumerate([*weights, *weights[-2::-1]]):
            rising = k < len(weights)
            page = Page(
                f"sensor{j + 1}-weight{k + 1}",
                f"Sensor {j + 1}: weight {k + 1}, {'rising' if rising else 'falling'}",
                f"Rest a known weight over sensor {j + 1}, and say how much it is.",
                asks=(ask("weight_n", Number(weight, 0.0, 5000.0, unit="N", doc="What rests over the sensor.")),),
                press=Press(at, weight, _STEADY_S, j),
                may_skip=True,
            )
            tags = {"group": j, "sensor": j, "rising": rising, "planned_n": weight}
            steps.append(Step(page, partial(self._weighed, j), tags))
        return steps

    def _rest(self, j: int, readings: Readings) -> Live | None:
        seen = last(readings, _REST_S)
        if seen is None:
            return Live("Stand clear.", np.ptp(readings.time_s) / _REST_S)
        if np.ptp(_middle(seen.values[:, j])) > 0.02 * _RAILS[1]:
            return Live("The reading moves; stand clear.", 0.5, (("reading", float(seen.values[-1, j]), ""),))
        if seen.force_n is not None and abs(float(np.median(seen.force_n))) > 0.01 * self._full:
            return Live("The load cell is loaded; take it off.", 0.5, (("force", float(seen.force_n[-1]), "N"),))
        return None

    def _rise(self, j: int, readings: Readings) -> Live | None:
        force = self._cell(readings)
        self._check_answers(j, readings, force)
        top, full = float(force.max()), self._full
        covered = _covered(force, full)
        shown = (("force", float(force[-1]), "N"), ("reading", float(readings.values[-1, j]), ""),
                 ("covered", 100.0 * covered, "%"))  # fmt: skip
        if top >= _NEAR * full and covered >= _COVERED:
            return None
        if top >= _NEAR * full:
            return Live("Too fast: let go and rise more slowly.", covered, shown)
        return Live(f"Press harder, up to {full:.0f} N.", min(top / full, covered), shown)

    def _fall(self, j: int, readings: Readings) -> Live | None:
        force = self._cell(readings)
        if (
            force[-1] <= 0.02 * self._full
            and np.ptp(readings.time_s) >= 0.3
            and force[-20:].mean() <= 0.03 * self._full
        ):
            return None
        gone = 1.0 - float(force[-1]) / max(float(force.max()), 1e-9)
        return Live("Let go.", max(gone, 0.0), (("force", float(force[-1]), "N"),))

    def _hold(self, j: int, held: float, hold_s: float, readings: Readings) -> Live | None:
        force = self._cell(readings)
        inside = np.abs(force - held) <= _HOLD_BAND * held
        outside = np.flatnonzero(~inside)
        since = readings.time_s[outside[-1] + 1 if outside.size else 0] if inside[-1] else readings.time_s[-1]
        kept = float(readings.time_s[-1] - since)
        shown = (("force", float(force[-1]), "N"), ("held", kept, "s"))
        if kept >= hold_s:
            return None
        hint = "Hold still." if inside[-1] else "Press harder." if force[-1] < held else "Press less."
        return Live(hint, kept / hold_s, shown)

    def _weighed(self, j: int, readings: Readings) -> Live | None:
        values = _middle(readings.values[:, j])
        shown = (("reading", float(readings.values[-1, j]), ""),)
        seen = last(readings, 2.0 * _STEADY_S)
        if seen is None:
            return Live("Wait until it rests.", float(np.ptp(readings.time_s)) / (2.0 * _STEADY_S), shown)
        values = _middle(seen.values[:, j])
        rest = self._rest_reading(j)
        moved = abs(float(np.median(values)) - rest)
        if np.ptp(values) > 0.03 * moved + 40.0:
            if np.ptp(readings.time_s) > 20.0:
                raise Refused(f"the load does not rest: the reading moves by {np.ptp(values):.0f} counts; put it down")
            return Live("Hold still: the reading moves.", 0.5, shown)
        given = float(self._answers[self._at]["weight_n"])
        self._check_weight(j, given, float(np.median(values)), rest, seen)
        return None

    def _cell(self, readings: Readings) -> Values:
        if readings.force_n is None:
            raise Refused("there is no load cell among the readings; choose known weights as reference")
        return readings.force_n

    def _check_answers(self, j: int, readings: Readings, force: Values) -> None:
        """Refuse a sensor that is silent, one that clips, another that answers, and a load cell that is silent."""
        rested = np.array([self._rest_reading(k) for k in range(4)])
        loaded = force >= 0.3 * self._full
        moved = np.abs(readings.values - rested)
        if np.count_nonzero(loaded) >= 20:
            typical = np.median(moved[loaded], axis=0)
            strongest = int(np.argmax(typical))
            if strongest != j and typical[strongest] > 400.0 and typical[strongest] > 2.0 * typical[j]:
                raise Refused(f"sensor {strongest + 1} answers where sensor {j + 1} is pressed; are they swapped?")
            if typical[j] < 20.0:
                raise Refused(
                    f"sensor {j + 1} gives no signal: it stays at {np.median(readings.values[loaded, j]):.0f} under "
                    f"{np.median(force[loaded]):.0f} N"
                )
        elif float(np.ptp(readings.values[:, j])) > 6000.0 and float(force.max()) < 0.01 * self._full:
            raise Refused(f"the load cell gives no force while sensor {j + 1} is pressed")
        pressed = readings.values[:, j]
        railed = np.isin(pressed, _RAILS) & (moved[:, j] > 400.0)
        if np.count_nonzero(railed) >= 20:
            raise Refused(
                f"sensor {j + 1} clips: it stands at {pressed[railed][0]:.0f} from {force[railed].min():.0f} N on; "
                "choose a lower full scale, or another divider"
            )

    def _check_weight(self, j: int, given_n: float, reading: float, rest: float, seen: Readings) -> None:
        """Refuse a weight that cannot be what was typed, by what this sensor and the others have shown so far."""
        moved = abs(reading - rest)
        if reading in _RAILS and moved > 400.0:
            raise Refused(f"sensor {j + 1} clips at {given_n:g} N: its reading stands at {reading:.0f}")
        others = np.abs(np.median(seen.values, axis=0) - [self._rest_reading(k) for k in range(4)])
        strongest = int(np.argmax(others))
        if given_n > 0.0 and strongest != j and others[strongest] > 400.0 and others[strongest] > 2.0 * others[j]:
            raise Refused(f"sensor {strongest + 1} answers where sensor {j + 1} is loaded; are they swapped?")
        if given_n >= 0.3 * self._full and moved < 20.0:
            raise Refused(f"sensor {j + 1} gives no signal: it stays at {reading:.0f} under {given_n:g} N")
        looks = self._looks_like_n(j, moved)
        if given_n > 0.0 and looks is not None and not 0.35 <= given_n / looks <= 2.8:
            raise Refused(
                f"{given_n:g} N was typed, but sensor {j + 1} reads as under about {looks:.0f} N; weigh again"
            )

    def _looks_like_n(self, j: int, moved: float) -> float | None:
        """The load that a reading looks like: by this sensor's own weights so far, else by another's."""
        own = self._points(j)
        if len(own) < 3:
            whole = [points for k in range(4) if k != j and len(points := self._points(k)) >= 3]
            if not whole:
                return None
            own = whole[0]
        x, f = np.log(np.array(own)).T
        order = np.argsort(x)
        x, f = x[order], np.maximum.accumulate(f[order])
        at = float(np.log(max(moved, 1.0)))
        if x[0] <= at <= x[-1]:
            return float(np.exp(np.interp(at, x, f)))
        two = slice(-2, None) if at > x[-1] else slice(0, 2)
        slope = float(np.clip(np.diff(f[two])[0] / max(np.diff(x[two])[0], 1e-3), 0.3, 4.0))
        end = -1 if at > x[-1] else 0
        return float(np.exp(f[end] + slope * (at - x[end])))

    def _points(self, j: int) -> list[tuple[float, float]]:
        """Distance from rest and newtons of the weights that a sensor has carried."""
        rest = self._rest_reading(j)
        found = []
        for step, readings, answers in self.taken():
            if step.tags["sensor"] == j and answers.get("weight_n", 0.0) > 0.0:
                moved = abs(_rested_reading(readings, j) - rest)
                if moved > 0.0:
                    found.append((moved, float(answers["weight_n"])))
        return found

    def _weights_on(self, j: int) -> list[float]:
        return [a["weight_n"] for step, _, a in self.taken() if step.tags["sensor"] == j and "weight_n" in a]

    def _rest_reading(self, k: int) -> float:
        """The reading of sensor `k` at the latest tare."""
        tares = [readings for step, readings, _ in self.taken() if step.page.key.endswith("-tare")]
        return float(np.median(tares[-1].values[:, k])) if tares else float("nan")

    def _pairs(self, first: Linearisation | None = None) -> Pairs:
        """All that was taken, a line each sample; what other sensors carried, by `first`, is off the reference."""
        times, sensors, values, forces = [], [], [], []
        shares = np.zeros(4) if first is None else np.array([self._share_of_others(first, j) for j in range(4)])
        for step, readings, answers in self.taken():
            j = step.tags["sensor"]
            if self._reference != REFERENCES[0]:
                time_s, value = readings.time_s[-1:], np.array([_rested_reading(readings, j)])
                force = np.array([float(answers.get("weight_n", 0.0))])
            elif step.page.key.endswith("-tare"):
                seen = last(readings, _REST_S) or readings
                time_s, value, force = seen.time_s, seen.values[:, j], np.zeros(seen.time_s.size)
            else:
                time_s, value, force = readings.time_s, readings.values[:, j], self._cell(readings) * (1.0 - shares[j])
            times.append(time_s)
            sensors.append(np.full(time_s.size, j))
            values.append(value)
            forces.append(force)
        return Pairs(self._tile.id, *(np.concatenate(one) for one in (times, sensors, values, forces)))

    def _share_of_others(self, first: Linearisation, j: int) -> float:
        """How much of a load over sensor `j` the other sensors carry: a plate is never quite true.

        The slope of their sum over the load, a slow drift taken out: they still remember loads of their own.
        """
        mine = [r for step, r, _ in self.taken() if step.tags["sensor"] == j and not step.page.key.endswith("-tare")]
        if not mine:
            return 0.0
        values = np.concatenate([r.values for r in mine])[::10]
        load = np.concatenate([self._cell(r) for r in mine])[::10]
        since = np.concatenate([r.time_s for r in mine])[::10]
        curves = [sensor.curve for sensor in first.sensors]
        others = np.nansum([curve.force(values[:, k]) for k, curve in enumerate(curves) if k != j], axis=0)
        terms = np.stack([load, np.ones(load.size), since - since[0], np.log1p(since - since[0])], axis=1)
        slope = float(np.linalg.lstsq(terms, others, rcond=None)[0][0])
        return float(np.clip(slope, -_MOST_ELSEWHERE, _MOST_ELSEWHERE))


def result_of(found: Linearisation, reference: str) -> Result:
    """What a linearisation shows, draws and puts into a profile."""
    return Result(
        kind="fsr",
        title=f"FSR linearisation of {found.tile}",
        quantities=found.quantities,
        verdict=found.verdict,
        good=found.good,
        warnings=found.warnings,
        drawings=drawings_of(found),
        raw=(("pairs", PAIR_HEADER, np.concatenate([sensor.rows(j) for j, sensor in enumerate(found.sensors)])),),
        apply=lambda profile: profile.with_part(found.part(reference)),
    )  # fmt: skip


def _rested_reading(readings: Readings, j: int) -> float:
    seen = last(readings, _STEADY_S) or readings
    return float(np.mean(seen.values[:, j]))


def _covered(force: Values, full: float) -> float:
    """The share of the steps from 5 to 95 % of full scale that a loading has passed through."""
    steps = np.floor((force / full - 0.05) / 0.9 * _STEPS)
    return np.unique(steps[(steps >= 0) & (steps < _STEPS)]).size / _STEPS


def _middle(values: Values) -> Values:
    """Means of twenty stretches: how a reading moves, without its noise."""
    return np.array([float(np.mean(part)) for part in np.array_split(values, min(20, values.size))])
