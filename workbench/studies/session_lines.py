"""The sessions of a study as lines of a list: whose, since when, how far, what was noted, and whether they count."""

from contextlib import closing
from dataclasses import dataclass
from pathlib import Path

from underfoot.errors import UnderfootError
from underfoot.experiments.duration import usual_trials
from underfoot.experiments.protocol import Protocol
from underfoot.experiments.store import SessionFile
from underfoot.studies.results import has_all_answers


@dataclass(frozen=True)
class SessionLine:
    """What a list says of a session; where the file cannot be read, `error` says why, and the rest is empty."""

    path: Path
    participant: str
    """The id, and the file's name where that is another."""
    id: str = ""
    begun: str = ""
    """The time of day, as the file has it."""
    answered: int = 0
    """How many trials count: neither practice nor spoiled."""
    trials: int = 0
    """How many there are by the protocol, of an adaptive method about so many."""
    is_whole: bool = False
    """Whether it has all answers."""
    left_out: str = ""
    notes: tuple[str, ...] = ()
    error: str = ""

    @property
    def progress(self) -> str:
        """How many trials count, and of how many, if that is not all.

        >>> SessionLine(Path(), "P3", answered=35, trials=96).progress
        '35 of 96'
        """
        if self.error:
            return ""
        return f"{self.answered}" if self.is_whole else f"{self.answered} of {max(self.trials, self.answered)}"

    @property
    def state(self) -> str:
        """Whether the session counts, and as what.

        >>> SessionLine(Path("P3.session"), "P3", left_out="loose shoe").state
        'left out: loose shoe'
        """
        if self.error:
            return self.error
        return f"left out: {self.left_out}" if self.left_out else "complete" if self.is_whole else "not finished"


def session_line(path: Path) -> SessionLine:
    """Return what a list says of a session file."""
    try:
        with closing(SessionFile.open(path)) as file:
            about, entries, protocol = file.about, file.entries(), file.stored_protocol()
            counted = _trials_of(protocol)
            answered = [one for one in entries if one.trial is not None and not one.spoiled and one.stage in counted]
            return SessionLine(
                path,
                file.label,
                file.counts_as,
                about.get("begun", "")[:16].replace("T", " "),
                len(answered),
                sum(counted.values()),
                has_all_answers(protocol, file.participant, entries),
                file.left_out,
                tuple(note.text for note in file.notes()),
            )
    except UnderfootError as error:
        return SessionLine(path, path.stem, error=str(error).removeprefix(f"{path} "))


def _trials_of(protocol: Protocol) -> dict[str, int]:
    """Return the number of trials of each stage that counts."""
    stages = (stage for stage in protocol.stages if stage.method is not None and not stage.practice)
    return {stage.id: usual_trials(protocol, stage)[0] for stage in stages}
