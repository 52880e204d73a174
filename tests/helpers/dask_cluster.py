"""A real Dask cluster on this computer: a scheduler, and workers that can be killed."""

import json
import subprocess
import sys
from contextlib import contextmanager

import pytest

WORKERS = 2


@contextmanager
def dask_cluster(folder, until):
    """Yield the scheduler's address and the workers' processes; its files are in `folder`. Skips without Dask."""
    pytest.importorskip("distributed")
    where = folder / "scheduler.json"
    module = [sys.executable, "-W", "ignore", "-m"]
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL, "cwd": folder}
    start = [*module, "distributed.cli.dask_scheduler", "--host", "127.0.0.1", "--port", "0", "--no-dashboard"]
    worker = [*module, "distributed.cli.dask_worker", "--scheduler-file", str(where), "--nthreads", "1"]
    running = [subprocess.Popen([*start, "--scheduler-file", str(where)], **quiet)]
    try:
        until(lambda: where.is_file() and where.stat().st_size > 0, "the scheduler is there")
        running += [subprocess.Popen([*worker, "--no-nanny", "--no-dashboard"], **quiet) for _ in range(WORKERS)]
        yield json.loads(where.read_text())["address"], running[1:]
    finally:
        for one in running:
            one.kill()
            one.wait()
