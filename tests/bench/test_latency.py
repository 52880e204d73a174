"""The latency that the bench measures: every step that is sent is found. How long it took is no test."""

import numpy as np
import pytest

from underfoot.bench import latency


@pytest.mark.parametrize("link", ["UDP", "pty"])
def test_each_step_that_is_sent_changes_what_is_played_behind_it(link):
    for _ in range(5):  # a machine that is busy with other programs loses steps
        found = latency.measured(link, jitter_s=0.2e-3, settled_s=0.5, seconds=2.0)
        assert len(found.seconds) <= 43  # one every 47 ms
        if len(found.seconds) >= 10:
            break
    assert len(found.seconds) >= 10
    assert (found.seconds > 0.0).all()
    assert len(np.unique(found.seconds.round(5))) > 5  # they are not of one moment
    assert 0.0 <= found.late_share <= 1.0
    assert found.shown_s >= found.hold_s + latency.BLOCK / latency.RATE - 1e-9


def test_each_step_of_a_load_shakes_the_simulated_plate():
    for _ in range(10):  # a busy machine loses steps
        found = latency.acceleration_latencies(2.5)
        assert len(found) <= 7  # one every 0.4 s, as above
        if len(found) >= 2:
            break
    assert len(found) >= 2
    assert (found > 0.0).all()


def test_a_bare_datagram_takes_its_time_too():
    found = latency.datagram_delays(0.2)
    assert found.shape == (200,)
    assert (found > 0.0).all()
