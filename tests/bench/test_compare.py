"""What got slower is named, beyond the noise of both runs; and a file that is none is refused."""

import pytest

from underfoot.bench.compare import Time, changes, read
from underfoot.bench.report import Bench
from underfoot.bench.requirements import Requirement
from underfoot.bench.requirements.requirement import SPEED
from underfoot.errors import BadFile


def time(row, value, slowness=1.0, spread=0.02, unit="ns"):
    return Time(row, value, unit, slowness, spread)


def test_rows_are_compared_on_the_processor_at_its_best():
    before = [time("a", 10.0), time("b", 10.0), time("c", 10.0), time("d", 10.0)]
    now = [time("a", 13.0), time("b", 24.0, slowness=2.0), time("c", 8.0), time("d", 15.0, slowness=1.5)]
    found = changes(before, now)
    assert [(one.row, round(one.by, 6)) for one in found.slower] == [("a", 0.3), ("b", 0.2)]
    assert [(one.row, round(one.by, 6)) for one in found.faster] == [("c", -0.2)]
    assert found.same == 1
    assert found.lines() == [
        "compared: 2 slower, 1 faster, 1 the same within their noise",
        "  slower by  30.0 % (noise 5 %)  a: 10 -> 13 ns",
        "  slower by  20.0 % (noise 5 %)  b: 10 -> 12 ns",
        "  faster by  20.0 % (noise 5 %)  c: 10 -> 8 ns",
    ]


def test_a_change_within_the_spread_of_both_is_noise():
    assert changes([time("a", 1.0, spread=0.1)], [time("a", 1.14, spread=0.05)]).same == 1
    assert changes([time("a", 1.14, spread=0.1)], [time("a", 1.0, spread=0.05)]).same == 1
    assert changes([time("a", 1.0, spread=0.1)], [time("a", 1.17, spread=0.05)]).slower
    assert changes([time("a", 1.17, spread=0.1)], [time("a", 1.0, spread=0.05)]).faster


def test_rows_of_one_run_alone_are_named():
    found = changes([time("gone", 1.0), time("a", 1.0)], [time("new", 1.0), time("a", 1.0, unit="ms")])
    assert (found.only_before, found.only_now, found.same) == (("gone", "a"), ("new", "a"), 0)
    assert "  measured before, not now: gone, a" in found.lines()


def test_speeds_are_times_of_a_second_and_other_figures_are_not_compared():
    rows = [
        Requirement("whole block", "gravel", 50.0, SPEED, slowness=1.5, spread=0.01),
        Requirement("modes", "free", 0.1, "ns", spread=0.02),
        Requirement("tones", "error", 1e-16),
    ]
    assert Bench(rows, []).times() == [
        Time("whole block: gravel", 20.0, "ms a second of sound", 1.5, 0.01),
        Time("modes: free", 0.1, "ns", 1.0, 0.02),
    ]


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("{", "not JSON"),
        ('{"format": "underfoot-patch", "version": 1}', r"\$\.format is 'underfoot-patch'; allowed: 'underfoot-bench'"),
        ('{"format": "underfoot-bench", "version": 2}', "newer Underfoot"),
        ('{"format": "underfoot-bench", "version": 1, "times": [{"row": 3}]}', r"\$\.times\[0\]\.row is 3"),
        ('{"format": "underfoot-bench", "version": 1}', "times"),
    ],
)
def test_what_is_no_run_of_the_bench_is_refused(tmp_path, text, reason):
    (tmp_path / "old.json").write_text(text)
    with pytest.raises(BadFile, match=reason):
        read(tmp_path / "old.json")


def test_a_file_that_is_not_there_is_named(tmp_path):
    with pytest.raises(BadFile, match=r"old\.json cannot be read"):
        read(tmp_path / "old.json")
