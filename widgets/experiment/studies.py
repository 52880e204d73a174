"""The available studies, and the places of their session files."""

from contextlib import closing, suppress
from dataclasses import dataclass, replace
from datetime import datetime
from itertools import chain, count
from pathlib import Path, PureWindowsPath

from underfoot.errors import UnderfootError
from underfoot.experiments.protocol import Protocol, node_files_of
from underfoot.experiments.store import SessionFile
from underfoot.experiments.study import is_over
from underfoot.files import make_folder, read_file, write_file
from underfoot.parameters import IDENTIFIER
from underfoot.patch import preset_files
from underfoot.patch.node_files import NodeFile

STUDY = "study.txt"
"""File beside the sessions of a study: the place of its protocol."""

LONGEST_ID = 40
"""Most characters of a participant's id, which names a file."""


@dataclass(frozen=True)
class StudyFile:
    """A protocol and its file."""

    name: str
    path: Path
    protocol: Protocol
    is_own: bool = False
    """Whether it is the user's own study, which can be edited and deleted."""
    is_pilot: bool = False

    @property
    def title(self) -> str:
        """Its title, or the name of its file."""
        return self.protocol.title or self.name

    @property
    def folder(self) -> Path:
        """The folder of its patches."""
        return self.path.parent

    def pilot(self) -> "StudyFile":
        """Return the pilot version of the study, with a separate folder of sessions."""
        return replace(self, name=f"{self.name}-pilot", protocol=self.protocol.pilot(), is_pilot=True)


@dataclass
class SessionFolder:
    """The session files of all studies, in one folder per study below `root`."""

    root: Path

    def of(self, study: StudyFile) -> Path:
        """Return the folder of a study's sessions: it has the name of the protocol's file.

        Another file of that name in another folder is another study; its sessions get a number after the name.
        """
        names = chain((study.name,), (f"{study.name}-{k}" for k in count(2)))
        return next(self.root / name for name in names if not _is_of_another(self.root / name, study))

    def claim(self, study: StudyFile) -> None:
        """Make the folder of a study's sessions, and keep whose it is; raise `BadFile` if that fails."""
        write_file(make_folder(self.of(study)) / STUDY, _origin(study).encode())

    def path(self, study: StudyFile, participant: str) -> Path:
        """Return the path of a participant's session file."""
        return self.of(study) / f"{participant}.session"

    def files(self, study: StudyFile) -> list[Path]:
        """Return the session files of a study, sorted by name."""
        return sorted(self.of(study).glob("*.session"))

    def alike(self, study: StudyFile, participant: str) -> str:
        """Return the id of a session in the study that differs from this id in letter case only; "" if there is none.

        Some file systems would take one for the other, and others would begin a second session.
        """
        ids = [path.stem for path in self.files(study)]
        if participant in ids:
            return ""
        return next((id for id in ids if id.casefold() == participant.casefold()), "")

    def was_begun_otherwise(self, study: StudyFile, participant: str) -> bool:
        """Return whether the participant's session was begun with another version of the study."""
        path = self.path(study, participant)
        if not path.exists():
            return False
        with closing(SessionFile.open(path)) as file:
            return not file.is_of(study.protocol, study.folder)

    def begun(self, study: StudyFile, participant: str) -> tuple[datetime, bool] | None:
        """Return when the participant's session was begun, and whether it is over; None if there is none to be read."""
        path = self.path(study, participant)
        if not path.exists():
            return None
        with suppress(UnderfootError, ValueError), closing(SessionFile.open(path)) as file:
            begun = datetime.fromisoformat(file.about.get("begun", ""))
            return begun, is_over(file.stored_protocol(), participant, file.entries())
        return None

    def unused_id(self, study: StudyFile) -> str:
        """Return the first number from 1 without a session in the study, as a participant's id."""
        return next(str(k) for k in count(1) if not self.path(study, str(k)).exists())


def _origin(study: StudyFile) -> str:
    """Return the place of a study's protocol; that of a preset is its name, wherever the program lies."""
    is_preset = study.path in preset_files.protocols().values()
    return study.path.name if is_preset else str(study.path.resolve())


def _is_of_another(folder: Path, study: StudyFile) -> bool:
    """Return whether a folder has the sessions of another study, whose protocol has not been moved away since."""
    try:
        origin = (folder / STUDY).read_text("utf-8")
    except (OSError, UnicodeDecodeError):
        return False
    is_preset = PureWindowsPath(origin).name == origin  # of either system, as sessions are copied
    return origin != _origin(study) and (is_preset or Path(origin).is_file())


def load_study(path: Path, *, is_own: bool = False) -> StudyFile:
    """Return the study in a protocol file; raise `BadFile` if it is not a protocol."""
    return StudyFile(path.stem, path, Protocol.load(path), is_own)


def preset_studies() -> list[StudyFile]:
    """Return the studies among the presets, by title.

    The program's tests have checked them; to read all their patches again would stop the window for 0.02 s.
    """
    files = preset_files.protocols().values()
    found = (StudyFile(path.stem, path, Protocol.unchecked(read_file(path), str(path))) for path in files)
    return sorted(found, key=lambda one: one.title)


def own_studies(folder: Path) -> tuple[list[StudyFile], list[str]]:
    """Return the user's studies in a folder, and an error line for each file that cannot be read."""
    found, wrong = [], []
    for path in sorted(folder.glob("*.json")):
        try:
            found.append(load_study(path, is_own=True))
        except UnderfootError as error:
            wrong.append(str(error))
    return found, wrong


def own_node_files(folder: Path) -> list[NodeFile]:
    """Return the files of nodes that the user's studies need and that are not allowed to run yet."""
    found: dict[str, NodeFile] = {}
    for path in folder.glob("*.json"):
        with suppress(UnderfootError):  # `own_studies` reports the error
            found |= {file.path: file for file in node_files_of(path)}
    return list(found.values())


def is_id(text: str) -> bool:
    """Return whether a text is a valid participant's id.

    >>> is_id("P07"), is_id("Ann Other"), is_id("")
    (True, False, False)
    """
    return len(text) <= LONGEST_ID and bool(IDENTIFIER.fullmatch(text))
