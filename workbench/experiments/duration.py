"""Estimated duration of a study, for planning and for the progress display."""

import math
from collections.abc import Mapping

from underfoot.experiments.methods.pairs import DISSIMILARITY, SAME
from underfoot.experiments.protocol import Protocol, Stage
from underfoot.experiments.questions import Adjusted

_PAGE_S, _QUESTION_S, _ANSWER_S, _ADJUST_S = 15.0, 8.0, 2.5, 20.0
_OF_TWO = ("interval", DISSIMILARITY, SAME)
"""The answers to trials that have two intervals also without a standard."""
_BY_FOOT_S: Mapping[str, float] = {"step": 3.0, "crossings": 8.0}
"""Usual duration of a presentation started by foot, in seconds."""


def usual_trials(protocol: Protocol, stage: Stage) -> tuple[int, int]:
    """Return the approximate numbers of trials and of blocks of a stage.

    For an adaptive method they are those that most people need.
    """
    if stage.method is None:
        return 0, 0
    given = stage.method.given(protocol.stimuli)
    trials, blocks = stage.method.rule.usual_trials(given, protocol.stimuli)
    if not 0 < stage.most_trials < trials:
        return trials, blocks
    return stage.most_trials, math.ceil(blocks * stage.most_trials / trials)


def usual_s(protocol: Protocol, stage: Stage) -> float:
    """Return the approximate duration of a stage in seconds.

    >>> usual_s(Protocol(), Stage(id="pause", kind="pause", seconds=60.0))
    60.0
    """
    if stage.method is None:
        return stage.seconds or _PAGE_S + _QUESTION_S * len(stage.questions)
    method, given = stage.method.rule, stage.method.given(protocol.stimuli)
    if isinstance(method.questions_for(given)[0], Adjusted):
        trial_s = _ADJUST_S
    elif method.uses_stimuli:
        intervals = 2 if given.get("standard") or method.questions_for(given)[0].name in _OF_TWO else 1
        presented_s = intervals * _BY_FOOT_S.get(stage.start, protocol.present_s)
        trial_s = presented_s + (intervals - 1) * stage.interval_pause_s + _ANSWER_S
    else:
        trial_s = given["visible_s"]
    trials, blocks = usual_trials(protocol, stage)
    long = max(blocks - 1, 0) // stage.long_pause_every if stage.long_pause_every else 0
    pauses = ((max(blocks - 1, 0) - long, stage.block_pause_s), (long, stage.long_pause_s))
    stretches = 1 + sum(count for count, seconds in pauses if seconds)  # rests are counted anew in each
    rests = stretches * (max(trials // stretches - 1, 0) // stage.rest_every) if stage.rest_every else 0
    trial_s += stage.pause_s(protocol.stimuli)
    return trials * trial_s + rests * stage.rest_s + sum(count * seconds for count, seconds in pauses)


def about(seconds: float) -> str:
    """Return a duration in words; `seconds` is rounded. No line ends between a number and its unit.

    >>> about(20.0), about(754.0), about(8000.0)
    ('less than a minute', 'about 13\\xa0min', 'about 2\\xa0h 15\\xa0min')
    """
    if seconds < 45.0:
        return "less than a minute"
    minutes = round(seconds / 60.0)
    if minutes < 100:
        return f"about {minutes}\xa0min"
    hours, rest = divmod(15 * round(minutes / 15), 60)
    return f"about {hours}\xa0h {rest}\xa0min" if rest else f"about {hours}\xa0h"
