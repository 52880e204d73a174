"""The plan of a participant's trials is what the study then presents."""

import numpy as np
import pytest
from click.testing import CliRunner
from made_studies import TD, made_protocol, preset_protocol, protocol_text

from underfoot.__main__ import cli
from underfoot.experiments.observers import SimulatedParticipant
from underfoot.experiments.plan import ADAPTIVE, plan_of
from underfoot.experiments.study import Study
from underfoot.nodes import REGISTRY
from underfoot.patch import preset_files
from underfoot.patch.patch import Patch

STANDARD = {"patch": "stimulus-wc", "level_m_s2": 2.0, "factors": {"stiffness_n_mm": 90}}
SOFT = {**STANDARD, "level_m_s2": 3.0, "factors": {"stiffness_n_mm": 60, "place": "heel"}, "correct": "standard"}


def presented(protocol, participant):
    """The trials that a study presents to somebody who answers at random, stage by stage."""
    answers = SimulatedParticipant(protocol, {}, np.random.default_rng(4))
    study = Study(protocol, participant)
    while not study.is_done:
        study.answer(answers.answer(study.page))
    return [(entry.stage, entry.trial) for entry in study.entries if entry.trial is not None]


@pytest.mark.parametrize(
    "name", ["compliance-rating", "free-labels", "identification-impact", "stiffness-vibration", "target-selection"]
)
def test_it_is_what_a_run_of_the_study_presents(name):
    protocol = preset_protocol(name)
    plan = plan_of(protocol, "P07")
    assert [
        (stage, trial.block, trial.number, ", then ".join(one.stimulus or "nothing" for one in trial.intervals))
        for stage, trial in presented(protocol, "P07")
    ] == [(row["stage"], row["block"], row["trial"], row["stimulus"]) for row in plan]
    if name == "target-selection":  # what is presented is a place on the floor
        told = [f"width_m {trial.facts['width_m']:.4g}" for _, trial in presented(protocol, "P07")]
        assert [row["condition"].split(", ")[0] for row in plan] == told


def test_another_participant_gets_another_order():
    plans = [[row["stimulus"] for row in plan_of(preset_protocol("free-labels"), person)] for person in ("A", "B")]
    assert plans[0] != plans[1]
    assert sorted(plans[0]) == sorted(plans[1])


def test_conditions_levels_and_the_place_of_the_comparison_are_said():
    parameters = {"comparisons": ["soft"], "standard": "standard", "blocks": 4}
    protocol = made_protocol("constant-stimuli", parameters, {"standard": STANDARD, "soft": SOFT}, most_trials=3)
    rows = plan_of(protocol, "P1")
    assert len(rows) == 3
    for row in rows:
        first = row["stimulus"] == "soft, then standard"
        assert row["condition"] == f"stiffness_n_mm 60, place heel, comparison_at {'first' if first else 'second'}"
        assert row["level_m_s2"] == ("3, then 2" if first else "2, then 3")
        assert row["correct"] == ("second" if first else "first")


def test_a_stage_whose_levels_follow_the_answers_says_so():
    (row,) = plan_of(made_protocol("staircases", {"followed": ["TD"]}, {"TD": TD}), "P1")
    assert (row["stage"], row["trial"], row["stimulus"], row["level_m_s2"]) == ("main", "", "TD", ADAPTIVE)


def test_stimuli_are_written_as_they_are_presented_into_a_new_folder_only(tmp_path):
    """Nobody could render or open them: a protocol names a patch, its settings and a level, each in its place."""
    stimuli = {"soft": {**TD, "settings": {"textured.centre": 200.0}}, "X": {}}
    (tmp_path / "a.json").write_text(protocol_text(stimuli=stimuli))
    new = tmp_path / "new"
    typed = ["experiment", str(tmp_path / "a.json"), "--patches", str(new)]
    assert CliRunner().invoke(cli, typed).stdout == f"{new / 'soft.json'}\n"
    made = Patch.load(new / "soft.json", REGISTRY)
    preset = Patch.load(preset_files.patches()["stimulus-td"], REGISTRY)
    assert made.node("gain").parameters["gain"] == pytest.approx(preset.node("gain").parameters["gain"] * 0.43 / 6.8)
    assert made.node("textured").parameters == {"centre": 200.0}
    assert str(CliRunner().invoke(cli, typed).exception) == f"{new} is there already; allowed: a new folder"


def test_nodes_of_ones_own_lie_beside_patches_that_are_written(own_node):
    """These could be neither rendered nor opened."""
    (own_node.folder / "a.json").write_text(protocol_text(stimuli={"hum": {"patch": "hum.json"}}))
    new = own_node.folder / "new"
    typed = ["experiment", str(own_node.folder / "a.json"), "--patches", str(new), "--run-code"]
    assert CliRunner().invoke(cli, typed).stdout == f"{new / 'hum.json'}\n"
    assert (new / "nodes" / "hum-of-mine.py").read_bytes() == own_node.file.read_bytes()
