"""A protocol during editing: a document that may contain mistakes, and the folder of its files."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import msgspec

from underfoot.errors import BadFile, UnderfootError
from underfoot.experiments.languages import LANGUAGES, is_own, path_of_language
from underfoot.experiments.method import StimulusName, StimulusNames
from underfoot.experiments.methods import METHODS
from underfoot.experiments.protocol import FORMAT, VERSION, Protocol
from underfoot.experiments.stimuli import parameters_of, settings_kept
from underfoot.files import make_folder, read_file, stem_of, write_file
from underfoot.parameters import Parameter
from underfoot.patch import preset_files
from underfoot.patch.custom_nodes import copy_needed
from underfoot.patch.file_paths import text_with_files_kept
from underfoot.patch.node import installed_nodes
from underfoot.patch.patch import Patch

PATCHES = "patches"
"""The folder beside a person's own protocols in which the patches lie that they present."""
_NEW: Mapping[str, Any] = {
    "format": FORMAT,
    "version": VERSION,
    "title": "My study",
    "seed": 1,
    "stimuli": {
        "A": {"patch": "stimulus-wc", "scaled_by": "gain.gain", "measured_m_s2": 20.4, "level_m_s2": 1.2},
        "nothing": {},
    },
    "stages": [
        {
            "id": "main",
            "kind": "trials",
            "title": "Feel it, then answer",
            "method": {"kind": "rating", "parameters": {"blocks": 1}},
        }
    ],
}
"""The content of a new protocol: two trials, which can be run unchanged; any method reaches levels within the limit."""


class Draft:
    """A protocol as plain JSON values in `raw`, which editors change in place; its files are in `folder`.

    >>> draft = Draft.new(Path("."))
    >>> draft.first_mistake()
    ''
    >>> draft.raw["present_s"] = "long"
    >>> draft.first_mistake()
    "$.present_s is 'long'; allowed: a number"
    """

    def __init__(self, raw: dict[str, Any], folder: Path) -> None:
        self.raw, self.folder = raw, folder

    @staticmethod
    def new(folder: Path) -> "Draft":
        """Return a new draft with a minimal protocol of two trials."""
        return Draft.of(msgspec.convert(_NEW, Protocol), folder)

    @staticmethod
    def of(protocol: Protocol, folder: Path) -> "Draft":
        """Return a draft of an existing protocol; `take_patch` copies the patches beside it."""
        return Draft(json.loads(msgspec.json.encode(protocol)), folder)

    def checked(self) -> Protocol:
        """Return the protocol; raise `BadFile` for the first mistake, as when a file is read."""
        return Protocol.loads(json.dumps(self.raw), "protocol", self.folder)

    def first_mistake(self) -> str:
        """Return the first mistake in one line; "" for none."""
        try:
            self.checked()
        except UnderfootError as error:
            return str(error).removeprefix("protocol: ")
        return ""

    def save(self, path: Path) -> Protocol:
        """Write the protocol to a file in `folder`, and return it; raise `BadFile` for a mistake in it."""
        protocol = self.checked()
        make_folder(path.parent)
        protocol.save(path)
        return protocol

    def take_patch(self, path: Path) -> str:
        """Copy a patch, and the custom nodes that it needs, to the protocol's folder; return its file name there.

        It reads the same sound files as before. Later edits of the original then do not affect the study. If an
        identical copy exists, it is used; a different file of that name is kept, and the copy gets another name.
        """
        folder = (self.folder / PATCHES).absolute()
        data = text_with_files_kept(read_file(path), str(path), installed_nodes(), path.absolute().parent, folder)
        name = self._name_for(data, path, PATCHES)
        there = self.folder / name
        make_folder(there.parent)
        wrong = copy_needed(Patch.unchecked(data, str(path)).types.values(), path.parent, there.parent)
        if wrong:
            raise BadFile(f"{path} cannot be copied to {there}: {wrong[0]}")
        if not there.is_file():
            write_file(there, data)
        return name

    def take_language(self, path: Path) -> str:
        """Copy a language to the protocol's folder, as a patch; return its file name there."""
        name = self._name_for(read_file(path), path, LANGUAGES)
        make_folder((self.folder / name).parent)
        write_file(self.folder / name, read_file(path))
        return name

    def _name_for(self, data: bytes, path: Path, kind: str) -> str:
        """Return the name in the folder `kind` of a file that has these bytes, or is not there yet."""
        for k in range(1, 1000):
            name = f"{kind}/{path.stem}{f'-{k}' if k > 1 else ''}.json"
            if not (self.folder / name).is_file() or read_file(self.folder / name) == data:
                return name
        raise BadFile(f"{path} cannot be copied to {self.folder / kind}: a thousand of this name are there")

    def take_patches(self, folder: Path) -> None:
        """Copy the patches of all stimuli, and a language of its own, from `folder` to the folder of this protocol.
        Settings name the same sound files as before.
        """
        if is_own(self.raw["language"]):
            self.raw["language"] = self.take_language(path_of_language(self.raw["language"], folder))
        presets = preset_files.patches()
        for stimulus in self.raw["stimuli"].values():
            name = stimulus.get("patch", "")
            if name and stimulus.get("settings"):
                parameters = parameters_of(name, folder)
                stimulus["settings"] = settings_kept(stimulus["settings"], parameters, folder)
            if name and name not in presets:
                stimulus["patch"] = self.take_patch(folder / name)

    def take_conditions(self, conditions: Mapping[str, Any]) -> None:
        """Replace all stimuli that methods list by these, given by name.

        Stimuli that a stage names individually, such as a standard, are kept.
        """
        alone = set()
        for stage in self.raw["stages"]:
            alone.add(stage.get("stimulus"))
            use = stage.get("method") or {}
            for name, parameter in _declared(use).items():
                if isinstance(parameter, StimulusNames):
                    use["parameters"] = {**use.get("parameters", {}), name: list(conditions)}
                elif isinstance(parameter, StimulusName):
                    alone.add(use.get("parameters", {}).get(name))
        stay = {name: one for name, one in self.raw["stimuli"].items() if name in alone}
        self.raw["stimuli"] = {**stay, **conditions}

    def rename_stimulus(self, old: str, new: str) -> None:
        """Rename a stimulus, also where stages refer to it; its position is kept."""
        self.raw["stimuli"] = {new if name == old else name: one for name, one in self.raw["stimuli"].items()}
        for stage in self.raw["stages"]:
            if stage.get("stimulus") == old:
                stage["stimulus"] = new
            use = stage.get("method") or {}
            declared = _declared(use)
            for name, value in use.get("parameters", {}).items():
                if isinstance(declared.get(name), StimulusNames) and isinstance(value, list | tuple):
                    use["parameters"][name] = [new if item == old else item for item in value]
                elif isinstance(declared.get(name), StimulusName) and value == old:
                    use["parameters"][name] = new


def _declared(use: Mapping[str, Any]) -> Mapping[str, Parameter]:
    """Return the parameters of a stage's method; none of one that is not known."""
    return METHODS[use["kind"]].parameters if use.get("kind") in METHODS else {}


def unused_path(title: str, folder: Path, sessions: Path) -> Path:
    """Return the path of a new protocol in `folder`, with a name that no preset, protocol or folder in `sessions` has.

    >>> unused_path("Thin ice?", Path("nowhere"), Path("nowhere")).as_posix()
    'nowhere/thin-ice.json'
    """
    stem = stem_of(title, "study")
    presets = preset_files.protocols()
    names = [stem, *(f"{stem}-{k}" for k in range(2, 1000))]
    free = (n for n in names if n not in presets and not (folder / f"{n}.json").exists())
    return folder / f"{next(n for n in free if not (sessions / n).exists())}.json"
