"""Commands that are stopped by signals: they end, with their processes, and leave no part of a file."""

import ctypes
import os
import signal
import subprocess
import sys
from functools import partial

import pytest
from long_recording import write_recording
from process_groups import members

from underfoot.commands.ending import Interrupted, ended_by_signals, raised_at_signals
from underfoot.engine.worker_pool import cores
from underfoot.errors import BadFile
from underfoot.floor.layout import default_floor
from underfoot.patch import preset_files

SINE = preset_files.patches()["stimulus-sp"]


def test_what_ends_a_rendering_of_several_leaves_no_part_of_a_file(underfoot, folder, until):
    """Ctrl-C, which goes to all processes, is in `test_bulk.py`."""
    patches = [SINE, preset_files.patches()["gravel"], preset_files.patches()["snow"]]
    assert underfoot("render", *patches, "--seconds", "0.01").status == 0  # kernels are there
    command = [sys.executable, "-m", "underfoot", "render", *patches, "-o", "all", "--seconds", "3000"]
    pipe = subprocess.PIPE
    with subprocess.Popen(command, stdout=pipe, stderr=pipe, start_new_session=True) as process:
        until(lambda: len(members(process.pid)) > min(cores(), len(patches)))
        os.kill(process.pid, signal.SIGTERM)
        out, error = process.communicate(timeout=300.0)
    assert (process.returncode, out, error.strip()) == (143, b"", b"")
    assert not (folder / "all").exists()
    until(lambda: not members(process.pid))


LEAVES = """
import os, signal, sys
def hear(event, given):
    if event == "os.rename" and os.path.basename(given[1]) == "plate.json":
        os.kill(os.getpid(), signal.SIGTERM)
sys.addaudithook(hear)
sys.argv = ["underfoot", "plate", "--footsteps", "steps.csv", "-o", "plate.json"]
from underfoot.start import main
main()
"""


def test_every_command_that_is_ended_leaves_no_part_of_a_file(folder):
    """Those that did not ask for it left `.plate.json.47ea30d3`, or a recording that came through a pipe."""
    lines = [
        f"{at},1,{force},{force / stiffness}" for at, stiffness in ((0, 40), (1, 90)) for force in range(0, 600, 5)
    ]
    (folder / "steps.csv").write_text("\n".join(["position,footstep,force_n,displacement_mm", *lines]))
    run = subprocess.run([sys.executable, "-c", LEAVES], check=False, capture_output=True)
    assert (run.returncode, run.stdout, run.stderr.strip()) == (143, b"", b"")
    assert os.listdir(folder) == ["steps.csv"]


EXPORTED = """
import os, signal, sys
def hear(event, given):
    if event == "open" and os.path.basename(str(given[0])).startswith(".walk.csv"):
        os.kill(os.getpid(), signal.SIGTERM)
sys.addaudithook(hear)
sys.argv = ["underfoot", "export", "walk.underfoot", "-o", "walk.csv"]
from underfoot.start import main
main()
"""


def test_an_export_that_is_ended_as_it_writes_leaves_no_part_of_a_file(folder):
    """An hour of a floor as C3D left 12 GB behind, under a name that `ls` does not show."""
    write_recording(folder / "walk.underfoot", 1.0, default_floor(1, 1))
    run = subprocess.run([sys.executable, "-c", EXPORTED], check=False, capture_output=True)
    assert (run.returncode, run.stdout, run.stderr.strip()) == (143, b"", b"")
    assert os.listdir(folder) == ["walk.underfoot"]


@pytest.mark.parametrize(
    ("module", "given"), [("click", "--version"), ("underfoot.engine.child_process", "--target=simulator")]
)
def test_a_command_and_the_window_are_stopped_without_a_word_while_they_are_imported(module, given):
    """It wrote a traceback of imports; the window aborted, crashed or stayed, or was said to lack libraries."""
    script = f"""
import os, signal, sys
class AtImport:
    def find_spec(name, *_):
        if name == {module!r}:
            os.kill(os.getpid(), signal.SIGINT)
sys.meta_path.insert(0, AtImport)
sys.argv = ["underfoot", {given!r}]
from underfoot.start import main
main()
"""
    heard = partial(signal.signal, signal.SIGINT, signal.SIG_DFL)
    run = subprocess.run([sys.executable, "-c", script], check=False, capture_output=True, preexec_fn=heard)
    assert (run.returncode, run.stdout, run.stderr) == (-signal.SIGINT, b"", b"")


def test_a_signal_that_a_library_drops_in_its_callback_ends_the_command_without_a_traceback(capfd):
    """As LLVM while it compiles a kernel: Numba's error of the code that was lost was written, with status 1."""

    @raised_at_signals()
    def compile():
        ctypes.CFUNCTYPE(None)(lambda: signal.raise_signal(signal.SIGTERM))()
        raise RuntimeError("no compiled object yet")

    with pytest.raises(Interrupted) as ended:
        compile()
    assert ended.value.status == 143
    assert str(ended.value.__cause__) == "no compiled object yet"
    assert capfd.readouterr().err == ""


def test_a_signal_that_is_dropped_while_a_session_opens_ends_it_as_it_begins():
    """`scene` played on after a Ctrl-C in its first second, which Python had dropped."""

    @raised_at_signals()
    def play():
        ctypes.CFUNCTYPE(None)(lambda: signal.raise_signal(signal.SIGTERM))()
        ended = []
        with ended_by_signals(lambda: ended.append("in order")):
            return ended

    assert play() == ["in order"]


def test_what_fails_as_a_signal_ends_a_command_is_told():
    """As a session that cannot be written: a signal had come, so its error was taken for the signal's."""

    @raised_at_signals()
    def run():
        try:
            signal.raise_signal(signal.SIGTERM)
        finally:
            raise BadFile("p7.session cannot be written: no space left")

    with pytest.raises(BadFile, match="no space left"):
        run()


ENDLESS = """
import ctypes, threading
from underfoot.commands.ending import interrupted_by_signals

system, lock, condition = ctypes.CDLL(None), ctypes.create_string_buffer(64), ctypes.create_string_buffer(64)

def tell():
    system.pthread_mutex_lock(lock)  # which is free once the other thread waits
    print("waiting", flush=True)

with interrupted_by_signals():
    system.pthread_mutex_lock(lock)
    threading.Thread(target=tell, daemon=True).start()
    system.pthread_cond_wait(condition, lock)
"""


@pytest.mark.parametrize(("name", "status"), [("SIGINT", 130), ("SIGTERM", 143), ("SIGHUP", 129)])
def test_a_command_ends_though_what_it_runs_never_returns(name, status, with_hangup):
    """As a node's kernel can: Python hears of no signal meanwhile."""
    command = [sys.executable, "-c", ENDLESS]
    heard = partial(signal.signal, signal.SIGINT, signal.SIG_DFL)
    with subprocess.Popen(command, stdout=subprocess.PIPE, preexec_fn=heard) as process:
        assert process.stdout.readline() == b"waiting\n"
        process.send_signal(getattr(signal, name))
        assert process.wait(timeout=60.0) == status
