"""Quantities as they are written and typed."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from underfoot.errors import BadValue
from underfoot.number_parsing import parse_numbers, parse_quantity
from underfoot.quantities import quantity


@given(st.floats(-1e9, 1e9), st.sampled_from(["N", "N/m", "m", "s", "Hz", "kg", "m/s^2", "", "dB"]))
def test_what_is_written_can_be_typed_again(value, unit):
    assert parse_quantity(quantity(value, unit, 9), unit) == pytest.approx(value, rel=1e-7, abs=1e-12)


def test_each_prefix_is_that_of_the_si():
    """Written and typed by one table: a wrong power of ten would come back as it was."""
    powers = {-12: "pN", -9: "nN", -6: "µN", -3: "mN", 0: "N", 3: "kN", 6: "MN", 9: "GN"}
    force = {power: quantity(3.0 * 10.0**power, "N") for power in powers}
    assert force == {power: f"3 {unit}" for power, unit in powers.items()}
    assert [quantity(value, "m") for value in (3e-15, 1.0 - 1e-13, 3000.0)] == ["0.003 pm", "1 m", "3\u202f000 m"]


@pytest.mark.parametrize("text", ["", "ten", "1.2.3", "5 parsecs", "0x10"])
def test_what_is_no_quantity_is_refused(text):
    with pytest.raises(BadValue):
        parse_quantity(text, "m")


@pytest.mark.parametrize(
    ("text", "unit", "reason"),
    [
        ("1.200,5", "m", "'1.200,5' has two decimal marks; allowed: one point or comma, with spaces between thousands"),
        ("5 m/s²", "", "the unit is 'm/s²'; allowed: a number without a unit"),
        ("ten", "", "'ten' is not a number; allowed: a number without a unit"),
        ("5 parsecs", "m", "the unit is 'parsecs'; allowed: a number, with or without m and a prefix"),
        ("5 s", "deg", "the unit is 's'; allowed: a number, with or without °"),
        ("1/0", "", "'1/0' is not a number; allowed: a number without a unit"),
        ("1 kHz + 20", "Hz", "'1 kHz + 20' has a number without a unit; allowed: one after each, or after the last"),
        ("1 k+2+3k", "Hz", "'1 k+2+3k' has a number without a unit; allowed: one after each, or after the last"),
        ("2 m * 3 m", "m", "'2 m * 3 m' is not a number; allowed: a number, with or without m and a prefix"),
        ("2*-3", "", "'2*-3' is not a number; allowed: a number without a unit"),
        ("9" + 80 * "a", "m", f"the unit is '{55 * 'a'}...'; allowed: a number, with or without m and a prefix"),
        (80 * "a", "", f"'{55 * 'a'}...' is not a number; allowed: a number without a unit"),
    ],
)
def test_a_refusal_says_what_may_be_typed(text, unit, reason):
    with pytest.raises(BadValue) as refused:
        parse_quantity(text, unit)
    assert str(refused.value) == reason


@pytest.mark.parametrize(
    ("text", "unit", "value"),
    [
        ("200 hz", "Hz", 200.0),
        ("0.2KHZ", "Hz", 200.0),
        ("3 MS", "s", 0.003),
        ("-6 db", "dB", -6.0),
        ("5 um", "m", 5e-6),
    ],
)
def test_a_unit_may_be_typed_in_the_other_case_or_without_greek(text, unit, value):
    assert parse_quantity(text, unit) == pytest.approx(value)


@pytest.mark.parametrize(("text", "unit"), [("1 mhz", "Hz"), ("1 mpa", "Pa"), ("5 N", "s"), ("5 M", "s")])
def test_what_would_be_another_unit_or_factor_in_the_other_case_is_refused(text, unit):
    with pytest.raises(BadValue, match="the unit is"):
        parse_quantity(text, unit)


@pytest.mark.parametrize("text", ["2 5 10 kg", "2 kg, 5, 10 kg", "1/2 5/2 1 kN"])
def test_a_list_has_a_unit_after_each_number_or_after_none(text):
    """5, 10, 20 kg were weights of 5 N, 10 N, and 196 N."""
    with pytest.raises(BadValue, match=r"has a number without a unit; allowed: one after each, or after none$"):
        parse_numbers(text, "N")
    assert parse_numbers("5 10 1k", "N") == parse_numbers("5, 10, 1000 N", "N") == [5.0, 10.0, 1000.0]
