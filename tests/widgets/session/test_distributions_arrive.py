"""Distributions that take longer than the small plots that are asked for meanwhile."""

import pytest
from polling import Poll
from PySide6.QtCore import QCoreApplication
from windows import LONG_MS, design, end_window, play_on_simulator

from underfoot.nodes import REGISTRY
from underfoot.patch.patch import Patch


@pytest.fixture
def window(qtbot, tmp_path):
    made = Patch()
    for type in ("stick-slip", "noise", "texture"):
        made = made.add(type, REGISTRY, (0.0, 200.0 * len(made.nodes)))
    made.save(tmp_path / "hiss.json")
    window = play_on_simulator(tmp_path)
    yield window
    end_window(window)


def test_distributions_come_though_other_previews_were_asked_for_after_them(window):
    workspace = design(window)
    workspace.canvas.patch_scene.select([workspace.patch().nodes[0].id])
    Poll()(
        _seen(lambda: workspace.preview.distributions.isVisible()), "distributions are offered", seconds=LONG_MS / 1000
    )
    workspace.preview.distributions.click()
    view = workspace.preview.distribution_view
    assert view.text.isVisible()
    assert view.text.text() == "being made…"
    Poll()(_seen(lambda: view.plots[0].isVisible()), "the distributions are drawn", seconds=LONG_MS / 1000)
    assert view.plots[0].drawing.series


def _seen(holds):
    def look():
        QCoreApplication.processEvents()
        return holds()

    return look
