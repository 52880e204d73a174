"""Which studies there are, and where a participant's session of each is kept."""

import re
from contextlib import closing, suppress
from dataclasses import dataclass, replace
from itertools import count
from pathlib import Path

from underfoot.errors import UnderfootError
from underfoot.experiments.protocol import Protocol, node_files_of
from underfoot.experiments.store import SessionFile
from underfoot.patch import preset_files
from underfoot.patch.node import Registry
from underfoot.patch.node_files import NodeFile


@dataclass(frozen=True)
class StudyFile:
    """A protocol with the file that it is in."""

    name: str
    path: Path
    protocol: Protocol
    is_own: bool = False
    """Whether it is a person's own, which can be edited and deleted."""
    is_pilot: bool = False

    @property
    def folder(self) -> Path:
        """Where its patches lie."""
        return self.path.parent

    def pilot(self) -> "StudyFile":
        """The same to be tried on oneself; its sessions lie apart."""
        return replace(self, name=f"{self.name}-pilot", protocol=self.protocol.pilot(), is_pilot=True)


def load_study(path: Path, registry: Registry, is_own: bool = False) -> StudyFile:
    """The study in a protocol file; `BadFile` for what is none."""
    return StudyFile(path.stem, path, Protocol.load(path, registry), is_own)


def preset_studies(registry: Registry) -> list[StudyFile]:
    """The studies among the presets."""
    return [load_study(path, registry) for path in preset_files.protocols().values()]


def own_studies(folder: Path, registry: Registry) -> tuple[list[StudyFile], list[str]]:
    """A person's own studies in a folder, and what is wrong with files that are none, a line each."""
    found, wrong = [], []
    for path in sorted(folder.glob("*.json")):
        try:
            found.append(load_study(path, registry, is_own=True))
        except UnderfootError as error:
            wrong.append(str(error))
    return found, wrong


def own_node_files(folder: Path) -> list[NodeFile]:
    """The files of nodes that a person's own studies need, and that do not run yet."""
    found: dict[str, NodeFile] = {}
    for path in folder.glob("*.json"):
        with suppress(UnderfootError):  # what is wrong with it is told by `own_studies`
            found |= {file.path: file for file in node_files_of(path)}
    return list(found.values())


def session_path(root: Path, study: StudyFile, participant: str) -> Path:
    """The session file of a participant in a study."""
    return root / study.name / f"{participant}.session"


def was_begun_otherwise(path: Path, study: StudyFile) -> bool:
    """Whether there is a session at `path` that was begun with another form of the study."""
    if not path.exists():
        return False
    with closing(SessionFile.open(path)) as file:
        return not file.is_of(study.protocol, study.folder)


def sessions_of(root: Path, study: StudyFile) -> list[Path]:
    """The session files of a study, in the order of their names."""
    return sorted((root / study.name).glob("*.session"))


def unused_id(root: Path, study: StudyFile) -> str:
    """An id of which there is no session of a study: 1, 2, …"""
    return next(str(k) for k in count(1) if not session_path(root, study, str(k)).exists())


def is_id(text: str) -> bool:
    """Whether a text can be a participant's id.

    >>> is_id("P07"), is_id("Ann Other"), is_id("")
    (True, False, False)
    """
    return bool(re.fullmatch(r"[A-Za-z0-9_-]{1,40}", text))
