"""The reach of whole blocks: what a large floor costs as the engine runs it, and what each preset costs."""

import statistics
from collections.abc import Iterable, Iterator, Mapping, Sequence

from underfoot.bench.blocks import BlockCost
from underfoot.bench.reach.row import SPEED, Reach
from underfoot.bench.timing import Timed

COARSE = "material-gravel-coarse"
_TILES, _EVERY = 36, {64: 25.0, 1024: 80.0, 4096: 80.0}
"""Times real time that are asked of so many tiles with a foot on each, by block; more tiles have their share of it."""
_SHARES = {2: 0.15, 0: 0.03}
"""Of that cost with a foot on so many of those tiles, at most."""
_PRESET, _MEDIAN_PRESET = 60.0, 200.0
"""Times real time that are asked of each preset under a walker, and of their median."""


def floors(costs: Sequence[BlockCost]) -> Iterable[Reach]:
    """Coarse gravel with a foot on each tile, on two and on none, read off `costs`."""
    for cost in costs:
        if cost.patch != COARSE:
            continue
        feet = "each" if cost.stood_on == cost.tiles else cost.stood_on or "none"
        what = f"coarse gravel, {cost.tiles} tiles, block {cost.block}, a foot on {feet}"
        beside = {"slowness": cost.slowness, "spread": cost.spread}
        if cost.simulated:
            yield Reach("whole block", f"{what}, simulated plates", cost.times_real_time, SPEED, **beside)
            continue
        if feet == "each":
            low = _EVERY[cost.block] * _TILES / cost.tiles / cost.slowness
            yield Reach("whole block", what, cost.times_real_time, SPEED, low, **beside)
            continue
        yield Reach("whole block", what, cost.times_real_time, SPEED, **beside)
        if cost.tiles == _TILES:
            yield Reach("whole block", what, cost.share, "of a foot on each", high=_SHARES[cost.stood_on])


def presets(took: Mapping[str, Timed]) -> Iterator[Reach]:
    """Each preset under a walker on two by two tiles, read off what a second of each takes."""
    for name, one in took.items():
        low, beside = _PRESET / one.slowness, {"slowness": one.slowness, "spread": one.spread}
        yield Reach("whole block", f"preset {name}, walked on", 1.0 / one.seconds, SPEED, low, **beside)
    median = statistics.median(1.0 / one.at_best for one in took.values())
    yield Reach("whole block", "median of the presets", median, SPEED, low=_MEDIAN_PRESET)
