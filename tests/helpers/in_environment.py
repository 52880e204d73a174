"""What a process that was forked from one of another environment does first (`conftest`)."""

import os


def run_in(environment, run, *given):
    """Give the process this environment, then run what it was started for."""
    os.environ.clear()
    os.environ.update(environment)
    run(*given)
