"""Exceptions that Underfoot raises on purpose; each message is one line for the user."""


class UnderfootError(Exception):
    """Base class: one line with what was given, what is allowed, and what to do."""


class BadValue(UnderfootError, ValueError):
    """Value outside the allowed range of a function, parameter or file."""


class BadFile(UnderfootError):
    """Invalid file; the message names the file and the place in it."""


class BadMeasurement(UnderfootError):
    """Implausible measurement; the message is the reason. It can be repeated."""


class DeviceError(UnderfootError):
    """Device or stream that cannot be opened or was lost."""


class TakenAway(DeviceError):
    """Connection that the other end has closed, as a hub does for a program that connects later."""


def in_one_line(error: object) -> str:
    """Return the message of another library's error in one line."""
    return " ".join(str(error).split())


def kind_and_words(error: BaseException) -> str:
    """Return what somebody else's code raised, which can be anything, in one line of at most 300 characters.

    >>> kind_and_words(KeyError("antenna"))
    "KeyError: 'antenna'"
    """
    return in_one_line(f"{type(error).__name__}: {error}")[:300]


def cut_short(text: str) -> str:
    """Return a value's text in at most 60 characters, of which the last closes what the first opens.

    >>> cut_short(repr("x" * 80))
    "'xxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxx...'"
    """
    return text if len(text) <= 60 else f"{text[:56]}...{text[-1]}"


def shown(value: object) -> str:
    """Return a value as Python writes it, in one line of at most 60 characters."""
    return cut_short(in_one_line(repr(value)))


def require(good: bool, name: str, given: object, allowed: str) -> None:
    """Raise `BadValue` unless `good`, with the name, the given value, and what is allowed.

    >>> require(False, "mass_kg", -1.0, "above 0")
    Traceback (most recent call last):
    underfoot.errors.BadValue: mass_kg is -1.0; allowed: above 0
    """
    if not good:
        raise refusal(name, given, allowed)


def refusal(name: str, given: object, allowed: str) -> BadValue:
    """Return the error that `require` raises."""
    return BadValue(f"{name} is {shown(given)}; allowed: {allowed}")
