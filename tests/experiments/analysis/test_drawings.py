"""Drawings of many conditions show all of them, or say how many they show."""

import pytest

from underfoot.experiments.analysis.analyses import analysed
from underfoot.experiments.analysis.settings import Settings

pytest.importorskip("statsmodels")
NAMES = tuple("abcdef")


def drawing_of(method, rows, title):
    """Return the drawing with this title of one person's rows of a method."""
    given = [
        {"participant": "P1", "stage": "main", "method": method, "block": 1, "trial": trial, **row}
        for trial, row in enumerate(rows, 1)
    ]
    (found,) = analysed(given, None, Settings(bootstrap=0))
    return next(drawing for drawing in found.drawings if drawing.title.startswith(title))


def named(drawing):
    return [series.name for series in drawing.series if series.name and series.name != "95 %"]


def test_a_curve_is_drawn_of_each_of_six_conditions():
    rows = [
        {"stimulus": f"{name}{level}", "material": name, "loudness": level, "felt": "yes" if level > k % 4 else "no"}
        for name in NAMES
        for level in range(9)
        for k in range(4)
    ]
    assert named(drawing_of("constant-stimuli", rows, "Judged more")) == [f"{name} material" for name in NAMES]


def test_ratings_are_drawn_along_a_factor_that_is_a_number():
    """The axis was 1 to 3, and its label said 1 5, 2 20, 3 100."""
    rows = [{"stimulus": f"s{hz}", "hz": hz, "rating": 10 + hz} for hz in (5, 100, 20) for _ in range(2)]
    drawing = drawing_of("rating", rows, "Rating by hz")
    assert (drawing.x, list(drawing.series[0].x), list(drawing.series[0].y)) == ("hz", [5, 20, 100], [15, 30, 110])
    words = [{"stimulus": name, "wave": name, "rating": 10} for name in "ba"]
    assert drawing_of("rating", words, "Rating by wave").x_names == ("a", "b")


def test_learning_is_drawn_of_each_of_four_sets():
    rows = [{"stimulus": f"{name}{k}", "set": name, "correct": k, "number": 1} for name in NAMES[:4] for k in (1, 2)]
    assert named(drawing_of("absolute-identification", rows, "Learning")) == list(NAMES[:4])


def test_of_more_stimuli_than_can_be_told_apart_the_drawing_says_how_many_it_shows():
    rows = [{"stimulus": name, "felt": "yes"} for name in NAMES]
    drawing = drawing_of("constant-stimuli", rows, "Judged more")
    assert (drawing.title, len(named(drawing))) == ("Judged more, so far (5 of 6 stimuli)", 5)
