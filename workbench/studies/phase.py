"""Phases of a study's page."""

from enum import StrEnum


class Phase(StrEnum):
    """The state of a runner within a page."""

    PREPARING = "preparing"
    """Every patch of the protocol is played once, silently, so that none has to be compiled later."""
    PAGE = "page"
    """A page that is read or answered; in learning, stimuli can be played."""
    PAUSE = "pause"
    WAITING = "waiting"
    """Before a presentation: a pause between trials, the plate that moves, the floor that has to be left."""
    READY = "ready"
    """For a key, a step, or crossings to begin."""
    PRESENTING = "presenting"
    ANSWERING = "answering"
    STOPPED = "stopped"
    """By the participant or the experimenter, until `go_on`."""
    END = "end"
