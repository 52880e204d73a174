"""Survey of a recording in a separate process, while the window stays responsive."""

from contextlib import suppress
from dataclasses import dataclass
from multiprocessing.connection import Connection
from pathlib import Path

from underfoot.clock import once_in
from underfoot.engine.child_process import leave_to_session
from underfoot.errors import UnderfootError
from underfoot.records.recording import Recording
from underfoot.records.survey import Survey, cache_survey, has_envelopes, make_envelopes, survey

TELL_S = 0.5
"""Interval in seconds between partial results."""


@dataclass(frozen=True)
class Progress:
    """Progress as a text and a share."""

    text: str
    share: float


def run(connection: Connection, path: str) -> None:
    """Send `Progress`, and each time a `Survey` of new data, the last one complete; or an error line."""
    leave_to_session("SIGINT")
    with suppress(OSError):
        try:
            with Recording(Path(path)) as recording:
                _survey(connection, recording)
        except UnderfootError as error:
            connection.send(str(error))


def _survey(connection: Connection, recording: Recording) -> None:
    is_due, sent = once_in(TELL_S), [0, 0, 0]
    first, end = recording.span
    length_s = max((end - first) / recording.rate_hz, 1e-9)

    def not_sent(made: Survey) -> Survey:
        contacts, steps, balance = made.contacts[sent[0] :], made.steps[sent[1] :], made.balance[sent[2] :]
        sent[:] = len(made.contacts), len(made.steps), len(made.balance)
        return Survey(contacts, steps, made.until_s, made.whole, balance=balance)

    def on_share(share: float) -> bool:
        if is_due():
            connection.send(Progress("Drawing what was recorded, which is done once", share))
        return not connection.poll()

    def found(made: Survey) -> bool:
        if is_due():
            connection.send(Progress("Looking for footsteps", min(made.until_s / length_s, 1.0)))
            connection.send(not_sent(made))
        return not connection.poll()

    if not has_envelopes(recording):
        make_envelopes(recording, on_share)
        connection.send(Progress("Drawing what was recorded, which is done once", 1.0))
    made = survey(recording, found)
    if made.whole:
        cache_survey(recording, made)
        connection.send(not_sent(made))
