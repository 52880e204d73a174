"""The table of slips holds the joint law to the error asked for, and says so where slips do not end."""

import numpy as np
import pytest

from underfoot.errors import BadValue
from underfoot.kernels import kernel
from underfoot.models.signals.random import stream_key
from underfoot.models.stick_slip.distribution import SlipLaw
from underfoot.models.stick_slip.quantile_table import LONGEST, MEAN, draw, look_up, slip_table

# zeta, D, x0, v0: strong and weak damping, a law in separate peaks, a start against the belt, slips that last long.
SETS = {
    "one peak": (0.4, 0.5, 2.0, 0.0),
    "subharmonics": (0.05, 0.02, 0.3, 0.0),
    "against the belt": (0.1, 0.4, 0.0, -1.0),
    "sure": (0.1, 0.02, 4.0, 0.0),
}


@kernel
def look_up_evenly(table, out):
    """Pairs of chances that fill the square evenly (the additive recurrence of the plastic number)."""
    first = second = 0.5
    for i in range(out.shape[0]):
        first = (first + 0.7548776662466927) % 1.0
        second = (second + 0.5698402909980532) % 1.0
        out[i, 0], out[i, 1] = look_up(table, first, second)


@kernel
def draw_many(table, key, out):
    for i in range(out.shape[0]):
        out[i, 0], out[i, 1] = draw(table, key, i)


def looked_up(table, count=400_000):
    out = np.empty((count, 2))
    look_up_evenly(table, out)
    return out.T


def difference(values, of, law):
    """The largest CDF difference of `values`, out of `of`, from a law."""
    at = np.sort(values)
    risen = (np.arange(at.size) + 0.5) / of
    return np.abs(np.interp(at, law.at, law.cdf) - risen).max()


@pytest.mark.parametrize("error", [1e-2, 1e-3])
@pytest.mark.parametrize("name", SETS)
def test_durations_distances_and_periods_keep_the_asked_error(name, error):
    zeta, noise, x0, v0 = SETS[name]
    law = SlipLaw.solve(1.0, zeta, noise, 1.0, x0, v0, LONGEST, 1e-4)
    durations, distances = looked_up(slip_table(*SETS[name], error=error))
    sticks = distances >= 0.0
    assert difference(durations, durations.size, law.duration) <= error
    assert difference(distances, durations.size, law.distance) <= error
    assert difference((durations + distances)[sticks], durations.size, law.period) <= error


def test_draws_are_looked_up_at_their_own_chances():
    table = slip_table(*SETS["one peak"])
    drawn = np.empty((200_000, 2))
    draw_many(table, stream_key(1, "slips"), drawn)
    law = SlipLaw.solve(1.0, 0.4, 0.5, 1.0, 2.0, 0.0, LONGEST, 1e-3)
    for column, of in ((0, law.duration), (1, law.distance)):
        assert difference(drawn[:, column], len(drawn), of) < 1e-3 + 1.95 / np.sqrt(len(drawn))  # Kolmogorov, 0.1 %
    assert np.abs(drawn[:, 1]).mean() == pytest.approx(table[MEAN], rel=5e-3)


def test_chances_at_their_ends_give_slips():
    table = slip_table(*SETS["one peak"], error=1e-2)
    edge = 2.0**-53
    for first in (edge, 1.0 - edge):
        for second in (edge, 1.0 - edge):
            assert np.isfinite(look_up(table, first, second)).all()


def test_slips_that_last_are_taken_to_end_at_last():
    zeta, noise, x0 = 0.54, 0.033, 0.15
    law = SlipLaw.solve(1.0, zeta, noise, 1.0, x0, 0.0, LONGEST, 1e-4)
    durations, _ = looked_up(slip_table(zeta, noise, x0))
    assert law.remaining > 0.5
    assert (durations > LONGEST - 1e-9).mean() == pytest.approx(law.remaining, abs=1e-3)


def test_a_slip_that_never_ends_is_a_table_too():
    durations, distances = looked_up(slip_table(2.0, 1e-3, 0.5), 1000)
    assert (durations == LONGEST).all()
    assert not distances.any()


def test_a_smaller_error_takes_a_larger_table():
    sizes = [slip_table(*SETS["sure"], error=error).size for error in (1e-1, 1e-2, 1e-3)]
    assert sizes == sorted(sizes)
    assert sizes[0] < 0.2 * sizes[-1]


@pytest.mark.parametrize(("name", "value"), [("error", 1e-7), ("noise", 0.0), ("zeta", -1.0), ("v0", 1.0)])
def test_what_has_no_law_is_refused_by_name(name, value):
    values = {"zeta": 0.4, "noise": 0.5, "x0": 2.0, "v0": 0.0} | {name: value}
    with pytest.raises(BadValue, match=f"^{name} is "):
        slip_table(**values)
