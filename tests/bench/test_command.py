"""`underfoot bench`: what it prints, what it writes, and that failures are an error."""

import json

from click.testing import CliRunner

from underfoot.__main__ import cli
from underfoot.bench import run_all
from underfoot.bench.blocks import BlockCost
from underfoot.bench.report import Bench
from underfoot.bench.requirements import Requirement
from underfoot.bench.stability import Failure, Stability
from underfoot.errors import UnderfootError
from underfoot.patch.patch import Patch

COST = BlockCost("gravel", 36, 36, 64, 50.0, 90.0, 1.0, 1.0, 0.01)


def bench(monkeypatch, *options, failures=(), ns=2.0):
    asked = {}
    rows = [Requirement("modes", "ten", ns, "ns", spread=0.02)]

    def run(quick, seed, progress, cluster):
        asked.update(quick=quick, seed=seed, cluster=cluster)
        progress("working")
        return Bench(rows, [COST], (), Stability(failures=list(failures)))

    def run_times(progress):
        asked.update(short=True)
        return Bench(rows, [COST])

    monkeypatch.setattr(run_all, "run", run)
    monkeypatch.setattr(run_all, "run_times", run_times)
    return CliRunner().invoke(cli, ["bench", *options]), asked


def test_figures_as_json_and_a_report(monkeypatch, tmp_path):
    done, asked = bench(monkeypatch, "--quick", "--json", "--seed", "4", "--report", str(tmp_path / "report"))
    assert done.exit_code == 0
    assert asked == {"quick": True, "seed": 4, "cluster": None}
    data = json.loads(done.stdout)
    assert (data["format"], data["version"]) == ("underfoot-bench", 1)
    assert data["blocks"][0]["times_real_time"] == 50.0
    assert json.loads((tmp_path / "report" / "bench.json").read_text()) == data
    assert "working" in done.stderr


def test_failures_are_printed_and_are_an_error(monkeypatch):
    done, asked = bench(monkeypatch, failures=[Failure("gain makes a mess", Patch(title="broken"), 8000)])
    assert asked["quick"] is False
    assert "gain makes a mess, at 8000 Hz" in done.stdout
    assert isinstance(done.exception, UnderfootError)
    assert str(done.exception) == "stability: 1 failures"


def test_times_alone_are_a_run_of_their_own(monkeypatch):
    done, asked = bench(monkeypatch, "--short")
    assert (done.exit_code, asked) == (0, {"short": True})
    assert "modes: ten" in done.stdout
    assert "stability" not in done.stdout
    done, asked = bench(monkeypatch, "--short", "--quick")
    assert asked == {}
    assert str(done.exception) == "--quick is given with --short; allowed: --compare, --report, --json"


def test_an_earlier_run_is_compared_and_nothing_is_judged(monkeypatch, tmp_path):
    old = tmp_path / "old.json"
    old.write_text(bench(monkeypatch, "--json")[0].stdout)
    done, _ = bench(monkeypatch, "--short", "--compare", str(old), ns=3.0)
    assert done.exit_code == 0
    assert "slower by  50.0 % (noise 5 %)  modes: ten: 2 -> 3 ns" in done.stdout
    done, _ = bench(monkeypatch, "--short", "--json", "--compare", str(old), ns=1.0)
    assert json.loads(done.stdout)["compared"]["faster"][0]["before"] == 2.0


def test_an_earlier_run_that_cannot_be_read_is_said_before_the_work(monkeypatch, tmp_path):
    (tmp_path / "old.json").write_text("[]")
    done, asked = bench(monkeypatch, "--compare", str(tmp_path / "old.json"))
    assert asked == {}
    assert isinstance(done.exception, UnderfootError)
    assert "allowed: 'underfoot-bench'" in str(done.exception)


def test_a_report_that_is_no_folder_is_refused_before_the_work(monkeypatch, tmp_path):
    (tmp_path / "file").write_text("")
    done, asked = bench(monkeypatch, "--report", str(tmp_path / "file"))
    assert asked == {}
    assert "is not a folder" in str(done.exception)


def test_times_are_not_spread_over_a_cluster(monkeypatch):
    done, asked = bench(monkeypatch, "--quick", "--cluster", "tcp://there:8786")
    assert (done.exit_code, asked["cluster"]) == (0, "tcp://there:8786")
    done, asked = bench(monkeypatch, "--short", "--cluster", "tcp://there:8786")
    assert "--cluster is given with --short" in str(done.exception)
    assert asked == {}
