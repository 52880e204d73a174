"""Masking sounds: their spectrum, level and clicks; and that a real card plays them on the channel asked for."""

import os
import signal
import subprocess
import sys

import numpy as np
import pytest
from null_sink import listening
from scipy.signal import welch

from underfoot.errors import DeviceError
from underfoot.experiments.protocol import Sounds
from underfoot.studies.masking import RATE_HZ, STILL_LOOKS, WAKING_LOOKS, CardLooks, Masking, sound_loop


@pytest.mark.parametrize(("noise", "slope"), [("pink", -10.0), ("white", 0.0)])
def test_noise_has_its_level_and_its_slope(noise, slope):
    loop = sound_loop(Sounds(noise=noise, noise_db=-26.0)).astype(np.float64)
    assert 20.0 * np.log10(np.sqrt(np.mean(loop**2))) == pytest.approx(-26.0, abs=0.05)
    hz, power = welch(loop, RATE_HZ, nperseg=16384)
    inside = (hz > 60.0) & (hz < 12_000.0)
    found, _ = np.polyfit(np.log10(hz[inside]), 10.0 * np.log10(power[inside]), 1)
    assert found == pytest.approx(slope, abs=0.3)


def test_the_loop_has_no_seam_and_whole_beats():
    loop = sound_loop(Sounds(noise="pink", metronome_hz=1.5, metronome_db=-6.0, noise_db=-60.0)).astype(np.float64)
    assert len(loop) == 20 * RATE_HZ
    loud = np.flatnonzero(np.abs(loop) > 0.3)
    begins = loud[np.diff(loud, prepend=-RATE_HZ) > 0.1 * RATE_HZ]
    assert len(begins) == 30
    np.testing.assert_allclose(np.diff(begins), RATE_HZ / 1.5, atol=1.0)
    plain = sound_loop(Sounds(noise="pink")).astype(np.float64)
    assert abs(plain[0] - plain[-1]) < 6.0 * np.diff(plain).std()


@pytest.mark.parametrize("hangs", [False, True])
def test_a_card_plays_it_on_its_channel(null_sink, until, hangs):
    """Once its card was gone, or its server hung, the study went on without it."""
    script = """
from threading import Event
from underfoot.experiments.protocol import Sounds
from underfoot.studies.masking import Masking
masking = Masking(Sounds(noise="pink", noise_db=-20.0, channel=3))
masking.start()
input()
while not masking.problem:
    Event().wait(0.02)
print(masking.problem)
masking.close()
"""
    with listening(null_sink) as heard:
        pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
        player = subprocess.Popen([sys.executable, "-c", script], text=True, **pipes)
        until(lambda: np.abs(heard()[-4800:, 3]).max(initial=0.0) > 0.1, "the noise comes", seen=heard.summary)
        played = heard()[-4800:]
        server = min(null_sink.threads())
        if hangs:
            os.kill(server, signal.SIGSTOP)
        else:
            null_sink.stop()
        said, _ = player.communicate("\n")
        if hangs:
            os.kill(server, signal.SIGCONT)
    assert (player.returncode, said.startswith("the masking sound has stopped")) == (0, True)
    assert np.abs(played[:, [0, 1, 2]]).max() == 0.0


@pytest.mark.parametrize(("asked", "waits"), [((9, 12), WAKING_LOOKS), ((9, 12, 15), STILL_LOOKS)])
def test_a_card_that_wakes_late_is_waited_for_longer_than_one_that_has_played(asked, waits):
    """Headphones that took 2 s to wake were said to have stopped, for the rest of the session."""
    looks = CardLooks()
    still = asked[-1:] * waits
    assert [looks.is_given_up(blocks) for blocks in asked + still].index(True) == len(asked) + waits - 1


def test_a_device_that_is_not_there_is_said():
    with pytest.raises(DeviceError, match="masking sound cannot be played on no such card"):
        Masking(Sounds(noise="pink"), "no such card")
