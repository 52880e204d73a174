"""Jobs are shared out, errors and deaths are their job's alone, and whoever stops stops all."""

import multiprocessing
import os
import signal
import subprocess
import sys
import threading
from contextlib import closing, contextmanager
from pathlib import Path

import pytest

from underfoot.engine.worker_pool import cores, in_parallel, run
from underfoot.errors import BadValue, UnderfootError


def worked(job):
    """What the processes do: what a job says."""
    if job == "fail":
        raise BadValue("it fails")
    if job == "die":
        os._exit(3)
    if job == "wait":
        threading.Event().wait()
    if isinstance(job, Path):
        with job.open("w"), cleaned_up(job):
            while job.name == "computed":
                pass
            threading.Event().wait()
    return job, os.getpid()


@contextmanager
def cleaned_up(path):
    try:
        yield
    finally:
        path.unlink()


def test_every_job_has_its_answer_and_processes_go_on_with_the_next():
    found = dict(in_parallel(worked, "abcdef", 2))
    assert [found[number][0] for number in range(6)] == list("abcdef")
    pids = {pid for _, pid in found.values()}
    assert 1 <= len(pids) <= 2
    assert os.getpid() not in pids


def test_an_error_is_its_job_s_alone():
    found = dict(in_parallel(worked, ["a", "fail", "b"], 1))
    assert isinstance(found[1], BadValue)
    assert str(found[1]) == "it fails"
    assert (found[0][0], found[2][0]) == ("a", "b")


def test_a_process_that_dies_is_said_and_another_goes_on():
    found = dict(in_parallel(worked, ["die", "a", "die"], 1))
    assert found[1][0] == "a"
    for number in (0, 2):
        assert isinstance(found[number], UnderfootError)
        assert str(found[number]) == "the process that worked on it died: exit status 3"


def test_whoever_stops_early_leaves_no_process(monkeypatch):
    monkeypatch.setattr("underfoot.engine.worker_pool._LEAVE_S", 0.1)
    with closing(in_parallel(worked, ["a", "wait", "wait"], 2)) as answers:
        assert next(answers)[1][0] == "a"
    assert multiprocessing.active_children() == []


def test_a_job_that_nobody_waits_for_any_more_cleans_up(tmp_path, until):
    half_written = tmp_path / "part"
    with closing(in_parallel(worked, [half_written, "a"], 2)) as answers:
        assert next(answers)[1][0] == "a"
        until(half_written.exists)
    assert not half_written.exists()


def test_a_job_ends_with_the_process_that_waits_for_it(tmp_path, until):
    half_written = tmp_path / "part"
    does = f"from test_worker_pool import *; list(in_parallel(worked, [Path({str(half_written)!r})], 1))"
    with subprocess.Popen([sys.executable, "-c", does], cwd=Path(__file__).parent) as waiting:
        try:
            until(half_written.exists)
        finally:
            waiting.kill()
    until(lambda: not half_written.exists())


WITHOUT_SIGNALS = """
import signal
for name in {*dir(signal)} - {"SIGABRT", "SIGFPE", "SIGILL", "SIGINT", "SIGSEGV", "SIGTERM", "SIG_DFL", "SIG_IGN"}:
    if name.isupper() or name.startswith(("pthread", "sig")) and name != "signal":
        delattr(signal, name)
"""
"""What Windows lacks is taken away in every process, as it starts."""


def test_jobs_are_done_and_cleaned_up_where_no_signal_can_be_held_back_or_sent_to_a_thread(tmp_path):
    (tmp_path / "sitecustomize.py").write_text(WITHOUT_SIGNALS)
    does = (
        "from test_worker_pool import *\n"
        "assert not hasattr(signal, 'pthread_kill')\n"
        f"path = Path({str(tmp_path / 'computed')!r})\n"
        "with closing(in_parallel(worked, [path, 'fail', 'a'], 2)) as answers:\n"
        "    print(next(answers), next(answers)[1][0])\n"
        "    while not path.exists():\n"
        "        pass\n"
        "print(path.exists())\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", does], cwd=Path(__file__).parent, env={**os.environ, "PYTHONPATH": str(tmp_path)},
        capture_output=True, text=True, timeout=60,
    )  # fmt: skip
    assert (done.stdout, done.stderr) == ("(1, BadValue('it fails')) a\nFalse\n", "")


def test_there_is_a_core():
    assert cores() >= 1


@pytest.mark.parametrize("processes", [1, 5])
def test_nothing_to_do_is_done_at_once(processes):
    assert list(in_parallel(worked, [], processes)) == []


@pytest.mark.skipif(sys.platform == "win32", reason="there are no signals to hold back")
def test_a_process_that_is_stopped_twice_while_it_begins_ends_without_a_word():
    """Ctrl-C, and what follows where nobody waits any longer: let through, the second one left a traceback."""
    ends = {signal.SIGINT, signal.SIGTERM}
    before = signal.pthread_sigmask(signal.SIG_BLOCK, ends)
    ours, theirs = multiprocessing.Pipe()
    try:
        for end in ends:
            signal.pthread_kill(threading.get_ident(), end)
        with closing(ours), closing(theirs):
            run(theirs, worked)
        assert {signal.sigwait(ends), signal.sigwait(ends)} == ends
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
