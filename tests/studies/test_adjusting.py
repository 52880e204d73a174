"""What is moved while it is felt, on the real engine and the simulated floor: the level, or a number of the patch."""

from contextlib import closing

import numpy as np
import pytest
from made_studies import made_protocol
from people import STEP_S, taking_part

from underfoot.errors import BadValue
from underfoot.experiments.store import SessionFile
from underfoot.experiments.table import rows_of
from underfoot.studies.page_words import title_of
from underfoot.studies.phase import Phase

SINE = {"patch": "stimulus-sc", "scaled_by": "gain.gain", "measured_m_s2": 2.9, "level_m_s2": 1.0}
LEVELS = {"above": [6.0, 6.0], "below": [-20.0, -20.0], "reach": [-21.0, 10.0], "steps": [10.0, 0.5], "blocks": 1}


def gain_db(runner):
    """The level that plays re that of the protocol, 1 m/s^2; the preset's gain of 2.18 has 2.9."""
    return 20.0 * np.log10(runner.session.patch.node("gain").parameters["gain"] / 2.18 * 2.9)


def begun(person):
    """Begin a trial by a key; return where it starts."""
    person.until_phase(Phase.READY)
    assert person.runner.adjusting is None
    person.runner.start()
    return person.runner.page.trial.facts["start_at"]


def test_a_level_is_felt_while_it_is_moved_and_so_is_the_standard(session, until, tmp_path):
    stimuli = {"C": SINE, "S": {**SINE, "level_m_s2": 0.5}}
    protocol = made_protocol("adjustment", {"followed": ["C"], "standard": "S", **LEVELS}, stimuli)
    with taking_part(session, protocol, tmp_path / "a.session", until) as person:
        runner = person.runner
        person.press(600.0)
        begun(person)
        person.until(lambda: runner.session.health.peak > 0.001, "it is felt")
        runner.stop("by the participant")
        assert runner.adjusting is None
        runner.go_on()  # what was felt comes again, from its start
        for _ in range(2):
            start, began = begun(person), runner.presenter.end_frame
            with pytest.raises(BadValue, match="Move it to answer: Set it to feel like"):
                runner.answer({})
            assert gain_db(runner) == pytest.approx(start, abs=1e-6)
            runner.adjust(-1, is_fine=False)
            assert gain_db(runner) == pytest.approx(max(start - 10.0, -21.0), abs=1e-6)  # as far as it goes
            runner.start()
            assert (title_of(runner), round(gain_db(runner), 4)) == ("The one to compare with", -6.0206)
            for _ in range(2):
                runner.adjust(1, is_fine=True)
            assert title_of(runner) == "The one to set"
            presenter = runner.presenter  # health has the peak of the trial before for a while
            person.until(lambda p=presenter, at=began: p.onset_frame(at, p.end_frame) is not None, "it is felt")
            runner.answer({})
        person.finish_study()
    with closing(SessionFile.open(tmp_path / "a.session")) as file:
        spoiled, *kept = rows_of(protocol, "P1", file.entries())
    assert (spoiled["spoiled"], spoiled["attempt"], "level_db" in spoiled) == ("stopped by the participant", 1, False)
    assert sorted((row["series"], row["level_db"]) for row in kept) == [("ascending", -20.0), ("descending", -3.0)]
    for row in kept:
        assert (row["stimulus"], row["other"], row["standard_at"]) == ("C", "S", -6.0206)
        assert (row["changes"], row["standard_plays"]) == (3, 1)
        assert row["level_m_s2"] == pytest.approx(10.0 ** (row["level_db"] / 20.0), rel=1e-5)
        assert row["response_s"] > 0.0
        assert row["commanded_m_s2"] > 0.0


def test_a_number_of_the_patch_is_moved_from_step_to_step_of_who_walks(session, until, tmp_path):
    given = {"parameter": "sine.frequency", "reach": [50.0, 400.0], "steps": [60.0, 5.0], "blocks": 1}
    given |= {"below": [80.0, 80.0], "above": [300.0, 300.0], "followed": ["C"]}
    protocol = made_protocol("adjustment", given, {"C": SINE}, start="step")
    with taking_part(session, protocol, tmp_path / "a.session", until) as person:
        runner = person.runner
        for _ in range(2):
            person.until_phase(Phase.READY)
            person.step()
            person.until_phase(Phase.ANSWERING)
            runner.adjust(1, is_fine=False)
            person.step()
            runner.answer({})
        person.finish_study()
    with closing(SessionFile.open(tmp_path / "a.session")) as file:
        for number, entry in enumerate(file.entries(), 1):
            wanted = entry.trial.facts["start_at"] + 60.0
            assert entry.answers == {"set_to": wanted}
            (felt,) = (one for one in file.excerpts(number) if one.kind == "vibration")
            second = felt.values[-round(STEP_S * felt.rate_hz) :, 0]
            spectrum = np.abs(np.fft.rfft(second * np.hanning(len(second))))
            assert spectrum.argmax() * felt.rate_hz / len(second) == pytest.approx(wanted, abs=4.0)
            assert entry.facts["onset_after_step_s"] < 0.1  # of the first step
        assert "level_m_s2" not in rows_of(protocol, "P1", file.entries())[0]  # at another frequency it is not known
