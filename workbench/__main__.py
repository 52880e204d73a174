"""The entry point: the command line, and the one place that opens the window."""

import builtins
import errno
import gc
import os
import signal
import stat
import sys
from collections.abc import Mapping
from contextlib import ExitStack, suppress
from importlib import import_module
from io import TextIOWrapper
from pathlib import Path
from typing import TYPE_CHECKING

# Before NumPy is loaded, here and in the processes that are started: the threads of its linear algebra wait busily at
# first, beside all that a start loads, and with their number results would differ in the last bits.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import click

from underfoot.commands import CommandGroup
from underfoot.commands.ending import raised_at_signals
from underfoot.commands.files import (
    FILE,
    FileOrPreset,
    complete_files_and,
    complete_names,
    live_targets,
    require_folders_writable,
    scene_names,
)
from underfoot.commands.telling import no_window
from underfoot.devices.transports import target_forms
from underfoot.errors import BadFile, BadValue, UnderfootError
from underfoot.version import __version__

if TYPE_CHECKING:
    from underfoot.engine.target import Target


@click.group(cls=CommandGroup, invoke_without_command=True, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(__version__)
@click.option(
    "--target",
    default="simulator",
    show_default=True,
    shell_complete=complete_files_and(live_targets),
    help=f"simulator, simulator:PARAMETERS.json, simulator:people=N,path=PATH, {target_forms()}, or "
    "a force CSV, a recording, or a C3D file.",
)
@click.option("--floor", type=FileOrPreset("floors"), help="Floor JSON; found automatically beside a force CSV.")
@click.option(
    "--patch",
    type=FileOrPreset("patches"),
    help="Patch to open: a file (also `underfoot FILE.json`), or a preset's name.",
)
@click.option("--recording", type=FILE, help="Recording to open; also `underfoot FILE`.")
@click.option(
    "--scene",
    shell_complete=complete_names(scene_names),
    help="Scene to play, and to show on the last screen, once the window is open.",
)
@click.option("--set", "settings", multiple=True, metavar="NAME=VALUE", help="Parameter of the scene.")
@click.option("--screenshot", type=FILE, help="Save a picture of every workspace in this folder, and exit.")
@click.pass_context
def cli(
    context: click.Context,
    target: str,
    floor: Path | None,
    patch: Path | None,
    recording: Path | None,
    scene: str | None,
    settings: tuple[str, ...],
    screenshot: Path | None,
) -> None:
    """Underfoot: a workbench for vibrotactile floors. Without a command it opens the window."""
    if context.invoked_subcommand is None:
        context.exit(open_window(target, floor, patch, recording, screenshot, _scene(scene, settings)))
    context.obj.enter_context(raised_at_signals())  # so that a command leaves no part of a file; the window ends itself


def main() -> None:
    """Run the command line; every error is one line, and exit status 1."""
    gc.set_threshold(100_000)  # or the interpreter looks through all that is being imported, again and again: 0.03 s
    if isinstance(sys.stdout, TextIOWrapper):
        sys.stdout.reconfigure(errors="replace")  # "m/s²" where a terminal or a pipe has no such sign
    _require_threads()
    try:
        status = cli.main(prog_name="underfoot", standalone_mode=False)
        if sys.stdout is not None:
            sys.stdout.flush()  # here, where an error of it is caught
    except (click.exceptions.Abort, KeyboardInterrupt) as error:
        sys.exit(getattr(error.__cause__ or error, "status", 130))  # click has its own exception for Ctrl-C
    except click.UsageError as error:
        text = error.format_message().rstrip(".")
        see = f"see `{error.ctx.command_path} --help`" if error.ctx else ""
        _fail(f"{text} {see[:1].upper()}{see[1:]}" if text.endswith("?") else "; ".join(filter(None, (text, see))))
    except click.ClickException as error:
        _fail(error.format_message())
    except UnderfootError as error:
        _fail(str(error))
    except MemoryError:
        _fail("there is not enough memory for this; ask for fewer seconds or fewer tiles")
    except OSError as error:
        if _is_unread(error):
            _discard_output()
            sys.exit(1)
        if error.errno in (errno.EMFILE, errno.ENFILE):
            _fail("the system allows no more open files; raise its limit (ulimit -n) and start again")
        if error.filename is None and error.errno in _REFUSED:
            _discard_output()
            _fail(f"what is printed cannot be written: {(error.strerror or 'refused').lower()}")
        if error.filename is None:
            raise
        _fail(f"{error.filename} cannot be reached: {(error.strerror or 'refused').lower()}")
    gc.freeze()  # or the interpreter looks through all that was loaded as it ends: 0.07 s
    sys.exit(status if isinstance(status, int) else 0)


def _require_threads() -> None:
    """End with a line for a number of threads at which Numba cannot be imported."""
    given = os.environ.get("NUMBA_NUM_THREADS", "")
    with suppress(ValueError):  # Numba goes on without what is no number
        if int(given) < 1:
            _fail(f"NUMBA_NUM_THREADS is {given}; allowed: 1 or more; unset it, nothing here uses it")


_REFUSED = (errno.ENOSPC, errno.EIO, errno.EFBIG)
"""What a full or broken disk says, to which the standard output goes."""


def _is_unread(error: OSError) -> bool:
    """Return whether this says that nobody reads the standard output any more; of a pipe, Windows does so by EINVAL."""
    if error.errno != errno.EINVAL or error.filename is not None:
        return isinstance(error, BrokenPipeError)
    with suppress(OSError):  # it is closed
        return stat.S_ISFIFO(os.fstat(1).st_mode)
    return False


def _discard_output() -> None:
    """Let nothing more be printed, or the interpreter tries again as it ends, and says that it failed."""
    if sys.stdout is not None:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _fail(line: str) -> None:
    from underfoot.file_places import readable

    print(f"underfoot: {' '.join(readable(line).split())}", file=sys.stderr)
    sys.exit(1)


def open_window(
    target: str,
    floor: Path | None,
    patch: Path | None,
    recording: Path | None,
    screenshot: Path | None,
    scene: tuple[str, Mapping[str, object]] | None = None,
) -> int:
    """Open the window, after everything that was named on the command line has been looked at."""
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:  # a shell's background ignores it
        # Until the window ends in order at signals, Ctrl-C ends the process as the system ends any: Qt aborts, crashes
        # or goes on at what Python would raise while it is imported, and nothing is there yet that is to be kept.
        signal.signal(signal.SIGINT, signal.SIG_DFL)
    from underfoot.engine.child_process import engine_process

    gc.disable()  # until the window is there, which collects by itself
    engine = engine_process()  # which loads while the window is made
    with ExitStack() as unless_opened:
        unless_opened.callback(engine.end, 0.0)
        from underfoot.files import make_folder, read_file
        from underfoot.nodes import REGISTRY
        from underfoot.patch.node_files import has_nodes
        from underfoot.patch.patch import Patch

        opened = _target(target, floor)
        if patch is not None:
            if has_nodes(patch.parent):  # which the window asks about
                Patch.unchecked(read_file(patch), str(patch))
            else:
                Patch.load(patch, REGISTRY)
        if recording is not None:
            from underfoot.records.recording import Recording

            Recording(recording).close()
        if screenshot is not None:
            require_folders_writable(screenshot)
            make_folder(screenshot)
        _require_qt()
        from underfoot.widgets.application import data_folder, run

        if screenshot is None:
            data_folder()  # refused here, the engine is ended
        unless_opened.pop_all()
    options = ["--target", target, *(["--floor", str(floor)] if floor else [])] if opened else []
    return run(opened, patch, screenshot, engine, recording, options, scene)


def _require_qt() -> None:
    """Import Qt, without what it adds to the import statement.

    PySide6 would read the source of every module that is imported from then on, to find those that may use its
    `__feature__`, which Underfoot does not: 0.05 s or more before the first picture.
    """
    imports = builtins.__import__
    try:
        import_module("PySide6.QtWidgets")
        builtins.__import__ = imports
    except ImportError as error:
        raise UnderfootError(no_window(str(error))) from None


def _scene(name: str | None, settings: tuple[str, ...]) -> tuple[str, Mapping[str, object]] | None:
    """Return the scene of the command line and its parameters; None without one."""
    if name is None:
        if settings:
            raise BadValue(f"--set is {' '.join(settings)}; allowed: with --scene, of which it is a parameter")
        return None
    from underfoot.arguments import choice
    from underfoot.scenes import discover
    from underfoot.scenes.scene import values_of

    kinds = discover()
    choice("scene", name, kinds)
    return name, values_of(kinds[name], settings)


def _target(name: str, floor: Path | None) -> "Target | None":
    """Return the target of the command line; None for the window's last one."""
    from underfoot.engine.target import Target, force_rate_hz, live_target, require_source
    from underfoot.floor.layout import Floor
    from underfoot.records.force_files import FORMS, floor_of

    live = live_target(name, floor)
    if live is not None:
        require_source(live)
        return live if floor or live.simulation or live.kind != "simulator" else None
    if not os.path.isfile(name):
        raise BadFile(
            f"--target is {name}; allowed: simulator, simulator:PARAMETERS.json, simulator:people=N,path=PATH, "
            f"{target_forms()}, or {FORMS} that is there"
        )
    target = Target(Floor.load(floor) if floor else floor_of(name), kind="replay", source=name)
    force_rate_hz(target)  # a file that cannot be played is said before a window is there
    return target


if __name__ == "__main__":
    main()
