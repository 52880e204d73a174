"""Virtual sound cards for tests, and what is played into them."""

import subprocess
import sys
from contextlib import contextmanager

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


@contextmanager
def listening(sink):
    """Collect what is played into a sink: yield a function that returns float32 [frame, channel] so far."""
    path = sink.folder / f"heard{len(list(sink.folder.glob('heard*')))}.f32"
    command = ["parec", "-s", f"unix:{sink.socket}", "-d", f"{sink.name}.monitor", "--format=float32le"]
    command += ["--rate=48000", "--latency-msec=20", "--raw"]
    with path.open("wb") as file:
        shape = f"--channels={sink.channels}", f"--channel-map={sink.places}"
        parec = subprocess.Popen([*command, *shape], stdout=file)
        try:
            Poll()(lambda: path.stat().st_size > 0, "parec records")
            size = 4 * sink.channels
            yield lambda: np.fromfile(path, "<f4", path.stat().st_size // size * sink.channels).reshape(
                -1, sink.channels
            )
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
        found = subprocess.run(
            [sys.executable, "-c", "from underfoot.devices.sound import devices; print(devices())"],
            capture_output=True,
            text=True,
            check=False,
        )
        if "default" not in found.stdout:
            pytest.skip("PortAudio does not reach PulseAudio (packages libportaudio2 and libasound2-plugins)")
        yield sinks
