"""A thread that must be in time asks for real-time priority, and does without it where it is not granted."""

import os
import threading

import pytest

from underfoot.devices.thread_priority import PRIORITY, raise_thread_priority

pytestmark = pytest.mark.skipif(not hasattr(os, "sched_setscheduler"), reason="this system has no such priorities")


def in_a_thread(do):
    found = []
    thread = threading.Thread(target=lambda: found.append(do()))
    thread.start()
    thread.join()
    return found[0]


def asked():
    raise_thread_priority()
    return os.sched_getscheduler(0) & ~os.SCHED_RESET_ON_FORK, os.sched_getparam(0).sched_priority


def test_it_is_the_threads_own_where_it_is_granted():
    before = os.sched_getscheduler(0)
    assert in_a_thread(asked) in ((os.SCHED_RR, PRIORITY), (before, 0))
    assert os.sched_getscheduler(0) == before


def test_without_the_right_to_it_all_goes_on(monkeypatch):
    def refused(pid, policy, parameter):
        raise PermissionError

    monkeypatch.setattr(os, "sched_setscheduler", refused)
    assert in_a_thread(asked) == (os.SCHED_OTHER, 0)
