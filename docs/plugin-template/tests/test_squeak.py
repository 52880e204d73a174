"""The squeak is found, and rises as it says."""

import numpy as np
from scipy.signal import find_peaks

import underfoot as uf


def test_a_load_of_400_n_squeaks_at_the_lowest_pitch_and_400_times_the_rise():
    patch = uf.Patch().add("tile-force").add("squeak", lowest=100.0, rise=0.25).add("tile-output")
    patch = patch.connect("tile-force.force", "squeak.signal").connect("squeak.out", "tile-output.acceleration")
    time_s = np.arange(2500) / 1000.0
    force_n = np.zeros((2500, 1, 4))
    force_n[500:] = 100.0  # at each corner
    forces = uf.Forces(time_s, force_n, 1000.0, uf.default_floor(1, 1))
    commanded = uf.render(patch, forces, plates=("foot",)).tiles["commanded"]
    one_second = commanded[48_000:96_000, 0]
    assert len(find_peaks(one_second)[0]) == 100 + 0.25 * 400
