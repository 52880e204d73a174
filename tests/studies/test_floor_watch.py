"""What a study knows of its floor."""

from contextlib import closing

import numpy as np

from underfoot.engine.rings import Ring
from underfoot.engine.session_memory import ForceReader
from underfoot.floor.layout import default_floor
from underfoot.studies.floor_watch import FloorWatch


def test_a_foot_stays_the_same_contact_where_samples_are_lost():
    """Each lost one was a force of 0 N, which lifted the foot: over Wi-Fi it never stood on a target long enough."""
    floor = default_floor(1, 2)
    rows = np.zeros((2000, 2 + 8))
    rows[:, 0] = np.arange(2000) * 48.0
    rows[1000:, 2:6] = 150.0
    rows[1100::90, 2:6] = np.nan
    with closing(Ring.create(10, 4000, "float64")) as ring:
        watch = FloorWatch(ForceReader(ring), floor, 48_000.0, 1000.0)
        ring.write(rows, len(rows))
        watch.read()
        (foot,) = watch.contacts
        assert round(foot.start_s, 3) in (0.999, 1.0)
        assert len(watch.visits) == 1
