"""What a protocol needs beside the floor, and what the equipment that was chosen has of it."""

import msgspec
import pytest
from made_studies import made_protocol
from people import taking_part

from underfoot.devices.plate import Plate, PlateCalibration
from underfoot.errors import BadValue
from underfoot.experiments.analysis.analyses import analysed
from underfoot.experiments.analysis.settings import Settings
from underfoot.experiments.protocol import Sounds
from underfoot.experiments.table import rows_of
from underfoot.studies.equipment import Equipment


@pytest.fixture
def protocol():
    """A study of stiffness beside pink noise."""
    stimuli = {"soft": {"stiffness_n_mm": 52.0}, "hard": {"stiffness_n_mm": 146.0}}
    return msgspec.structs.replace(made_protocol("rating", {"blocks": 1}, stimuli), sounds=Sounds(noise="pink"))


def test_stiffness_that_nothing_sets_and_noise_that_nobody_hears_are_told_and_noted(session, until, protocol, tmp_path):
    """A study of stiffness went without a plate to its end, and its table had the stiffness that nobody had felt."""
    with taking_part(session, protocol, tmp_path / "a.session", until) as person:
        told, noted = person.runner.messages, [note.text for note in person.runner.file.notes()]
        person.answer_page()
        rows = rows_of(protocol, "P1", person.runner.study.entries)
    (found,) = analysed(rows, protocol, Settings())
    assert "In 1 of 1 trials no plate set the stiffness that the table has." in found.remarks
    assert (
        told
        == noted
        == [
            "without a plate: the stimuli's stiffness, 52 to 146 N/mm, is not set; "
            "without masking sound: the protocol's is not heard"
        ]
    )


def test_a_stiffness_that_the_plate_does_not_have_is_refused_before_the_first_trial(protocol):
    """Participants came as far as the first trial of it, where the study stopped for good."""
    plate = Plate("simulated", PlateCalibration(positions=(0.0, 1.0), stiffness_n_mm=(60.0, 160.0)))
    with pytest.raises(
        BadValue, match=r"stimulus soft: stiffness is 52\.0; allowed: 60 to 160 N/mm, which the plate has"
    ):
        Equipment(plate).lacks(protocol)
