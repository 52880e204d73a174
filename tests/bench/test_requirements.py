"""What requirements are measured on: models that are known to keep theirs, floors, presets and times."""

import math
import pkgutil
import sys
from importlib import import_module

import pytest

from underfoot.bench import requirements
from underfoot.bench.blocks import BlockCost
from underfoot.bench.requirements import (
    FAMILIES,
    TIMINGS,
    Timing,
    blocks,
    friction,
    impacts,
    materials,
    modes,
    run,
    signals,
    starts,
)
from underfoot.bench.timing import Run, Timed
from underfoot.errors import UnderfootError


def met(rows):
    """The words of the rows that are not met."""
    return [f"{row.what}: {row.measured} is not {row.limits}" for row in rows if not row.is_met]


def test_noises_envelopes_and_rhythms_keep_their_reach():
    assert not met([*signals.of_noises(4), *signals.of_envelopes(), *signals.of_rhythms()])


def test_impacts_keep_theirs():
    rows = [*impacts.errors(0.01), *impacts.rigid_wall(), *impacts.energy(30), *impacts.standing()]
    assert not met(rows)
    assert all(math.isfinite(row.measured) for row in rows)


def test_energy_that_is_made_would_show(monkeypatch):
    monkeypatch.setattr(impacts, "energy_of", lambda state, modes: 1e9)
    gained = next(iter(impacts.energy(3)))
    assert not gained.is_met


def test_a_bank_that_has_died_away_is_empty():
    assert [modes.left(driven) for driven in (True, False)] == [0, 0]


def test_materials_keep_theirs():
    assert not met([*materials.slips(), *materials.thresholds(), *materials.quasi_static(100)])


def test_slips_drawn_from_tables_keep_theirs():
    rows = list(friction.tables(100_000))
    assert len(rows) == 6
    assert not met(rows)


def cost(stood_on, block, speed, share, slowness=1.0, tiles=36):
    return BlockCost(blocks.COARSE, tiles, stood_on, block, speed, 2.0 * speed, share, slowness, 0.02)


def test_floors_are_read_off_the_costs_of_coarse_gravel():
    rows = list(
        blocks.floors(
            [
                cost(36, 1024, 90.0, 1.0),
                cost(2, 1024, 400.0, 0.16),
                cost(0, 1024, 4000.0, 0.02),
                cost(36, 64, 20.0, 1.0),
                cost(36, 64, 20.0, 1.0, slowness=1.5),
                cost(144, 64, 7.0, 1.0, tiles=144),
            ]
        )
    )
    assert [(row.measured, row.is_met) for row in rows] == [
        *((90.0, True), (400.0, True), (0.16, False), (4000.0, True), (0.02, True)),
        *((20.0, False), (20.0, True), (7.0, True)),
    ]
    assert rows[0].what == "coarse gravel, 36 tiles, block 1024, a foot on each"
    assert [row.spread for row in rows[:3]] == [0.02, 0.02, None]


def test_presets_are_asked_one_by_one_and_in_the_middle():
    took = {"fast": Timed(1e-3, 1.0, 0.0), "slow": Timed(0.02, 1.0, 0.0), "slowed": Timed(0.02, 2.0, 0.0)}
    rows = list(blocks.presets(took))
    assert [(row.measured, row.is_met) for row in rows] == [(1000.0, True), (50.0, False), (50.0, True), (100.0, False)]


def test_a_time_is_held_against_the_best_that_was_seen():
    timing = Timing("modes", "ten", Run(int), "ns", 1e9, best=2.0)
    assert timing.requirement(Timed(2.5e-9, 1.0, 0.0)).is_met
    assert not timing.requirement(Timed(2.7e-9, 1.0, 0.0)).is_met
    assert timing.requirement(Timed(2.7e-9, 1.1, 0.0)).is_met


def test_what_is_timed_runs_and_has_a_name_of_its_own():
    names = []
    for of_family in TIMINGS:
        for timing in of_family():
            names.append((timing.model, timing.what))
            assert timing.best < math.inf
            if timing.model != "starts":
                timing.run.call()
    assert len(set(names)) == len(names) > 15


def test_a_start_is_a_process_of_its_own():
    assert starts.started([sys.executable, "-c", "print(3)"]) == "3\n"
    with pytest.raises(UnderfootError, match="fails: ZeroDivisionError"):
        starts.started([sys.executable, "-c", "1 / 0"])


def test_each_file_with_requirements_is_a_family():
    names = {file.name for file in pkgutil.iter_modules(requirements.__path__)}
    files = {name: import_module(f"{requirements.__name__}.{name}") for name in names}
    assert {name for name, file in files.items() if hasattr(file, "requirements")} == set(FAMILIES)


def test_every_family_is_asked_and_told_of(monkeypatch):
    monkeypatch.setattr("underfoot.bench.requirements.FAMILIES", {"tones": lambda quick: [quick]})
    told = []
    assert run(True, told.append) == [True]
    assert told == ["requirements: tones"]
