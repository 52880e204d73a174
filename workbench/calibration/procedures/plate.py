"""Calibration of a variable stiffness plate (section 6.3): footsteps at each position of its servo, a line for each."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from underfoot.calibration.declaration import STEPPING, Calibration, FileMeasurement, MeasurementSetup, named_tile
from underfoot.calibration.files.plate_profiles import read_plate_profiles
from underfoot.calibration.procedure import Answers, Page, PageProgress, Procedure, Step
from underfoot.calibration.result import Result
from underfoot.calibration.rig import PressRequest, Readings
from underfoot.devices.plate import MOVE_S
from underfoot.drawing import Drawing
from underfoot.errors import BadFile, BadMeasurement
from underfoot.floor.profile_parts import PARTS
from underfoot.kernels import Floats
from underfoot.options import option
from underfoot.parameters import Choice, Count, Numbers, Parameter, ask

if TYPE_CHECKING:
    from underfoot.calibration.science.plate_stiffness import FootstepLine
    from underfoot.floor.layout import Tile
    from underfoot.floor.profile import Profile

FORCES = LOAD_CELL, TILE = "load cell", "tile"
POSITIONS = (0.0, 0.25, 0.5, 0.75, 1.0)
FOOTSTEPS, LEAST_FOOTSTEPS = 12, 3
"""Twelve at each of five positions are the sixty of the thesis."""
_STEP_N = 700.0
_ON_N = 20.0
"""Force above which somebody is on the plate."""
_LEAST_PEAK_N = 150.0
_PERSON_N = 250.0
"""More than the plate itself weighs, and less than a person."""
_CLEAR_S, _RELEASED_S = 0.5, 0.2
_STAY_OFF = f"Step off the plate, and stay off while it moves; that takes {MOVE_S:g} s."
_NO_FORCE = "No force arrives; is the load cell plugged in, and named? Else choose the tile for the force."
_NO_DISPLACEMENT = "No displacement arrives; is its sensor plugged in, and named?"


@dataclass(frozen=True)
class PlateCalibration(Calibration):
    """Calibration of a variable stiffness plate, and the options of its command."""

    kind = "plate"
    name = PARTS[kind]
    title = "Stiffness: of a plate whose servo sets it"
    about = (
        "The servo goes to one position after another, and somebody steps on the plate at each. A line is fitted to "
        "each footstep's force over displacement; its slope is the stiffness. With the result, a study sets the "
        "plate in N/mm."
    )
    summary = "Measure the stiffness of a variable stiffness plate at positions of its servo."
    rig = STEPPING
    file_options = ("footsteps",)

    footsteps: Path | None = option("CSV of footsteps: position,footstep,force_n,displacement_mm.", None)
    each: int = option("Footsteps at each position on a target.", FOOTSTEPS)

    def procedure(self, setup: MeasurementSetup) -> "PlateProcedure":
        return PlateProcedure(setup.tile, setup.profile, setup.sensors)

    def answers(self, has_load_cell: bool) -> Answers:
        return {"force": LOAD_CELL if has_load_cell else TILE, "footsteps": self.each}

    def from_files(self, floor: Path | None, tile: str) -> FileMeasurement:
        from underfoot.calibration.results.plate import result_of
        from underfoot.calibration.science.plate_stiffness import line_of

        assert self.footsteps is not None
        path, footsteps = self.footsteps, read_plate_profiles(self.footsteps)

        def analyse(profile: "Profile") -> Result:
            try:
                lines = [line_of(position, *samples) for (position, _), samples in footsteps.items()]
                return result_of(lines, list(footsteps.values()), f"footsteps of {path.name}")
            except BadMeasurement as error:
                raise BadFile(f"{path}: {error}") from None

        return FileMeasurement(named_tile(floor, tile), analyse)


@dataclass(frozen=True)
class PositionStep(Step):
    """Step at one position of the servo: its move, or a footstep."""

    position: float = 0.0


class PlateProcedure(Procedure):
    """Footsteps on a plate on one tile. The force is a load cell's, or the tile's by the curves of `profile`.

    In the profile, load cell and displacement sensor are called `sensors`.

    >>> from underfoot.floor.layout import default_floor
    >>> PlateProcedure(default_floor().tiles[0]).page.key
    'setup'
    """

    def __init__(
        self,
        tile: "Tile",
        profile: "Profile | None" = None,
        sensors: tuple[str, str] = (LOAD_CELL, ""),
    ) -> None:
        self._tile, self._profile = tile, profile
        self._cell, self._displacement = sensors
        self._has_forces = profile is not None and profile.fsr is not None
        self._states = None if profile is None else profile.rested()
        self._force = LOAD_CELL
        self._is_loaded = self._is_elsewhere = False
        self._taken: dict[int, Footstep] = {}
        instruction = (
            f"The plate is on tile {tile.id}. Its servo goes to each position, and you step on it, as in a walk. "
            "Nobody stands on it while it moves."
        )
        super().__init__(Page("setup", "Stiffness", instruction, questions=_setup_questions()))

    def plan(self, answers: Answers) -> list[Step]:
        """Return, for each position, the servo's move and the footsteps."""
        self._force, positions = answers["force"], answers["positions"]
        if self._force == TILE and not self._has_forces:
            raise BadMeasurement(
                f"tile {self._tile.id} gives no force: its forces are not calibrated; do that first, or use a load cell"
            )
        if any(two <= one for one, two in pairwise(positions)):
            shown = " ".join(f"{position:g}" for position in positions)
            raise BadMeasurement(f"positions out of order: {shown}; allowed: from the softest to the stiffest, rising")
        return [
            step for k in range(len(positions)) for step in self._at_position(k, positions, int(answers["footsteps"]))
        ]

    @property
    def page(self) -> Page:
        """Return the present page; a loaded plate is not to move, and after Back the servo moves before a footstep."""
        page, step = super().page, self._steps[self._at]
        if page.press is not None and self._is_loaded:
            return replace(page, press=replace(page.press, position=None))
        if self._is_elsewhere and isinstance(step, PositionStep):
            return replace(page, instruction=_STAY_OFF, press=_clear(step.position))
        return page

    @property
    def drawings(self) -> tuple[Drawing, ...]:
        """Return a footstep of each position so far."""
        from underfoot.calibration.science.plate_stiffness import profiles_drawn

        lines, samples = self._footsteps()
        return (profiles_drawn(lines, samples),) if lines else ()

    def conclude(self) -> Result:
        """Return stiffness over position, and the mean error of a line."""
        from underfoot.calibration.results.plate import result_of

        lines, samples = self._footsteps()
        force = f"a {self._cell}" if self._force == LOAD_CELL else f"the forces of {self._tile.id}"
        if self._force == TILE and self._profile is not None and self._profile.fsr is not None:
            force += f", calibrated {self._profile.fsr.identity}"
        reference = "; ".join(filter(None, (force, self._displacement)))
        return result_of(lines, samples, reference, self._tile.id)

    def without_conclusion(self, reason: str) -> Result | None:
        """Return the footsteps so far."""
        from underfoot.calibration.results.plate import inconclusive

        lines, samples = self._footsteps()
        return inconclusive(lines, samples, reason, self.drawings, self._tile.id) if lines else None

    def feed(self, readings: Readings) -> None:
        """Take readings; with the tile's force for that of a load cell, if so chosen."""
        if self._force == TILE and self._profile is not None and readings.time_s.size:
            force = self._profile.force_over_time(readings.values, readings.time_s, self._states).sum(axis=1)
            readings = replace(readings, force_n=force)
        super().feed(readings)

    def back(self) -> None:
        """Return to the previous page, and discard the data taken since."""
        super().back()
        self._is_loaded = self._is_elsewhere = False

    # --- pages ---

    def _at_position(self, k: int, positions: Sequence[float], footsteps: int) -> list[Step]:
        position, count = positions[k], f"{k + 1} of {len(positions)}"
        move = Page(
            f"move{k + 1}",
            f"Position {count}: the servo goes to {position:g}",
            _STAY_OFF,
            press=_clear(position),
        )
        on = PressRequest((0.0, 0.0), _STEP_N, footstep=True)
        steps: list[Step] = [PositionStep(move, partial(self._move, position), k, position)]
        for j in range(footsteps):
            page = Page(
                f"position{k + 1}-footstep{j + 1}",
                f"Position {count}: footstep {j + 1} of {footsteps}",
                f"Walk over it as usual; its servo is at position {position:g}.",
                press=on,
            )
            steps.append(PositionStep(page, self._footstep, k, position))
        return steps

    # --- data of each page ---

    def _move(self, position: float, readings: Readings) -> PageProgress | None:
        if readings.force_n is None:
            return PageProgress(_NO_FORCE)
        taken = float(np.ptp(readings.time_s))
        force = np.asarray((readings.last(0.5 * _CLEAR_S) or readings).force_n)
        self._is_loaded = self._is_on(force)
        if self._is_loaded:
            return PageProgress("Step off: the plate waits for it.", 0.0, (("force", float(force[-1]), "N"),))
        there = readings.position is not None and abs(float(readings.position[-1]) - position) < 1e-3
        if there and taken >= _CLEAR_S:
            return None
        return PageProgress("The plate moves; stand clear.", min(taken / MOVE_S, 1.0))

    def _footstep(self, readings: Readings) -> PageProgress | None:
        if readings.force_n is None:
            return PageProgress(_NO_FORCE)
        if readings.displacement_mm is None:
            return PageProgress(_NO_DISPLACEMENT)
        step = self._steps[self._at]
        assert isinstance(step, PositionStep)
        assert readings.position is not None
        away = np.flatnonzero(~(np.abs(readings.position - step.position) < 1e-3))
        self._is_elsewhere = away.size > 0 and away[-1] == readings.time_s.size - 1
        if self._is_elsewhere:
            return self._move(step.position, readings)
        readings = readings.since(int(away.max(initial=-1)) + 1)
        assert readings.force_n is not None
        assert readings.displacement_mm is not None
        force = readings.force_n - self._rest_n()
        shown = (("force", float(force[-1]), "N"), ("depth", float(readings.displacement_mm[-1]), "mm"))
        contact = _contact(readings.time_s, force)
        if contact is None:
            peak = min(float(force.max()) / _STEP_N, 0.9)
            return PageProgress("Step on the plate, and off again.", max(peak, 0.0), shown)
        taken = _footstep(step.position, force[contact], readings.displacement_mm[contact])
        _require_rise([*self._footsteps()[0], taken[0]])
        self._taken[self._at] = taken
        return None

    def _is_on(self, force: Floats) -> bool:
        """Return whether a person is on the plate: the force changes, or exceeds its initial value."""
        moves = [data for data in self.step_data() if data.step.page.key == "move1"]
        most = _rest_of(moves[0].readings) + 2.0 * _ON_N if moves else _PERSON_N
        return float(np.ptp(force)) > 4.0 * _ON_N or float(np.median(force)) > most

    def _rest_n(self) -> float:
        """Return the force with nobody on the plate: at the end of the last move."""
        return _rest_of([data for data in self.step_data() if data.step.page.key.startswith("move")][-1].readings)

    def _footsteps(self) -> tuple[list["FootstepLine"], list[tuple[Floats, Floats]]]:
        """Return the lines of the footsteps so far, and the force and displacement of each."""
        taken = [self._taken[k] for k in sorted(self._step_data) if k in self._taken]
        return [line for line, _, _ in taken], [(force, displacement) for _, force, displacement in taken]


def _setup_questions() -> tuple[Parameter, ...]:
    return (
        ask(
            "force",
            Choice(
                LOAD_CELL,
                FORCES,
                label="Force measured by",
                doc="What measures the force: a load cell, or the tile, calibrated.",
            ),
        ),
        ask(
            "positions",
            Numbers(
                POSITIONS, 0.0, 1.0, least=2, most=20, label="Positions of the servo", doc="From softest to stiffest."
            ),
        ),
        ask(
            "footsteps",
            Count(
                FOOTSTEPS,
                low=LEAST_FOOTSTEPS,
                high=50,
                label="Footsteps at each position",
                doc="Sixty in all are the thesis's.",
            ),
        ),
    )


def _clear(position: float) -> PressRequest:
    """Return the request to stand clear while the servo goes to a position."""
    return PressRequest((0.0, 0.0), 0.0, _CLEAR_S, position=position)


def _rest_of(readings: Readings) -> float:
    """Return the force of the plate alone, at the end of these readings."""
    recent = readings.last(0.5 * _CLEAR_S) or readings
    return 0.0 if recent.force_n is None else float(np.median(recent.force_n))


def _contact(time_s: Floats, force: Floats) -> slice | None:
    """Return the samples of the first footstep that begins and ends in these readings; None if there is none yet."""
    on = force > max(_ON_N, 0.05 * float(force.max()))
    if on.all():
        return None
    before = int(np.argmin(on))
    loaded = before + np.flatnonzero(on[before:])
    if not loaded.size or time_s[-1] - time_s[loaded[-1]] < _RELEASED_S:
        return None
    return slice(int(loaded[0]), int(loaded[-1]) + 1)


def _footstep(position: float, force: Floats, displacement: Floats) -> "Footstep":
    """Return a footstep with its regression line; raise `BadMeasurement` if load or displacement is too small."""
    from underfoot.calibration.science.plate_stiffness import line_of

    if force.max() < _LEAST_PEAK_N:
        raise BadMeasurement(
            f"the footstep reached {force.max():.0f} N; allowed: {_LEAST_PEAK_N:.0f} N or more; "
            "step on the plate with your weight"
        )
    return line_of(position, force, displacement), force, displacement


def _require_rise(lines: Sequence["FootstepLine"]) -> None:
    """Raise `BadMeasurement` where stiffness falls, or at the last position hardly rises: the plate did not move."""
    from underfoot.calibration.science.plate_stiffness import ALLOWED_ERROR, plate_fit

    if len({line.position for line in lines}) < 2:
        return
    found = plate_fit(lines).calibration
    (before, last), (soft, stiff) = found.positions[-2:], found.stiffness_n_mm[-2:]
    count = sum(line.position == last for line in lines)
    if count >= LEAST_FOOTSTEPS and stiff < (1.0 + ALLOWED_ERROR) * soft:
        raise BadMeasurement(
            f"stiffness hardly rises, from {soft:.1f} to {stiff:.1f} N/mm between positions {before:g} and {last:g}; "
            "does the servo move the plate, or does a sensor clip? Then go back to the first footstep there"
        )


Footstep = tuple["FootstepLine", Floats, Floats]
"""Line, force and displacement of a footstep."""
