"""A mistake in a draft names what the form shows: every sentence is of a real check of a real draft."""

import pytest

from underfoot.experiments.analysis.thesis import THRESHOLD_M_S2
from underfoot.experiments.draft import Draft
from underfoot.experiments.methods import METHODS
from underfoot.experiments.mistake_places import in_form

STAGE = {"id": "main", "kind": "trials", "method": {"kind": "rating", "parameters": {}}}


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"present_s": "long"}, "Presented for is 'long'; allowed: a number"),
        ({"seed": 1.5}, "Seed is 1.5; allowed: a whole number"),
        ({"stages": []}, "Stages is []; allowed: at least one"),
        ({"sounds": {"noise_db": "loud"}}, "Sounds, Noise level is 'loud'; allowed: a number"),
        ({"participant": [{"name": "age", "text": "", "kind": "count", "low": 9, "high": 1}]},
         "Question age, High is 1.0; allowed: above low"),
        ({"participant": [{"name": "", "text": ""}]}, "Question 1, Name is ''; allowed: letters, digits, - and _"),
        ({"stimuli": {"hum": {"patch": "stimulus-wc", "settings": {"gain.gain": "much"}}}},
         "Stimulus hum, Settings: gain.gain is 'much'; allowed: 0 to 1000"),
        ({"stages": [STAGE | {"id": ""}]}, "Stage 1, Id is ''; allowed: letters, digits, - and _"),
        ({"stages": [STAGE | {"start": "now"}]}, "Stage main, Begun by: invalid enum value 'now'"),
        ({"stages": [STAGE | {"trial_pause_s": -1}]}, "Stage main, Trial pause is -1; allowed: a number >= 0.0"),
        ({"stages": [STAGE | {"questions": [{"name": "q", "text": "", "kind": "choice"}], "kind": "questions",
                              "method": None}]},
         "Stage main, question q, Options is []; allowed: two or more different ones"),
        ({"stages": [STAGE | {"foot": {"by": "hand"}}]}, "Stage main, answer by foot, Fields: invalid"),
        ({"stages": [STAGE | {"method": {"kind": "rating", "parameters": {"rated": ["gone"]}}}]},
         "Stage main, Rated is 'gone'; allowed: the stimuli"),
    ],
)  # fmt: skip
def test_a_mistake_is_placed_by_what_the_form_shows(changes, said, tmp_path):
    draft = Draft.new(tmp_path)
    draft.raw.update(changes)
    mistake = draft.first_mistake()
    assert mistake.startswith("$.")
    assert in_form(mistake, draft.raw).startswith(said)


def test_what_has_no_place_stays_as_it_is():
    assert in_form("a thousand of this name are there", {}) == "a thousand of this name are there"


@pytest.mark.parametrize("kind", METHODS)
def test_a_new_study_has_no_mistake_with_any_method_and_is_felt_beside_the_thesis_s_threshold(kind, tmp_path):
    """Staircases said at once that 126 m/s^2 is too much, and then that *nothing* cannot be followed."""
    draft = Draft.new(tmp_path)
    draft.raw["stages"][0]["method"] = {"kind": kind, "parameters": {}}
    assert draft.first_mistake() == ""
    assert draft.checked().stimuli["A"].level_m_s2 > 2.5 * THRESHOLD_M_S2
