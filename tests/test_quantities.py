"""Quantities as they are written and typed."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from underfoot.errors import BadValue
from underfoot.quantities import parse_quantity, quantity


@given(st.floats(-1e9, 1e9), st.sampled_from(["N", "N/m", "m", "s", "Hz", "kg", "m/s^2", "", "dB"]))
def test_what_is_written_can_be_typed_again(value, unit):
    assert parse_quantity(quantity(value, unit, 9), unit) == pytest.approx(value, rel=1e-7, abs=1e-12)


@pytest.mark.parametrize("text", ["", "ten", "1.2.3", "5 parsecs", "0x10"])
def test_what_is_no_quantity_is_refused(text):
    with pytest.raises(BadValue):
        parse_quantity(text, "m")
