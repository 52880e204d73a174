"""The list of nodes, by the words that somebody types who comes from another program or field."""

import pytest

from underfoot.nodes import REGISTRY
from underfoot.widgets.design.node_list import NodeList


@pytest.mark.parametrize(
    ("words", "found"),
    [
        ("sine", ["tone", "modal-bank", "lfo", "stick-slip"]),
        ("drum", ["impact", "modal-bank"]),
        ("metronome", ["rhythm"]),
        ("slider", ["value"]),
        ("heel", ["footfall", "stance-curve"]),
        ("crack", ["fibre-bundle", "fibre-grid"]),
        ("weibull grid", ["fibre-grid"]),
        ("rolloff", ["drawn-bank"]),
        ("delay~", ["delay", "event-delay", "footfall", "tile-place"]),  # as in Max and Pure Data
        ("*~", ["gain", "multiply"]),
        ("vca", ["gain", "multiply"]),
        ("abs~", ["rectify", "strain-rate-envelope"]),  # which has a part that is absolute
        ("envelope follower", ["force-envelope", "rectify"]),
        ("osc~", ["tone", "lfo"]),
        ("color ramp", ["map"]),  # as in Blender
        ("ColorRamp", ["map"]),
        ("map_range", ["map", "scale"]),
        ("lowpass", ["low-pass"]),
        ("counter", ["step-sequence"]),
        ("ring", ["drawn-bank", "modal-bank", "multiply", "impact"]),  # not "during"
        ("sequencer", ["rhythm", "step-sequence"]),
        ("bang", ["strike"]),
        ("step", ["step-sequence", "footfall", "impact", "rhythm"]),
        ("pan", ["tile-output"]),  # which has the choice of tiles
        ("clip", ["map"]),
        ("limiter", ["map"]),
        ("saturate", ["map"]),
        ("max", ["map", "fibre-bundle", "fibre-grid", "high-pass", "low-pass"]),
        ("bubble", ["modal-bank"]),
        ("flanger", ["delay"]),
        ("audio file", ["wav-player"]),
        ("triangle", ["lfo"]),  # one of its shapes
        ("pink", ["noise"]),  # through a Low-pass
        ("chirp", ["breakpoints"]),
        ("distance", ["tile-place", "stick-slip"]),
        ("lift off", ["footfall"]),
        ("no such word", []),
    ],
)
def test_a_node_is_found_by_what_it_is_for_and_then_by_its_parameters(qapp, words, found):
    shown = NodeList(REGISTRY)
    shown.filter_by(words)
    assert shown.types() == found
