"""Footsteps of a recording as a command looks for them, with a line each second."""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from underfoot.commands.telling import tell_share
from underfoot.errors import BadFile

if TYPE_CHECKING:
    from underfoot.records.recording import Recording
    from underfoot.records.survey import Survey


def survey_told(recording: "Recording") -> "Survey":
    """Return the contacts and footsteps of a recording, from the cache or else found now; `BadFile` for an empty
    one."""
    from underfoot.records.survey import cache_survey, load_cached_survey, survey

    known = load_cached_survey(recording)
    if known is None:
        first, end = recording.span
        if first == end:
            raise BadFile(f"{recording.path} holds no force samples: it was ended before the first")
        known = survey(recording, survey_progress(recording.path, (end - first) / recording.rate_hz))
        cache_survey(recording, known)
    return known


def survey_progress(path: Path, length_s: float) -> "Callable[[Survey], bool]":
    """Return what tells once a second how far a survey of a file of this length is."""
    told = tell_share()
    return lambda so_far: told(f"looking for footsteps in {path.name}", so_far.until_s / length_s)
