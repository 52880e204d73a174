"""What all tests share: nothing that a test starts outlives it. Fixtures of several files are in `helpers/`."""

import builtins
import gc
import linecache
import math
import multiprocessing
import os
import threading
from collections import Counter
from importlib import import_module
from multiprocessing import forkserver
from pathlib import Path
from types import SimpleNamespace

import pytest
from filelock import FileLock
from hypothesis import HealthCheck, settings

_imports = builtins.__import__
import_module("PySide6.QtCore")
builtins.__import__ = _imports  # as in the program: PySide6 would read the source of all that is imported from here on

gc.disable()  # collected between tests, in the main thread: Qt crashes where another one deletes a widget


@pytest.hookimpl(wrapper=True)
def pytest_collect_file():
    """Tests have no examples in docstrings to look for; what would look for them is a subclass of `Module`."""
    return [one for one in (yield) if type(one) is pytest.Module]


@pytest.hookimpl(wrapper=True)
def pytest_make_collect_report(collector):
    """One worker after another imports a file: the first one keeps its bytecode, which the others find.

    In a new clone, to rewrite the assertions of all files takes a worker eight seconds.
    """
    if type(collector) is not pytest.Module:
        return (yield)
    with FileLock(collector.path.parent / "__pycache__" / f"{collector.path.stem}.lock", poll_interval=0.005):
        return (yield)


def pytest_collection_finish(session):
    gc.freeze()
    linecache.clearcache()  # of the sources of all docstrings: each example would look at each of these files


@pytest.hookimpl(wrapper=True)
def pytest_collection_modifyitems(config):
    """One worker after another: the first keeps the constants of all modules, from which Hypothesis draws, on disk.

    In a new clone to read all modules for them takes a worker four seconds.
    """
    with FileLock(config.rootpath / ".hypothesis" / "constants.lock"):
        return (yield)


pytest_plugins = ("polling", "null_sink", "command_line", "calibrated_tile", "own_nodes", "examples")

settings.register_profile("untimed", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("untimed")

_TESTS_PER_FULL_COLLECTION = 200
_THREAD_ENDS_S = 1.0
_BLOCKS = Path("/dev/shm")
_OURS = f"underfoot_{os.getpid()}_"


def _alive():
    blocks = [f"shared memory {path.name}" for path in _BLOCKS.glob(f"{_OURS}*")] if _BLOCKS.is_dir() else []
    threads = [f"thread {thread.name}" for thread in threading.enumerate()]
    return Counter([*blocks, *threads, *(f"process {child.name}" for child in multiprocessing.active_children())])


@pytest.fixture(scope="session", autouse=True)
def _nothing_stands_by():
    """Sessions start no second engine, and no compiler before one is asked for: each takes a second to load.

    Where an engine or a compiler dies, `Live.complete` starts both beforehand; after a death they start anyway.
    """
    from underfoot.engine import session

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(session, "STANDBY_AFTER_S", math.inf)
        yield


@pytest.fixture(scope="session", autouse=True)
def _processes_are_forked():
    """Processes of sessions are forked from one that has imported what they need: alone, each takes a second for that.

    They have the environment of their test, with its sound server, which PortAudio reads when a process opens a card.
    They are spawned where a test has given them another cache: that one is read with the imports. What tests start as a
    command begins as it does elsewhere, with a new interpreter.
    """
    from in_environment import run_in

    from underfoot.engine import child_process

    environment = _environment()
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(["preloaded"])

    def process(target, args, **given):
        return context.Process(target=run_in, args=(dict(os.environ), target, *args), **given)

    def get_context(method):
        if _environment() != environment:
            return multiprocessing.get_context(method)
        with pytest.MonkeyPatch.context() as patch:
            patch.setenv("PYTHONPATH", str(Path(__file__).parent / "helpers"))
            forkserver.ensure_running()
        return SimpleNamespace(Pipe=context.Pipe, Process=process)

    with pytest.MonkeyPatch.context() as patch:
        names = vars(multiprocessing) | {"get_context": get_context}
        patch.setattr(child_process, "multiprocessing", SimpleNamespace(**names))
        yield


@pytest.fixture(scope="session", autouse=True)
def _streams_are_seen_by_their_process_only(tmp_path_factory):
    """Marks of the Lab Streaming Layer would be taken by other workers and other runs of the tests, and theirs here."""
    path = tmp_path_factory.mktemp("lsl") / "lsl_api.cfg"
    path.write_text(f"[lab]\nSessionID = tests of process {os.getpid()}\n[log]\nlevel = -2\n")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("LSLAPICFG", str(path))
        yield


def _environment():
    return {name: value for name, value in os.environ.items() if name.startswith("UNDERFOOT_")}


@pytest.fixture(autouse=True)
def _nothing_left_behind():
    """A process, thread or block of shared memory that a test leaves behind fails it."""
    before, threads = _alive(), set(threading.enumerate())
    yield
    gc.collect(2 if gc.get_count()[2] > _TESTS_PER_FULL_COLLECTION else 1)
    if _alive() - before:
        # A thread that has told its result, for which the test waited, may still be on its way out.
        for thread in set(threading.enumerate()) - threads:
            thread.join(_THREAD_ENDS_S)
    left = _alive() - before
    assert not left, f"left behind: {', '.join(left)}"
