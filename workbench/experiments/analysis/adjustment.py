"""Method of adjustment: thresholds or points of equality, constant errors, and what the start does.

Its measures are those of Gescheider (Psychophysics: the fundamentals, 1997, chapter 3): the mean of the settings, their
distance from the standard, and their standard deviation as the difference threshold.
"""

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from underfoot.drawing import Drawing, ReferenceLine, series
from underfoot.experiments.analysis.estimate import Estimate, sd_interval, student_interval
from underfoot.experiments.analysis.findings import Findings, estimates_table, people_drawn
from underfoot.experiments.analysis.settings import Settings
from underfoot.experiments.analysis.staircase import over_people
from underfoot.experiments.methods.adjustment import ASCENDING, DESCENDING, LEVEL_DB, SET_TO, Adjustment
from underfoot.experiments.methods.staircases import PSE, THRESHOLD
from underfoot.experiments.table import Row, grouped

ERROR, SD, START = "CE", "SD", "start"
"""First words of estimates: of the constant error, the standard deviation, and the effect of the start."""
_COLOURS = {ASCENDING: "force", DESCENDING: "vibration"}
_NOTE = (
    "SD: of settings around the mean of their series, the difference threshold of this method. start: ascending minus "
    "descending."
)
_NOTE_OF_ERROR = "CE: constant error, the PSE minus the standard."


def estimates(rows: Sequence[Row], settings: Settings) -> list[Estimate]:
    """Estimate one person's PSE or threshold of each stimulus, the mean of both series, with what goes with it.

    The model is a mean of each series, ascending and descending, and one variance. Intervals are Student's, that of the
    SD by chi squared.
    """
    parts, found = grouped(rows, "comparison"), list[Estimate]()
    order = dict.fromkeys([*settings.given.get("followed", ()), *(str(name) for (name,) in parts)])
    for name in order:
        found += _of_stimulus(name, parts[name,]) if (name,) in parts else []
    return found


def _of_stimulus(name: str, rows: Sequence[Row]) -> list[Estimate]:
    unit = _unit(rows)
    by_series = {of: [_setting(row) for row in rows if row["series"] == of] for of in (ASCENDING, DESCENDING)}
    means = {of: float(np.mean(values)) for of, values in by_series.items() if values}
    free = len(rows) - len(means)
    squares = sum((value - means[of]) ** 2 for of in means for value in by_series[of])
    sd = math.sqrt(squares / free) if free > 0 else math.nan
    error = sd * math.sqrt(sum(1.0 / len(by_series[of]) for of in means))
    middle = student_interval(
        f"{_point(rows)} {name}", sum(means.values()) / len(means), error / len(means), free, unit
    )
    found = [middle]
    if (standard := rows[0].get("standard_at")) not in (None, ""):
        at = float(standard)
        found.append(Estimate(f"{ERROR} {name}", middle.value - at, middle.low - at, middle.high - at, unit))
    found.append(sd_interval(f"{SD} {name}", sd, free, unit))
    if len(means) > 1:
        found.append(student_interval(f"{START} {name}", means[ASCENDING] - means[DESCENDING], error, free, unit))
    return found


def findings(rows: Sequence[Row], settings: Settings) -> Findings:
    """Report over people: thresholds or PSEs, constant errors, standard deviations and effects of the start."""
    found, people, point = Findings("Method of adjustment"), grouped(rows, "participant"), _point(rows)
    title = "Points of subjective equality (PSE)" if point == PSE else "Thresholds"
    lines = [(str(person), one) for (person,), part in people.items() for one in estimates(part, settings)]
    moved = str(settings.given.get("parameter", ""))
    scale = f"Values of {moved}, in its own unit." if moved or not _unit(rows) else "dB re the level of the stimulus."
    has_error = any(one.name.startswith(f"{ERROR} ") for _, one in lines)
    note = " ".join((scale, *([_NOTE_OF_ERROR] if has_error else ()), _NOTE))
    found.tables.append(estimates_table(f"{title} of each person", "participant", lines, note))
    points = [line for line in lines if line[1].name.startswith(f"{point} ")]
    found.tables.append(over_people(title, points, rows, unit=_unit(rows)))
    others = [line for line in lines if line not in points]
    found.tables.append(over_people("SDs, effects of the start and constant errors", others, (), unit=_unit(rows)))
    if settings.given and (held := _held(people, settings)):
        what = "PSE" if point == PSE else THRESHOLD
        found.remarks.append(f"Set to an end of what can be set, beyond which the {what} may lie: {held}.")
    found.drawings += people_drawn(f"{title} over people", "stimulus", _axis(rows), points)
    found.drawings += [_drawn(str(person), part, settings) for (person,), part in people.items()]
    return found


def _held(people: Mapping[tuple[Any, ...], Sequence[Row]], settings: Settings) -> str:
    """Return who has set which stimuli to an end, and in how many of the trials; "" for nobody."""
    ends, found = settings.of(Adjustment)["reach"], list[str]()
    for (person,), rows in people.items():
        counts = {
            str(name): (sum(_setting(row) in ends for row in part), len(part))
            for (name,), part in grouped(rows, "comparison").items()
        }
        of = ", ".join(f"{name} {count} of {all_of}" for name, (count, all_of) in counts.items() if count)
        found += [f"{person} ({of})"] if of else []
    return ", ".join(found)


def _setting(row: Row) -> float:
    """Return what was answered, on its own scale."""
    return float(row[SET_TO] if row.get(SET_TO) not in (None, "") else row[LEVEL_DB])


def _unit(rows: Sequence[Row]) -> str:
    return "" if any(row.get(SET_TO) not in (None, "") for row in rows) else "dB"


def _axis(rows: Sequence[Row]) -> str:
    return "level, dB" if _unit(rows) else "setting"


def _point(rows: Sequence[Row]) -> str:
    """Return what is set: beside a standard what is equal to it, else what is just felt."""
    return PSE if any(row.get("other") for row in rows) else THRESHOLD


def _drawn(person: str, rows: Sequence[Row], settings: Settings) -> Drawing:
    lines = []
    for (of,), part in grouped(rows, "series").items():
        values = [_setting(row) for row in part]
        lines.append(series(str(of), [row["trial"] for row in part], values, "dots", _COLOURS[of]))
    points = [one for one in estimates(rows, settings) if one.name.startswith(f"{_point(rows)} ")]
    marks = tuple(ReferenceLine("y", one.value, dashed=True, name=one.name) for one in points[:3])
    return Drawing(f"Settings of {person}", "trial", _axis(rows), tuple(lines), lines=marks)
