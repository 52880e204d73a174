"""A real Dask cluster on this computer, of which a worker is killed in each test: what it makes is the same."""

import hashlib
import json
import signal
import subprocess
import sys

import pytest
from made_studies import preset_protocol

import underfoot as uf
from underfoot.engine.bulk import Item, rendered
from underfoot.engine.offline import RenderJob
from underfoot.experiments.simulation import jobs_of
from underfoot.patch import preset_files
from underfoot.records.wav import wav_bytes
from underfoot.studies.simulated import simulate_locally, simulate_on_cluster

WORKERS = 3
"""One for each test, which kills it, and one that is left."""


@pytest.fixture(scope="module")
def cluster(until, tmp_path_factory):
    """The address of the scheduler, and the processes of workers that are alive."""
    pytest.importorskip("distributed")
    folder = tmp_path_factory.mktemp("cluster")
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


def test_the_same_files_are_rendered(cluster, tmp_path):
    address, workers = cluster
    killed = workers.pop()
    patch = uf.open_patch("stimulus-sp")
    items = [
        Item(RenderJob(patch.set("gain", "gain", 0.1 * k), seconds=1.0), "sp", {}, tmp_path / f"{k}.wav")
        for k in range(8)
    ]
    made = []
    for number, summary in rendered(items, address):
        if not made:
            killed.kill()
        made.append(number)
        data = wav_bytes(items[number].job.run().samples, 48_000)
        assert (tmp_path / f"{number}.wav").read_bytes() == data
        assert hashlib.sha256(data).hexdigest() == summary["sha256"]
    assert sorted(made) == list(range(len(items)))
    assert killed.wait() == -signal.SIGKILL


def test_the_same_people_are_simulated(cluster):
    pytest.importorskip("statsmodels")
    address, workers = cluster
    killed = workers.pop()
    jobs = jobs_of(preset_protocol("free-labels"), preset_files.protocols()["free-labels"].parent, 30, each=3)

    def kill(done):
        if done == 1:
            killed.kill()

    assert simulate_on_cluster(jobs, address, kill) == simulate_locally(jobs, 1)
    assert killed.wait() == -signal.SIGKILL
