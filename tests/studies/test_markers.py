"""Streams and triggers of a study for other recorders."""

import itertools
import os
import socket

import numpy as np
import pytest

from underfoot.floor.layout import default_floor
from underfoot.studies.markers import LslMarkers, SerialTrigger


def test_what_is_sent_late_has_the_time_of_its_samples_and_events(until):
    """It had that of sending, which a busy machine delays."""
    pylsl = pytest.importorskip("pylsl")
    markers = LslMarkers(default_floor(1, 3), 1000.0)
    inlets = []
    for stream in "force", "markers":
        (found,) = pylsl.resolve_byprop("source_id", f"underfoot-{stream}-{socket.gethostname()}", timeout=120.0)
        inlets.append(pylsl.StreamInlet(found))
        inlets[-1].open_stream(timeout=120.0)
    told_of = inlets[0].info(120.0)
    assert told_of.get_channel_labels() == ["t1", "t2", "t3"]
    assert told_of.get_channel_units() == ["newtons"] * 3
    assert told_of.get_channel_types() == ["Force"] * 3
    began_s, late_s, stamps_s = pylsl.local_clock() - 2.0, itertools.cycle((0.0, 0.1, 0.2)), [[], []]

    def told():
        ago_s = pylsl.local_clock() - began_s - 2.0 - next(late_s)
        markers.forces(2.0, ago_s, np.ones((1, 3)))
        markers.mark("onset", "main.1", 2.0, ago_s)
        for stamps, inlet in zip(stamps_s, inlets, strict=True):
            stamps += inlet.pull_chunk(0.01)[1]
        return min(map(len, stamps_s)) > 6

    until(told, "forces and markers come")
    for stamps, inlet in zip(stamps_s, inlets, strict=True):
        assert stamps == pytest.approx([began_s + 2.0] * len(stamps), abs=0.05)  # a busy machine delays a call too
        inlet.close_stream()
    markers.close()


def test_a_trigger_that_is_plugged_in_again_gets_its_markers(tmp_path):
    tty = pytest.importorskip("tty")
    port, ends = tmp_path / "trigger", []

    def plug():
        ends[:] = os.openpty()
        tty.setraw(ends[1])
        port.symlink_to(os.ttyname(ends[1]))

    def unplug():
        port.unlink()
        for end in ends:
            os.close(end)

    plug()
    trigger = SerialTrigger(str(port))
    unplug()
    for what in ("begin", "end"):
        trigger.mark(what, "main.1")
        assert trigger.problem == f"no markers reach the trigger {port}: it was unplugged"
    plug()
    trigger.mark("answer", "main.1")
    assert (trigger.problem, os.read(ends[0], 9)) == ("", b"\x04")
    unplug()
    plug()
    trigger.mark("stop", "")
    assert (trigger.problem, os.read(ends[0], 9)) == ("", b"\x05")
    trigger.close()
    unplug()
