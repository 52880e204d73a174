"""Constant stimuli: psychometric curves by condition, and their differences (thesis figure 6.7, tables 6.2, 6.3)."""

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from itertools import cycle
from typing import Any

import numpy as np

from underfoot.drawing import Drawing, ReferenceLine, Series, series
from underfoot.errors import BadMeasurement
from underfoot.experiments.analysis import thesis
from underfoot.experiments.analysis.comparisons import Test, friedman, paired_t
from underfoot.experiments.analysis.estimate import Estimate
from underfoot.experiments.analysis.findings import (
    LINE_COLOURS,
    Cell,
    Findings,
    Table,
    estimates_table,
    means_table,
    people_drawn,
)
from underfoot.experiments.analysis.preferences import preferences, share_estimates
from underfoot.experiments.analysis.psychometric import NAMES, Guessed, fit, lapses_p
from underfoot.experiments.analysis.psychometric import estimates as curve_estimates
from underfoot.experiments.analysis.settings import Settings
from underfoot.experiments.analysis.staircase import false_alarms
from underfoot.experiments.methods.staircases import GUESSED
from underfoot.experiments.questions import YES
from underfoot.experiments.table import LEVEL, Row, by_value, factors_of, grouped

_STIFFNESS = "stiffness_n_mm"
_LABELS = {_STIFFNESS: "stiffness, N/mm", LEVEL: "level, m/s^2"}
_UNITS = {_STIFFNESS: ("N/mm", "mm/N"), LEVEL: ("m/s^2", "s^2/m")}
"""Units of a PSE and of a slope along factors that have one in their names."""
JND = "jnd"
QUARTER = 0.67448975
"""The 75 % quantile of the standard normal distribution, in standard deviations."""


def judged_more(row: Row) -> bool:
    """Return whether the participant judged the comparison of a trial as greater in its factor.

    >>> judged_more({"interval": "first", "comparison_at": "second", "judged_more": "not chosen"})
    True
    """
    if row.get("felt"):
        return bool(row["felt"] == YES)
    chosen = row["interval"] == row["comparison_at"]
    return bool(chosen != (row.get("judged_more") == "not chosen"))


def axis_and_condition(rows: Sequence[Row], *, in_si: bool = False) -> tuple[str, str]:
    """Return the curves' axis, the numeric factor with most values, and the factor that separates curves, or "".

    A factor with a value of its own for each of another's is the same in other words, and separates nothing. Of the
    level in other words, such as dB, and the level itself, the axis is the former, or, `in_si`, the latter.

    >>> places = [(db, place) for db in (0, 6, 12) for place in ("heel", "toe")]
    >>> rows = [{"stimulus": f"{db}{at}", "level_m_s2": 10.0 ** (db / 20), "db": db, "place": at} for db, at in places]
    >>> axis_and_condition(rows), axis_and_condition(rows, in_si=True)
    (('db', 'place'), ('level_m_s2', 'place'))
    """
    values = {name: {row[name] for row in rows if name in row} for name in factors_of(rows)}
    numbers = [name for name, found in values.items() if all(isinstance(v, int | float) for v in found)]
    if not numbers:
        raise BadMeasurement("the stimuli have no factor that is a number; a curve needs one")
    levels = [name for name in numbers if is_level(rows, name)]
    less = {name for name in levels if (name == LEVEL) != in_si} if len(levels) > 1 else set()
    axis = max((name for name in numbers if name not in less), key=lambda name: len(values[name]))
    return axis, next((name for name in values if name != axis and not _are_one(rows, name, axis)), "")


def is_level(rows: Sequence[Row], name: str) -> bool:
    """Return whether a factor is the level, or the level in other words."""
    return name == LEVEL or _are_one(rows, name, LEVEL)


def _are_one(rows: Sequence[Row], name: str, other: str) -> bool:
    """Return whether each value of a factor belongs to one value of another, and the other way round."""
    pairs = {(row[name], row[other]) for row in rows if name in row and other in row}
    return len({one for one, _ in pairs}) == len({one for _, one in pairs}) == len(pairs) > 0


def prepared(rows: Sequence[Row], *, in_si: bool = False) -> tuple[list[Row], str, str]:
    """Return the rows of stimuli that have a place in the curves, and the axis and the condition of these.

    Who set a level of their own gets other levels than the next. Levels are a condition of all people only as in the
    protocol; as an axis, they are what each person got. Trials of nothing have no place among levels that are detected.

    Raises `BadMeasurement` where no factor is a number, or one stimulus alone is left.
    """
    alike = _at_protocol_levels(rows)
    axis, condition = axis_and_condition(alike, in_si=in_si)
    nothing = {row.get("stimulus") for row in of_nothing(rows, axis)}
    placed = {row.get("stimulus") for row in rows if axis in row and (not condition or condition in row)} - nothing
    if nothing and len(placed) == 1:
        raise BadMeasurement("a curve needs two levels beside nothing; of one, d' tells where right answers are given")
    there = rows if axis == LEVEL else alike
    return [row for row in there if row.get("stimulus") in placed], axis, condition


def of_nothing(rows: Sequence[Row], axis: str) -> list[Row]:
    """Return the trials of one interval in which nothing vibrated, where curves are over levels; else [].

    >>> rows = [{"stimulus": f"s{level}", "level_m_s2": level, "felt": "yes"} for level in (0.0, 0.1, 0.2)]
    >>> of_nothing(rows, "level_m_s2") == rows[:1], of_nothing(rows, "stiffness_n_mm")
    (True, [])
    """
    are_levels = is_level(_at_protocol_levels(rows), axis)
    return [row for row in rows if row.get("felt") and row.get(LEVEL) == 0.0] if are_levels else []


def _at_protocol_levels(rows: Sequence[Row]) -> Sequence[Row]:
    """Return the rows with the levels that the stimuli have where nobody set one.

    >>> _at_protocol_levels([{"gain_db": -6.0, "level_m_s2": 0.215511}])[0]["level_m_s2"]
    0.43
    """
    if not any(row.get("gain_db") for row in rows):
        return rows
    return [
        {**row, LEVEL: float(f"{row[LEVEL] / 10.0 ** (row['gain_db'] / 20.0):.4g}")}
        if LEVEL in row and "gain_db" in row
        else row
        for row in rows
    ]


def further_factors(rows: Sequence[Row], axis: str, condition: str) -> list[str]:
    """Return the factors of which a point of a curve has several values.

    >>> rows = [{"n": n, "on": True, "place": place} for n, place in ((1, "heel"), (1, "toe"), (2, "toe"))]
    >>> further_factors(rows, "n", "on")
    ['place']
    """
    points = grouped(rows, axis, condition).values()
    return [name for name in factors_of(rows) if any(len({row.get(name) for row in point}) > 1 for point in points)]


def axis_label(factor: str) -> str:
    """Return the axis label of this factor.

    >>> axis_label("stiffness_n_mm"), axis_label("foot_side")
    ('stiffness, N/mm', 'foot side')
    """
    return _LABELS.get(factor, factor.replace("_", " "))


def counts(rows: Sequence[Row], axis: str) -> tuple[list[float], list[int], list[int]]:
    """Return levels along the axis, the number of "greater" judgements at each, and the number of trials."""
    parts = by_value(rows, axis)
    yes = [sum(judged_more(row) for row in part) for _, part in parts]
    return [float(level) for level, _ in parts], yes, [len(part) for _, part in parts]


def estimates(rows: Sequence[Row], settings: Settings) -> list[Estimate]:
    """Estimate one person's PSE (without a standard: threshold), slope, JND and intercept for each condition's curve.

    NaN if it cannot be fitted.

    Without a numeric factor, estimate the share of each stimulus.
    """
    try:
        placed, axis, condition = prepared(rows)
    except BadMeasurement:
        return share_estimates(_counted(rows))
    return _curves(placed, of_nothing(rows, axis), axis, condition, settings)


def _curves(
    rows: Sequence[Row], nothing: Sequence[Row], axis: str, condition: str, settings: Settings
) -> list[Estimate]:
    beside = _guessed(rows, axis, settings)
    found, point = [], _half_name(rows, beside)
    unit, of_slope = _UNITS.get(axis, ("", ""))
    for value, (x, yes, of, guessed) in _answers(rows, nothing, axis, condition, beside):
        try:
            made = curve_estimates(x, yes, of, settings.bootstrap, with_lapses=settings.with_lapses, guessed=guessed)
        except BadMeasurement:
            made = tuple(Estimate(name, np.nan) for name in NAMES[: 4 if settings.with_lapses else 3])
        slope = replace(made[1], unit=of_slope)
        jnd = () if beside else _jnd(slope)
        named = (replace(made[0], name=point, unit=unit), slope, *jnd, *made[2:])
        found += [replace(one, name=f"{one.name} {value}".rstrip()) for one in named]
    return found


def _guessed(rows: Sequence[Row], axis: str, settings: Settings) -> float:
    """Return the share of right answers where nothing is felt: a half where a level is to be found beside silence."""
    return GUESSED if settings.is_beside_silence and is_level(rows, axis) else 0.0


def _answers(
    rows: Sequence[Row], nothing: Sequence[Row], axis: str, condition: str, beside: float
) -> list[tuple[Any, tuple[list[float], list[int], list[int], Guessed]]]:
    """Return the levels, the answers, and what is guessed, of each condition's curve."""
    parts = _by_condition(rows, condition)
    return [(value, (*counts(part, axis), beside or _to_nothing(nothing, condition, value))) for value, part in parts]


def _to_nothing(rows: Sequence[Row], condition: str, value: object) -> Guessed:
    """Return to how many of how many trials of nothing the answer was yes, of one condition where they have it.

    >>> rows = [{"felt": felt, "place": place} for felt, place in (("yes", "toe"), ("no", "toe"), ("no", "heel"))]
    >>> _to_nothing(rows, "place", "toe"), _to_nothing(rows, "shoe", "soft"), _to_nothing([], "", "")
    ((1, 2), (1, 3), 0.0)
    """
    mine = [row for row in rows if row.get(condition, value) == value]
    return (sum(map(judged_more, mine)), len(mine)) if mine else 0.0


def _half_name(rows: Sequence[Row], guessed: float) -> str:
    """Return what the middle of the curve is: beside a standard it is equal to that, alone or beside silence a
    threshold.
    """
    return "pse" if not guessed and any(row.get("comparison_at") or row.get("other") for row in rows) else "threshold"


def findings(rows: Sequence[Row], settings: Settings) -> Findings:
    """Report over people: shares by level, curves, and tests of PSE, slope and intercept between conditions."""
    all_rows = rows
    try:
        rows, axis, condition = prepared(rows)
    except BadMeasurement as error:
        plain = preferences(_counted(rows))
        plain.remarks.append(f"No psychometric curve: {error}.")
        return plain
    guessed = _guessed(rows, axis, settings)
    found, half = Findings("Constant stimuli"), _half_name(rows, guessed)
    if not guessed and settings.is_beside_silence is not False and any(row.get("comparison_at") for row in rows):
        found.remarks += _as_if_beside_vibration(rows, axis, settings)
    nothing = of_nothing(all_rows, axis)
    if beside := len(all_rows) - len(rows) - len(nothing):
        needed = " and ".join(filter(None, (axis, condition)))
        they, their = ("trials are", "their stimuli have") if beside > 1 else ("trial is", "its stimulus has")
        found.remarks.append(f"{beside} {they} in no curve: {their} no {needed}.")
    if mixed := ", ".join(further_factors(rows, axis, condition)):
        found.remarks.append(f"Each curve is over all values of {mixed}: they are told apart by {condition} only.")
    of_nobody = grouped(nothing, "participant")
    people = {
        who: _curves(part, of_nobody.get((who,), []), axis, condition, settings)
        for (who,), part in grouped(rows, "participant").items()
    }
    if not settings.with_lapses:
        found.remarks += _lapsing(rows, nothing, axis, condition, guessed)
    lines = [(str(person), one) for person, several in people.items() for one in several]
    along = f"Along {axis_label(axis)}{f'; each number is of {axis_label(condition)}' if condition else ''}."
    how = f"{along} {_how(lines, half, guessed, settings, with_nothing=bool(nothing))}"
    found.tables.append(estimates_table("Curves of each person", "participant", lines, how))
    found.remarks += _unbounded(lines, half) + _turned_around(lines, axis)
    values = [{one.name: one.value for one in several} for several in people.values()]
    by_name = {one.name: [of.get(one.name, np.nan) for of in values] for _, one in lines}
    is_thesis = _is_of_thesis(rows, axis, condition)
    units = {one.name: one.unit for _, one in lines}
    found.tables.append(_over_people(by_name, units, beside_thesis=is_thesis))
    found.tables += [_shares(rows, axis, condition), *false_alarms([{**row, "catch": True} for row in nothing])]
    found.drawings.append(_curves_drawn(rows, nothing, axis, condition, guessed, settings))
    halves = [line for line in lines if line[1].name.split(" ")[0] == half]
    title, apart = "PSE" if half == "pse" else "Thresholds", axis_label(condition or "all stimuli")
    found.drawings += people_drawn(f"{title} over people", apart, axis_label(axis), halves)
    for name in (half, "slope", "intercept"):
        compared = {k: values for k, values in by_name.items() if k.split(" ")[0] == name}
        if len(compared) > 1:
            found.add_tests(
                f"Does {condition} change the {name}?",
                _tests(name, compared),
                " ".join(filter(None, (_THESIS.get(name) if is_thesis else "", _lacking(name, compared, people)))),
            )
    return found


def _as_if_beside_vibration(rows: Sequence[Row], axis: str, settings: Settings) -> list[str]:
    """Return what is missing to know that curves begin at a half, where the standard is silence, or may be."""
    if not any(LEVEL in row for row in rows):
        return [
            f"These trials have no column {LEVEL}: analysed as if the standard vibrates. Beside silence curves begin "
            "at a half: give `underfoot analyse --protocol`, and that column, or stimuli as the protocol names them."
        ]
    if settings.is_beside_silence is None and is_level(rows, axis):
        return [
            "These trials come without their protocol: analysed as if the standard vibrates. Beside silence curves "
            "begin at a half: `underfoot analyse --protocol` knows."
        ]
    return []


def _lapsing(rows: Sequence[Row], nothing: Sequence[Row], axis: str, condition: str, beside: float) -> list[str]:
    """Return a remark where answers look like lapses, and nothing elsewhere."""
    people, of_nobody = grouped(rows, "participant").items(), grouped(nothing, "participant")
    parts = [_answers(part, of_nobody.get(who, []), axis, condition, beside) for who, part in people]
    p = lapses_p(curve for person in parts for _, curve in person)
    if p >= _UNLIKELY:
        return []
    return [
        f"Answers far from the middle look like lapses (p = {p:.2g}): slopes are too shallow. "
        "`underfoot analyse --lapses`, or Lapses under Results in the window, gives curves a lapse rate."
    ]


_UNLIKELY = 0.01


def _how(
    lines: Sequence[tuple[str, Estimate]], half: str, guessed: float, settings: Settings, *, with_nothing: bool
) -> str:
    """Return what is to be known of the curves of each person."""
    called = _CALLED.get(half, half)
    how = f"Intervals of {settings.bootstrap} bootstrap draws." if settings.bootstrap else "Intervals by covariance."
    if settings.with_lapses:
        how += " Each curve has a lapse rate."
    if any(_is_unbounded(one) for _, one in lines):
        how += f" From -inf to inf: the slope may be 0, and these trials do not bound the {called}."
    if any(math.isnan(one.value) for _, one in lines):
        how += " Empty: the answers are all alike; or, of a slope, they turn between two levels, or at one."
    if any(math.isinf(one.low) != math.isinf(one.high) for _, one in lines if not one.name.startswith(JND)):
        how += " A bound of inf, and of 0 for the JND: these trials do not bound the slope."
    if guessed:
        return how + " Half of what is not felt is guessed rightly: the threshold is where three quarters are right."
    if with_nothing:
        return how + _FROM_NOTHING
    return how + f" JND: from the {called} to where the share is three quarters, 0.6745 / slope."


_FROM_NOTHING = (
    " Curves begin at the share of yes to nothing, which is estimated with them: the threshold is where half of the "
    "rest is yes. JND: from there to where three quarters of the rest are, 0.6745 / slope."
)


def _unbounded(lines: Sequence[tuple[str, Estimate]], half: str) -> list[str]:
    """Return whose answers may say nothing: their estimate is in means and tests as a value between the levels.

    Those that turn between two levels, which few trials do not bound either, have no slope, and are no guesses.

    >>> pses = {"P1": Estimate("pse", 99.0, -math.inf, math.inf), "P2": Estimate("pse", 90.0, 80.0, 95.0)}
    >>> _unbounded(list(pses.items()), "pse")
    ['The answers of P1 may be guesses: their PSE is drawn to the middle of the levels, and counts over people.']
    """
    turn = {(who, one.name.partition(" ")[2]) for who, one in lines if math.isnan(one.value)}
    named = [who for who, one in lines if _is_unbounded(one) and (who, one.name.partition(" ")[2]) not in turn]
    if not (people := ", ".join(dict.fromkeys(named))):
        return []
    point = _CALLED.get(half, half)
    its = f"their {point} is drawn to the middle of the levels, and counts over people"
    if any(one.name.startswith(JND) for _, one in lines):
        its += "; so does their JND, which may be any: medians hardly change"
    return [f"The answers of {people} may be guesses: {its}."]


def _turned_around(lines: Sequence[tuple[str, Estimate]], axis: str) -> list[str]:
    """Return whose curves fall, unless most rise, or run against most people's; slopes whose intervals hold 0 say
    nothing.

    >>> slopes = {"P1": 0.5, "P2": 0.4, "P3": -0.3, "P4": -0.1}.items()
    >>> lines = [(who, Estimate("slope", at, at - 0.2, at + 0.2)) for who, at in slopes]
    >>> _turned_around(lines, "stiffness_n_mm")
    ['The answers of P3 go the other way than most, and count: keys or question may be mistaken.']
    >>> _turned_around(lines[1:3], "stiffness_n_mm")  # of one who is right and one who is not
    ['The curves of P3 fall with stiffness: question, keys or judged_more may be mistaken.']
    """
    sure = [(who, one.value) for who, one in lines if one.name.split(" ")[0] == "slope" and one.low * one.high > 0.0]
    most = sum(math.copysign(1.0, value) for _, value in sure)
    found = list[str]()
    if most <= 0.0 and (falling := ", ".join(dict.fromkeys(who for who, value in sure if value < 0.0))):
        what = axis_label(axis).partition(",")[0]
        found.append(f"The curves of {falling} fall with {what}: question, keys or judged_more may be mistaken.")
    if people := ", ".join(dict.fromkeys(who for who, value in sure if value * most < 0.0)):
        found.append(
            f"The answers of {people} go the other way than most, and count: keys or question may be mistaken."
        )
    return found


def _is_unbounded(one: Estimate) -> bool:
    return math.isinf(one.low) and math.isinf(one.high) and math.isfinite(one.value)


def _is_of_thesis(rows: Sequence[Row], axis: str, condition: str) -> bool:
    """Return whether the curves are over stiffness, at levels that table 6.3 has.

    >>> [_is_of_thesis([{"level_m_s2": a}], "stiffness_n_mm", "level_m_s2") for a in (0.43, 0.5)]
    [True, False]
    """
    return axis == _STIFFNESS and condition == LEVEL and {row[LEVEL] for row in rows} <= set(thesis.LEVELS_M_S2)


def _jnd(slope: Estimate) -> list[Estimate]:
    """Return the just noticeable difference of a slope; none of one that is 0, and no upper bound where it may be.

    >>> [(round(one.value, 1), round(one.low, 1), one.high) for one in _jnd(Estimate("slope", -0.02, -0.04, 0.0))]
    [(33.7, 16.9, inf)]
    """
    if not slope.value:
        return []
    low, high = sorted((abs(slope.low), abs(slope.high)))
    widest = math.inf if slope.covers(0.0) else QUARTER / low
    unit = {of_slope: of_level for of_level, of_slope in _UNITS.values()}.get(slope.unit, "")
    return [Estimate(JND, QUARTER / abs(slope.value), QUARTER / high if high else math.inf, widest, unit)]


def _by_condition(rows: Sequence[Row], condition: str) -> list[tuple[Any, list[Row]]]:
    return by_value(rows, condition) if condition else [("", list(rows))]


def _counted(rows: Sequence[Row]) -> list[Row]:
    return [{**row, "counted": judged_more(row)} for row in rows]


_THESIS = {
    "pse": "Thesis table 6.3: chi squared (2) = 34.9, p < 1e-7.",
    "slope": "Thesis table 6.3: chi squared (2) = 17.2, p < 0.0002; the slope falls, though its text says it rose.",
    "intercept": "Thesis table 6.3: chi squared (2) = 3.9, p > 0.14.",
}


def _tests(name: str, values: Mapping[str, Sequence[float]]) -> Callable[[], list[Test]]:
    def make() -> list[Test]:
        table = np.array(list(values.values()))
        whole = np.isfinite(table).all(axis=0)
        kept = dict(zip(values, table[:, whole], strict=True))
        ranks = [friedman(name, list(kept.values()))] if len(kept) > 2 else []
        return ranks + paired_t(kept)

    return make


def _lacking(name: str, values: Mapping[str, Sequence[float]], people: Iterable[object]) -> str:
    """Return who is in no test, for lack of an estimate in a condition.

    >>> _lacking("slope", {"slope 0.0": [0.02, 0.03], "slope 0.43": [0.02, math.nan]}, ["P1", "P2"])
    'Left out, with no slope in some condition: P2.'
    """
    of_people = zip(people, zip(*values.values(), strict=True), strict=True)
    lack = ", ".join(str(who) for who, of in of_people if not all(map(math.isfinite, of)))
    return f"Left out, with no {_CALLED.get(name, name)} in some condition: {lack}." if lack else ""


_CALLED = {"pse": "PSE"}


def _over_people(by_name: Mapping[str, Sequence[float]], units: Mapping[str, str], *, beside_thesis: bool) -> Table:
    printed = {"pse": thesis.PSE_N_MM, "slope": thesis.SLOPE_MM_N, "intercept": thesis.INTERCEPT}
    note = "Thesis table 6.3: stiffness against vibration." if beside_thesis else ""
    lines = [("all people", name, values, units[name]) for name, values in by_name.items()]
    table, rows = means_table("Curves over people", "of", lines, note), list[tuple[Cell, ...]]()
    for row, (name, values) in zip(table.rows, by_name.items(), strict=True):
        word, _, level = name.partition(" ")
        there = [value for value in values if np.isfinite(value)]
        beside = (printed.get(word, {}).get(_number(level), np.nan),) if beside_thesis else ()
        rows.append((*row, float(np.median(there)) if there else np.nan, *beside))
    return replace(
        table, columns=(*table.columns, "median", *(["thesis, median"] if beside_thesis else [])), rows=tuple(rows)
    )


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return np.nan


def _shares(rows: Sequence[Row], axis: str, condition: str) -> Table:
    parts = _by_condition(rows, condition)
    levels = sorted({float(row[axis]) for row in rows})
    lines = []
    for level in levels:
        cells = []
        for _, part in parts:
            here = [judged_more(row) for row in part if float(row[axis]) == level]
            cells.append(float(np.mean(here)) if here else np.nan)
        lines.append((level, *cells))
    names = tuple(f"{condition} {value}" if condition else "share" for value, _ in parts)
    return Table("Share judged more", (axis, *names), tuple(lines), "All people together.")


def _curves_drawn(
    rows: Sequence[Row], nothing: Sequence[Row], axis: str, condition: str, beside: float, settings: Settings
) -> Drawing:
    """Draw shares with the curve of all people together, beside the thesis's shares if the levels are the same."""
    drawn: list[Series] = []
    parts = _answers(rows, nothing, axis, condition, beside)
    for colour, (value, (x, yes, of, guessed)) in zip(cycle(LINE_COLOURS), parts, strict=False):
        name = f"{value} {axis_label(condition).partition(', ')[2] or condition}" if condition else "judged more"
        drawn.append(series(name, x, np.array(yes) / np.array(of), "dots", colour))
        fine = np.linspace(min(x), max(x), 100)
        try:
            curve = fit(x, yes, of, with_lapses=settings.with_lapses, guessed=guessed)
            drawn.append(series("", fine, curve.at(fine), "line", colour))
        except BadMeasurement:
            continue
        if _is_of_thesis(rows, axis, condition):
            label = f"thesis, {value}"
            drawn.append(series(label, thesis.STIFFNESS_N_MM, thesis.JUDGED_STIFFER[value], "dashed", colour))
    half = ReferenceLine("y", 0.5 * (1.0 + beside), dashed=True)
    lines = () if nothing else (half,)  # of each curve, half is at another share there
    return Drawing("Judged more", axis_label(axis), "share", tuple(drawn), y_range=(0.0, 1.0), lines=lines)
