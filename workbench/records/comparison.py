"""Recordings, feet or persons compared: the same measures side by side, and the mean force over the stance of each."""

import math
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from msgspec import Struct
from msgspec.structs import asdict, replace
from numpy.typing import ArrayLike, NDArray

from underfoot.arguments import choice
from underfoot.drawing import Drawing, Series
from underfoot.files import replaced, written
from underfoot.floor.footsteps import BODY_WEIGHT_MEASURES
from underfoot.floor.gait_summary import PersonGait, counting, gait_of, on_the_way
from underfoot.records.survey import STANCE, Stance
from underfoot.records.tables import csv_line, require_table_name

BY = ("recording", "side", "person")
"""What groups differ in; those by side and by person are of each recording."""
STEP_MEASURES = (
    "contact_ms",
    "peak1_n",
    "valley_n",
    "peak2_n",
    "impulse_ns",
    "loading_kn_s",
    "path_mm",
    "net_mm",
    "cadence_per_min",
    "step_length_mm",
    "step_width_mm",
    "swing_ms",
    "double_support_ms",
    "speed_m_s",
    "stance_percent",
)
"""Measures of a `Step` of which a mean says something; that of a heading, a time or a number does not."""
GAIT_MEASURES = ("stance_asymmetry_percent", "length_asymmetry_percent", "stride_variation_percent")
"""Measures of a `PersonGait` that no single step has: their means are over persons. Feet apart have none."""
PERCENT = np.linspace(0.0, 100.0, STANCE)
"""The share of stance at each value of a curve."""
_MOST_BANDS = 4
"""Of more groups, bands would lie over each other and over the means."""
STANCE_SUFFIX = ".stance.csv"

_NO_SHARE = ("double_support_ms", "stance_percent", *GAIT_MEASURES)
_COLOURS = ("force", "vibration", "events", "contact", "measured", "muted")


class Figures(Struct, frozen=True):
    """Mean and standard deviation (of a sample) of `count` values; NaN if there are too few.

    `difference` is the mean's from that of the first group, and `difference_percent` the same in % of the first mean;
    NaN for a measure that is in percent, or can be negative: a share of it says nothing.
    """

    count: int
    mean: float
    sd: float
    difference: float = math.nan
    difference_percent: float = math.nan


class StanceCurve(Struct, frozen=True):
    """Mean and standard deviation of the force of `count` steps at 0 to 100 % of stance: `STANCE` values; NaN if too
    few."""

    count: int
    mean: NDArray[np.float64]
    sd: NDArray[np.float64]


class Group(Struct, frozen=True):
    """Steps that are compared with others; `persons` are those who are known. `figures` are by the measure's name.

    `stance` is in N, `stance_bw` in % of the body weight of those of whom it is noted.
    """

    name: str
    steps: int
    persons: int
    figures: dict[str, Figures]
    stance: StanceCurve
    stance_bw: StanceCurve


def compared(recordings: Mapping[str, Sequence[Stance]], by: str = "recording") -> list[Group]:
    """Return the groups of some recordings, given by their names, in the order of these, then of sides or persons.

    Groups by side or by person leave out the steps of which it is not known. Those that are left out of a recording
    count nowhere, nor what is measured from them to the next ones.

    >>> from underfoot.floor.footsteps import Step
    >>> steps = [Step(k, "t1", ("left", "right")[k % 2], k, 600.0 + 10.0 * k, *[1.0] * 7) for k in range(4)]
    >>> left, right = compared({"walk": [Stance(step, ()) for step in steps]}, "side")
    >>> left.name, left.figures["contact_ms"].mean, right.name, right.figures["contact_ms"].difference
    ('left', 610.0, 'right', 10.0)
    """
    choice("by", by, BY)
    groups: list[Group] = []
    for recording, whole in recordings.items():
        gaits = gait_of(one.step for one in whole) if by != "side" else []  # of steps that follow one another
        name = recording if len(recordings) > 1 or by == "recording" else ""
        groups += [_group(of, stances, gaits) for of, stances in _divided(name, _counting(whole), by)]
    return [replace(group, figures=_against(groups[0].figures, group.figures)) for group in groups]


def names_of(paths: Sequence[Path]) -> list[str]:
    """Return a short name of each recording: without its folder, unless another has the same.

    >>> names_of([Path("before/anna.underfoot"), Path("after/anna.underfoot"), Path("after/ben.underfoot")])
    ['before/anna', 'after/anna', 'ben']
    """
    short = [path.stem for path in paths]
    with_folder = [f"{path.parent.name}/{path.stem}" for path in paths]
    for names, longer in ((short, with_folder), (with_folder, [str(path) for path in paths])):
        twice = {name for name in names if names.count(name) > 1}
        short = [other if name in twice else name for name, other in zip(short, longer, strict=True)]
    return short


def stance_curve(curves: Sequence[Sequence[float] | NDArray[np.float64]]) -> StanceCurve:
    """Return mean and spread of the curves of some steps; a step without a curve is left out.

    >>> found = stance_curve([np.zeros(101), np.full(101, 2.0), ()])
    >>> found.count, float(found.mean[50]), round(float(found.sd[50]), 3)
    (2, 1.0, 1.414)
    """
    kept = np.array([curve for curve in curves if len(curve) == STANCE]).reshape(-1, STANCE)
    unknown = np.full(STANCE, math.nan)
    mean = kept.mean(axis=0) if len(kept) else unknown
    return StanceCurve(len(kept), mean, kept.std(axis=0, ddof=1) if len(kept) > 1 else unknown)


def band(curve: StanceCurve, name: str = "± 1 SD", colour: str = "force", *, in_legend: bool = True) -> Series:
    """Return one standard deviation around a mean."""
    return Series(name, PERCENT, curve.mean, "band", colour, in_legend=in_legend, spread=curve.sd)


def of_body_weight(one: Stance) -> NDArray[np.float64]:
    """Return the curve of a step in % of the body weight; () if that is not noted.

    >>> from underfoot.floor.footsteps import Step
    >>> step = Step(1, "t1", "left", 0.2, 600.0, *[0.0] * 7, body_weight_n=800.0)
    >>> of_body_weight(Stance(step, (0.0, 1000.0))).tolist()
    [0.0, 125.0]
    """
    known = math.isfinite(one.step.body_weight_n)
    return 100.0 * np.array(one.force_n if known else ()) / one.step.body_weight_n


def comparison_drawing(groups: Sequence[Group], note: str = "no steps") -> Drawing:
    """Return the mean force over stance of each group, of up to four with bands of one SD; a note without any.

    It is in % of body weight where that of all steps is noted, else in N.
    """
    series = []
    in_bw = sum(group.stance_bw.count for group in groups) == sum(group.stance.count for group in groups) > 0
    shown = [(k, g.name, g.stance_bw if in_bw else g.stance) for k, g in enumerate(groups) if g.stance.count]
    looks = {k: (_COLOURS[k % len(_COLOURS)], "dashed" if k >= len(_COLOURS) else "line") for k, *_ in shown}
    has_bands = len(shown) <= _MOST_BANDS
    series += [
        band(curve, f"{name} ± 1 SD", looks[k][0], in_legend=False)
        for k, name, curve in shown
        if has_bands and curve.count > 1
    ]
    series += [Series(name, PERCENT, curve.mean, looks[k][1], looks[k][0]) for k, name, curve in shown]
    largest = max((float(np.max(one.outline_y)) for one in series), default=0.0)
    return Drawing(
        "Stance",
        "share of stance, %",
        f"mean force{' ± 1 SD' if has_bands else ''}, {'% of body weight' if in_bw else 'N'}",
        tuple(series),
        x_range=(0.0, 100.0),
        y_range=(0.0, max(100.0, 1.05 * largest)),
        note="" if series else note,
    )


# --- files ---


def comparison_csv(groups: Sequence[Group]) -> str:
    """Return a table, a line per measure: n of each group, mean, SD, and difference from the first one."""
    heads = ["measure"]
    for number, group in enumerate(groups):
        ends = ("n", "mean", "SD", *(("difference", "difference %") if number else ()))
        heads += [f"{group.name} {end}" for end in ends]
    lines = [heads]
    for measure in (*STEP_MEASURES, *GAIT_MEASURES, *BODY_WEIGHT_MEASURES):
        cells = [measure]
        for number, group in enumerate(groups):
            one = group.figures[measure]
            further = (one.difference, one.difference_percent) if number else ()
            cells += [str(one.count), *map(_cell, (one.mean, one.sd, *further))]
        lines.append(cells)
    return _csv(lines)


def stance_csv(groups: Sequence[Group]) -> str:
    """Return the curves: share of stance, and mean and SD of each group in N; then in % of body weight where noted."""
    kinds = [("n", [group.stance for group in groups])]
    if any(group.stance_bw.count for group in groups):
        kinds.append(("percent_bw", [group.stance_bw for group in groups]))
    names = [group.name for group in groups]
    lines = [["percent", *(f"{name} {end}_{unit}" for unit, _ in kinds for name in names for end in ("mean", "sd"))]]
    curves = [values for _, of_groups in kinds for one in of_groups for values in (one.mean, one.sd)]
    lines += [[f"{percent:g}", *map(_cell, row)] for percent, *row in zip(PERCENT, *curves, strict=True)]
    return _csv(lines)


def write_comparison(groups: Sequence[Group], path: Path) -> None:
    """Write both tables as CSV: the curves beside `path`, as NAME.stance.csv. `BadFile` if that fails."""
    require_table_name(path)
    curves = path.with_suffix(STANCE_SUFFIX)
    with replaced(path) as part, replaced(curves) as beside, written(path):
        part.write_text(comparison_csv(groups), encoding="utf-8", newline="\n")
        beside.write_text(stance_csv(groups), encoding="utf-8", newline="\n")


def comparison_data(groups: Sequence[Group]) -> list[dict[str, Any]]:
    """Return the groups as plain data for JSON, with None for what is not known."""
    return [
        {
            "name": group.name,
            "steps": group.steps,
            "persons": group.persons,
            "measures": {name: {k: _plain(v) for k, v in asdict(one).items()} for name, one in group.figures.items()},
            "stance": _curve_data(group.stance, "n"),
            "stance_bw": _curve_data(group.stance_bw, "percent_bw"),
        }
        for group in groups
    ]


def _curve_data(curve: StanceCurve, unit: str) -> dict[str, Any]:
    means = {f"{name}_{unit}": values.tolist() for name, values in (("mean", curve.mean), ("sd", curve.sd))}
    return {"count": curve.count} | {name: [*map(_plain, values)] for name, values in means.items()}


def _csv(lines: Sequence[Sequence[str]]) -> str:
    return "".join(f"{csv_line(line)}\n" for line in lines)


def _cell(value: float) -> str:
    return f"{value:.6g}" if math.isfinite(value) else ""


def _plain(value: float) -> float | None:
    return value if math.isfinite(value) else None


# --- figures ---


def _counting(whole: Sequence[Stance]) -> list[Stance]:
    """Return the footsteps with what counts of them, of which those beside a turn have no length and width; none has
    the curve of one that is left out."""
    steps = on_the_way(counting([one.step for one in whole]))
    return [Stance(step, () if step.left_out else one.force_n) for step, one in zip(steps, whole, strict=True)]


def _divided(recording: str, stances: Sequence[Stance], by: str) -> Iterator[tuple[str, Sequence[Stance]]]:
    """Yield the groups of a recording by their names; `recording` is "" where it does not tell them apart."""
    if by == "recording":
        yield recording, stances
        return
    persons = sorted({one.step.person for one in stances if not one.step.left_out} - {0})
    values: Sequence[str | int] = ("left", "right") if by == "side" else persons
    for value in values:
        name = str(value) if by == "side" else f"person {value}"
        found = [one for one in stances if getattr(one.step, by) == value]
        if not all(one.step.left_out for one in found):
            yield f"{recording}, {name}" if recording else name, found


def _group(name: str, stances: Sequence[Stance], gaits: Sequence[PersonGait]) -> Group:
    """Return the group of some steps, with what is known of the gait of those who made them."""
    steps = [one.step for one in stances]
    measures = (*STEP_MEASURES, *BODY_WEIGHT_MEASURES)
    values = {name: np.array([getattr(step, name) for step in steps]) for name in measures}
    for loading in ("loading_kn_s", "loading_percent_bw_per_s"):
        values[loading][[step.spike for step in steps]] = math.nan  # an impact has it
    figures = {name: _figures(of_steps) for name, of_steps in values.items()}
    persons = [step.person for step in steps if not step.left_out]
    of_persons = [gait for gait in gaits if gait.person in persons]
    figures |= {measure: _figures([getattr(gait, measure) for gait in of_persons]) for measure in GAIT_MEASURES}
    curves = (stance_curve([one.force_n for one in stances]), stance_curve([of_body_weight(one) for one in stances]))
    return Group(name, len(persons), len({*persons} - {0}), figures, *curves)


def _figures(values: ArrayLike) -> Figures:
    given = np.asarray(values, np.float64)
    known = given[np.isfinite(given)]
    mean = float(known.mean()) if len(known) else math.nan
    return Figures(len(known), mean, float(known.std(ddof=1)) if len(known) > 1 else math.nan)


def _against(first: Mapping[str, Figures], figures: Mapping[str, Figures]) -> dict[str, Figures]:
    def of(name: str, one: Figures) -> Figures:
        if first is figures:
            return one
        difference, base = one.mean - first[name].mean, first[name].mean
        share = 100.0 * difference / base if base > 0.0 and name not in _NO_SHARE else math.nan
        return replace(one, difference=difference, difference_percent=share)

    return {name: of(name, one) for name, one in figures.items()}
