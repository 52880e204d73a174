"""A sound card that is not there: a PulseAudio null sink, and what is played into it."""

import shutil
import subprocess
import sys
from contextlib import contextmanager

import numpy as np
import pytest
from polling import Poll


class NullSink:
    """A PulseAudio server of its own with a sink that goes nowhere; what is played into it can be heard."""

    channels = 4
    places = "front-left,front-right,rear-left,rear-right"  # ALSA's order; others would be mixed

    def __init__(self, folder, server):
        self.folder, self.server = folder, server

    @contextmanager
    def heard(self):
        """Collects what is played meanwhile: a function that gives float32 [frame, channel] so far."""
        path = self.folder / f"heard{len(list(self.folder.glob('heard*')))}.f32"
        command = ["parec", "-d", "uf.monitor", "--format=float32le", "--rate=48000", "--latency-msec=20", "--raw"]
        with path.open("wb") as file:
            shape = f"--channels={self.channels}", f"--channel-map={self.places}"
            parec = subprocess.Popen([*command, *shape], stdout=file)
            try:
                Poll()(lambda: path.stat().st_size > 0, "parec records")
                yield lambda: np.fromfile(path, "<f4")[: path.stat().st_size // 4 // 4 * 4].reshape(-1, self.channels)
            finally:
                parec.terminate()
                parec.wait()

    def stop(self):
        """Take the sound card away."""
        self.server.terminate()
        self.server.wait()


@pytest.fixture
def null_sink(tmp_path, monkeypatch):
    """PortAudio's default device is a PulseAudio null sink; skips where there is no PulseAudio or PortAudio."""
    for program in ("pulseaudio", "parec"):
        if shutil.which(program) is None:
            pytest.skip(f"{program} is not installed (packages pulseaudio and pulseaudio-utils)")
    runtime = tmp_path / "run"
    (runtime / "pulse").mkdir(parents=True, mode=0o700)
    runtime.chmod(0o700)
    client, alsa = tmp_path / "client.conf", tmp_path / "asound.conf"
    client.write_text("autospawn = no\nenable-shm = no\nenable-memfd = no\n")
    alsa.write_text("pcm.!default { type pulse }\nctl.!default { type pulse }\n")
    for name, value in (
        ("XDG_RUNTIME_DIR", runtime),
        ("PULSE_RUNTIME_PATH", runtime / "pulse"),
        ("PULSE_CLIENTCONFIG", client),
        ("ALSA_CONFIG_PATH", alsa),
    ):
        monkeypatch.setenv(name, str(value))
    monkeypatch.delenv("PULSE_SERVER", raising=False)
    sink = "sink_name=uf format=float32le rate=48000 norewinds=1"
    sink += f" channels={NullSink.channels} channel_map={NullSink.places}"
    options = ["-n", "--daemonize=no", "--use-pid-file=no", "--exit-idle-time=-1", "--disable-shm=1"]
    modules = ["-L", "module-native-protocol-unix auth-anonymous=1", "-L", f"module-null-sink {sink}"]
    with (tmp_path / "pulseaudio.log").open("wb") as log:
        server = subprocess.Popen(["pulseaudio", *options, *modules], stdout=log, stderr=log)
    try:
        Poll(10.0)(lambda: (runtime / "pulse/native").exists() or server.poll() is not None, "pulseaudio answers")
        found = subprocess.run(
            [sys.executable, "-c", "from underfoot.devices.sound import devices; print(devices())"],
            capture_output=True,
            text=True,
            check=False,
        )
        if "default" not in found.stdout:
            pytest.skip("PortAudio does not reach PulseAudio (packages libportaudio2 and libasound2-plugins)")
        yield NullSink(tmp_path, server)
    finally:
        server.terminate()
        server.wait()
