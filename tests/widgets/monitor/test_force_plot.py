"""The plot of force over time."""

import numpy as np

from underfoot.widgets.monitor.force_plot import ForcePlot


def test_the_force_axis_grows_at_once_and_shrinks_late(qtbot):
    plot = ForcePlot()
    qtbot.addWidget(plot)
    plot.set_duration(5.0)

    def top_after(force_n, now_s):
        times = np.linspace(now_s - 1.0, now_s, 200)
        plot.show_forces(times, np.full((200, 4), force_n / 4, np.float32), now_s, np.zeros(0))
        return plot.ranges[3]

    assert top_after(700.0, 10.0) == 1000.0
    assert top_after(1500.0, 11.0) == 2000.0
    assert top_after(100.0, 13.0) == 2000.0
    assert top_after(100.0, 17.0) == 200.0
