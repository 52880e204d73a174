"""Formatting of quantities: few digits, a fitting prefix, and always the unit."""

import math
import re
from collections.abc import Sequence

PREFIXES = {"p": -12, "n": -9, "µ": -6, "m": -3, "": 0, "k": 3, "M": 6, "G": 9}
"""Powers of ten of the prefixes."""
_TAKES = {"N": "pnµm kMG", "Hz": "m kMG", "s": "pnµm ", "m": "pnµm ", "Pa": "µm kMG", "J": "nµm kM", "W": "nµm kM",
          "V": "nµm kM", "g": "nµm k", "B": " kMG"}  # fmt: skip
"""Usual prefixes of each unit; a space stands for none."""
_KEEPS = {"m/s^2": 0.01, "m/s": 0.01, "s/m": 0.01}
"""Smallest values for which these units are usual without a prefix."""
_UNITS = {
    "_percent_bw_per_s": "% of body weight/s",
    "_percent_bw_s": "% of body weight s",
    "_percent_bw": "% of body weight",
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

    >>> first_of(["gravel", "sand", "snow"], 2), first_of(["ice", "mud"], 2)
    (['gravel', 'sand', 'and 1 more'], ['ice', 'mud'])
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


INVERTED = "ø"
"""Suffix of the decibels of a negative factor, which inverts the signal."""


def gain(factor: float, digits: int = 3) -> str:
    """Format a factor in decibels, with a suffix if it inverts.

    >>> gain(1.0), gain(0.5), gain(0.0), gain(-2.0)
    ('0 dB', '−6.02 dB', '−∞ dB', '6.02 dB ø')
    """
    size = number(20.0 * math.log10(abs(factor)), digits) if factor else "−∞"
    return f"{size} dB{f' {INVERTED}' if factor < 0.0 else ''}"


def prefixes_of(unit: str) -> list[str]:
    """Return the allowed prefixes of `unit`: those of its first factor, unless that has an exponent."""
    first = re.split(r"[/*·]", unit)[0]
    return [p.strip() for p in _TAKES.get(first, " ")]


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
    prefixes = sorted(prefixes_of(unit), key=PREFIXES.__getitem__, reverse=True)
    best = next((p for p in prefixes if abs(value) * (1 + 1e-12) >= 10.0 ** PREFIXES[p]), prefixes[-1])
    return best, 10.0 ** PREFIXES[best], shown
