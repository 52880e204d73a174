"""The compiler's process, in this one: in which order it answers what is asked of it at once."""

import multiprocessing
import signal
from threading import Thread

import pytest

from underfoot.array_cache import ArrayCache
from underfoot.engine import compiler
from underfoot.engine.reports import Compiled, Distributions, Outlines, Preview
from underfoot.engine.requests import CompileRequest, OutlinesRequest, PreviewRequest
from underfoot.engine.target import Target
from underfoot.floor import simulated_plates
from underfoot.floor.layout import default_floor
from underfoot.floor.tile_parameters import TileParameters
from underfoot.nodes import REGISTRY
from underfoot.patch.patch import Patch

FLOOR = default_floor(1, 1)
PATCH = Patch().add("poisson", REGISTRY).dumps()
LIMIT_S = 300.0  # a new clone compiles kernels before the first answer, and a busy machine takes minutes for them
POISSON = (PATCH, "poisson", FLOOR.tiles[0], 0.05, 48_000.0)


@pytest.fixture
def answers():
    """Ask for all of these at once; the reports that come, in their order."""
    numbers = [getattr(signal, name) for name in ("SIGINT", "SIGHUP") if hasattr(signal, name)]
    before = {number: signal.getsignal(number) for number in numbers}

    def ask(*requests, reports):
        ours, theirs = multiprocessing.Pipe()
        found = []

        def collect():
            while len(found) < reports and ours.poll(LIMIT_S):
                found.append(ours.recv())
            ours.close()

        for request in requests:
            ours.send(request)
        reader = Thread(target=collect)
        reader.start()
        compiler.run(theirs)
        reader.join()
        theirs.close()
        return found

    yield ask
    for number, handler in before.items():
        signal.signal(number, handler)


def test_distributions_that_were_asked_for_come_whatever_is_asked_besides(answers):
    found = answers(
        PreviewRequest(1, *POISSON, distributions=True),
        CompileRequest(2, b"no patch", Target(FLOOR)),
        reports=3,
    )
    assert [(type(report), report.ticket) for report in found] == [(Compiled, 2), (Preview, 1), (Distributions, 1)]
    assert found[2].drawings


def test_of_programs_that_wait_the_newest_is_compiled(answers):
    """While one is compiled a hand makes many: each of them was compiled, one after the other."""
    found = answers(*(CompileRequest(ticket, b"no patch", Target(FLOOR)) for ticket in range(9)), reports=1)
    assert [report.ticket for report in found] == [8]


def test_of_pictures_the_newest_counts(answers):
    outlines = OutlinesRequest(3, PATCH, ("poisson",), FLOOR.tiles[0], 0.05, 48_000.0)
    found = answers(PreviewRequest(1, *POISSON), PreviewRequest(2, *POISSON), outlines, reports=1)
    assert [(type(report), report.ticket) for report in found] == [(Outlines, 3)]


def test_plates_are_computed_of_the_tiles_that_are_simulated(answers, monkeypatch, tmp_path):
    """Those of usual tiles were, half a second each, at the first edit on a floor of others."""
    monkeypatch.setattr(simulated_plates, "_CACHE", ArrayCache(str(tmp_path)))
    tile = TileParameters(tolerance=0.0)
    tile.save(tmp_path / "tile.json")
    simulated_plates.load_plate(FLOOR.tiles[0], tile, 48_000.0, "accelerometer")
    target = Target(FLOOR, simulation=str(tmp_path / "tile.json"))
    answers(CompileRequest(1, PATCH, target, plates=("accelerometer",)), reports=1)
    assert len(list(tmp_path.glob("*.npy"))) == 1
