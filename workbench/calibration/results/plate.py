"""Results of a variable stiffness plate: stiffness at each position, a verdict, drawings, and the profile's part."""

from collections.abc import Sequence
from datetime import date

import numpy as np
from numpy.typing import NDArray

from underfoot.calibration.result import Result
from underfoot.calibration.results.labels import title_of
from underfoot.calibration.science.plate_stiffness import ALLOWED_ERROR, FootstepLine, PlateFit, drawings_of, plate_fit
from underfoot.drawing import Drawing
from underfoot.floor.profile import PlateStiffness

METHOD = (
    "At each position of the servo somebody steps on the plate. Each footstep is a profile of force over displacement; "
    "its stiffness is the slope of the least-squares line, that of the plate the mean of those at a position. "
    "The error is how far a line is off the mean of the others at its position. Between positions the logarithm of the "
    "stiffness is interpolated."
)


_LEAST_R_SQUARED = 0.95
"""Explained variance below which a delay between force and displacement makes a plate 3 % too soft, or more."""


def result_of(
    lines: Sequence[FootstepLine],
    samples: Sequence[tuple[NDArray[np.float64], NDArray[np.float64]]],
    reference: str,
    tile: str = "",
) -> Result:
    """Return the result of footsteps: their lines, and force and displacement of each.

    It is for the profile of `tile`; for any tile's if there is none.
    """
    fit = plate_fit(lines)
    found = fit.calibration
    error = None if found.error is None else 100.0 * found.error
    figures = (
        *(() if error is None else (("worst_error_percent", 100.0 * float(np.nanmax(fit.errors)), "%"),)),
        *(
            (f"stiffness_at_{at:.3f}_n_per_mm", stiffness, "N/mm")
            for at, stiffness in zip(found.positions, found.stiffness_n_mm, strict=True)
        ),
        ("least_r_squared", min(line.r_squared for line in lines), ""),
        ("footsteps", float(len(lines)), ""),
    )
    soft, stiff = found.stiffness_n_mm[0], found.stiffness_n_mm[-1]
    verdict = f"The plate has {soft:.1f} to {stiff:.1f} N/mm. {error_words(fit)}"
    part = PlateStiffness(
        made=date.today().isoformat(),
        reference=reference,
        error=0.0 if error is None else float(f"{error:.4g}"),
        error_allowed=100.0 * ALLOWED_ERROR,
        error_unit="" if error is None else "%",
        good=fit.good,
        verdict=verdict,
        figures={name: float(f"{value:.6g}") for name, value, _ in figures},
        positions=found.positions,
        stiffness_n_mm=found.stiffness_n_mm,
    )
    return Result(
        kind="plate",
        title=title_of("plate", tile),
        quantities=figures if error is None else (("mean_error_percent", error, "%"), *figures),
        verdict=verdict,
        good=fit.good,
        warnings=_warnings(lines),
        drawings=drawings_of(fit, samples),
        raw=_raw(lines, samples),
        part=part,
        tile=tile,
        method=METHOD,
    )


def _warnings(lines: Sequence[FootstepLine]) -> tuple[str, ...]:
    """Return a line where force and displacement do not go together, which all footsteps have alike."""
    usual = float(np.median([line.r_squared for line in lines]))
    if usual >= _LEAST_R_SQUARED:
        return ()
    return (
        f"displacement explains {100.0 * usual:.0f} % of the force only: where one lags behind the other, as of two "
        "boards or by a filter, the plate is stiffer than this says, where one clips it may be softer; a foam that is "
        "slow looks the same",
    )


def inconclusive(
    lines: Sequence[FootstepLine],
    samples: Sequence[tuple[NDArray[np.float64], NDArray[np.float64]]],
    reason: str,
    drawings: tuple[Drawing, ...],
    tile: str,
) -> Result:
    """Return the footsteps alone, which led to no stiffness for this reason."""
    return Result("plate", title_of("plate", tile), (), reason, good=False, drawings=drawings, raw=_raw(lines, samples))


def error_words(fit: PlateFit) -> str:
    """Return how far a footstep's line is off the others, and what to do where that is too much or not known."""
    if fit.calibration.error is None:
        return "There is one footstep at each position, so its error is not known: take two or more at each."
    words = f"A footstep's line is off the others at its position by {100.0 * fit.calibration.error:.1f} % on average."
    return words if fit.good else f"{words} That is more than {100.0 * ALLOWED_ERROR:.0f} %: measure again."


def _raw(
    lines: Sequence[FootstepLine], samples: Sequence[tuple[NDArray[np.float64], NDArray[np.float64]]]
) -> tuple[tuple[str, str, NDArray[np.float64]], ...]:
    """Return the table of footsteps, which has a row per sample."""
    rows = [
        np.column_stack([np.full(len(force), line.position), np.full(len(force), k), force, displacement])
        for k, (line, (force, displacement)) in enumerate(zip(lines, samples, strict=True), 1)
    ]
    return (("footsteps", "position,footstep,force_n,displacement_mm", np.concatenate(rows)),)
