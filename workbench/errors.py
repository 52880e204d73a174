"""The one family of errors that Underfoot raises on purpose: one line each, made for the person who reads it."""


class UnderfootError(Exception):
    """What was given, what is allowed, and what to do, in one line."""


class BadValue(UnderfootError, ValueError):
    """A value outside what a function, parameter or file allows."""


class BadFile(UnderfootError):
    """A file that is not what it should be; the line names the file and the place in it."""


class BadMeasurement(UnderfootError):
    """A measurement that cannot be right: the reason. It can be taken again."""


class DeviceError(UnderfootError):
    """A device or stream that cannot be opened or has gone away."""


def require(good: bool, name: str, given: object, allowed: str) -> None:
    """Raise `BadValue` unless `good`: which value, what was given, what is allowed.

    >>> require(False, "mass_kg", -1.0, "above 0")
    Traceback (most recent call last):
    underfoot.errors.BadValue: mass_kg is -1.0; allowed: above 0
    """
    if not good:
        text = repr(given)
        raise BadValue(f"{name} is {text if len(text) <= 60 else text[:57] + '...'}; allowed: {allowed}")
