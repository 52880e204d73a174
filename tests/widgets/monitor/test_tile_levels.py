"""Levels of the chosen tile: at once on a small floor, from its choice on on a large one."""

import numpy as np
import pytest
from PySide6.QtGui import QTextLayout

from underfoot.widgets import theme
from underfoot.widgets.monitor.level_plot import whole_parts
from underfoot.widgets.monitor.tile_levels import TileLevels
from underfoot.widgets.monitor.vibration_history import MOST_TILES

RATE_HZ = 48_000.0


def feed(levels, tiles):
    """Half a second of noise, of which tile k does 1 / (k + 1)."""
    commanded = np.random.default_rng(1).normal(size=(24_000, 1)).repeat(tiles, 1).astype(np.float32)
    levels.feed(commanded, commanded / np.arange(1, tiles + 1, dtype=np.float32))


def transfer_db(levels):
    return levels.levels()[0].transfer_db


def test_another_tile_of_a_small_floor_has_levels_at_once():
    levels = TileLevels(MOST_TILES, RATE_HZ)
    feed(levels, MOST_TILES)
    assert transfer_db(levels) == pytest.approx(0.0, abs=1e-4)
    levels.choose(9)
    assert transfer_db(levels) == pytest.approx(-20.0, abs=1e-4)


def test_another_tile_of_a_large_floor_has_levels_of_itself_alone_from_then_on():
    levels = TileLevels(MOST_TILES + 1, RATE_HZ)
    feed(levels, MOST_TILES + 1)
    levels.choose(0)  # which it is
    assert transfer_db(levels) == pytest.approx(0.0, abs=1e-4)
    levels.choose(9)
    assert levels.levels() == (None, "")
    feed(levels, MOST_TILES + 1)
    assert transfer_db(levels) == pytest.approx(-20.0, abs=1e-4)


def test_the_line_above_the_levels_wraps_between_its_parts_and_not_within_a_unit(qapp):
    text = QTextLayout(whole_parts("8 dB under threshold, noticed by 7 %; 90 N/mm feel like 79 N/mm"), theme.font())
    for width in range(60, 400, 10):
        text.beginLayout()
        while (line := text.createLine()).isValid():
            line.setLineWidth(width)
            end = line.textStart() + line.textLength()
            assert text.text()[end - 2 : end] in ("; ", "mm"), width
        text.endLayout()
