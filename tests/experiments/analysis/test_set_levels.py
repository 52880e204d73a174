"""Participants who set a level of their own get lower levels than the protocol's, and the analysis knows which."""

import pytest
from made_studies import TD, protocol_text

from underfoot.experiments.analysis.analyses import analysed
from underfoot.experiments.analysis.settings import Settings
from underfoot.experiments.protocol import Protocol
from underfoot.experiments.study import Study
from underfoot.experiments.table import rows_of

pytest.importorskip("statsmodels")
SETS_A_LEVEL = {"id": "level", "kind": "level", "stimulus": "TD"}
SET_DB = {"P1": -12.0, "P2": -6.0}


def tables_of(kind, parameters, answer, stimuli=None):
    """Return the tables of a study in which everybody sets a level first; `answer(trial, gain_db)` answers a trial."""
    main = {"id": "main", "kind": "trials", "method": {"kind": kind, "parameters": parameters}}
    text = protocol_text(stages=[SETS_A_LEVEL, main], stimuli={"TD": TD, **(stimuli or {})})
    protocol, rows = Protocol.loads(text), []
    for person, gain_db in SET_DB.items():
        study = Study(protocol, person)
        study.answer({"gain_db": gain_db})
        while not study.is_done:
            study.answer(answer(study.page.trial, gain_db))
        rows += rows_of(protocol, person, study.entries)
    return {table.title: table for table in analysed(rows, protocol, Settings(bootstrap=0))[0].tables}


def test_a_threshold_in_m_s2_is_of_what_was_presented():
    def feels_above_0_2(trial, gain_db):
        peak = TD["level_m_s2"] * 10.0 ** ((trial.intervals[0].gain_db + gain_db) / 20.0)
        return {"felt": "yes" if peak > 0.2 else "no"}

    tables = tables_of("staircases", {"followed": ["TD"], "pairs": 3, "highest_db": 20.0}, feels_above_0_2)
    (_, _, mean, _, _, unit, *_) = tables["Thresholds over people"].rows[1]
    assert (mean, unit) == (pytest.approx(0.2, rel=0.15), "m/s^2")
    thresholds_db = {row[0]: row[2] for row in tables["Thresholds of each person"].rows}
    peaks = [TD["level_m_s2"] * 10.0 ** ((SET_DB[person] + db) / 20.0) for person, db in thresholds_db.items()]
    assert len(peaks) == 2
    assert mean == pytest.approx(sum(peaks) / 2.0, rel=1e-3)


def test_curves_are_over_the_stiffness_and_a_condition_is_the_same_for_all():
    stiffness, levels = (52, 64, 76, 90), (0.2, 0.43)
    stimuli = {
        f"s{n}-{level * 100:.0f}": {**TD, "level_m_s2": level, "factors": {"stiffness_n_mm": n}}
        for n in stiffness
        for level in levels
    }

    def stiffer_than_the_standard(trial, gain_db):
        is_more = int(str(trial.facts["comparison"])[1:3]) + 8.0 * (trial.block % 4) > 82.0
        return {"interval": trial.facts["comparison_at"] if is_more else _other(trial.facts["comparison_at"])}

    parameters = {"comparisons": list(stimuli), "standard": "TD", "blocks": 8}
    tables = tables_of("constant-stimuli", parameters, stiffer_than_the_standard, stimuli)
    points = {row[:2]: row[2] for row in tables["Curves of each person"].rows if row[1].startswith("pse")}
    assert list(points) == [(person, f"pse {level}") for person in SET_DB for level in levels]
    assert list(points.values()) == [pytest.approx(70.0, abs=3.0)] * 4
    assert tables["Share judged more"].columns == ("stiffness_n_mm", "level_m_s2 0.2", "level_m_s2 0.43")


def _other(interval):
    return {"first": "second", "second": "first"}[interval]
