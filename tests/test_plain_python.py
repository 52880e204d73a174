"""Where Numba is disabled, for a debugger, models run as plain Python: with the same results as compiled."""

import json
import os
import subprocess
import sys

import numpy as np

from underfoot.models.fibre_bundle.bundle import FibreBundle
from underfoot.models.filtering import cascade
from underfoot.models.modal.impact import Hammer, ModalObject, strike
from underfoot.models.signals.noise import white
from underfoot.models.tile.fsr import Fsr


def results():
    """Return what models with parts, records, random numbers and lanes compute, as lists."""
    bundle = FibreBundle(200, mass=0.0, damping=0.0).response(np.linspace(0.0, 200.0, 400), 48000.0, seed=3)
    blow = strike(Hammer(0.02, 1.0, 1e7), ModalObject([200.0], [10.0], [1.0], [1.0]), 0.002, 48000, error=1e-3)
    lag, state = cascade.coefficients([[0.5, 0.0, 0.0, 1.0, -0.5, 0.0]]), np.zeros(1, cascade.STATE)[0]
    filtered, noise = np.ones(64), np.empty(32)
    cascade.run(state, lag, filtered, filtered)
    white(np.uint64(1), 0, noise)
    counts = Fsr().counts([0.0, 100.0, 1000.0])
    found = (bundle.strain, bundle.event_s, blow.force_n, filtered, noise, counts)
    return [np.asarray(values, dtype=float).tolist() for values in found]


def test_models_and_lanes_run_as_plain_python():
    environment = {**os.environ, "NUMBA_DISABLE_JIT": "1"}
    ran = subprocess.run([sys.executable, __file__], env=environment, capture_output=True, text=True, check=True)
    for plain, compiled in zip(json.loads(ran.stdout), results(), strict=True):
        assert len(compiled) > 0
        np.testing.assert_allclose(plain, compiled, rtol=1e-9, atol=1e-15)


def test_a_patch_says_that_it_needs_compiled_code(tmp_path):
    environment = {**os.environ, "NUMBA_DISABLE_JIT": "1"}
    command = [sys.executable, "-m", "underfoot", "render", "gravel", "--seconds", "0.01", "-o", tmp_path / "a.wav"]
    ran = subprocess.run(command, env=environment, capture_output=True, text=True)
    said = "underfoot: a patch runs as compiled code only; unset NUMBA_DISABLE_JIT, which is for models by themselves"
    assert (ran.returncode, ran.stderr.splitlines()[-1]) == (1, said)


def test_no_threads_for_numba_are_refused_in_a_line():
    environment = {**os.environ, "NUMBA_NUM_THREADS": "0"}
    ran = subprocess.run([sys.executable, "-m", "underfoot", "nodes"], env=environment, capture_output=True, text=True)
    said = "underfoot: NUMBA_NUM_THREADS is 0; allowed: 1 or more; unset it, nothing here uses it\n"
    assert (ran.returncode, ran.stderr) == (1, said)


if __name__ == "__main__":
    import test_lanes

    for name in dir(test_lanes):
        if name.startswith("test_"):
            getattr(test_lanes, name)()
    print(json.dumps(results()))
