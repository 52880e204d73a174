"""Requirements on stick-slip: distribution of slip durations, run time, and the texture drawn from its table."""

from collections.abc import Iterable, Iterator

import numpy as np
from numpy.typing import NDArray

from underfoot.bench.requirements.requirement import Requirement, Timing
from underfoot.bench.timing import Run
from underfoot.kernels import Floats, kernel
from underfoot.models.stick_slip import quantile_table
from underfoot.models.stick_slip.oscillator import BlockOnBelt
from underfoot.models.stick_slip.slip_distribution import SlipDistribution
from underfoot.models.stick_slip.tabulated import Distribution

_BLOCK, _T_END_S = BlockOnBelt(w0=1.0, zeta=0.1, noise=0.4, belt_velocity=1.0, x0=0.0, v0=-1.0), 20.0
"""Of the thesis's figure 8.6."""
_TIMES = np.array([0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0, 15.0, 20.0])
_GRID = np.array(
    [
        *(0.002019384, 0.044782616, 0.174225486, 0.411223842, 0.662094327, 0.814336304, 0.930253544),
        *(0.968434299, 0.984788666, 0.996321132, 0.999114084, 0.999975510, 0.999999327),
    ]
)
"""CDF at `_TIMES` from the Fokker-Planck equation on a grid, extrapolated over four; the last two agree to 2e-9."""

_BEST_SOLVE_S, _BEST_LOOK_UP_NS = 0.072, 27.0
"""Best times seen of the distribution at 1e-4, and of one slip looked up."""


def requirements(quick: bool) -> Iterable[Requirement]:
    """Yield errors of the distribution of figure 8.6, and of draws from tables."""
    for error in (1e-4,) if quick else (1e-3, 1e-4, 1e-5):
        distribution = SlipDistribution.solve(_BLOCK, _T_END_S, error=error).duration
        apart = float(np.abs(distribution.cdf_at(_TIMES) - _GRID).max())
        yield Requirement("friction", f"CDF error of figure 8.6, asked {error:.0e}", apart, high=error)
    yield from tables(100_000 if quick else 2_000_000)


def timings() -> Iterator[Timing]:
    """Yield the timings of solving the distribution of figure 8.6, and of looking up a slip."""
    solve = Run(lambda: SlipDistribution.solve(_BLOCK, _T_END_S, error=1e-4).duration)
    yield Timing("friction", "the distribution of figure 8.6 at 1e-4", solve, "s", 1.0, _BEST_SOLVE_S)
    table, pairs = quantile_table.slip_table(0.4, 0.5, 2.0, error=1e-3), np.empty((100_000, 2))
    look_up = Run(lambda: _look_up_evenly(table, pairs))
    yield Timing("friction", "a slip looked up, zeta 0.4", look_up, "ns", 1e9 / len(pairs), _BEST_LOOK_UP_NS)


def tables(count: int) -> Iterator[Requirement]:
    """Compare slips looked up at evenly spread probabilities with the distribution solved ten times as exactly."""
    error = 1e-3
    for zeta, noise, x0 in ((0.4, 0.5, 2.0), (0.1, 0.05, 1.5)):
        distribution = SlipDistribution.solve(
            BlockOnBelt(1.0, zeta, noise, 1.0, x0, 0.0), quantile_table.LONGEST, 0.1 * error
        )
        table = quantile_table.slip_table(zeta, noise, x0, error=error)
        pairs = np.empty((count, 2))
        _look_up_evenly(table, pairs)
        durations, distances = pairs.T
        periods = (durations + distances)[distances >= 0.0]
        for name, values, of in (
            ("durations", durations, distribution.duration),
            ("distances", distances, distribution.distance),
            ("periods", periods, distribution.period),
        ):
            what = f"CDF error of {name} from a table at 1e-3, zeta {zeta}"
            yield Requirement("friction", what, _apart(values, count, of), high=error)


def _apart(values: NDArray[np.float64], of: int, distribution: Distribution) -> float:
    at = np.sort(values)
    return float(np.abs(distribution.cdf_at(at) - (np.arange(at.size) + 0.5) / of).max())


@kernel
def _look_up_evenly(table: Floats, out: Floats) -> None:
    # Pairs of probabilities that fill the square evenly: the additive recurrence of the plastic number.
    first = second = 0.5
    for i in range(out.shape[0]):
        first = (first + 0.7548776662466927) % 1.0
        second = (second + 0.5698402909980532) % 1.0
        out[i, 0], out[i, 1] = quantile_table.look_up(table, first, second)
