"""Real-time priority for threads that fill a sound card's blocks, where the system grants it."""

import os
from contextlib import suppress

PRIORITY = 20
"""Priority, 1 to 99. Threads that read tiles request none: with 10, samples were later in three of three pairs of
runs.
"""


def raise_thread_priority(thread: int = 0) -> None:
    """Run the calling thread (or another, by its id) before all that are not real-time; no error if not granted.

    Linux grants it to root, and to users permitted by `ulimit -r`. Processes that the thread starts do not inherit it.
    """
    with suppress(AttributeError, OSError):  # other systems lack the call, and most users the right
        os.sched_setscheduler(thread, os.SCHED_RR | os.SCHED_RESET_ON_FORK, os.sched_param(PRIORITY))
