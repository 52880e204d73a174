"""From which frame on a requested patch plays, on a real engine; and which patch is requested."""

import pytest
from made_patches import hum, patch_of
from made_studies import made_protocol
from people import open_session

from underfoot.engine.commands import Swap
from underfoot.engine.reports import CommandApplied
from underfoot.errors import BadValue
from underfoot.experiments.trials import Presentation
from underfoot.nodes import REGISTRY
from underfoot.studies.presenter import Presenter
from underfoot.studies.stimulus_patches import StimulusPatches


def test_a_level_that_is_set_while_its_stimulus_is_being_swapped_in_plays_from_then_on(until):
    soft, loud = (hum(tone={"amplitude": amplitude}) for amplitude in (0.5, 1.0))
    reports = []

    def swapped():
        reports.extend(session.poll())
        done = [report for report in reports if isinstance(report, CommandApplied)]
        return [one.frame for one in done if isinstance(one.command, Swap) and one.command.patch == soft.dumps()]

    with open_session(until) as session:
        presenter = Presenter(session)
        presenter.request(soft)
        (frame,) = until(swapped, "it is swapped in")
        presenter.request(loud)  # before the presenter is told
        assert presenter.since_frame is None
        presenter.take(reports)
        assert presenter.since_frame == frame
        presenter.request(soft)
        assert presenter.since_frame >= frame


def test_a_number_of_a_patch_that_was_refused_is_not_said_to_play(until):
    """The patch before it does; a trial counted, in which nothing was felt."""
    missing = patch_of(("wav-player.out", "tile-output.acceleration"), wav_player={"file": "none.wav"})

    def is_told():
        presenter.take(session.poll())
        return presenter.problem

    with open_session(until) as session:
        presenter = Presenter(session)
        for patch in (missing, missing.set("tile-output", "level", 0.5, REGISTRY)):
            presenter.request(patch)
            assert "none.wav" in until(is_told, "it is refused")
            assert presenter.since_frame is None
        presenter.request(hum())
        until(lambda: is_told() or presenter.since_frame, "another patch plays")
        assert not presenter.problem


def test_a_participants_gain_is_added_and_nothing_beyond_the_limit_is_presented():
    """It is the last check before a foot: 0.43 m/s^2 at 35 dB are 24.2."""
    stimuli = StimulusPatches(made_protocol("rating"), None)
    assert stimuli.presented(Presentation("TD", -6.0), -4.0) == stimuli.protocol.stimuli["TD"].at(-10.0)
    assert stimuli.presented(Presentation("TD", 33.0), 0.0).nodes
    with pytest.raises(BadValue, match=r"^TD is 24\.181; allowed: up to 20 m/s\^2$"):
        stimuli.presented(Presentation("TD", 33.0), 2.0)
