"""What a reference itself is off by: its expanded uncertainty (k = 2), as its certificate or data sheet says."""

from underfoot.parameters import Number, Parameter, ask

COVERAGE = 2.0
"""k of an expanded uncertainty, for 95 % of normal errors (JCGM 100:2008, 6.3.3)."""
OF_FORCE = ask(
    "reference_percent",
    Number(
        1.0,
        0.0,
        20.0,
        unit="%",
        label="Uncertainty of the reference",
        doc="By how much the reference may be off, % of the largest force (k = 2, as in a certificate): some 0.1 % of "
        "a weighing cell, 1 % of a load cell that was set by a weight, 0.05 % of weights of class M, 3 % of a gym's.",
    ),
)
OF_ACCELERATION = ask(
    "reference_percent",
    Number(
        10.0,
        0.0,
        50.0,
        unit="%",
        label="Uncertainty of the accelerometer",
        doc="By how much accelerometer, input and mounting may be off together (k = 2, as in a certificate): some 3 % "
        "with a certificate, 10 % by a data sheet alone.",
    ),
)
OF_PLACE = ask(
    "reference_mm",
    Number(
        2.0,
        0.0,
        50.0,
        unit="mm",
        label="Uncertainty of the places",
        doc="How far a press may be from where it should be (95 %): some 2 mm by marks on the tile, 5 mm by a "
        "projector.",
    ),
)


def require_given(reference: Parameter, given: float | None) -> None:
    """Raise `BadValue` for an uncertainty out of its range; one that was not `given` (None) is its default."""
    if given is not None:
        reference.check(given)


def uncertain_by(given: float | None, unit: str) -> str:
    """Return in words, for the name of a reference, its expanded uncertainty; nothing where none was `given`.

    >>> f"load cell{uncertain_by(1.0, '% of full scale')}"
    'load cell, uncertain by 1 % of full scale (k = 2)'
    """
    return "" if given is None else f", uncertain by {given:g} {unit} (k = 2)"
