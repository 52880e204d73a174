"""Sound cards that are not there: PulseAudio null sinks, and what is played into them."""

import os
import shutil
import subprocess
import sys
from contextlib import contextmanager

import numpy as np
import pytest
from polling import Poll

_FIRST_PLACES = (
    *("front-left", "front-right", "rear-left", "rear-right"),
    *("front-center", "lfe", "side-left", "side-right"),
)
"""ALSA's order of the first eight channels; others would be mixed."""


class NullSink:
    """A PulseAudio server of its own with a sink that goes nowhere; what is played into it can be heard."""

    def __init__(self, folder, name, channels):
        self.folder, self.name, self.channels = folder / name, name, channels
        self.socket = self.folder / "pulse/native"
        self.socket.parent.mkdir(parents=True, mode=0o700)
        self.folder.chmod(0o700)
        self.server = None

    def start(self):
        """Have the sound card be there, or there again."""
        sink = f"sink_name={self.name} format=float32le rate=48000 norewinds=1"
        sink += f" channels={self.channels} channel_map={self._places}"
        options = ["-n", "--daemonize=no", "--use-pid-file=no", "--exit-idle-time=-1", "--disable-shm=1"]
        modules = ["-L", f"module-native-protocol-unix auth-anonymous=1 socket={self.socket}"]
        modules += ["-L", f"module-null-sink {sink}"]
        environment = os.environ | {
            "XDG_RUNTIME_DIR": str(self.folder),
            "PULSE_RUNTIME_PATH": str(self.folder / "pulse"),
        }
        with (self.folder / "pulseaudio.log").open("ab") as log:
            self.server = subprocess.Popen(["pulseaudio", *options, *modules], stdout=log, stderr=log, env=environment)
        Poll(10.0)(lambda: self.socket.exists() or self.server.poll() is not None, "pulseaudio answers")

    def stop(self):
        """Take the sound card away."""
        self.server.terminate()
        self.server.wait()
        self.socket.unlink(missing_ok=True)

    @contextmanager
    def heard(self):
        """Collects what is played meanwhile: a function that gives float32 [frame, channel] so far."""
        path = self.folder / f"heard{len(list(self.folder.glob('heard*')))}.f32"
        command = ["parec", "-s", f"unix:{self.socket}", "-d", f"{self.name}.monitor", "--format=float32le"]
        command += ["--rate=48000", "--latency-msec=20", "--raw"]
        with path.open("wb") as file:
            shape = f"--channels={self.channels}", f"--channel-map={self._places}"
            parec = subprocess.Popen([*command, *shape], stdout=file)
            try:
                Poll()(lambda: path.stat().st_size > 0, "parec records")
                size = 4 * self.channels
                yield lambda: np.fromfile(path, "<f4", path.stat().st_size // size * self.channels).reshape(
                    -1, self.channels
                )
            finally:
                parec.terminate()
                parec.wait()

    @property
    def _places(self):
        return ",".join([*_FIRST_PLACES, *(f"aux{i}" for i in range(32))][: self.channels])


@pytest.fixture
def null_sink(tmp_path, monkeypatch):
    """PortAudio's default device is a PulseAudio null sink; skips where there is no PulseAudio or PortAudio."""
    with _sinks(tmp_path, monkeypatch, {"uf": 4}) as (sink,):
        yield sink


@pytest.fixture
def two_sinks(tmp_path, monkeypatch):
    """Two sound cards of 18 channels, "left" and "right"; skips as `null_sink` does."""
    with _sinks(tmp_path, monkeypatch, {"left": 18, "right": 18}) as sinks:
        yield sinks


@contextmanager
def _sinks(tmp_path, monkeypatch, channels):
    """A null sink for each name, which PortAudio has under that name, and the first as its default device, too."""
    for program in ("pulseaudio", "parec"):
        if shutil.which(program) is None:
            pytest.skip(f"{program} is not installed (packages pulseaudio and pulseaudio-utils)")
    sinks = [NullSink(tmp_path, name, count) for name, count in channels.items()]
    client, alsa = tmp_path / "client.conf", tmp_path / "asound.conf"
    client.write_text("autospawn = no\nenable-shm = no\nenable-memfd = no\n")
    of = [f'type pulse\n server "unix:{sink.socket}"' for sink in sinks]
    named = [
        f'pcm.{sink.name} {{ {what}\n hint {{ show on\n description "{sink.name}" }} }}\n'
        for sink, what in zip(sinks, of, strict=True)
    ]
    alsa.write_text(f"pcm.!default {{ {of[0]} }}\nctl.!default {{ {of[0]} }}\n" + "".join(named))
    for name, value in (
        ("XDG_RUNTIME_DIR", sinks[0].folder),
        ("PULSE_RUNTIME_PATH", sinks[0].folder / "pulse"),
        ("PULSE_CLIENTCONFIG", client),
        ("ALSA_CONFIG_PATH", alsa),
    ):
        monkeypatch.setenv(name, str(value))
    monkeypatch.delenv("PULSE_SERVER", raising=False)
    try:
        for sink in sinks:
            sink.start()
        found = subprocess.run(
            [sys.executable, "-c", "from underfoot.devices.sound import devices; print(devices())"],
            capture_output=True,
            text=True,
            check=False,
        )
        if "default" not in found.stdout:
            pytest.skip("PortAudio does not reach PulseAudio (packages libportaudio2 and libasound2-plugins)")
        yield sinks
    finally:
        for sink in sinks:
            sink.stop()
