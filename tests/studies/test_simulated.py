"""Simulated studies on processes: the same people, also when one of those who work is killed."""

import os
import signal
from multiprocessing import active_children

import pytest
from made_studies import preset_protocol

from underfoot.errors import DeviceError
from underfoot.experiments.simulation import jobs_of
from underfoot.patch import preset_files
from underfoot.studies.simulated import simulate_locally, simulate_on_cluster

pytest.importorskip("statsmodels")


def jobs(people=24, each=3):
    return jobs_of(preset_protocol("free-labels"), preset_files.protocols()["free-labels"].parent, people, each=each)


def test_a_process_that_is_killed_loses_nobody():
    killed = []

    def kill(done):
        if not killed:
            killed.append(active_children()[0].pid)
            os.kill(killed[0], signal.SIGKILL)

    assert simulate_locally(jobs(), 2, kill) == simulate_locally(jobs(), 1)
    assert killed


@pytest.mark.parametrize("address", ["tcp://127.0.0.1:9", "127.0.0.1", "tcp://127.0.0.1:x"])
def test_a_cluster_that_is_not_there_is_said(address):
    pytest.importorskip("distributed")
    with pytest.raises(DeviceError, match="cannot be reached"):
        simulate_on_cluster(jobs(), address)
