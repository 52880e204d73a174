"""What an edit of a study is called in its undo list, and which edits are one step."""

import pytest

from underfoot.experiments.draft_edits import edit_between

A, B = {"patch": "a", "factors": {}}, {"patch": "b"}
FOOT = {"id": "x", "kind": "trials", "foot": {"by": "halves"}}


@pytest.mark.parametrize(
    ("before", "after", "name", "index", "merge"),
    [
        ({"stimuli": {"A": A}}, {"stimuli": {"A": A, "B": B}}, "Add stimulus B", 1, ""),
        ({"stimuli": {"A": A, "B": B}}, {"stimuli": {"B": B}}, "Remove stimulus A", 0, ""),
        ({"stimuli": {"A": A, "B": B}}, {"stimuli": {"B": B, "A": A}}, "Move stimulus B", 0, ""),
        ({"stimuli": {"A": A, "B": B}}, {"stimuli": {"A": A, "Be": B}}, "Rename stimulus B", 1, "stimuli.1.name"),
        ({"stimuli": {"A": A, "B": B}}, {"stimuli": {"C": A, "D": B, "E": B}}, "Replace the stimuli", 0, ""),
        (
            {"stimuli": {"A": A}},
            {"stimuli": {"A": {**A, "factors": {"waveform": "C"}}}},
            "Change stimulus A, Factors",
            0,
            "stimuli.0.factors",
        ),
        (  # 0 and 0.0, as one types 0.5
            {"stimuli": {"A": {**A, "factors": {"amplitude": 0}}}},
            {"stimuli": {"A": {**A, "factors": {"amplitude": 0.0}}}},
            "Change stimulus A, Factors",
            0,
            "stimuli.0.factors",
        ),
        ({"seed": 1}, {"seed": 1.0}, "Change Seed", -1, "seed"),
        ({"stages": [{"id": "a"}]}, {"stages": [{"id": "ab"}]}, "Rename stage a", 0, "stages.0.name"),
        ({"stages": [{**FOOT, "foot": None}]}, {"stages": [FOOT]}, "Change stage x, answer by foot", 0, ""),
        (
            {"stages": [{"id": "q", "questions": [{"name": "age", "text": "H"}]}]},
            {"stages": [{"id": "q", "questions": [{"name": "age", "text": "Ho"}]}]},
            "Change stage q, question age, Text",
            0,
            "stages.0.questions.0.text",
        ),
        ({"participant": []}, {"participant": [{"name": "q1"}]}, "Add question q1", 0, ""),
        (
            {"sounds": {"noise_db": -30}},
            {"sounds": {"noise_db": "x"}},
            "Change sounds, Noise level",
            -1,
            "sounds.noise_db",
        ),
        ({"seed": 1}, {"seed": 12}, "Change Seed", -1, "seed"),
    ],
)
def test_an_edit_has_a_name_a_place_and_what_it_goes_on_with(before, after, name, index, merge):
    found = edit_between(before, after)
    assert (found.name, found.index, found.merge) == (name, index, merge)
