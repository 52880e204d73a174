"""The wizard of figure 5.5: loads at known places, error vectors, a correction, and what it is worth elsewhere."""

from dataclasses import replace
from functools import partial
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from underfoot.calibration.files.tables import PRESS_HEADER, Presses
from underfoot.calibration.procedures.pressing import Step, Wizard, joined, last
from underfoot.calibration.procedures.procedure import Live, Page, Press, Readings, Refused, Result, ask
from underfoot.calibration.science.centroid import Accuracy, assessed_forces, centroid, in_hindsight
from underfoot.drawing import Drawing, Series, series
from underfoot.errors import BadValue, require
from underfoot.floor.layout import Tile
from underfoot.floor.profile import Profile
from underfoot.parameters import Choice, Numbers, Rows

FORMS = ("full", "quick")
PATTERNS = ("jittered", "grid", "own")
DEFAULT_LOADS_N = (150.0, 300.0, 600.0)
FULL_PLACES, QUICK_PLACES = 50, 9
_INSET_M = 0.02
"""How far from the edge the outermost places lie: a finger or a load cell's foot must stand on the tile."""
_STEADY_S = 0.5
_FORCE_BAND = 0.2
_FORCE_STEADY, _PLACE_STEADY_M = 0.05, 0.006
_WRONG_PLACE_M = 0.08
_UNSTEADY_S = 20.0
_EMPTY_S, _AFTER_S = 0.15, 0.3
_PLACES_HEADER = "x_m,y_m,force_n,before_x_m,before_y_m,after_x_m,after_y_m"

Values = NDArray[np.float64]

_STATIC, _OVER_TIME = slice(4, 8), slice(8, 12)
"""Where newtons stand beside readings: by the static curve, and with what sensors remember taken out."""


class CentroidProcedure(Wizard):
    """Contact-centroid accuracy of one tile. Readings go through the curves of `profile`, else count as newtons.

    At each place the loads rest one after the other, rising, and where asked falling again. Fifty places, or nine.
    """

    kind = "centroid"
    title = "Contact centroid"

    def __init__(self, tile: Tile, profile: Profile | None = None, seed: int = 1) -> None:
        self._tile, self._profile, self._seed = tile, profile, seed
        self._memory = Profile.rested()
        self._places: Values = np.empty((0, 2))
        self.accuracy: Accuracy | None = None
        half = max(tile.size_m) / 2.0
        super().__init__(
            Page(
                "setup",
                "Contact centroid",
                f"Tile {tile.id}: say how many places are pressed, where, and how hard.",
                asks=(
                    ask("form", Choice("full", options=FORMS, doc="Full: fifty places; quick: nine.")),
                    ask("pattern", Choice("jittered", options=PATTERNS, doc="How the places lie on the tile.")),
                    ask(
                        "places_m",
                        Rows((), columns=(("x m", -half, half), ("y m", -half, half)), doc="One's own, tile frame, m."),
                    ),
                    ask("loads_n", Numbers(DEFAULT_LOADS_N, 1.0, 5000.0, most=10, unit="N", doc="Loads, rising.")),
                    ask("falling", Choice("no", options=("no", "yes"), doc="Falling loads too, for hysteresis.")),
                ),
            )
        )  # fmt: skip

    def plan(self, answers: dict[str, Any]) -> list[Step]:
        loads = answers["loads_n"]
        if any(two <= one for one, two in pairwise(loads)):
            raise Refused(f"loads out of order: {', '.join(f'{load:g}' for load in loads)} N; from light to heavy")
        if answers["pattern"] == "own":
            require(
                len(answers["places_m"]) >= 6, "places_m", len(answers["places_m"]), "at least 6 places of one's own"
            )
            self._places = np.array(answers["places_m"])
        else:
            count = FULL_PLACES if answers["form"] == "full" else QUICK_PLACES
            jitter = answers["pattern"] == "jittered" and count == FULL_PLACES
            self._places = places(self._tile, count, self._seed if jitter else None)
        shown = tuple((float(x), float(y)) for x, y in self._places)
        tare = Page(
            "tare", "Nothing on it", "Take everything off the tile and stand clear.",
            press=Press(shown[0], 0.0, 1.0), places_m=shown,
        )  # fmt: skip
        steps = [Step(tare, self._rest)]
        passes = [(load, True) for load in loads]
        if answers["falling"] == "yes":
            passes += [(load, False) for load in loads[-2::-1]]
        for k, at in enumerate(shown):
            for load, rising in passes:
                page = Page(
                    f"place{k + 1}-{load:g}{'' if rising else '-falling'}",
                    f"Place {k + 1} of {len(shown)}: {load:.0f} N",
                    f"Press {load:.0f} N at x {1e3 * at[0]:.0f} mm, y {1e3 * at[1]:.0f} mm, and hold it still."
                    if rising
                    else f"Let go down to {load:.0f} N, and hold it still.",
                    press=Press(at, load, _STEADY_S),
                    places_m=shown,
                    may_skip=True,
                )
                tags = {"group": k, "at_m": at, "load_n": load, "rising": rising}
                first = rising and load == loads[0]
                steps.append(Step(page, partial(self._press, at, load, first), tags))
        release = Page(
            "release", "Let go", "Let go, and stand clear.", press=Press(shown[-1], 0.0, _AFTER_S), places_m=shown
        )
        return [*steps, Step(release, partial(self._release, loads[0]))]

    @property
    def drawings(self) -> tuple[Drawing, ...]:
        if self._result is not None:
            return self._result.drawings
        presses, forces = self._presses(_STATIC, rising=None)
        if not presses.force_n.size:
            return ()
        found = centroid(forces, np.array(self._tile.sensors_m))
        return (_vectors("Taken so far", presses.at_m, (("measured", "alarm", found),), self._tile),)

    def concluded(self) -> Result:
        presses, forces = self._presses(_STATIC, rising=True)
        try:
            found = assessed_forces(presses, forces, self._tile)
            if self._remembers():
                nearer = self._presses(_OVER_TIME, rising=True)[1]
                over_time = assessed_forces(presses, nearer, self._tile)
                if over_time.at_m.shape == found.at_m.shape:
                    found = replace(found, over_time=over_time)
                    truest = over_time.correction.linearised(nearer)
                    bound = assessed_forces(presses, in_hindsight(forces, truest), self._tile)
                    if bound.mean_mm <= found.mean_mm:  # else few presses have shown no bound
                        found = replace(found, bound=bound)
        except BadValue as error:
            raise Refused(str(error)) from None
        self.accuracy = found
        falling, fallen = self._presses(_STATIC, rising=False)
        if not falling.force_n.size:
            return result_of(found, presses)
        place = found.correction.position(fallen, np.array(self._tile.sensors_m), 0.0)
        return result_of(found, presses, float(1e3 * np.hypot(*(place - falling.at_m).T).mean()))

    def _rest(self, readings: Readings) -> Live | None:
        seen = last(readings, 1.0)
        if seen is None:
            return Live("Stand clear.", float(np.ptp(readings.time_s)))
        spans = np.ptp(seen.values[:, :4], axis=0)
        if self._profile is None and (spans > 20.0).any():
            return Live("The readings move; stand clear.", 0.5)
        if seen.force_n is not None and abs(float(np.median(seen.force_n))) > 20.0:
            return Live("The load cell is loaded; take it off.", 0.5)
        return None

    def _release(self, least: float, readings: Readings) -> Live | None:
        seen = last(readings, _AFTER_S)
        if seen is None:
            return Live("Let go.", float(np.ptp(readings.time_s)) / _AFTER_S)
        force = seen.values[:, _STATIC].sum(axis=1) if seen.force_n is None else seen.force_n
        resting = self._rests()[1][-1][_STATIC].sum() if seen.force_n is None else 0.0
        if np.abs(force - resting).max() > (0.1 if seen.force_n is not None else 0.25) * least:
            return Live("Let go.", 0.5, (("force", float(force[-1] - resting), "N"),))
        return None

    def _press(self, at: tuple[float, float], load: float, first: bool, readings: Readings) -> Live | None:
        if first:
            begun = self._begun(self._at, readings, load)
            if begun is None:
                return Live("Let go, and then press at the new place.")
            _, rest, readings = begun
            baseline = rest[_STATIC]
        else:
            baseline = self._rests(self._steps[self._at].tags["group"])[1][-1][_STATIC]
        seen = last(readings, _STEADY_S)
        latest = seen or readings
        forces = latest.values[:, _STATIC] - baseline
        measured = forces.sum(axis=1)
        total = measured if latest.force_n is None else latest.force_n
        force = float(np.median(total))
        shown = [("force", force, "N")]
        if force < 0.3 * load or seen is None:
            self._check_silent(load, latest, measured)
            return Live(f"Press {load:.0f} N.", 0.5 * max(force, 0.0) / load, tuple(shown))
        place = centroid(forces, np.array(self._tile.sensors_m))
        x, y = np.median(place, axis=0)
        shown += [("x", 1e3 * float(x), "mm"), ("y", 1e3 * float(y), "mm")]
        if abs(force - load) > _FORCE_BAND * load:
            return Live("Press harder." if force < load else "Press less.", 0.6, tuple(shown))
        self._check_silent(load, latest, measured)
        tremble = float(np.std(total)) / load
        wander = float(np.std(place, axis=0).max())
        if tremble > _FORCE_STEADY or wander > _PLACE_STEADY_M:
            if np.ptp(readings.time_s) > _UNSTEADY_S:
                raise Refused(f"the press is unsteady: {100 * tremble:.0f} % and {1e3 * wander:.0f} mm; hold it still")
            return Live("Hold still.", 0.8, tuple(shown))
        off = float(np.hypot(x - at[0], y - at[1]))
        if off > _WRONG_PLACE_M:
            raise Refused(
                f"the press is seen {1e3 * off:.0f} mm from where it was asked for: another place, or sensors swapped"
            )
        return None

    def _rests(self, only: int | None = None) -> tuple[Values, Values]:
        """What the empty tile showed before the first press at each place (or at `only` that one), and at the end.

        Times (n,), in order, and values (n, 12), as `feed` keeps them.
        """
        times, shown, group = [], [], None
        for k in sorted(self._taken):
            step, readings = self._steps[k], self._taken[k]
            if step.page.key == "release":
                seen = last(readings, _EMPTY_S) or readings
                times.append(float(seen.time_s.mean()))
                shown.append(np.median(seen.values, axis=0))
            elif step.tags.get("group", group) != group and only in (None, step.tags["group"]):
                group = step.tags["group"]
                begun = self._begun(k, readings, step.tags["load_n"])
                if begun is not None:
                    times.append(begun[0])
                    shown.append(begun[1])
        return np.array(times or [0.0]), np.array(shown or [np.zeros(12)])

    def _begun(self, at: int, readings: Readings, load: float) -> tuple[float, Values, Readings] | None:
        """When the tile was last empty before a press, what it showed, and the press; None while nobody has let go.

        A sensor still remembers the load before. What it shows on an empty tile is taken off (CONTRACTS.md, baseline).
        """
        if at - 1 in self._taken:
            before = self._taken[at - 1]
            readings = joined(last(before, _EMPTY_S) or before, readings)
        total = readings.force_n
        if total is None:
            total = readings.values[:, _STATIC].sum(axis=1)
            total = total - total.min()
        light = np.flatnonzero(total < 0.3 * load)
        if not light.size:
            return None
        empty = light[total[light] <= total[light].min() + 0.03 * load]
        if readings.time_s[empty[-1]] - readings.time_s[empty[0]] < 0.9 * _EMPTY_S:
            return None
        late = empty[readings.time_s[empty] >= readings.time_s[empty[-1]] - _EMPTY_S]
        when = float(readings.time_s[late].mean())
        return when, np.median(readings.values[late], axis=0), _from(readings, int(light[-1]))

    def _check_silent(self, load: float, readings: Readings, measured: Values) -> None:
        """Refuse a tile that gives no signal under a load that the reference sees, and readings that clip."""
        if readings.force_n is not None and float(np.median(readings.force_n)) > 0.8 * load:
            felt = float(np.median(measured)) / float(np.median(readings.force_n))
            if felt < 0.02:
                raise Refused(f"no signal: the sensors add up to {np.median(measured):.3g} N under {load:.0f} N")
        if self._is_counts():
            railed = np.flatnonzero((readings.values[:, :4] >= 65535.0).mean(axis=0) > 0.5)
            resting = self._resting_counts()
            railed = railed[np.abs(resting[railed] - 65535.0) > 400.0]
            if railed.size:
                raise Refused(f"sensor {railed[0] + 1} clips: its reading stands at 65535; press less hard there")

    def _is_counts(self) -> bool:
        return self._profile is not None and self._profile.is_calibrated

    def _resting_counts(self) -> Values:
        tares = [readings for step, readings, _ in self.taken() if step.page.key == "tare"]
        return np.median(tares[-1].values[:, :4], axis=0) if tares else np.zeros(4)

    def feed(self, readings: Readings) -> None:
        """As all wizards; each reading is kept beside its newtons by the static curve, and over time."""
        static = over_time = readings.values
        if self._profile is not None and readings.time_s.size:
            static = self._profile.force(readings.values)
            over_time = self._profile.force_over_time(readings.values, readings.time_s, self._memory)
        super().feed(Readings(readings.time_s, np.hstack([readings.values, static, over_time]), readings.force_n))

    def _remembers(self) -> bool:
        """Whether the profile takes out what sensors remember."""
        part = None if self._profile is None else self._profile.fsr
        return part is not None and any(curve.compensation is not None for curve in part.sensors)

    def _presses(self, way: slice, rising: bool | None) -> tuple[Presses, Values]:
        """The presses taken so far, with mean readings of the stretch that was steady, and tared corner forces."""
        at, load, values, forces = [], [], [], []
        times, shown = self._rests()
        for step, readings, _ in self.taken():
            if "at_m" not in step.tags or rising not in (None, step.tags["rising"]):
                continue
            seen = last(readings, _STEADY_S) or readings
            # A sensor that still remembers old loads drifts while it is pressed: from empty to empty, straight.
            now = float(seen.time_s.mean())
            empty = np.array([np.interp(now, times, column) for column in shown.T])
            newtons = (seen.values.mean(axis=0) - empty)[way]
            at.append(step.tags["at_m"])
            values.append(seen.values[:, :4].mean(axis=0))
            forces.append(newtons)
            load.append(float(newtons.sum() if seen.force_n is None else seen.force_n.mean()))
        found = Presses(self._tile.id, np.array(at).reshape(-1, 2), np.array(load), np.array(values).reshape(-1, 4))
        return found, np.array(forces).reshape(-1, 4)


def _from(readings: Readings, start: int) -> Readings:
    force = None if readings.force_n is None else readings.force_n[start:]
    return Readings(readings.time_s[start:], readings.values[start:], force)


def places(tile: Tile, count: int, seed: int | None = None) -> Values:
    """`count` places on a tile, (count, 2): a grid within 2 cm of the edge, each moved about in its cell by `seed`.

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


def result_of(found: Accuracy, presses: Presses, falling_mm: float = float("nan")) -> Result:
    """What presses show, draw and put into a profile; `falling_mm` is the mean error of a falling pass."""
    quantities = found.quantities
    if np.isfinite(falling_mm):
        quantities += (("mean_after_mm_falling", falling_mm, "mm"),)
    return Result(
        kind="centroid",
        title=f"Contact centroid of {found.tile.id}",
        quantities=quantities,
        verdict=found.verdict,
        good=found.good,
        warnings=found.left_out,
        drawings=_drawings(found),
        raw=(
            ("presses", PRESS_HEADER, presses.rows()),
            ("places", _PLACES_HEADER, np.column_stack([found.at_m, found.force_n, found.before_m, found.after_m])),
        ),
        apply=lambda profile: profile.with_part(found.part("presses at known places")),
    )  # fmt: skip


def _drawings(found: Accuracy) -> tuple[Drawing, ...]:
    shown = [("before", "alarm", found.before_m), ("after", "contact", found.after_m)]
    if found.over_time is not None:
        shown.append(("after, over time", "vibration", found.over_time.after_m))
    errors = [(name, colour, found.errors_mm(at_m)) for name, colour, at_m in shown]
    share = np.linspace(0.0, 100.0, len(found.at_m))
    vectors = [
        _vectors(name.capitalize() + (", each place left out of its own correction" if k else ""), found.at_m,
                 (("", colour, at_m),), found.tile)
        for k, (name, colour, at_m) in enumerate(shown)
    ]  # fmt: skip
    candidates = np.arange(1.0, len(found.tried) + 1.0)
    return (
        *vectors,
        Drawing("Error of all presses", "error, mm", "% of presses below",
                tuple(series(name, np.sort(one), share, "line", colour) for name, colour, one in errors)),
        Drawing("Error over load", "load, N", "error, mm",
                tuple(series(name, found.force_n, one, "dots", colour) for name, colour, one in errors)),
        Drawing("Error of the candidates on places left out", ", ".join(name for name, _ in found.tried), "RMS, mm",
                (series("", candidates, [error for _, error in found.tried], "line"),)),
    )  # fmt: skip


def _vectors(title: str, at_m: Values, found: tuple[tuple[str, str, Values], ...], tile: Tile) -> Drawing:
    """Circles where the presses were, arrows to where they seemed to be, and the tile's edge: figure 5.5."""
    half = np.array(tile.size_m) / 2.0
    edge = np.array([half, half * (-1, 1), -half, half * (1, -1), half])
    shown: list[Series] = [series("", 1e3 * edge[:, 0], 1e3 * edge[:, 1], "line", "muted")]
    sensors = 1e3 * np.array(tile.sensors_m)
    shown.append(series("sensors", sensors[:, 0], sensors[:, 1], "dots", "events"))
    shown.append(series("pressed", 1e3 * at_m[:, 0], 1e3 * at_m[:, 1], "dots", "force"))
    shown += [
        series(name, 1e3 * at_m[:, 0], 1e3 * at_m[:, 1], "arrows", colour, 1e3 * to) for name, colour, to in found
    ]
    return Drawing(title, "x, mm", "y, mm", tuple(shown), equal=True)
