"""`underfoot scene`: a scene on the floor without a window; events are printed, and filmed on request."""

import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import click

from underfoot.arguments import choice
from underfoot.commands.compiling import report_compiling
from underfoot.commands.ending import ended_by_signals
from underfoot.commands.files import complete_names, require_outputs_writable, scene_names
from underfoot.commands.options import command, require_only
from underfoot.commands.session_target import LEVEL, RECORD, TargetOptions
from underfoot.commands.telling import tell
from underfoot.errors import BadFile, BadValue, UnderfootError
from underfoot.options import argument, option, shared

if TYPE_CHECKING:
    from underfoot.engine.session import Session
    from underfoot.engine.target import Target
    from underfoot.monitoring import LastingRecording
    from underfoot.scenes.scene import Scene
    from underfoot.scenes.shapes import Shape
    from underfoot.scenes.stage import Stage

_TICK_S = 0.005
FILM_HZ = 12.5
MOST_FILM_S = 60.0


@dataclass(frozen=True)
class SceneOptions(TargetOptions):
    """Options of the command; None if not given."""

    name: str | None = argument(shell_complete=complete_names(scene_names))
    level: float = shared(LEVEL)
    seconds: float | None = option("Stop after this long; by default at Ctrl-C.")
    settings: tuple[str, ...] = option("Parameter of the scene.", (), "--set", metavar="NAME=VALUE")
    seed: int = option("Seed of the random draws.", 1, type=click.IntRange(0, 2**31 - 1))
    record: Path | None = shared(RECORD)
    film: Path | None = option("GIF film of the scene to write; needs --seconds, at most 60.", is_written=True)
    picture: Path | None = option("PNG picture to write of the scene at the end.", is_written=True)
    width: int = option("Width of film and picture in pixels.", 480, type=click.IntRange(64, 1920))
    measure: bool = option("Press simulated tiles, and report the response latency.", False)


@command(SceneOptions)
def scene(options: SceneOptions) -> None:
    """Play the scene NAME on the floor, and print what happens. Without NAME, list the scenes.

    A scene is an interactive surface. The window can show it on a projector (Ctrl+6).
    """
    from underfoot.scenes import discover
    from underfoot.scenes.scene import values_of

    if options.name is None:
        for name, kind in discover().items():
            print(f"{name:18} {kind.doc}")
            for parameter in kind.parameters.values():
                print(f"    {parameter.name}={parameter.default}: {parameter.doc} ({parameter.allowed})")
        return
    choice("scene", options.name, discover())
    kind = discover()[options.name]
    given = values_of(kind, options.settings)
    _check(options)
    if options.measure:
        require_only(options, "--measure", "--seconds --set")  # of the simulated floor, without sound
    with report_compiling():
        if options.measure:
            from underfoot.bench.scene_latency import measured

            print(measured(kind, given, seconds=options.seconds or 30.0).in_words())
        else:
            target = options.session_target(walker=True)
            with _ended_in_a_line():
                made = kind(target.floor, given, options.seed)
            _Show(options, made).run(target)


@contextmanager
def _ended_in_a_line() -> Iterator[None]:
    """End the command with a line, whatever the scene raises."""
    from underfoot.scenes.stage import why_ended

    try:
        yield
    except Exception as error:
        raise UnderfootError(why_ended(error)) from error


def _check(options: SceneOptions) -> None:
    if options.seconds is not None and not 0.0 < options.seconds <= 24 * 3600.0:
        raise BadValue(f"--seconds is {options.seconds:g}; allowed: above 0, up to a day")
    if options.film is not None and (options.seconds is None or options.seconds > MOST_FILM_S):
        raise BadValue(f"--film needs --seconds of at most {MOST_FILM_S:g}")
    for flag, path, suffix in (("--film", options.film, ".gif"), ("--picture", options.picture, ".png")):
        if path is not None and path.suffix.lower() != suffix:
            raise BadValue(f"{flag} is {path}; allowed: a name that ends in {suffix}")
    require_outputs_writable(options.record, options.film, options.picture, inputs=(options.floor,))


@dataclass
class _Show:
    """A scene that plays in its own session."""

    options: SceneOptions
    scene: "Scene"
    _frames: "list[list[Shape]]" = field(default_factory=list)
    _stopped: bool = False

    def run(self, target: "Target") -> None:
        """Play until the time is over, or a signal comes; then write what was asked for."""
        from underfoot.engine.commands import Level
        from underfoot.engine.session import Session
        from underfoot.monitoring import LastingRecording
        from underfoot.nodes import REGISTRY
        from underfoot.scenes.stage import Stage

        with ExitStack() as opened:
            session = Session(target, self.scene.patch(REGISTRY), REGISTRY)
            opened.callback(session.close)
            opened.enter_context(ended_by_signals(self._stop))
            recording = LastingRecording(session, self.options.record)
            session.send(Level(self.options.level))
            session.start()
            stage = Stage(session, self.scene)
            opened.callback(stage.close)
            self._play(session, stage, recording)
            failure = recording.end()
        print(self.scene.state)
        self._write()
        if failure:
            raise BadFile(failure)

    def _stop(self) -> None:
        self._stopped = True

    def _play(self, session: "Session", stage: "Stage", recording: "LastingRecording") -> None:
        from underfoot.floor.contacts import SILENT_S
        from underfoot.monitoring import messages_of

        now_s, film_s = 0.0, 0.0
        while not self._stopped and (self.options.seconds is None or now_s < self.options.seconds):
            reports = session.poll()
            for line in (line for report in reports for line in messages_of(report, session.health)):
                tell(line)
            if begun := recording.poll():
                tell(begun)
            stage.take(reports)
            with _ended_in_a_line():
                moments = stage.tick()
            now_s = moments[-1].time_s if moments else max(now_s, session.played_s - SILENT_S)
            while stage.said:
                print(f"{now_s:8.2f} s  {stage.said.popleft()}", flush=True)
            if self.options.film is not None and now_s >= film_s:
                film_s += 1.0 / FILM_HZ
                self._frames.append(self._shapes())
            time.sleep(_TICK_S)

    def _shapes(self) -> "list[Shape]":
        with _ended_in_a_line():
            return list(self.scene.shapes())

    def _write(self) -> None:
        """Write the picture and the film."""
        from underfoot.drawing.png import png
        from underfoot.files import write_file
        from underfoot.scenes.pictures import Canvas, gif

        canvas = Canvas(self.scene.floor, self.options.width)
        if self.options.picture is not None:
            write_file(self.options.picture, png(canvas.paint(self._shapes())))
        if self.options.film is not None:
            tell(f"painting {len(self._frames)} pictures")
            write_file(self.options.film, gif([canvas.paint(shapes) for shapes in self._frames], 1.0 / FILM_HZ))
