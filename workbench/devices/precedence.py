"""A thread that fills a sound card's blocks goes before others, where the system lets a program ask for that."""

import os
from contextlib import suppress

PRIORITY = 20
"""Of 1 to 99. Threads that read tiles ask for none: with 10, samples came later in three of three pairs of runs."""


def take_precedence() -> None:
    """Let the calling thread run before all that is not real time; without a word where that is not granted.

    On Linux it is granted to root, and to whom `ulimit -r` says so. Processes that the thread starts do not inherit it.
    """
    with suppress(AttributeError, OSError):  # other systems have no such call, and most people no right to it
        os.sched_setscheduler(0, os.SCHED_RR | os.SCHED_RESET_ON_FORK, os.sched_param(PRIORITY))
