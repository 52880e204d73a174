"""`underfoot bench`: run time against error, scale, and stability."""

import json
import sys
from pathlib import Path

import click

from workbench.commands.files import FILE
from workbench.errors import BadFile, BadValue, UnderfootError


@click.command()
@click.option("--quick", is_flag=True, help="About a minute instead of hours.")
@click.option("--report", type=FILE, help="Folder for a page with pictures, the figures as JSON, and what failed.")
@click.option("--seed", type=int, default=1, show_default=True, help="Of the random points and patches.")
@click.option("--json", "as_json", is_flag=True, help="Print all figures as JSON.")
def bench(quick: bool, report: Path | None, seed: int, as_json: bool) -> None:
    """Run time against error beside naive methods, cost of a large floor, and stability under stress."""
    from workbench.bench.report import text, write
    from workbench.bench.whole import run

    if seed < 0:
        raise BadValue(f"--seed is {seed}; allowed: 0 or more")
    if report is not None and report.exists() and not report.is_dir():
        raise BadFile(f"{report} is not a folder")
    found = run(quick, seed, lambda line: print(f"underfoot: {line}", file=sys.stderr))
    if report is not None:
        write(found, report)
    print(json.dumps(found.data()) if as_json else text(found))
    if found.stability.failures:
        raise UnderfootError(f"stability: {len(found.stability.failures)} failures")
