"""Streams of a study for other recorders."""

import itertools
import socket

import numpy as np
import pytest

from underfoot.floor.layout import default_floor
from underfoot.studies.markers import LslMarkers


def test_what_is_sent_late_has_the_time_of_its_samples_and_events(until):
    """It had that of sending, which a busy machine delays."""
    pylsl = pytest.importorskip("pylsl")
    markers = LslMarkers(default_floor(1, 3), 1000.0)
    inlets = []
    for stream in "force", "markers":
        (found,) = pylsl.resolve_byprop("source_id", f"underfoot-{stream}-{socket.gethostname()}", timeout=120.0)
        inlets.append(pylsl.StreamInlet(found))
        inlets[-1].open_stream(timeout=120.0)
    began_s, late_s, stamps_s = pylsl.local_clock() - 2.0, itertools.cycle((0.0, 0.01, 0.02)), [[], []]

    def told():
        ago_s = pylsl.local_clock() - began_s - 2.0 - next(late_s)
        markers.forces(2.0, ago_s, np.ones((1, 3)))
        markers.mark("onset", "main.1", 2.0, ago_s)
        for stamps, inlet in zip(stamps_s, inlets, strict=True):
            stamps += inlet.pull_chunk(0.01)[1]
        return min(map(len, stamps_s)) > 6

    until(told, "forces and markers come")
    for stamps, inlet in zip(stamps_s, inlets, strict=True):
        assert stamps == pytest.approx([began_s + 2.0] * len(stamps), abs=1e-3)
        inlet.close_stream()
    markers.close()
