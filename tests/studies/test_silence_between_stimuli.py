"""What is felt between the stimuli of a study: nothing, neither of the patch that is open nor of the last stimulus."""

import numpy as np
import pytest
from made_patches import patch_of
from made_studies import TD, first_answers, made_protocol, protocol_text
from people import taking_part

from underfoot.engine.commands import Swap
from underfoot.engine.reports import CommandApplied
from underfoot.experiments.protocol import Protocol
from underfoot.studies.phase import Phase
from underfoot.studies.presenter import IDLE

UNFELT_M_S2 = 0.01
"""Far below any threshold; a fade leaves a thousandth of what it ends."""
STAGES = [{"id": "consent", "kind": "consent"}, {"id": "try", "kind": "learn"}]


def felt(person, seconds=0.6):
    """Return the largest vibration that is played from now on."""
    presenter = person.runner.presenter
    first = presenter.end_frame
    end = first + round(seconds * person.runner.session.target.rate)
    person.until(lambda: presenter.end_frame >= end, "time goes by")
    return np.abs(presenter.played(first, end)[1]).max()


def test_the_open_patch_and_the_last_stimulus_are_not_felt_on_the_first_page(session, until, tmp_path):
    """They played at 0 dB until silence was compiled, while consent was asked for."""
    hiss = patch_of(("noise.out", "tile-output.acceleration"))
    hiss.save(tmp_path / "hiss.json")
    session.edit(hiss)
    for stimuli in ({}, {"hiss": {"patch": "hiss.json"}}):
        text = protocol_text(stages=STAGES[: 1 + len(stimuli)], stimuli=stimuli, present_s=60.0)
        protocol = Protocol.loads(text, folder=tmp_path)
        with taking_part(session, protocol, tmp_path / f"{len(stimuli)}.session", until, folder=tmp_path) as person:
            runner = person.runner
            person.until_phase(Phase.PAGE)
            assert felt(person) < UNFELT_M_S2
            runner.answer({"agreed": "yes"})
            if stimuli:
                runner.play("hiss")
                person.until(lambda: session.health.peak > 0.0, "it is felt")
                runner.stop("by the participant")
                person.wait(0.6)
                runner.go_on()
                assert felt(person) < UNFELT_M_S2


CATCH = {"followed": ["TD"], "catch_share": 0.5, "reversals": 2, "last": 2}


@pytest.mark.parametrize(
    ("kind", "given", "start", "wanted"), [("rating", {}, "key", 2), ("staircases", CATCH, "step", 1)]
)
def test_nothing_is_put_in_as_what_is_felt_is(kind, given, start, wanted, session, until, tmp_path):
    """Its question came 0.1 s sooner, and to step on the tile was asked 0.35 s sooner: catch trials told themselves."""
    protocol = made_protocol(kind, given, {"TD": TD, "X": {}}, start=start)
    swaps = {}
    with taking_part(session, protocol, tmp_path / "a.session", until) as person:
        person.until_phase(Phase.WAITING)
        while len(swaps) < 2:
            person.reports.clear()
            person.until_phase(Phase.READY)
            person.present()
            applied = [one.command for one in person.reports if isinstance(one, CommandApplied)]
            put_in = [one for one in applied if isinstance(one, Swap) and one.patch != IDLE.dumps()]
            swaps[person.runner.page.trial.intervals[0].stimulus] = len(put_in)
            person.runner.answer(first_answers(person.runner.page))
    assert set(swaps.values()) == {wanted}
