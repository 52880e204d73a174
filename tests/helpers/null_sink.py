"""Virtual sound cards for tests, and what is played into them."""

import subprocess
import sys
from contextlib import contextmanager
from functools import cache

import numpy as np
import pytest
from polling import Poll

from underfoot.bench.stress import null_sinks


@pytest.fixture
def null_sink(tmp_path, monkeypatch):
    """Make a PulseAudio null sink PortAudio's default device; skip without PulseAudio or PortAudio."""
    with _sinks(tmp_path, monkeypatch, {"uf": 4}) as (sink,):
        yield sink


@pytest.fixture
def two_sinks(tmp_path, monkeypatch):
    """Make two sound cards of 18 channels, "left" and "right"; skip as `null_sink` does."""
    with _sinks(tmp_path, monkeypatch, {"left": 18, "right": 18}) as sinks:
        yield sinks


class Heard:
    """What was played into a sink so far: called, float32 [frame, channel], which stays on disk until it is read."""

    def __init__(self, path, channels):
        self._path, self._channels = path, channels

    def __call__(self):
        frames = self._path.stat().st_size // (4 * self._channels)
        shape = (frames, self._channels)
        return np.memmap(self._path, "<f4", "r", shape=shape) if frames else np.zeros(shape, "<f4")

    def summary(self):
        """What is heard of each channel, for a test that hears something else than it waits for."""
        heard = np.abs(self())
        lines = [f"{len(heard) / 48_000:.2f} s were heard"]
        for channel, one in enumerate(heard.T, start=1):
            at = np.flatnonzero(one)
            if len(at):
                times = f"{at[0] / 48_000:.2f} to {at[-1] / 48_000:.2f} s, {len(at) / 48_000:.2f} s of that not zero"
                lines.append(f"channel {channel} from {times}, {one.max():.3g} at most")
        return "; ".join(lines if len(lines) > 1 else [*lines, "all silent"])


@contextmanager
def listening(sink):
    """Collect what is played into a sink: yield `Heard`."""
    path = sink.folder / f"heard{len(list(sink.folder.glob('heard*')))}.f32"
    command = ["parec", "-s", f"unix:{sink.socket}", "-d", f"{sink.name}.monitor", "--format=float32le"]
    command += ["--rate=48000", "--latency-msec=20", "--raw"]
    with path.open("wb") as file:
        shape = f"--channels={sink.channels}", f"--channel-map={sink.places}"
        parec = subprocess.Popen([*command, *shape], stdout=file)
        try:
            heard = Heard(path, sink.channels)
            Poll()(lambda: len(heard()) > 0, "parec records")
            yield heard
        finally:
            parec.terminate()
            parec.wait()


@contextmanager
def _sinks(tmp_path, monkeypatch, channels):
    if not null_sinks.is_possible():
        pytest.skip("pulseaudio or parec is not installed (packages pulseaudio and pulseaudio-utils)")
    with null_sinks.null_sinks(tmp_path, channels) as (sinks, environment):
        for name, value in environment.items():
            monkeypatch.setenv(name, value)
        monkeypatch.delenv("PULSE_SERVER", raising=False)
        if not _is_reached():
            pytest.skip("PortAudio does not reach PulseAudio (packages libportaudio2 and libasound2-plugins)")
        yield sinks


@cache
def _is_reached():
    """Whether PortAudio finds the sinks that this process's environment names; looked for once, whatever they are."""
    found = subprocess.run(
        [sys.executable, "-c", "from underfoot.devices.sound import devices; print(devices())"],
        capture_output=True,
        text=True,
        check=False,
    )
    return "default" in found.stdout
