"""What the reaches are read off: times, models that are known to keep theirs, and floors."""

import math

import numpy as np
import pytest

from underfoot.bench import timing
from underfoot.bench.reach import floors, friction, impacts, materials, modes, run, signals
from underfoot.bench.scale import Cost
from underfoot.errors import UnderfootError


def met(rows):
    """The words of the rows that are not met."""
    return [f"{row.what}: {row.measured} is not {row.asked}" for row in rows if not row.met]


def test_the_least_of_some_runs_is_told_and_the_first_are_not_counted(monkeypatch):
    now, steps = [0.0], iter([0.1, 50.0, 3.0, 1.0, 2.0])

    def advance():
        now[0] += next(steps)

    monkeypatch.setattr(timing.time, "perf_counter", lambda: now[0])
    assert timing.timed(advance, budget_s=6.0).seconds == 1.0
    assert next(steps, None) is None


def test_a_slow_processor_shows_in_its_floor(monkeypatch):
    ticks = iter(np.arange(100.0))
    monkeypatch.setattr(timing.time, "perf_counter", lambda: next(ticks))
    took = timing.timed(lambda: None, most=3)
    assert took.seconds == 1.0
    repeats = timing.MAX_REPEATS  # as a run seems to take a second
    assert took.slowness == pytest.approx(1e9 / (repeats * timing.PAIRS) / timing.FLOOR_NS)


def test_noises_envelopes_and_rhythms_keep_their_reach():
    assert not met([*signals.of_noises(10), *signals.of_envelopes(), *signals.of_rhythms()])


def test_impacts_keep_theirs():
    rows = [*impacts.errors(0.01), *impacts.rigid_wall(), *impacts.energy(100), *impacts.standing()]
    assert not met(rows)
    assert all(math.isfinite(row.measured) for row in rows)


def test_energy_that_is_made_would_show(monkeypatch):
    monkeypatch.setattr(impacts, "_energy_of", lambda state, modes: 1e9)
    gained = next(iter(impacts.energy(3)))
    assert not gained.met


def test_a_bank_that_has_died_away_is_empty():
    assert [modes.left(driven) for driven in (True, False)] == [0, 0]


def test_materials_keep_theirs():
    assert not met([*materials.slips(), *materials.thresholds(), *materials.quasi_static(100)])


def test_slips_drawn_from_tables_keep_theirs():
    rows = [row for row in friction.tables(100_000) if row.unit != "ns"]
    assert len(rows) == 6
    assert not met(rows)


def test_floors_are_read_off_the_costs_of_coarse_gravel(monkeypatch):
    monkeypatch.setattr(floors, "cold_start_s", lambda name: 0.3)
    costs = [
        Cost(floors.COARSE, 36, 36, 1024, 50.0, 1.0),
        Cost(floors.COARSE, 36, 2, 1024, 400.0, 0.125),
        Cost(floors.COARSE, 36, 0, 1024, 4000.0, 0.0125),
        Cost(floors.COARSE, 36, 36, 64, 20.0, 1.0),
        Cost("another", 36, 36, 64, 1.0, 1.0),
    ]
    rows = list(floors.reaches(costs, True))
    assert [(row.measured, row.met) for row in rows] == [(50.0, True), (0.125, False), (20.0, False), (0.3, True)]
    assert len(list(floors.reaches([], False))) > 5


def test_a_cold_start_is_timed_in_a_process_of_its_own(monkeypatch):
    monkeypatch.setattr(floors, "COLD_START", "import sys; print(0.25 if sys.argv[1] == 'gravel' else 1 / 0)")
    assert floors.cold_start_s("gravel") == 0.25
    with pytest.raises(UnderfootError, match="snow does not start: ZeroDivisionError"):
        floors.cold_start_s("snow")


def test_every_family_is_asked_and_told_of(monkeypatch):
    monkeypatch.setattr(floors, "cold_start_s", lambda name: 0.3)
    monkeypatch.setattr("underfoot.bench.reach.FAMILIES", {"tones": lambda quick: [quick]})
    told = []
    found = run([], True, told.append)
    assert found[0] is True
    assert len(found) == 2
    assert told == ["reach: tones", "reach: floors"]
