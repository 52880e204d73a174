"""Simulated sound cards: PulseAudio servers, each with a null sink, which PortAudio lists by name."""

import os
import shutil
import socket
import subprocess
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import closing, contextmanager
from pathlib import Path

PROGRAMS = ("pulseaudio", "parec")
_FIRST_PLACES = (
    *("front-left", "front-right", "rear-left", "rear-right"),
    *("front-center", "lfe", "side-left", "side-right"),
)
"""ALSA's order of the first eight channels; others would be mixed."""
_START_S = 60.0


class NullSink:
    """A separate PulseAudio server with a null sink; `module` is the module that creates the sink."""

    module = "module-null-sink norewinds=1"

    def __init__(self, folder: Path, name: str, channels: int) -> None:
        self.folder, self.name, self.channels = folder / name, name, channels
        self.socket = self.folder / "pulse/native"
        self.socket.parent.mkdir(parents=True, mode=0o700)
        self.folder.chmod(0o700)
        self._server: subprocess.Popen[bytes] | None = None

    def start(self) -> None:
        """Start the server, so that the sound card appears."""
        options = ["-n", "--daemonize=no", "--use-pid-file=no", "--exit-idle-time=-1", "--disable-shm=1"]
        modules = ["-L", f"module-native-protocol-unix auth-anonymous=1 socket={self.socket}"]
        sink = f"sink_name={self.name} format=float32le rate=48000 channels={self.channels} channel_map={self.places}"
        modules += ["-L", f"{self.module} {sink}"]
        here = os.environ | {"XDG_RUNTIME_DIR": str(self.folder), "PULSE_RUNTIME_PATH": str(self.folder / "pulse")}
        with (self.folder / "pulseaudio.log").open("ab") as log:
            self._server = subprocess.Popen(["pulseaudio", *options, *modules], stdout=log, stderr=log, env=here)
        end = time.perf_counter() + _START_S
        while not self._answers() and self._server.poll() is None and time.perf_counter() < end:
            time.sleep(0.02)

    def threads(self) -> list[int]:
        """Return the ids of the server's threads."""
        return [int(name) for name in os.listdir(f"/proc/{self._server.pid}/task")] if self._server is not None else []

    def stop(self) -> None:
        """Stop the server, so that the sound card disappears."""
        if self._server is not None:
            self._server.terminate()
            self._server.wait()
        self.socket.unlink(missing_ok=True)

    def _answers(self) -> bool:
        with closing(socket.socket(socket.AF_UNIX)) as line:
            return line.connect_ex(str(self.socket)) == 0

    @property
    def places(self) -> str:
        """PulseAudio's names of the channels."""
        return ",".join([*_FIRST_PLACES, *(f"aux{i}" for i in range(32))][: self.channels])


def is_possible() -> bool:
    """Return whether PulseAudio is installed."""
    return all(map(shutil.which, PROGRAMS))


@contextmanager
def null_sinks(folder: Path, channels: Mapping[str, int]) -> Iterator[tuple[list[NullSink], dict[str, str]]]:
    """Yield a sink per name, and the environment in which PortAudio lists them; the first is the default device."""
    sinks = [NullSink(folder, name, count) for name, count in channels.items()]
    with served(folder, sinks) as environment:
        yield sinks, environment


@contextmanager
def served(folder: Path, sinks: Sequence[NullSink]) -> Iterator[dict[str, str]]:
    """Start sinks in a folder; yield the environment in which PortAudio lists them."""
    client, alsa = folder / "client.conf", folder / "asound.conf"
    client.write_text("autospawn = no\nenable-shm = no\nenable-memfd = no\n")
    of = [f'type pulse\n server "unix:{sink.socket}"' for sink in sinks]
    named = [
        f'pcm.{sink.name} {{ {what}\n hint {{ show on\n description "{sink.name}" }} }}\n'
        for sink, what in zip(sinks, of, strict=True)
    ]
    alsa.write_text(f"pcm.!default {{ {of[0]} }}\nctl.!default {{ {of[0]} }}\n" + "".join(named))
    environment = {
        "XDG_RUNTIME_DIR": str(sinks[0].folder),
        "PULSE_RUNTIME_PATH": str(sinks[0].folder / "pulse"),
        "PULSE_CLIENTCONFIG": str(client),
        "ALSA_CONFIG_PATH": str(alsa),
    }
    try:
        for sink in sinks:
            sink.start()
        yield environment
    finally:
        for sink in sinks:
            sink.stop()


@contextmanager
def playing_on_null_sinks(folder: Path, channels: Mapping[str, int]) -> Iterator[None]:
    """Run null sinks for the programs that this one starts, through its environment."""
    with null_sinks(folder, channels) as (_, environment):
        before = dict(os.environ)
        os.environ.update(environment)
        try:
            yield
        finally:
            os.environ.clear()
            os.environ.update(before)
