"""The thesis's results stand beside its own studies, and beside no other."""

import re

import pytest
from made_studies import preset_protocol

from underfoot.experiments.analysis.analyses import analysed
from underfoot.experiments.analysis.report import text_of
from underfoot.experiments.analysis.settings import Settings
from underfoot.experiments.protocol import Protocol
from underfoot.experiments.simulation import simulated_rows


def results_of(protocol):
    rows = [row for person in range(2) for row in simulated_rows(protocol, person, 1, {})[0]]
    found = analysed(rows, protocol, Settings(bootstrap=0))
    lines = [line.name for one in found for drawing in one.drawings for line in (*drawing.series, *drawing.lines)]
    return "\n".join([text_of(found), *lines]).lower()


@pytest.mark.parametrize(
    ("preset", "own", "other", "said"),
    [
        ("detection-threshold", '"TD"', '"buzz"', "thesis 6.4.2: 0.46 m/s^2"),
        ("intensity-equalisation", r'"([SWT][CPD])"', r'"my-\1"', "thesis 6.3.5, equal intensity"),
        ("compliance-rating", '"waveform"', '"material"', "thesis 6.4.1"),
        ("free-labels", '"set": "', '"set": "of ', "thesis 3.4.2"),
        ("identification-impact", '"set": "', '"set": "of ', "thesis, mean"),
        ("stiffness-vibration", "0.43", "0.4", "thesis, median"),
        ("target-selection", '"origin_m"', '"widths_m": [0.1, 0.2], "origin_m"', "thesis 5.6.1"),
    ],
)
def test_the_thesis_stands_beside_its_own_studies_only(preset, own, other, said):
    protocol = preset_protocol(preset)
    assert said in results_of(protocol)
    text = re.sub(own, other, protocol.dumps().decode())
    assert "thesis" not in results_of(Protocol.loads(text))
