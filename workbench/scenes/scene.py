"""The interface of a scene: contacts go in moment by moment, cues and shapes come out. No screen is needed.

Everything that a scene does follows from its parameters, its seed and the moments so far: the same contacts give the
same cues and the same picture. docs/scenes.md builds one from an empty folder.
"""

from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, ClassVar

from underfoot.errors import BadValue, require
from underfoot.experiments.seeded_random import SeededRandom
from underfoot.floor.layout import Floor
from underfoot.parameters import Parameter, declared_in
from underfoot.patch.node import Registry
from underfoot.patch.patch import Patch
from underfoot.scenes.cues import Cue
from underfoot.scenes.moments import Moment
from underfoot.scenes.shapes import Shape


class Scene(ABC):
    """A scene on a floor. `name` is that of its folder; `title` and `doc` are for display.

    Parameters are declared like those of nodes; `given` has their values. `patch.json` in the folder is the scene's
    patch; without it, nothing is played.
    """

    name: ClassVar[str] = ""
    title: ClassVar[str]
    doc: ClassVar[str]
    """Two or three sentences on what people do, see and feel."""
    folder: ClassVar[Path | None] = None
    """Folder of its patch and its picture."""
    parameters: ClassVar[dict[str, Parameter]] = {}

    def __init_subclass__(cls) -> None:
        super().__init_subclass__()
        cls.parameters = cls.parameters | declared_in(cls)

    def __init__(self, floor: Floor, given: Mapping[str, Any] | None = None, seed: int = 1) -> None:
        """Raise `BadValue` for invalid parameters."""
        self.floor, self.seed = floor, seed
        self.draws = SeededRandom(seed, self.name or type(self).__name__)
        self.given: dict[str, Any] = {name: p.check(p.default) for name, p in self.parameters.items()}
        for name, value in (given or {}).items():
            self.change(name, value)

    def change(self, name: str, value: object) -> None:
        """Change a parameter; `BadValue` for an unknown one or an invalid value."""
        known = ", ".join(self.parameters) or "none"
        require(name in self.parameters, "parameter", name, f"the parameters of {self.title}: {known}")
        self.given[name] = self.parameters[name].check(value)

    @classmethod
    def patch(cls, registry: Registry) -> Patch:
        """Return the patch that it plays."""
        path = cls.folder / "patch.json" if cls.folder is not None else None
        return Patch.load(path, registry) if path is not None and path.exists() else Patch(title=cls.title)

    @classmethod
    def picture(cls) -> Path | None:
        """Return the path of its picture; None if its folder has none."""
        path = cls.folder / "picture.png" if cls.folder is not None else None
        return path if path is not None and path.exists() else None

    @abstractmethod
    def step(self, moment: Moment) -> Iterable[Cue]:
        """Take the next moment, and return cues; called a hundred times a second."""

    @abstractmethod
    def shapes(self) -> Iterable[Shape]:
        """Return the present picture, the last shape on top. Must not change the scene: it is called at any rate."""

    def places_m(self) -> list[tuple[float, float]]:
        """Return places to press, in metres of the floor's frame, to try the scene: by default the middles of the
        tiles."""
        return [tile.centre_m for tile in self.floor.tiles]

    @property
    def state(self) -> str:
        """The state in a few words, for the experimenter."""
        return ""


def values_of(kind: type[Scene], texts: Iterable[str]) -> dict[str, Any]:
    """Parse parameters of a scene, "name=value"; `BadValue` names what is allowed.

    Numbers in lists are separated by commas.
    """
    found: dict[str, Any] = {}
    for text in texts:
        name, equals, value = text.partition("=")
        known = ", ".join(kind.parameters) or "none"
        require(bool(equals) and name in kind.parameters, "--set", text, f"NAME=VALUE with a name of: {known}")
        parameter = kind.parameters[name]
        try:
            found[name] = parameter.check(_parsed(parameter, value))
        except ValueError as error:
            raise error if isinstance(error, BadValue) else parameter.refuse(value) from None
    return found


def _parsed(parameter: Parameter, text: str) -> object:
    match parameter.kind:
        case "number":
            return float(text)
        case "count":
            return int(text)
        case "numbers":
            return [float(part) for part in text.split(",")]
    return text
