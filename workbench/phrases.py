"""What the program says to participants of studies, whose language may be another than English."""

from collections.abc import Mapping
from typing import Self

import msgspec


class Language(msgspec.Struct, frozen=True):
    """`phrases` has what stands for an English phrase, and for its `{values}` in whatever order.

    `decimal_mark` stands in numbers. A language without phrases is English.

    >>> german = Language({"Go on": "Weiter", "{low} to {high} {unit}": "{low} bis {high} {unit}"}, ",")
    >>> german.say("Go on"), german.say(Phrase("{low} to {high} {unit}", low=0.5, high=2.0, unit="kg"))
    ('Weiter', '0,5 bis 2 kg')
    """

    phrases: Mapping[str, str] = {}
    decimal_mark: str = "."

    def say(self, text: str) -> str:
        """Return an English phrase in this language; text that is none, as what a protocol asks, as it is."""
        if isinstance(text, Phrase):
            return self.fill(text.template, text.values)
        return self.phrases.get(text, text)

    def fill(self, template: str, values: Mapping[str, object]) -> str:
        """Return a phrase with its values, of which phrases are said in this language, too, and none leaves a gap."""
        return self.say(template).format(**{name: self._word(value) for name, value in values.items()}).strip()

    def number(self, text: str) -> str:
        """Return a number with a decimal point as it is written in this language."""
        return text.replace(".", self.decimal_mark)

    def _word(self, value: object) -> str:
        match value:
            case str():
                return self.say(value)
            case float():
                return self.number(f"{value:g}")
            case tuple():
                return ", ".join(map(self._word, value))
        return str(value)


ENGLISH = Language()


class Phrase(str):
    """English text with values, made of its `template`; numbers that are no whole ones have up to six digits.

    >>> Phrase("{low} to {high} {unit}", low=0.5, high=2.0, unit="")
    '0.5 to 2'
    """

    template: str
    values: Mapping[str, object]

    def __new__(cls, template: str, **values: object) -> Self:
        phrase = super().__new__(cls, ENGLISH.fill(template, values))
        phrase.template, phrase.values = template, values
        return phrase
