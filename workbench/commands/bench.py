"""`underfoot bench`: requirements, run time against error, whole blocks, and stability; or the thesis's figures."""

import json
from dataclasses import asdict, dataclass
from pathlib import Path

import click

from underfoot.commands.files import require_folders_writable
from underfoot.commands.options import FIGURES_AS_JSON, command, require_only
from underfoot.commands.telling import tell
from underfoot.errors import BadValue, UnderfootError
from underfoot.options import option, shared


@dataclass(frozen=True)
class BenchOptions:
    """Options of a run; None if not given."""

    quick: bool = option("Take about five minutes. The full run takes minutes per table, at most ten per node.", False)
    short: bool = option("Measure run times only, in about twenty seconds.", False)
    compare: Path | None = option("JSON of an earlier run; list what got slower or faster, and by how much.")
    report: Path | None = option("Folder for a page with pictures, the figures as JSON, and what failed.")
    figures: Path | None = option("Folder for reproductions of the thesis's figures; nothing else is measured.")
    seed: int = option("Seed of the random points and patches.", 1)
    as_json: bool = shared(FIGURES_AS_JSON)
    stress: str | None = option(
        "Run stress tests only: one row of the table, or all.", is_flag=False, flag_value="", metavar="[ROW]"
    )
    times: int | None = option("With --stress: number of attempts.", type=click.IntRange(1))
    seconds: float | None = option("With --stress: duration of rows that take time.", type=click.FloatRange(0.1, 1e6))
    cluster: str | None = option(
        "Scheduler of a Dask cluster that computes errors and bounds of models; times are measured on this computer.",
        metavar="TCP://HOST:PORT",
    )


@command(BenchOptions)
def bench(options: BenchOptions) -> None:
    """Benchmark models, run time against error, large floors, and stability."""
    report, figures = options.report, options.figures
    if options.stress is not None:
        require_only(options, "--stress", "--times --seconds --seed --json")
        _stress(options)
        return
    if options.seed < 0:
        raise BadValue(f"--seed is {options.seed}; allowed: 0 or more")
    require_folders_writable(report, figures)
    if figures is not None:
        require_only(options, "--figures", "--quick --json")
        _draw(figures, options.quick, options.as_json)
        return
    if options.short:
        require_only(options, "--short", "--compare --report --json")
    else:
        require_only(options, "the whole bench", "--quick --compare --report --seed --cluster --json")
    from underfoot.bench import run_all
    from underfoot.bench.compare import changes, read
    from underfoot.bench.report import text, write

    before = None if options.compare is None else read(options.compare)
    found = (
        run_all.run_times(tell) if options.short else run_all.run(options.quick, options.seed, tell, options.cluster)
    )
    if report is not None:
        write(found, report)
    since = None if before is None else changes(before, found.times())
    if options.as_json:
        print(json.dumps(found.data() | ({} if since is None else {"compared": asdict(since)})))
    else:
        print("\n".join([text(found), *([] if since is None else ["", *since.lines()])]))
    if found.stability and found.stability.failures:
        raise UnderfootError(f"stability: {len(found.stability.failures)} failures")


def _stress(options: BenchOptions) -> None:
    from underfoot.bench import stress
    from underfoot.bench.stress.outcome import Effort

    found = stress.run(options.stress or "", Effort(options.times, options.seconds, options.seed), tell)
    as_data = {name: [asdict(one) for one in tried] for name, tried in found.items()}
    print(json.dumps(as_data) if options.as_json else stress.text(found))
    failed = sum(not one.passed for tried in found.values() for one in tried)
    if failed:
        raise UnderfootError(f"stress: {failed} failed")


def _draw(folder: Path, quick: bool, as_json: bool) -> None:
    from underfoot.bench import figures

    found = figures.run(quick, tell)
    figures.write(found, folder)
    print(json.dumps([figure.data() for figure in found]) if as_json else figures.text(found))
