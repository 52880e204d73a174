"""The page on several hosts has the figures that `python -m underfoot.bench.hosts` prints."""

import re
from pathlib import Path

import numpy as np
import pytest

from underfoot.bench.hosts import LINKS, by_round_trips, centroid_errors_m

PAGE = (Path(__file__).parents[2] / "docs" / "hosts.md").read_text(encoding="utf-8")


def test_the_page_has_the_figures_of_today():
    for name, link in LINKS.items():
        (given_ms,) = re.findall(rf"^\| {name}.*?\) \| ([\d.]+) ms", PAGE, re.MULTILINE)
        error_ms = 1e3 * np.percentile(np.abs(by_round_trips(link, 50.0, 600.0)), 95)
        assert error_ms == pytest.approx(float(given_ms), abs=5e-3)
    (given_mm,) = re.findall(r"^\| centroid wrong by .* \| ([\d.]+) mm \|$", PAGE, re.MULTILINE)
    assert 1e3 * np.percentile(centroid_errors_m(0.016), 95) == pytest.approx(float(given_mm), abs=0.5)
