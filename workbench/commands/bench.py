"""`underfoot bench`: what is reached, run time against error, scale, and stability; or the figures of the thesis."""

import json
import sys
from pathlib import Path

import click

from underfoot.commands.files import FILE
from underfoot.errors import BadFile, BadValue, UnderfootError


@click.command()
@click.option("--quick", is_flag=True, help="In about two minutes. In full: minutes per table, at most ten per node.")
@click.option("--report", type=FILE, help="Folder for a page with pictures, the figures as JSON, and what failed.")
@click.option("--figures", type=FILE, help="Folder for the thesis's figures drawn anew; nothing else is measured.")
@click.option("--seed", type=int, default=1, show_default=True, help="Seed of the random points and patches.")
@click.option("--json", "as_json", is_flag=True, help="Print all figures as JSON.")
def bench(quick: bool, report: Path | None, figures: Path | None, seed: int, as_json: bool) -> None:
    """What every model reaches, run time against error beside naive methods, a large floor's cost, and stability."""
    if seed < 0:
        raise BadValue(f"--seed is {seed}; allowed: 0 or more")
    for folder in (report, figures):
        if folder is not None and folder.exists() and not folder.is_dir():
            raise BadFile(f"{folder} is not a folder")
    if figures is not None:
        _draw(figures, quick, as_json)
        return
    from underfoot.bench.report import text, write
    from underfoot.bench.whole import run

    found = run(quick, seed, _tell)
    if report is not None:
        write(found, report)
    print(json.dumps(found.data()) if as_json else text(found))
    if found.stability.failures:
        raise UnderfootError(f"stability: {len(found.stability.failures)} failures")


def _draw(folder: Path, quick: bool, as_json: bool) -> None:
    from underfoot.bench import figures

    found = figures.run(quick, _tell)
    figures.write(found, folder)
    print(json.dumps([figure.data() for figure in found]) if as_json else figures.text(found))


def _tell(line: str) -> None:
    print(f"underfoot: {line}", file=sys.stderr)
