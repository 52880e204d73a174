"""Answers by foot: the fields on the floor, and the detection of an answer from contacts."""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from underfoot.errors import BadValue, require
from underfoot.experiments.foot import FootAnswer, least_fields, values_of
from underfoot.experiments.protocol import Protocol
from underfoot.floor.contacts import OngoingContact
from underfoot.floor.layout import Floor, Tile
from underfoot.parameters import Parameter
from underfoot.phrases import Phrase

BETWEEN_M = 0.02
"""So near to the middle of a tile no half is meant."""


@dataclass(frozen=True)
class FootField:
    """A field of a tile for the answer `value`: from `low_m` to `high_m` in the tile's frame, over its whole depth."""

    value: Any
    tile: Tile
    low_m: float
    high_m: float

    @property
    def text(self) -> str:
        """The answer's label.

        >>> from underfoot.floor.layout import default_floor
        >>> FootField(33.333, default_floor().tiles[0], -0.1, 0.1).text
        '33'
        """
        return f"{self.value:.0f}" if isinstance(self.value, float) else str(self.value)

    @property
    def corners_m(self) -> tuple[tuple[float, float], ...]:
        """Its corners in the floor's frame, in order around the field."""
        y_m = 0.5 * self.tile.size_m[1]
        ends = ((self.low_m, -y_m), (self.high_m, -y_m), (self.high_m, y_m), (self.low_m, y_m))
        return tuple((float(x_m), float(y_m)) for x_m, y_m in self.tile.to_floor(ends))

    def has(self, x_m: float, y_m: float) -> bool:
        """Return whether the field contains a point of the floor."""
        x, y = self.tile.to_tile((x_m, y_m))
        return bool(self.low_m <= x <= self.high_m and abs(y) <= 0.5 * self.tile.size_m[1])


def fields_on(foot: FootAnswer, question: Parameter, floor: Floor) -> tuple[FootField, ...]:
    """Return the fields on a floor for a question.

    Raises `BadValue` if the floor has too few tiles, or lacks a named one.
    """
    known = {tile.id: tile for tile in floor.tiles}
    for name in foot.tiles:
        require(name in known, "foot.tiles", name, f"tiles of the floor: {', '.join(known)}")
    tiles = [known[name] for name in foot.tiles] or list(floor.tiles)
    if foot.by == "halves":
        edge = 0.5 * tiles[0].size_m[0]
        left, right = values_of(question, 2)
        return (FootField(left, tiles[0], -edge, -BETWEEN_M), FootField(right, tiles[0], BETWEEN_M, edge))
    least = least_fields((question,))
    if len(tiles) < least:
        raise BadValue(f"{least} answers by foot need {least} tiles, and there are {len(tiles)}; take a larger floor")
    edges = [0.5 * tile.size_m[0] for tile in tiles]
    values = values_of(question, len(tiles))
    return tuple(FootField(value, tile, -x, x) for value, tile, x in zip(values, tiles, edges, strict=False))


def require_fields(protocol: Protocol, floor: Floor) -> None:
    """Raise `BadValue` if the floor lacks fields for a study's answers by foot."""
    for stage in protocol.stages:
        if stage.foot is not None and stage.method is not None:
            question = stage.method.rule.questions_for(stage.method.given(protocol.stimuli))[0]
            try:
                fields_on(stage.foot, question, floor)
            except BadValue as error:
                raise BadValue(f"stage {stage.id!r}: {error}") from None


class FootAnswers:
    """Detects the answer to one question from `asked_s` on, in session seconds; earlier contacts are ignored.

    >>> from underfoot.experiments.questions import yes_or_no
    >>> from underfoot.floor.layout import default_floor
    >>> watch = FootAnswers(FootAnswer(by="halves"), yes_or_no("felt", "?"), default_floor(1, 1), 0.0)
    >>> x_m, y_m = default_floor(1, 1).tiles[0].centre_m
    >>> foot = OngoingContact(1, x_m - 0.07, y_m, 300.0, (0,), start_s=0.9)
    >>> watch.judged((foot,), 1.0), watch.judged((foot,), 1.7)
    (None, {'felt': 'yes'})
    """

    def __init__(self, foot: FootAnswer, question: Parameter, floor: Floor, asked_s: float) -> None:
        self.foot, self.question, self.asked_s = foot, question, asked_s
        self.fields = fields_on(foot, question, floor)
        self._since_s = math.nan
        self.on: FootField | None = None
        """The field that is stepped on."""
        self.share = 0.0
        """Elapsed share of the dwell time, 0 to 1."""
        self._is_earlier_foot_on = False

    @property
    def facts(self) -> dict[str, Any]:
        """Facts to store with the answer: that it was given by foot, and the time from question to contact."""
        return {"answered_by": "foot", "foot_after_s": round(self._since_s - self.asked_s, 4)}

    def judged(self, contacts: Iterable[OngoingContact], now_s: float) -> dict[str, Any] | None:
        """Return the answer as soon as there is one, else None."""
        feet = [one for one in contacts if one.force_n >= self.foot.force_n]
        pressing = [one for one in feet if one.start_s >= self.asked_s]
        earlier = [one for one in feet if one.start_s < self.asked_s]
        self._is_earlier_foot_on = any(field.has(one.x_m, one.y_m) for field in self.fields for one in earlier)
        fields = [field for field in self.fields if any(field.has(one.x_m, one.y_m) for one in pressing)]
        field = fields[0] if len(fields) == 1 else None
        is_left = not pressing and self.foot.rule == "release" and self.share >= 1.0
        if is_left and self.on is not None:
            return {self.question.name: self.on.value}
        if field is not self.on:
            self.on, self._since_s, self.share = field, now_s, 0.0
        if field is None:
            return None
        self.share = min((now_s - self._since_s) / self.foot.dwell_s, 1.0)
        return {self.question.name: field.value} if self.share >= 1.0 and self.foot.rule == "dwell" else None

    @property
    def hint(self) -> str:
        """An instruction in a sentence or two."""
        step = "Step on your answer." if self.foot.rule == "dwell" else "Step on your answer, and off again."
        return Phrase("Please step off first. {step}", step=step) if self._is_earlier_foot_on else step
