"""Streams of a study for other recorders."""

import itertools
import socket

import numpy as np
import pytest

from underfoot.floor.layout import default_floor
from underfoot.studies.markers import LslMarkers


def test_forces_that_are_sent_late_have_the_time_of_their_samples(until):
    """They had that of sending, which a busy machine delays, beside markers that have the time of their event."""
    pylsl = pytest.importorskip("pylsl")
    markers = LslMarkers(default_floor(1, 3), 1000.0)  # no other test's stream is of three tiles
    which = f"source_id='underfoot-force-{socket.gethostname()}' and channel_count=3"
    (found,) = pylsl.resolve_bypred(which, timeout=120.0)
    inlet = pylsl.StreamInlet(found)
    inlet.open_stream(timeout=120.0)
    began_s, late_s, stamps_s = pylsl.local_clock() - 2.0, itertools.cycle((0.0, 0.01, 0.02)), []

    def told():
        ago_s = pylsl.local_clock() - began_s - 2.0 - next(late_s)
        markers.forces(2.0, ago_s, np.ones((1, 3)))
        stamps_s.extend(inlet.pull_chunk(0.02)[1])
        return len(stamps_s) > 6

    until(told, "forces come")
    assert stamps_s == pytest.approx([began_s + 2.0] * len(stamps_s), abs=1e-3)
    inlet.close_stream()
    markers.close()
