"""Formatting and parsing of quantities: few digits, a fitting prefix, and always the unit."""

import math
import re
from collections.abc import Sequence

from underfoot.errors import BadValue, cut_short

_PREFIXES = {"p": -12, "n": -9, "µ": -6, "m": -3, "": 0, "k": 3, "M": 6, "G": 9}
_TAKES = {"N": "pnµm kMG", "Hz": "m kMG", "s": "pnµm ", "m": "pnµm ", "Pa": "µm kMG", "J": "nµm kM", "W": "nµm kM",
          "V": "nµm kM", "g": "nµm k", "B": " kMG"}  # fmt: skip
"""Usual prefixes of each unit; a space stands for none."""
_KEEPS = {"m/s^2": 0.01, "m/s": 0.01, "s/m": 0.01}
"""Smallest values for which these units are usual without a prefix."""
_UNITS = {
    "_per_min": "1/min",
    "_m_s2": "m/s^2",
    "_n_mm": "N/mm",
    "_kn_s": "kN/s",
    "_deg": "deg",
    "_hz": "Hz",
    "_db": "dB",
    "_ms": "ms",
    "_mm": "mm",
    "_ns": "N s",
    "_m": "m",
    "_n": "N",
    "_s": "s",
}
"""Units by the ends of names, longest first."""
_DIGIT_GROUP = "\u202f"
_NUMBER = r"(?:\d+[.,]?\d*|[.,]\d+)(?:[eE][-+]?\d+)?"
_SUM = re.compile(rf"[-+]?{_NUMBER}(?:[-+*/]{_NUMBER})+")
_TERMS = re.compile(rf"[-+]?{_NUMBER}(?:[-+*/]{_NUMBER})*")
_AFTER_UNIT = re.compile(r"(?<=[^\d.,^*/+-])(?<![\d.,][eE])(?=[-+])")
"""Where a sum goes on after a term with a unit; in 1e-3 it does not."""
_FACTORS_AFTER_UNIT = re.compile(
    rf"(?<=[\d.,])(?![eE][-+]?\d)([^\d.,+*/^-][^+-]*?)(?<![*/])((?:[*/]{_NUMBER})+)(?=[-+]|$)"
)
"""What multiplies or divides a term after its unit, as in 1 kHz * 2; in 1e3 * 2 there is no unit."""
_IN_NO_UNIT = ("+", "-", "*", "/", "^", "_", "'", "’", "(", ")")
"""What a unit does not begin with: by such a sign a number or a calculation goes on in a way that is not read."""
_BETWEEN_NUMBERS = re.compile(r";\s*|,\s+|,(?=\D)|\s+(?=[-+−.,\d])")
_BEFORE_UNIT = re.compile(r"(?<=\d) (?=(?:%|dB|kHz|Hz|kN|N|[cmµ]?m|m?s|m/s²)(?![\w/]))")


def quantity(value: float, unit: str = "", digits: int = 3) -> str:
    """Format `value`, in SI `unit`, to `digits` significant digits with a fitting prefix.

    >>> quantity(1300000, "N/m"), quantity(0.0027, "s"), quantity(-9.4, "dB"), quantity(2000)
    ('1.3 MN/m', '2.7 ms', '−9.4 dB', '2\\u202f000')
    """
    prefix, factor, shown = _prefix(value, unit)
    text = number(value / factor, digits)
    return f"{text} {prefix}{shown}" if shown else text


def split_unit(name: str) -> tuple[str, str]:
    """Return a name without the unit at its end, and that unit; "" for a name without one.

    >>> split_unit("trial_pause_s"), split_unit("loading_kn_s"), split_unit("person")
    (('trial_pause', 's'), ('loading', 'kN/s'), ('person', ''))
    """
    end = next((end for end in _UNITS if name.endswith(end)), "")
    return name.removesuffix(end), _UNITS.get(end, "")


def counted(count: int, what: str, plural: str = "") -> str:
    """Return a count with what is counted, in the plural unless it is one.

    >>> counted(1, "step"), counted(0, "time"), counted(2, "person", "people")
    ('1 step', '0 times', '2 people')
    """
    return f"{count} {what if count == 1 else plural or f'{what}s'}"


def first_of(lines: Sequence[str], most: int) -> list[str]:
    """Return the first lines, and in a further one how many more there are.

    >>> first_of(["gravel", "sand", "snow"], 2), first_of(["ice"], 2)
    (['gravel', 'sand', 'and 1 more'], ['ice'])
    """
    return [*lines[:most], *([f"and {len(lines) - most} more"] if len(lines) > most else [])]


def number(value: float, digits: int = 3) -> str:
    """Format `value` to `digits` significant digits, in groups of three, without trailing zeros.

    >>> number(1234.5678, 6), number(0.25), number(float("nan"))
    ('1\\u202f234.57', '0.25', '–')
    """
    if not math.isfinite(value):
        return "–" if math.isnan(value) else ("∞" if value > 0 else "−∞")
    if value == 0:
        return "0"
    magnitude = abs(value)
    if not 1e-4 <= magnitude < 1e7:
        mantissa, _, exponent = f"{magnitude:.{digits - 1}e}".partition("e")
        text = f"{mantissa.rstrip('0').rstrip('.') if '.' in mantissa else mantissa}e{int(exponent)}"
    else:
        decimals = max(digits - 1 - math.floor(math.log10(magnitude)), 0)
        text = f"{magnitude:,.{decimals}f}".replace(",", _DIGIT_GROUP)
        text = text.rstrip("0").rstrip(".") if "." in text else text
    return f"−{text}" if value < 0 else text


def fixed(value: float, decimals: int = 0) -> str:
    """Format a finite `value` with so many decimals, in groups of three.

    >>> fixed(-1234.5678, 1), fixed(-0.2)
    ('−1\\u202f234.6', '0')
    """
    return f"{round(value, decimals) + 0.0:,.{decimals}f}".replace(",", _DIGIT_GROUP).replace("-", "−")


def pretty_unit(unit: str) -> str:
    """Return a unit as it is displayed.

    >>> pretty_unit("m/s^2"), pretty_unit("N*s/m"), pretty_unit("N/m^a")
    ('m/s²', 'N·s/m', 'N/mᵃ')
    """
    for plain, high in (("^2", "²"), ("^3", "³"), ("^-1", "⁻¹"), ("^a", "ᵃ"), ("*", "·"), ("deg", "°")):
        unit = unit.replace(plain, high)
    return unit


def pretty_text(text: str) -> str:
    """Return prose with superscript powers, true minus signs, and no line breaks between numbers and units.

    >>> pretty_text("in m/s^2"), pretty_text("at -92 mm, 3 % off")
    ('in m/s²', 'at −92\\xa0mm, 3\\xa0% off')
    """
    high = text.replace("s^2", "s²").replace("m^2", "m²").replace("m^3", "m³")
    return _BEFORE_UNIT.sub("\u00a0", re.sub(r"(?<![\w.)-])-(?=\d)", "−", high))


def parse_quantity(text: str, unit: str = "") -> float:
    """Parse typed text to a number in SI `unit`: with or without the unit, a prefix, digit groups or a decimal comma.

    Letters of the unit and before it may be of the other case where that leaves one meaning: "mhz" could be two.

    >>> parse_quantity("1.3 MN/m", "N/m"), parse_quantity("0,82 mm", "m"), parse_quantity("2 000")
    (1300000.0, 0.00082, 2000.0)
    >>> parse_quantity("0.25 of full scale", "of full scale"), parse_quantity("2 KHZ", "Hz")
    (0.25, 2000.0)
    >>> parse_quantity("0.5 kN s/m", "N*s/m"), parse_quantity("500 N·s/m", "N*s/m")
    (500.0, 500.0)
    """
    compact = _without_spaces(text).replace("μ", "µ")
    match = re.fullmatch(rf"([-+]?{_NUMBER})(.*)", compact)
    if match is None or match[2].startswith(_IN_NO_UNIT) or re.search(r"[-+*/]\d", match[2]):
        raise BadValue(f"{cut_short(repr(text))} is not a number; allowed: {_form(unit)}")
    value = float(match[1].replace(",", "."))
    tail = match[2]
    if tail.startswith((".", ",")):
        given = cut_short(repr(text))
        raise BadValue(f"{given} has two decimal marks; allowed: one point or comma, with spaces between thousands")
    factors = {"": 1.0}
    if unit == "kg":
        factors |= {f"{prefix}g": 10.0 ** (_PREFIXES[prefix] - 3) for prefix in _allowed("g")} | {"k": 1.0}
    else:
        for prefix in _allowed(unit):
            exact = 10.0 ** _PREFIXES[prefix]
            names = (prefix, prefix + unit, prefix + pretty_unit(unit), prefix + unit.replace("*", ""))
            factors |= {name: exact for name in names if name}
            factors |= {name.replace("µ", "u"): exact for name in (prefix, prefix + unit) if "µ" in prefix}
        factors |= {name.replace(" ", ""): 1.0 for name in (unit, pretty_unit(unit))}
    in_other_case = {factors[name] for name in factors if unit in name and name.lower() == tail.lower()}
    meant = {factors[tail]} if tail in factors else in_other_case
    if len(meant) != 1:
        raise BadValue(f"the unit is {cut_short(repr(tail))}; allowed: {_form(unit)}")
    factor = meant.pop()
    return value * factor if factor >= 1.0 else value / round(1.0 / factor)


def _form(unit: str) -> str:
    """Return how a number in this unit may be typed."""
    prefix = " and a prefix" if len(_allowed(unit)) > 1 else ""
    return f"a number, with or without {pretty_unit(unit)}{prefix}" if unit else "a number without a unit"


def worked_out(text: str) -> str:
    """Return typed text with a sum, difference, product or quotient of numbers before the unit worked out. Terms of a
    sum may each have the unit, with prefixes of their own, and be multiplied or divided after it: what a field shows
    is typed on at its end.

    >>> worked_out("2 * 440 Hz"), worked_out("1/4 s"), worked_out("0,5+1*2"), worked_out("-6 dB"), worked_out("1/0")
    ('880.0Hz', '0.25s', '2.5', '-6 dB', '1/0')
    >>> worked_out("100 Hz + 20 Hz"), worked_out("1e-3 s - 5e-4 s"), worked_out("1 kHz + 20 Hz")
    ('120.0Hz', '0.0005s', '1020.0Hz')
    >>> worked_out("1 kHz*2"), worked_out("3 m/s^2 / 2"), worked_out("2 ms*3 + 4 ms"), worked_out("1 m + 1 s")
    ('2.0kHz', '1.5m/s^2', '10.0ms', '1 m + 1 s')
    """
    compact = _with_one_unit(_without_spaces(text))
    match = _SUM.match(compact)
    if match is None:
        return text
    terms: list[float] = []
    for sign, digits in re.findall(rf"([-+*/]?)({_NUMBER})", match[0]):
        value = float(digits.replace(",", "."))
        if sign == "/" and value == 0.0:
            return text
        if sign == "*":
            terms[-1] *= value
        elif sign == "/":
            terms[-1] /= value
        else:
            terms.append(-value if sign == "-" else value)
    return f"{sum(terms)!r}{compact[match.end() :]}"


def _with_one_unit(compact: str) -> str:
    """Return a calculation with its unit at the end only, and without prefixes if those of its terms differ."""
    compact = _FACTORS_AFTER_UNIT.sub(r"\2\1", compact)
    terms = _AFTER_UNIT.split(compact)
    units = {_TERMS.sub("", term, count=1) for term in terms}
    shared = units - {""}
    if len(shared) > 1:
        shared = set.intersection(*({unit, unit[1:]} if unit[:1] in _PREFIXES else {unit} for unit in units)) - {""}
    if len(terms) == 1 or len(shared) != 1:
        return compact
    unit = shared.pop()
    return "".join(_without_unit(term, unit) for term in terms) + unit


def _without_unit(term: str, unit: str) -> str:
    """Return a term as a factor of `unit`, which it has, if any, with a prefix or without."""
    plain = term.removesuffix(unit)
    power = _PREFIXES.get(plain[-1:] if plain != term else "", 0)
    return f"{plain[:-1]}{'*' if power > 0 else '/'}1e{abs(power)}" if power else plain


def _without_spaces(text: str) -> str:
    return re.sub(r"[\s\u202f\u00a0]", "", text).replace("−", "-")


def parse_numbers(text: str, unit: str = "") -> list[float]:
    """Parse typed numbers separated by spaces, semicolons or commas.

    A comma between two digits is a decimal comma, unless there are several in a row.

    >>> parse_numbers("0,3; 0,4"), parse_numbers("1, 2 3.5"), parse_numbers("1,2,3"), parse_numbers("8 ms 15 ms", "s")
    ([0.3, 0.4], [1.0, 2.0, 3.5], [1.0, 2.0, 3.0], [0.008, 0.015])
    """
    found = []
    for part in _BETWEEN_NUMBERS.split(text.strip()):
        found += [parse_quantity(one, unit) for one in (part.split(",") if part.count(",") > 1 else [part]) if one]
    return found


INVERTED = "ø"
"""Suffix of the decibels of a negative factor, which inverts the signal."""


def gain(factor: float, digits: int = 3) -> str:
    """Format a factor in decibels, with a suffix if it inverts.

    >>> gain(1.0), gain(0.5), gain(0.0), gain(-2.0)
    ('0 dB', '−6.02 dB', '−∞ dB', '6.02 dB ø')
    """
    size = number(20.0 * math.log10(abs(factor)) + 0.0, digits) if factor else "−∞"
    return f"{size} dB{f' {INVERTED}' if factor < 0.0 else ''}"


def parse_gain(text: str) -> float:
    """Parse a typed factor: decibels, with or without the unit, or a factor with a times sign or an x.

    >>> round(parse_gain("-6 dB"), 3), parse_gain("0"), parse_gain("x2.5"), parse_gain("−∞"), parse_gain("0 dB ø")
    (0.501, 1.0, 2.5, 0.0, -1.0)
    >>> parse_gain("x1/4")
    0.25
    """
    compact = _without_spaces(text).lower()
    if compact.endswith(INVERTED):
        return -parse_gain(compact.removesuffix(INVERTED))
    if compact.removesuffix("db") in ("-∞", "-inf", "off"):
        return 0.0
    factor = re.fullmatch(r"[x×](.+)|(.+)[x×]", compact)
    if factor:
        return parse_quantity(worked_out(factor[1] or factor[2]))
    decibels = parse_quantity(compact, "dB")
    try:
        return float(10.0 ** (decibels / 20.0))
    except OverflowError:
        return math.inf  # which no parameter allows


def _prefix(value: float, unit: str) -> tuple[str, float, str]:
    """Return the prefix, its factor, and the unit that follows."""
    if unit == "kg" and 0 < abs(value) < 1:
        prefix, factor, shown = _prefix(value * 1000, "g")
        return prefix, factor / 1000, shown
    shown = pretty_unit(unit)
    if value == 0 or not math.isfinite(value):
        return "", 1.0, shown
    if abs(value) >= _KEEPS.get(unit, math.inf):
        return "", 1.0, shown
    best = ""
    for prefix in _allowed(unit):
        if abs(value) * (1 + 1e-12) >= 10.0 ** _PREFIXES[prefix] and _PREFIXES[prefix] >= _PREFIXES[best]:
            best = prefix
    if best == "" and abs(value) < 1:
        smaller = [p for p in _allowed(unit) if _PREFIXES[p] < 0]
        fitting = [p for p in smaller if abs(value) * (1 + 1e-12) >= 10.0 ** _PREFIXES[p]]
        if fitting:
            best = max(fitting, key=_PREFIXES.__getitem__)
        elif smaller:
            best = min(smaller, key=_PREFIXES.__getitem__)
    return best, 10.0 ** _PREFIXES[best], shown


def _allowed(unit: str) -> list[str]:
    """Return the allowed prefixes of `unit`: those of its first factor, unless that has an exponent."""
    first = re.split(r"[/*·]", unit)[0]
    return [p.strip() for p in _TAKES.get(first, " ")]
