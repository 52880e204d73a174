"""Phases of a study's page."""

from enum import StrEnum


class Phase(StrEnum):
    """The state of a runner within a page."""

    PREPARING = "preparing"
    """Each patch of the protocol is played once, silently, so that all are compiled in advance."""
    PAGE = "page"
    """A page that is read or answered; in learning, stimuli can be played."""
    PAUSE = "pause"
    WAITING = "waiting"
    """Before a presentation: a pause between trials, the plate that moves, the floor that has to be left."""
    READY = "ready"
    """Waiting for a key, a step, or crossings that start the presentation."""
    PRESENTING = "presenting"
    ANSWERING = "answering"
    STOPPED = "stopped"
    """Stopped by the participant or the experimenter, until `go_on`."""
    END = "end"
