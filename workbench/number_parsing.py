"""Parsing of typed numbers: with or without a unit, as calculations, in lists, and as gains."""

import math
import re

from underfoot.errors import BadValue, cut_short
from underfoot.quantities import INVERTED, PREFIXES, prefixes_of, pretty_unit

_PART = re.compile(r"([-+]?(?:\d+[.,]?\d*|[.,]\d+)(?:[eE][-+]?\d+)?)(.*)")
"""A number and its unit."""
_UP_TO_UNIT = re.compile(r".*[\d.,]")
"""A number or a calculation, up to the unit at its end."""
_OPERATOR = re.compile(r"(?<=[^-+*/^])(?<![\d.,][eE])([-+*/])(?=[\d.,])")
"""What stands between two numbers: not the sign of an exponent, nor what belongs to a unit, as in N*s/m."""
_IN_NO_UNIT = ("+", "-", "*", "/", "^", "_", "'", "’", "(", ")")
"""What a unit does not begin with: by such a sign a number or a calculation goes on in a way that is not read."""
_SIGNS = str.maketrans("μ⋅∙•−", "µ···-")
"""Signs that mean the same; keyboards, word processors and other programs differ."""
STANDARD_GRAVITY = 9.80665
"""m/s^2 (CGPM 1901); that of a place is within 0.3 % of it."""
_BETWEEN_NUMBERS = re.compile(r";\s*|,\s+|,(?=\D)|\s+(?=[-+−.,\d])")


def parse_quantity(text: str, unit: str = "") -> float:
    """Parse typed text to a number in SI `unit`: with or without the unit, a prefix, digit groups or a decimal comma.

    It may be a calculation with +, -, * and /. The unit follows each term of a sum, or only the last. Letters of the
    unit and before it may be of the other case where that leaves one meaning: "mhz" could be two. Of a force, kilograms
    are what weighs as much.

    >>> parse_quantity("1.3 MN/m", "N/m"), parse_quantity("0,82 mm", "m"), parse_quantity("2 000")
    (1300000.0, 0.00082, 2000.0)
    >>> parse_quantity("0.25 of full scale", "of full scale"), parse_quantity("2 KHZ", "Hz")
    (0.25, 2000.0)
    >>> parse_quantity("0.5 kN s/m", "N*s/m"), parse_quantity("500 N·s/m", "N*s/m")
    (500.0, 500.0)
    >>> parse_quantity("1K", "Hz"), parse_quantity("9.81 m/s2", "m/s^2"), parse_quantity("500 N⋅s/m", "N*s/m")
    (1000.0, 9.81, 500.0)
    >>> parse_quantity("2*440 Hz", "Hz"), parse_quantity("1 kHz*2 + 50 Hz", "Hz"), parse_quantity("5 + 2 ms", "s")
    (880.0, 2050.0, 0.007)
    >>> parse_quantity("5K", "kg"), parse_quantity("1 kg", "N")
    (5.0, 9.80665)
    """
    refusal = f"{cut_short(repr(text))} is not a number; allowed: {_form(unit)}"
    terms: list[float] = []
    units: list[str] = []
    pieces = ["+", *_OPERATOR.split(_without_spaces(text))]
    for operator, part in zip(pieces[::2], pieces[1::2], strict=True):
        match = _PART.fullmatch(part)
        if match is None or match[2].startswith(_IN_NO_UNIT):
            raise BadValue(refusal)
        if match[2].startswith((".", ",")):
            given = cut_short(repr(text))
            raise BadValue(f"{given} has two decimal marks; allowed: one point or comma, with spaces between thousands")
        value, given_unit = float(match[1].replace(",", ".")), match[2]
        if operator in "+-":
            terms.append(-value if operator == "-" else value)
            units.append(given_unit)
        elif (units[-1] and given_unit) or (operator == "/" and value == 0.0):
            raise BadValue(refusal)
        else:
            terms[-1] = terms[-1] * value if operator == "*" else terms[-1] / value
            units[-1] = units[-1] or given_unit
    if not any(units[:-1]):
        units = units[-1:] * len(units)
    if any(units) and not all(units):
        raise BadValue(
            f"{cut_short(repr(text))} has a number without a unit; allowed: one after each, or after the last"
        )
    return sum(_in_si(term, one, unit) for term, one in zip(terms, units, strict=True))


def _in_si(value: float, given: str, unit: str) -> float:
    """Return a value with the unit that was `given`, "" for none, in SI `unit`."""
    factors = {"": 1.0}
    if unit == "kg":
        factors |= {f"{prefix}g": 10.0 ** (PREFIXES[prefix] - 3) for prefix in prefixes_of("g")} | {"k": 1.0}
    else:
        for prefix in prefixes_of(unit):
            exact = 10.0 ** PREFIXES[prefix]
            names = (prefix, prefix + unit, prefix + pretty_unit(unit), prefix + re.sub(r"[*^]", "", unit))
            factors |= {name: exact for name in names if name}
            factors |= {name.replace("µ", "u"): exact for name in (prefix, prefix + unit) if "µ" in prefix}
        factors |= {name.replace(" ", ""): 1.0 for name in (unit, pretty_unit(unit))}
    factors |= {"K": factors["k"]} if "k" in factors else {}  # alone; before a unit it is found below
    factors |= {"kg": STANDARD_GRAVITY} if unit == "N" else {}
    in_other_case = {factors[name] for name in factors if unit in name and name.lower() == given.lower()}
    meant = {factors[given]} if given in factors else in_other_case
    if len(meant) != 1:
        raise BadValue(f"the unit is {cut_short(repr(given))}; allowed: {_form(unit)}")
    factor = meant.pop()
    return value * factor if factor >= 1.0 else value / round(1.0 / factor)


def _form(unit: str) -> str:
    """Return how a number in this unit may be typed."""
    prefix = " and a prefix" if len(prefixes_of(unit)) > 1 else ""
    return f"a number, with or without {pretty_unit(unit)}{prefix}" if unit else "a number without a unit"


def _without_spaces(text: str) -> str:
    return re.sub(r"[\s\u202f\u00a0]", "", text).translate(_SIGNS)


def parse_numbers(text: str, unit: str = "") -> list[float]:
    """Parse typed numbers separated by spaces, semicolons or commas.

    A comma between two digits is a decimal comma, unless there are several in a row. A list of which the last number
    alone has a unit, not the SI one, as "2 5 kg", could mean two things, and is refused.

    >>> parse_numbers("0,3; 0,4"), parse_numbers("1, 2 3.5"), parse_numbers("1,2,3"), parse_numbers("8 ms 15 ms", "s")
    ([0.3, 0.4], [1.0, 2.0, 3.5], [1.0, 2.0, 3.0], [0.008, 0.015])
    """
    split = [part.split(",") if part.count(",") > 1 else [part] for part in _BETWEEN_NUMBERS.split(text.strip())]
    given = [one for part in split for one in part if one]
    found = [parse_quantity(one, unit) for one in given]
    *before, last = ["", *(_UP_TO_UNIT.sub("", _without_spaces(one)) for one in given)]
    # One letter is the SI unit itself, or a prefix alone, which belongs to its number.
    if "" in before[1:] and len(last) > 1 and _in_si(1.0, last, unit) != 1.0:
        raise BadValue(f"{cut_short(repr(text))} has a number without a unit; allowed: one after each, or after none")
    return found


def parse_gain(text: str) -> float:
    """Parse a typed factor: decibels, with or without the unit, or a factor with a times sign or an x.

    >>> round(parse_gain("-6 dB"), 3), parse_gain("0"), parse_gain("x2.5"), parse_gain("−∞"), parse_gain("0 dB ø")
    (0.501, 1.0, 2.5, 0.0, -1.0)
    >>> parse_gain("x1/4"), parse_gain("4×")
    (0.25, 4.0)
    """
    compact = _without_spaces(text).lower()
    if compact.endswith(INVERTED):
        return -parse_gain(compact.removesuffix(INVERTED))
    if compact.removesuffix("db") in ("-∞", "-inf", "off"):
        return 0.0
    factor = re.fullmatch(r"[x×](.+)|(.+)[x×]", compact)
    if factor:
        return parse_quantity(factor[1] or factor[2])
    decibels = parse_quantity(compact, "dB")
    try:
        return float(10.0 ** (decibels / 20.0))
    except OverflowError:
        return math.inf  # which no parameter allows
