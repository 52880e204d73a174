"""The text form of the sound cards that a floor plays on, and the assignment of its channels to them."""

import re
from collections.abc import Sequence

from msgspec import Struct

from underfoot.devices.sound import MAX_CHANNELS, max_channels, pairs_up_to
from underfoot.errors import BadValue, require

FORM = 'NAME, NAME=CHANNELS, or several with "; " between, as USB A=18; USB B=18'
"""Text form of sound cards."""
MOST_CARDS = 8

_ONE = re.compile(r"(?P<name>[^;]*?)\s*(=\s*(?P<channels>\d+))?")


class Output(Struct, frozen=True):
    """A sound card by (a part of) its name, "" for the default one, and the number of channels to use; 0 for all."""

    name: str
    channels: int = 0

    def __str__(self) -> str:
        return f"{self.name}={self.channels}" if self.channels else self.name


def outputs_of(text: str) -> tuple[Output, ...]:
    """Parse a list of cards, at least one; raise `BadValue` for an invalid text.

    >>> outputs_of("USB A=18; USB B")
    (Output(name='USB A', channels=18), Output(name='USB B', channels=0))
    >>> outputs_of("")
    (Output(name='', channels=0),)
    >>> outputs_of("USB A=40")
    Traceback (most recent call last):
    underfoot.errors.BadValue: channels of 'USB A' is 40; allowed: 1 to 32
    """
    found: list[Output] = []
    for word in text.split(";"):
        match = _ONE.fullmatch(word.strip())
        if match is None:
            raise BadValue(f"sound device is {word.strip()!r}; allowed: {FORM}")
        name = match["name"]
        channels = 0 if match["channels"] is None else int(match["channels"])
        if match["channels"] is not None:
            require(1 <= channels <= MAX_CHANNELS, f"channels of {name!r}", channels, f"1 to {MAX_CHANNELS}")
        require(name not in {known.name for known in found}, "sound device", text, "each card once")
        found.append(Output(name, channels))
    require(len(found) <= MOST_CARDS, "sound device", f"{len(found)} cards", f"at most {MOST_CARDS}")
    return tuple(found)


def text_of(outputs: Sequence[Output]) -> str:
    """Return the text that `outputs_of` parses.

    >>> text_of(outputs_of("USB A=18;USB B"))
    'USB A=18; USB B'
    """
    return "; ".join(map(str, outputs))


class CardChannels(Struct, frozen=True):
    """The channels of a card: `count` channels of the floor, from `first` on, of which the last may be unused."""

    output: Output
    first: int
    count: int

    def __contains__(self, channel: int) -> bool:
        return self.first <= channel < self.first + self.count

    def opened(self, needed: int) -> int:
        """Return how many of the card's channels to open where the floor needs `needed` of its own.

        Whole pairs, if the card has them: a sound server would play a single channel on all outputs, and a third one
        nowhere. Of a card whose number of channels is given, all.

        >>> CardChannels(Output("USB A"), 0, 8).opened(3), CardChannels(Output("USB A", 3), 0, 3).opened(3)
        (4, 3)
        """
        return self.count if self.output.channels else pairs_up_to(needed - self.first - 1, self.count)

    @property
    def name(self) -> str:
        """The card in words.

        >>> CardChannels(Output("USB A"), 0, 18).name
        "sound device 'USB A'"
        """
        return f"sound device {self.output.name!r}" if self.output.name else "the default sound device"


def card_channels(text: str, wanted: int) -> tuple[CardChannels, ...]:
    """Assign `wanted` channels to the cards of `text`, one card after the other; the last may have too few.

    Cards that get no channels are not opened, except the first. A card whose number of channels is given is opened
    whole: a sound server repeats the channels of a smaller stream on those that are left.

    >>> [card.count for card in card_channels("nowhere A=18; nowhere B=18", 30)]
    [18, 18]
    >>> [card.count for card in card_channels("nowhere A", 3)]
    [3]
    """
    found: list[CardChannels] = []
    first = 0
    for output in outputs_of(text):
        room = min(output.channels or MAX_CHANNELS, max_channels(output.name))
        count = room if output.channels and first < wanted else min(room, wanted - first)
        if count > 0 or not found:
            found.append(CardChannels(output, first, count))
        first += max(count, 0)
    return tuple(found)
