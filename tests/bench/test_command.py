"""`underfoot bench`: what it prints, what it writes, and that failures are an error."""

import json

from click.testing import CliRunner

from underfoot.__main__ import cli
from underfoot.bench import whole
from underfoot.bench.report import Bench
from underfoot.bench.scale import Cost
from underfoot.bench.stability import Failure, Stability
from underfoot.errors import UnderfootError
from underfoot.patch.patch import Patch


def bench(monkeypatch, *options, failures=()):
    asked = {}

    def run(quick, seed, tell):
        asked.update(quick=quick, seed=seed)
        tell("working")
        return Bench([], [], [Cost("gravel", 36, 36, 64, 50.0, 1.0)], Stability(failures=list(failures)))

    monkeypatch.setattr(whole, "run", run)
    return CliRunner().invoke(cli, ["bench", *options]), asked


def test_figures_as_json_and_a_report(monkeypatch, tmp_path):
    done, asked = bench(monkeypatch, "--quick", "--json", "--seed", "4", "--report", str(tmp_path / "report"))
    assert done.exit_code == 0
    assert asked == {"quick": True, "seed": 4}
    data = json.loads(done.stdout)
    assert data["scale"][0]["times_real_time"] == 50.0
    assert json.loads((tmp_path / "report" / "bench.json").read_text()) == data
    assert "working" in done.stderr


def test_failures_are_printed_and_are_an_error(monkeypatch):
    done, asked = bench(monkeypatch, failures=[Failure("gain makes a mess", Patch(title="broken"), 8000)])
    assert asked["quick"] is False
    assert "gain makes a mess, at 8000 Hz" in done.stdout
    assert isinstance(done.exception, UnderfootError)
    assert str(done.exception) == "stability: 1 failures"


def test_a_report_that_is_no_folder_is_refused_before_the_work(monkeypatch, tmp_path):
    (tmp_path / "file").write_text("")
    done, asked = bench(monkeypatch, "--report", str(tmp_path / "file"))
    assert asked == {}
    assert "is not a folder" in str(done.exception)
