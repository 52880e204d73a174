"""Stiffness of a variable stiffness plate from footsteps on it (thesis 6.3): a line for each, then over the position.

Each footstep is a profile of force over displacement. Its stiffness is the slope of the least-squares line; that of the
plate at a position is the mean over the profiles there.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import date
from itertools import cycle

import numpy as np

from underfoot.arguments import number, numbers
from underfoot.devices.plate import PlateCalibration
from underfoot.drawing import Drawing, series
from underfoot.errors import BadMeasurement, require
from underfoot.kernels import Floats
from underfoot.quantities import counted

LEAST_SAMPLES = 50
"""Fewest samples of a footstep through which a line is fitted."""
LEAST_TRAVEL_MM = 0.2
"""Smallest travel of the plate that shows its stiffness."""
ALLOWED_ERROR = 0.03
"""Mean relative error above which a calibration should be repeated; the thesis had about 1 %."""

_DOTS = 40
"""Samples of a footstep that are drawn; more hide its line."""
_COLOURS = ("force", "contact", "vibration", "events", "muted")


@dataclass(frozen=True)
class FootstepLine:
    """Line through one profile: its stiffness, the force at zero displacement, and explained variance."""

    position: float
    stiffness_n_mm: float
    force_at_zero_n: float
    r_squared: float


@dataclass(frozen=True)
class PlateFit:
    """Calibration with its lines, and `errors`: each line's relative error against the others at its position.

    The error of a line that is alone at its position is NaN; with one line at each position none is known.
    """

    calibration: PlateCalibration
    lines: tuple[FootstepLine, ...]
    errors: Floats

    @property
    def good(self) -> bool:
        """Whether the mean error is known, and small enough."""
        return self.calibration.error is not None and self.calibration.error <= ALLOWED_ERROR


def line_of(position: float, force_n: Floats, displacement_mm: Floats) -> FootstepLine:
    """Fit the line of one footstep. `BadMeasurement` if it is too short, or does not press the plate.

    >>> x = np.linspace(0.0, 8.0, 100)
    >>> line_of(0.5, 20.0 + 90.0 * x, x).stiffness_n_mm.round(6)
    np.float64(90.0)
    """
    number("position", position, 0.0, 1.0, "0 to 1")
    force_n, displacement_mm = numbers("force_n", force_n), numbers("displacement_mm", displacement_mm)
    same = force_n.size == displacement_mm.size
    require(same, "displacement_mm", f"{displacement_mm.size} samples", f"{force_n.size}, as of force_n")
    travel_mm = float(np.ptp(displacement_mm)) if len(displacement_mm) else 0.0
    if len(force_n) < LEAST_SAMPLES or travel_mm < LEAST_TRAVEL_MM:
        raise BadMeasurement(
            f"a footstep at position {position:g} has {counted(len(force_n), 'sample')} over {travel_mm:.2f} mm; "
            f"allowed: {LEAST_SAMPLES} or more, over {LEAST_TRAVEL_MM:g} mm or more"
        )
    squared_mm, product, _, squared_n = np.cov(displacement_mm, force_n, bias=True).flat
    slope = product / squared_mm
    if not slope > 0.0:
        raise BadMeasurement(
            f"a footstep at position {position:g} has less force the deeper it goes; are columns swapped?"
        )
    correlation = min(product / np.sqrt(squared_mm * squared_n), 1.0)
    return FootstepLine(position, slope, force_n.mean() - slope * displacement_mm.mean(), correlation**2)


def plate_fit(lines: Sequence[FootstepLine]) -> PlateFit:
    """Fit the calibration of all lines. `BadMeasurement` for a single position, or stiffness that does not rise."""
    by_position: dict[float, list[FootstepLine]] = {}
    for line in lines:
        by_position.setdefault(line.position, []).append(line)
    positions = sorted(by_position)
    means = [float(np.mean([line.stiffness_n_mm for line in by_position[at]])) for at in positions]
    if len(positions) < 2:
        raise BadMeasurement("footsteps at one position only; two or more positions are needed")
    falls = next((k for k in range(1, len(means)) if means[k] <= means[k - 1]), 0)
    if falls:
        raise BadMeasurement(
            f"stiffness falls from {means[falls - 1]:.1f} to {means[falls]:.1f} N/mm between positions "
            f"{positions[falls - 1]:g} and {positions[falls]:g}; measure these again"
        )
    errors = np.array([_error(line, by_position[line.position]) for line in lines])
    kept = errors[np.isfinite(errors)]
    calibration = PlateCalibration(
        positions=tuple(positions),
        stiffness_n_mm=tuple(float(f"{mean:.6g}") for mean in means),
        error=float(f"{kept.mean():.4g}") if kept.size else None,
        made=date.today().isoformat(),
    )
    return PlateFit(calibration, tuple(lines), errors)


def drawings_of(fit: PlateFit, profiles: Sequence[tuple[Floats, Floats]]) -> tuple[Drawing, ...]:
    """Return stiffness over position, and a footstep of each position with its line.

    Its logarithm is interpolated between positions: a straight line on this axis.
    """
    at = [line.position for line in fit.lines]
    every = series("footsteps", at, [line.stiffness_n_mm for line in fit.lines], "dots", "force")
    mean = series("calibration", fit.calibration.positions, fit.calibration.stiffness_n_mm)
    over = Drawing("Stiffness over position", "position of the servo", "stiffness, N/mm", (every, mean), y_log=True)
    return over, profiles_drawn(fit.lines, profiles)


def profiles_drawn(lines: Sequence[FootstepLine], profiles: Sequence[tuple[Floats, Floats]]) -> Drawing:
    """Return the latest footstep of each position with its line; `profiles` are force and displacement of each line."""
    latest = {line.position: (line, *profile) for line, profile in zip(lines, profiles, strict=True)}
    drawn = []
    for (position, (line, force, displacement)), colour in zip(sorted(latest.items()), cycle(_COLOURS), strict=False):
        ends = np.array([displacement.min(), displacement.max()])
        some = slice(None, None, max(len(force) // _DOTS, 1))
        drawn.append(series("", displacement[some], force[some], "dots", colour))
        name = f"{position:g}: {line.stiffness_n_mm:.1f} N/mm"
        drawn.append(series(name, ends, line.force_at_zero_n + line.stiffness_n_mm * ends, "line", colour))
    return Drawing("A footstep at each position", "displacement, mm", "force, N", tuple(drawn))


def _error(line: FootstepLine, alike: Sequence[FootstepLine]) -> float:
    """Return the relative error of a line against the mean of the others at its position; NaN if it is alone."""
    others = [one.stiffness_n_mm for one in alike if one is not line]
    if not others:
        return float("nan")
    mean = float(np.mean(others))
    return abs(line.stiffness_n_mm - mean) / mean
