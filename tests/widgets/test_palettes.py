"""The two palettes: everything that is read or seen stands out from what it is on, by the formula of WCAG 2.1."""

import pytest

from underfoot.drawing import look
from underfoot.widgets import theme


def contrast(colour, ground):
    """The ratio of WCAG 2.1, 1 to 21, between two colours."""

    def luminance(hex):
        parts = [part / 255 for part in look.rgb(hex)]
        linear = [part / 12.92 if part <= 0.04045 else ((part + 0.055) / 1.055) ** 2.4 for part in parts]
        return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]

    high, low = sorted((luminance(colour), luminance(ground)), reverse=True)
    return (high + 0.05) / (low + 0.05)


def pairs(declared):
    return [(name, on) for name, grounds in declared.items() for on in grounds]


@pytest.mark.parametrize("name", look.PALETTES)
@pytest.mark.parametrize(("declared", "least"), [(theme.TEXT_BACKGROUNDS, 4.5), (theme.LINE_BACKGROUNDS, 3.0)])
def test_every_pair_stands_out(name, declared, least):
    known = theme.colours(name)
    found = {(a, b): round(contrast(known[a], known[b]), 2) for a, b in pairs(declared)}
    assert {pair: ratio for pair, ratio in found.items() if ratio < least} == {}


def test_the_formula_gives_what_wcag_says():
    assert contrast("#ffffff", "#000000") == pytest.approx(21.0)
    assert contrast("#777777", "#ffffff") == pytest.approx(4.48, abs=0.005)
