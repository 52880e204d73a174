"""Calibration of positions (figure 5.5): presses at known positions, error vectors, and a correction."""

from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from underfoot.calibration.declaration import PRESSING, Calibration, FileMeasurement, MeasurementSetup
from underfoot.calibration.files.measurements import Presses, read_presses
from underfoot.calibration.procedure import EMPTY_TILE, LONGEST_GAP_S, Answers, Page, PageProgress, Procedure, Step
from underfoot.calibration.reference import OF_PLACE, require_given
from underfoot.calibration.result import Result
from underfoot.calibration.rig import PressRequest, Readings
from underfoot.drawing import Drawing
from underfoot.errors import BadFile, BadMeasurement, BadValue, require
from underfoot.floor.profile_parts import PARTS
from underfoot.kernels import Floats
from underfoot.options import option
from underfoot.parameters import Choice, Numbers, Parameter, Rows, ask

if TYPE_CHECKING:
    from underfoot.calibration.science.centroid import CentroidAccuracy
    from underfoot.floor.layout import Tile
    from underfoot.floor.profile import Profile

FORMS = ("full", "quick")
PATTERNS = ("jittered", "grid", "own")
DEFAULT_LOADS_N = (150.0, 300.0, 600.0)
FULL_PLACES, QUICK_PLACES, LEAST_PLACES = 50, 9, 6
_INSET_M = 0.02
"""Distance of the outermost positions from the edge: a finger or a load cell's foot must fit on the tile."""
_STEADY_S = 0.5
_FORCE_BAND = 0.2
"""Accepted relative deviation from the requested force."""
_RELEASED_S = 0.3
_DOUBTFUL_S = 10.0
"""Time without a press after which a page tells what the nearest sensor reads: it may be dead."""
_EMPTY_N = 20.0
"""Force below which a tile, or its load cell, counts as empty in the tare."""
_RELEASED, _RELEASED_BY_SENSORS = 0.1, 0.25
"""Share of the lightest load below which a press is over: by a load cell; by the tile's sensors, which creep."""


_NEWTONS = slice(8, 12)
"""Columns of the newtons with hysteresis compensated, as in a session, behind readings and newtons of static curves."""


@dataclass(frozen=True)
class CentroidCalibration(Calibration):
    """Calibration of the contact centroid, and the options of its command."""

    kind = "centroid"
    name = PARTS[kind]
    title = "Places: where a foot stands"
    about = (
        "The tile is pressed at places that are shown on it, or on the floor by a projector. The result corrects where "
        "contacts seem to be, and says how accurate that is at places that were left out of its fit."
    )
    summary = "Measure how accurate the contact centroid is, and fit its correction."
    rig = PRESSING
    file_options = ("presses",)
    requires = "fsr"

    presses: Path | None = option("CSV of loads at known positions: tile,x_m,y_m,force_n,r1,r2,r3,r4.", None)
    reference_mm: float | None = option(OF_PLACE.doc, None)
    quick: bool = option("Nine places instead of fifty, on a target.", False)

    def check(self, target: str) -> None:
        super().check(target)
        require_given(OF_PLACE, self.reference_mm)

    def procedure(self, setup: MeasurementSetup) -> "CentroidProcedure":
        return CentroidProcedure(setup.tile, setup.profile, setup.seed)

    def answers(self, has_load_cell: bool) -> Answers:
        return {"form": "quick" if self.quick else "full", OF_PLACE.name: self.reference_mm}

    def from_files(self, floor: Path | None, tile: str) -> FileMeasurement:
        from underfoot.calibration.results.centroid import result_of
        from underfoot.calibration.science.centroid import assess
        from underfoot.floor.layout import Floor

        assert self.presses is not None
        if floor is None:
            raise BadValue("--presses needs --floor: the sensors' places are in the floor JSON")
        layout, path, presses = Floor.load(floor), self.presses, read_presses(self.presses, tile)
        measured = layout.tiles[layout.index(presses.tile)]

        def analyse(profile: "Profile") -> Result:
            try:
                used = profile.fsr if presses.newtons is None else None
                accuracy = replace(assess(presses, measured, profile), reference_mm=self.reference_mm)
                return result_of(accuracy, presses, forces=used)
            except BadValue as error:
                raise BadFile(f"{path}: {error}") from None

        return FileMeasurement(measured.id, analyse)


@dataclass(frozen=True)
class PlaceStep(Step):
    """Step that presses at one position with one load; a position is a group, from 0."""

    at_m: tuple[float, float] = (0.0, 0.0)
    load_n: float = 0.0
    rising: bool = True


class CentroidProcedure(Procedure):
    """Contact-centroid accuracy of one tile. Readings are converted by the curves of `profile`, else taken as newtons.

    Each position is pressed with one load after another, rising, and optionally falling again. Fifty positions, or
    nine.
    """

    def __init__(self, tile: "Tile", profile: "Profile | None" = None, seed: int = 1) -> None:
        self._tile, self._profile, self._seed = tile, profile, seed
        self._hysteresis_state = None if profile is None else profile.rested()
        self._sensors_m = np.array(tile.sensors_m)
        self._empty_before: dict[int, tuple[float, Floats]] = {}
        self._must_let_go, self._reference_mm = False, OF_PLACE.default
        self.accuracy: CentroidAccuracy | None = None
        instruction = f"Tile {tile.id}: choose how many places are pressed, where they are, and with which loads."
        super().__init__(Page("setup", "Places", instruction, questions=_setup_questions(tile)))

    def plan(self, answers: Answers) -> list[Step]:
        """Return a tare, each position with each load, and a release at the end."""
        loads, self._reference_mm = answers["loads_n"], answers[OF_PLACE.name]
        if any(two <= one for one, two in pairwise(loads)):
            shown = ", ".join(f"{load:g}" for load in loads)
            raise BadMeasurement(f"loads out of order: {shown} N; allowed: from the lightest to the heaviest")
        at = self._places(answers)
        tare = Page("tare", "Nothing on it", EMPTY_TILE, press=PressRequest(at[0], 0.0, 1.0), places_m=at)
        passes = [(load, True) for load in loads]
        if answers["falling"] == "yes":
            passes += [(load, False) for load in loads[-2::-1]]
        presses = [
            self._press_step(k, at, load, rising, first=rising and load == loads[0])
            for k in range(len(at))
            for load, rising in passes
        ]
        done = PressRequest(at[-1], 0.0, _RELEASED_S)
        release = Page("release", "Release", "Let go, and stand clear.", press=done, places_m=at)
        return [Step(tare, self._tare), *presses, Step(release, partial(self._release, loads[0]))]

    @property
    def page(self) -> Page:
        """Return the present page; after Back more has been done than before it, and a press begins with letting go."""
        page = super().page
        page = replace(page, share=max(page.share, len(self._step_data) / len(self._steps)))
        if page.press is not None and self._must_let_go:
            return replace(page, press=replace(page.press, force_n=0.0))
        return page

    def back(self) -> None:
        """Return to the first press of this place, or of the one before; other places keep their presses.

        From the first place it goes to the empty tile, and from there to the first page, which discards all.
        """
        if self._at <= 1:
            super().back()
            return
        # From the result: letting go is read by itself, and would lead to the result again.
        at = self._at - (2 if self._steps[self._at].page.last else 1)
        unfinished = self._steps[self._at].group if self._steps[at].group == self._steps[self._at].group else None
        while at > 1 and self._steps[at].group == self._steps[at - 1].group:
            at -= 1
        self._skipped -= {k for k, step in enumerate(self._steps) if step.group == self._steps[at].group}
        kept = (k for k in self._step_data if k == 1 or self._steps[k].group not in (unfinished, None))
        self._step_data = {k: self._step_data[k] for k in kept}
        self._result, self._must_let_go = None, True
        self._open(at)

    def next_step(self) -> int:
        """Return the index of the next step without data; a place whose first press is repeated is pressed anew."""
        step = self._steps[self._at]
        if isinstance(step, PlaceStep) and self._steps[self._at - 1].group != step.group:
            again = [k for k in self._step_data if k > self._at and self._steps[k].group == step.group]
            for k in again:
                del self._step_data[k]
        done = {0, *self._step_data, *self._skipped}
        return next(k for k in range(len(self._steps)) if k not in done)

    @property
    def drawings(self) -> tuple[Drawing, ...]:
        """Return the error vectors so far."""
        from underfoot.calibration.results.centroid import error_vectors
        from underfoot.calibration.science.centroid_fit import centroid

        presses = self._presses(rising=None)
        if not presses.force_n.size:
            return ()
        found = centroid(presses.static_n, self._sensors_m)
        return (error_vectors("Taken so far", presses.at_m, (("measured", "alarm", found),), self._tile),)

    def conclude(self) -> Result:
        """Return the accuracy on rising loads, and the mean error on falling ones if any."""
        from underfoot.calibration.results.centroid import result_of
        from underfoot.calibration.science.centroid import assess

        presses, falling = self._presses(rising=True), self._presses(rising=False)
        self.accuracy = replace(assess(presses, self._tile), reference_mm=self._reference_mm)
        return result_of(self.accuracy, presses, falling, None if self._profile is None else self._profile.fsr)

    def without_conclusion(self, reason: str) -> Result | None:
        """Return the presses without an accuracy."""
        from underfoot.calibration.results.centroid import inconclusive

        presses, falling = self._presses(rising=True), self._presses(rising=False)
        return inconclusive(presses, falling, reason, self.drawings) if presses.force_n.size else None

    def feed(self, readings: Readings) -> None:
        """Take readings; each is stored with its newtons, by the static curves and with hysteresis compensated."""
        static = compensated = readings.values
        if self._profile is not None and readings.time_s.size:
            static = self._profile.force(readings.values)
            compensated = self._profile.force_over_time(readings.values, readings.time_s, self._hysteresis_state)
        super().feed(Readings(readings.time_s, np.hstack([readings.values, static, compensated]), readings.force_n))

    # --- pages ---

    def _places(self, answers: Answers) -> tuple[tuple[float, float], ...]:
        """Return the positions to press, metres in the tile's frame."""
        own = answers["places_m"]
        if answers["pattern"] == "own":
            require(len(own) >= LEAST_PLACES, "places_m", len(own), f"at least {LEAST_PLACES} places of your own")
            found = np.array(own)
        else:
            count = FULL_PLACES if answers["form"] == "full" else QUICK_PLACES
            jitter = answers["pattern"] == "jittered" and count == FULL_PLACES
            found = places(self._tile, count, self._seed if jitter else None)
        return tuple((float(x), float(y)) for x, y in found)

    def _press_step(
        self, k: int, at: tuple[tuple[float, float], ...], load: float, rising: bool, first: bool
    ) -> PlaceStep:
        x, y = (1e3 * part + 0.0 for part in at[k])
        page = Page(
            f"place{k + 1}-{load:g}{'' if rising else '-falling'}",
            f"Place {k + 1} of {len(at)}: {load:.0f} N",
            f"Press with {load:.0f} N at x {x:.4g} mm, y {y:.4g} mm, and hold still."
            if rising
            else f"Lower the force to {load:.0f} N, and hold still.",
            press=PressRequest(at[k], load, _STEADY_S),
            places_m=at,
            may_skip=True,
        )
        return PlaceStep(page, partial(self._press, at[k], load, first), k, at[k], load, rising)

    # --- data of each page ---

    def _tare(self, readings: Readings) -> PageProgress | None:
        seen = readings.last(1.0)
        if seen is None:
            return PageProgress("Stand clear.", float(np.ptp(readings.time_s)))
        spans = np.ptp(seen.values[:, :4], axis=0)
        if self._profile is None and (spans > _EMPTY_N).any():
            return PageProgress("The readings change; stand clear.", 0.5)
        if seen.force_n is not None and abs(float(np.median(seen.force_n))) > _EMPTY_N:
            return PageProgress("The load cell is loaded; take it off.", 0.5)
        return None

    def _release(self, least: float, readings: Readings) -> PageProgress | None:
        seen = readings.last(_RELEASED_S)
        if seen is None:
            return PageProgress("Let go.", float(np.ptp(readings.time_s)) / _RELEASED_S)
        if seen.force_n is None:
            force = seen.values[:, _NEWTONS].sum(axis=1) - self._empty()[1][-1][_NEWTONS].sum()
            share = _RELEASED_BY_SENSORS
        else:
            force, share = seen.force_n, _RELEASED
        if np.abs(force).max() > share * least:
            return PageProgress("Let go.", 0.5, (("force", float(force[-1]), "N"),))
        return None

    def _press(self, at: tuple[float, float], load: float, first: bool, readings: Readings) -> PageProgress | None:
        from underfoot.calibration.science.centroid_fit import centroid
        from underfoot.calibration.science.load_checks import swings_n
        from underfoot.calibration.science.press_checks import PRESSED, is_steady, nearest_words, require_place

        waited_s = float(np.ptp(readings.time_s))
        if first:
            begun = self._begun(readings, load)
            if begun is None:
                return PageProgress("Let go, and then press at the new place.")
            self._must_let_go = False
            when, empty, readings = begun
            self._empty_before[self._at] = when, empty
            baseline = empty[_NEWTONS]
        else:
            step = self._steps[self._at]
            assert isinstance(step, PlaceStep)
            baseline = self._empty(step.group)[1][-1][_NEWTONS]
        seen = readings.last(_STEADY_S)
        latest = seen or readings
        forces = latest.values[:, _NEWTONS] - baseline
        measured = forces.sum(axis=1)
        total = measured if latest.force_n is None else latest.force_n
        force = float(np.median(total))
        shown = [("force", force, "N")]
        nearest = nearest_words(at, self._sensors_m, latest.values[:, :4], self._tare_counts())
        doubt = f" If you do: {nearest}." if waited_s > _DOUBTFUL_S else ""
        if force < PRESSED * load or seen is None:
            self._check(load, latest, forces, nearest)
            return PageProgress(f"Press with {load:.0f} N.{doubt}", 0.5 * max(force, 0.0) / load, tuple(shown))
        place = centroid(forces, self._sensors_m)
        x, y = np.median(place, axis=0)
        shown += [("x", 1e3 * float(x), "mm"), ("y", 1e3 * float(y), "mm")]
        if abs(force - load) > _FORCE_BAND * load:
            hint = f"Press harder.{doubt}" if force < load else "Press less hard."
            return PageProgress(hint, 0.6, tuple(shown))
        self._check(load, latest, forces, nearest)
        deviations = float(np.std(total)) / load, float(np.std(place, axis=0).max())
        if not is_steady(*deviations, np.ptp(readings.time_s), swings_n(self._empty_tile()[:, _NEWTONS])):
            return PageProgress("Hold still.", 0.8, tuple(shown))
        require_place(np.median(forces, axis=0), self._sensors_m, at, nearest)
        return None

    def _check(self, load: float, readings: Readings, forces: Floats, nearest: str) -> None:
        """Refuse a tile without signal under a load that the reference measures, and readings that clip."""
        from underfoot.calibration.science.press_checks import require_signal, require_unclipped

        require_signal(load, readings.force_n, forces, nearest)
        if self._profile is not None and self._profile.is_calibrated:
            rest, is_pressed = self._tare_counts(), np.median(forces, axis=0) > 0.0
            # A corner that lifts reads as without a load: that may be an end of the range, too.
            require_unclipped(np.where(is_pressed, readings.values[:, :4], rest), rest)

    # --- evaluation ---

    def _empty(self, place: int | str | None = None) -> tuple[Floats, Floats]:
        """Return values of the empty tile before the first press at each position (or at this one), and at the end.

        Times (n,), in order, and values (n, 12), as stored by `feed`.
        """
        from underfoot.calibration.science.press_checks import EMPTY_S

        times, values = [], []
        for k in sorted(self._step_data):
            step, readings = self._steps[k], self._step_data[k]
            if step.page.key == "release":
                seen = readings.last(EMPTY_S) or readings
                times.append(float(seen.time_s.mean()))
                values.append(np.median(seen.values, axis=0))
            elif k in self._empty_before and place in (None, step.group):
                times.append(self._empty_before[k][0])
                values.append(self._empty_before[k][1])
        order = np.argsort(times or [0.0])  # a place may have been repeated
        return np.array(times or [0.0])[order], np.array(values or [np.zeros(12)])[order]

    def _begun(self, readings: Readings, load: float) -> tuple[float, Floats, Readings] | None:
        """Return when the tile was last empty before a press, its values then, and the press; None before a release.

        A sensor still creeps after the previous load. Its value on the empty tile is the baseline of the press.
        """
        from underfoot.calibration.science.press_checks import EMPTY_S, press_begun

        earlier = [one for one in self._step_data.values() if 0.0 < readings.time_s[0] - one.time_s[-1] < LONGEST_GAP_S]
        if earlier:
            before = max(earlier, key=lambda one: float(one.time_s[-1]))
            readings = (before.last(EMPTY_S) or before).followed_by(readings)
        total = readings.force_n
        if total is None:
            total = readings.values[:, _NEWTONS].sum(axis=1)
            total = total - total.min()
        return press_begun(readings, total, load)

    def _presses(self, rising: bool | None) -> Presses:
        """Return the presses so far, with mean readings of the steady stretch, and newtons less the baseline.

        `rising` selects rising or falling loads, None both.
        """
        at, load, values, forces = [], [], [], []
        times, empty_values = self._empty()
        for step, readings, _ in self.step_data():
            if not isinstance(step, PlaceStep) or rising not in (None, step.rising):
                continue
            seen = readings.last(_STEADY_S) or readings
            # A creeping sensor drifts while it is pressed: the baseline is interpolated from empty to empty.
            now = float(seen.time_s.mean())
            empty = np.array([np.interp(now, times, column) for column in empty_values.T])
            corners = (seen.values.mean(axis=0) - empty)[4:]
            at.append(step.at_m)
            values.append(seen.values[:, :4].mean(axis=0))
            forces.append(corners)
            load.append(float(corners[4:].sum() if seen.force_n is None else seen.force_n.mean()))
        newtons = np.array(forces).reshape(-1, 8)[:, : 8 if self._has_hysteresis() else 4]
        counts = np.array(values).reshape(-1, 4)
        return Presses(self._tile.id, np.array(at).reshape(-1, 2), np.array(load), counts, newtons)

    def _has_hysteresis(self) -> bool:
        """Return whether the profile has a hysteresis model for a sensor."""
        part = None if self._profile is None else self._profile.fsr
        return part is not None and any(curve.compensation is not None for curve in part.sensors)

    def _tare_counts(self) -> Floats:
        """Return the readings (4,) of the latest tare."""
        return np.asarray(np.median(self._empty_tile()[:, :4], axis=0))

    def _empty_tile(self) -> Floats:
        """Return the values (n, 12) of the latest tare, as stored by `feed`."""
        tares = [readings.last(1.0) or readings for step, readings, _ in self.step_data() if step.page.key == "tare"]
        return tares[-1].values if tares else np.zeros((10, 12))


def _setup_questions(tile: "Tile") -> tuple[Parameter, ...]:
    """Return the parameters of the first page."""
    columns = tuple((f"{axis} m", -0.5 * side, 0.5 * side) for axis, side in zip("xy", tile.size_m, strict=True))
    return (
        ask(
            "form",
            Choice("full", options=FORMS, label="Form: fifty places, or nine", doc="Full: fifty places; quick: nine."),
        ),
        ask(
            "pattern",
            Choice("jittered", options=PATTERNS, label="Where the places are", doc="How the places lie on the tile."),
        ),
        ask(
            "places_m",
            Rows(
                (), columns=columns, label="Places of your own", doc="Places of your own, in the tile's frame, metres."
            ),
        ),
        OF_PLACE,
        ask("loads_n", Numbers(DEFAULT_LOADS_N, 1.0, 5000.0, most=10, unit="N", doc="Loads, rising.")),
        ask(
            "falling",
            Choice(
                "no",
                options=("no", "yes"),
                label="Falling loads, too",
                doc="Press with falling loads, too, to show hysteresis.",
            ),
        ),
    )


def places(tile: "Tile", count: int, seed: int | None = None) -> Floats:
    """Return `count` positions on a tile, (count, 2), metres in its frame: a grid up to 2 cm from the edges.

    With a `seed` each is jittered by up to half a cell. `count` is 4 or more, so that each row has two places.

    >>> from underfoot.floor.layout import default_floor
    >>> places(default_floor(1, 1).tiles[0], 9)[[0, 4, 8]].round(3) + 0.0
    array([[-0.132, -0.132],
           [ 0.   ,  0.   ],
           [ 0.132,  0.132]])
    """
    half = np.array(tile.size_m) / 2.0 - _INSET_M
    rows = int(round(np.sqrt(count)))
    across = [count // rows + (1 if row < count % rows else 0) for row in range(rows)]
    found = []
    for row, columns in enumerate(across):
        y = -1.0 + 2.0 * row / (rows - 1)
        found += [(-1.0 + 2.0 * column / (columns - 1), y) for column in range(columns)]
    at = np.array(found)
    if seed is not None:
        cell = 1.0 / rows
        at = np.clip(at + np.random.default_rng(seed).uniform(-cell, cell, at.shape), -1.0, 1.0)
    return np.asarray((at * half).round(4))
