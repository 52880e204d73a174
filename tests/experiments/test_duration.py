"""About how long a study takes: as many trials as people need, and the pauses that they get."""

import pytest
from made_studies import made_protocol, preset_protocol, trials, walked
from msgspec import structs

from underfoot.experiments.duration import usual_s, usual_trials
from underfoot.experiments.simulation import simulated_rows
from underfoot.experiments.study import Study

LISTED = ["compliance-rating", "identification-impact", "target-selection", "stiffness-vibration", "free-labels"]


@pytest.mark.parametrize("name", ["detection-threshold", "intensity-equalisation"])
def test_staircases_take_about_as_many_trials_as_simulated_people(name):
    protocol = preset_protocol(name)
    counts = [len(simulated_rows(protocol, person, 1, {})[0]) for person in range(5)]
    expected, blocks = usual_trials(protocol, protocol.stage("main"))
    assert 0.8 < expected / (sum(counts) / len(counts)) < 1.25
    assert blocks == simulated_rows(protocol, 0, 1, {})[0][-1]["block"]


@pytest.mark.parametrize("name", LISTED)
def test_trials_and_pauses_are_those_that_come(name):
    """So are rests of 20 s within blocks, and across those that no pause divides."""
    protocol = preset_protocol(name)
    rested = [structs.replace(stage, rest_s=20.0, rest_every=5) for stage in protocol.stages]
    protocol = structs.replace(protocol, stages=tuple(rested))
    main = protocol.stage("main")
    pages = [page for page in walked(Study(protocol, "P1")) if page.stage == "main"]
    count, blocks = usual_trials(protocol, main)
    assert (count, blocks) == (len(trials(pages)), pages[-1].trial.block)
    without = {"block_pause_s": 0.0, "long_pause_s": 0.0, "rest_s": 0.0}
    bare = structs.replace(main, **without)
    assert usual_s(protocol, main) - usual_s(protocol, bare) == pytest.approx(sum(page.seconds for page in pages))


def test_what_is_done_is_told_in_time_not_in_stages():
    """Target selection has 40 trials of practice before 240: after the practice a sixth is done."""
    study = Study(preset_protocol("target-selection"), "P1")
    pages = walked(study)
    first = next(page for page in pages if page.stage == "main")
    assert first.share == pytest.approx(1 / 6, abs=0.03)


def test_a_long_pause_alone_begins_the_count_of_rests_anew():
    stimuli = {f"S{k}": {"patch": "stimulus-td"} for k in range(7)}
    pauses = {"long_pause_s": 60.0, "long_pause_every": 2, "rest_s": 20.0, "rest_every": 7}
    protocol = made_protocol("rating", {"blocks": 4}, stimuli, **pauses)
    (stage,) = protocol.stages
    bare = structs.replace(stage, long_pause_s=0.0, rest_s=0.0)
    come = sum(page.seconds for page in walked(Study(protocol, "P1")))
    assert usual_s(protocol, stage) - usual_s(protocol, bare) == pytest.approx(come)
