"""The reach of whole patches: what a large floor costs, and how soon a patch plays."""

import statistics
import subprocess
import sys
from collections.abc import Iterable, Sequence

from underfoot.bench.reach.row import Reach
from underfoot.bench.scale import Cost
from underfoot.errors import UnderfootError
from underfoot.patch import library

COARSE = "material-gravel-coarse"
_ALL = {1024: 40.0, 64: 25.0}
"""Times real time with a foot on every tile, at least, by block size."""
_TWO = 0.1
"""Of that cost with two tiles stood on, at most."""

COLD_START = """
import sys, time
from underfoot.nodes import REGISTRY
from underfoot.patch import library
from underfoot.patch.patch import Patch
from underfoot.patch.program import Program
began = time.perf_counter()
program = Program(Patch.load(library.patches()[sys.argv[1]], REGISTRY), REGISTRY, ("t1",), block=256)
program.run(0, 256)
print(time.perf_counter() - began)
"""


def reaches(costs: Sequence[Cost], quick: bool) -> Iterable[Reach]:
    """Coarse gravel on all tiles and on two of them, read off `costs`; and the cold start of patches."""
    for cost in costs:
        if cost.patch != COARSE or cost.stood_on == 0:
            continue
        where = f"block {cost.block}, a foot on {'every' if cost.stood_on == cost.tiles else cost.stood_on}"
        what = f"coarse gravel, {cost.tiles} tiles, {where}"
        if cost.stood_on == cost.tiles:
            yield Reach("floors", what, cost.times_real_time, "times real time", low=_ALL[cost.block])
        else:
            yield Reach("floors", what, cost.share, "of the cost of all", high=_TWO)
    for name in [COARSE] if quick else library.patches():
        yield Reach("floors", f"cold start of {name}", cold_start_s(name), "s", high=0.5)


def cold_start_s(name: str) -> float:
    """From a patch on disk to its first block, in a process that has nothing but its imports; kernels are cached."""
    spent = []
    for _ in range(4):
        done = subprocess.run([sys.executable, "-c", COLD_START, name], capture_output=True, text=True, check=False)
        if done.returncode:
            raise UnderfootError(f"{name} does not start: {done.stderr.strip().splitlines()[-1]}")
        spent.append(float(done.stdout))
    return statistics.median(spent[1:])  # the first compiles what is not cached yet
