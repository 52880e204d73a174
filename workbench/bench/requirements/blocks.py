"""Requirements on whole blocks: the cost of a large floor in the engine, and of each preset."""

import statistics
from collections.abc import Iterable, Iterator, Mapping, Sequence

from underfoot.bench.blocks import BlockCost
from underfoot.bench.requirements.requirement import SPEED, Requirement
from underfoot.bench.timing import Timed

COARSE = "material-gravel-coarse"
_TILES, _EVERY = 36, {64: 25.0, 1024: 80.0, 4096: 80.0}
"""Required speed (times real time) for this many tiles with a foot on each, by block; larger floors in proportion."""
_SHARES = {2: 0.15, 0: 0.03}
"""Largest share of that cost with a foot on this many of the tiles."""
_PRESET, _MEDIAN_PRESET = 60.0, 200.0
"""Required speed of each preset under a walker, and of their median."""


def floors(costs: Sequence[BlockCost]) -> Iterable[Requirement]:
    """Yield the rows for coarse gravel with a foot on each tile, on two and on none, from `costs`."""
    for cost in costs:
        feet = "each" if cost.stood_on == cost.tiles else cost.stood_on or "none"
        what = f"coarse gravel, {cost.tiles} tiles, block {cost.block}, a foot on {feet}"
        beside = {"slowness": cost.slowness, "spread": cost.spread}
        if cost.simulated:
            yield Requirement("whole block", f"{what}, simulated plates", cost.times_real_time, SPEED, **beside)
            continue
        if feet == "each":
            low = _EVERY[cost.block] * _TILES / cost.tiles / cost.slowness
            yield Requirement("whole block", what, cost.times_real_time, SPEED, low, **beside)
            continue
        yield Requirement("whole block", what, cost.times_real_time, SPEED, **beside)
        if cost.tiles == _TILES:
            yield Requirement("whole block", what, cost.share, "of a foot on each", high=_SHARES[cost.stood_on])


def presets(timed: Mapping[str, Timed]) -> Iterator[Requirement]:
    """Yield the rows for each preset under a walker on two by two tiles, from the times of one second."""
    for name, one in timed.items():
        low, beside = _PRESET / one.slowness, {"slowness": one.slowness, "spread": one.spread}
        yield Requirement("whole block", f"preset {name}, walked on", 1.0 / one.seconds, SPEED, low, **beside)
    median = statistics.median(1.0 / one.at_best for one in timed.values())
    yield Requirement("whole block", "median of the presets", median, SPEED, low=_MEDIAN_PRESET)
