"""Presets on disk: patches, floors, simulated tiles and protocols to begin with; and a person's own patches."""

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import msgspec

from underfoot import presets
from underfoot.errors import BadFile, UnderfootError
from underfoot.files import read_file
from underfoot.patch.patch import Patch


def presets_folder() -> Path:
    """The folder of presets, in a checkout as in an installed wheel.

    >>> (presets_folder() / "patches" / "gravel.json").is_file()
    True
    """
    return Path(presets.__file__).parent


def patches() -> dict[str, Path]:
    """The patches' files by name, in alphabetical order.

    >>> "gravel" in patches()
    True
    """
    return _files("patches")


def open_patch(name: str | Path) -> Patch:
    """The preset of this name, or the patch in a file; `BadFile` where there is neither, or the file is no patch.

    >>> open_patch("gravel")
    <Patch 'Gravel underfoot': 15 nodes, 16 wires>
    """
    found = Path(name)
    if found.suffix != ".json" and not found.is_file():
        if str(name) not in patches():
            raise BadFile(f"there is no patch {str(name)!r}; allowed: a file, or one of {', '.join(patches())}")
        found = patches()[str(name)]
    return Patch.load(found)


FAMILIES = {"material": "Materials", "stimulus": "Thesis stimuli", "tacton": "Tactons"}
"""What the first word of a patch's name says it belongs to, and how that is called."""
OWN = "My presets"
"""The family of a person's own presets."""


class _Header(msgspec.Struct):
    """What a patch file says of itself, beside its nodes."""

    title: str = ""
    comment: str = ""
    author: str = ""
    tags: tuple[str, ...] = ()


@dataclass(frozen=True)
class Preset:
    """A patch to begin with: its file, the family that it belongs to ("" for none), and what it says of itself.

    `name` tells it from the others of its family.
    """

    path: Path
    family: str
    name: str
    title: str
    comment: str = ""
    author: str = ""
    tags: tuple[str, ...] = ()

    @property
    def is_own(self) -> bool:
        """Whether it is a person's own, which can be taken away again."""
        return self.family == OWN

    def rank(self, text: str) -> int:
        """How well it fits the words of `text`, all together: 0 is best, -1 where a word is nowhere in it.

        The title and the name come before tags and family, and those before the comment and the author; in each, whole
        words come before beginnings, and those before other parts.

        >>> ice = Preset(Path("ice.json"), "Materials", "Ice", "Ice", "It cracks.", tags=("brittle",))
        >>> ice.rank("ice"), ice.rank("brittle"), ice.rank("brit"), ice.rank("crack"), ice.rank("sand")
        (0, 3, 4, 7, -1)
        """
        places = [(self.name, self.title), (self.family, *self.tags), (self.comment, self.author)]
        ranks = [_rank_of(word, places) for word in text.lower().split()]
        return -1 if -1 in ranks else sum(ranks)


def all_presets(own: Path | None = None) -> list[Preset]:
    """The presets of the program, and those in the folder `own`, by family and name. Files that are none are left out.

    >>> next(preset.title for preset in all_presets() if preset.name == "Ice")
    'Ice'
    """
    found = []
    for name, path in patches().items():
        first, _, rest = name.partition("-")
        family = FAMILIES.get(first, "")
        found.append(_preset(path, family, _words(rest if family else name)))
    mine = sorted(own.glob("*.json")) if own is not None else []
    found += [_preset(path, OWN, "") for path in mine]
    order = ["", OWN, *FAMILIES.values()]
    there = (preset for preset in found if preset is not None)
    return sorted(there, key=lambda preset: (order.index(preset.family), _in_number_order(preset.name)))


def families() -> dict[str, dict[str, Path]]:
    """The program's patches by the name of their family, "" for those without one; each under its name.

    >>> list(families()), list(families()["Tactons"])[-2:]
    (['', 'Materials', 'Thesis stimuli', 'Tactons'], ['WS7', 'WS8'])
    """
    found: dict[str, dict[str, Path]] = {"": {}, **{name: {} for name in FAMILIES.values()}}
    for preset in all_presets():
        found[preset.family][preset.name] = preset.path
    return found


def file_of(title: str, own: Path) -> Path:
    """The file of a person's own preset of this title.

    >>> file_of("Ice, thin!", Path("mine")).as_posix()
    'mine/ice-thin.json'
    """
    return own / f"{re.sub(r'[^a-z0-9]+', '-', title.lower()).strip('-') or 'preset'}.json"


def ranked(presets: Iterable[Preset], text: str) -> list[Preset]:
    """Those that fit `text`, the best first; of equal ones, and without text, in the order in which they were."""
    fitting = [(preset.rank(text), preset) for preset in presets]
    return [preset for rank, preset in sorted(fitting, key=lambda found: found[0]) if rank >= 0]


def _rank_of(word: str, places: Sequence[tuple[str, ...]]) -> int:
    """Where a word is found: in which of the places, as a whole, a beginning, or a part of a word; -1 for nowhere."""
    for at, texts in enumerate(places):
        known = " ".join(texts).lower()
        if word in known:
            words = re.findall(r"\w+", known)
            how = 0 if word in words else 1 if any(one.startswith(word) for one in words) else 2
            return 3 * at + how
    return -1


def _preset(path: Path, family: str, name: str) -> Preset | None:
    try:
        header = msgspec.json.decode(read_file(path), type=_Header)
    except (UnderfootError, msgspec.DecodeError, UnicodeDecodeError, RecursionError):
        return None
    title = header.title or path.stem
    return Preset(path, family, name or title, title, header.comment, header.author, header.tags)


def _in_number_order(name: str) -> tuple[str, int]:
    digits = re.search(r"\d+$", name)
    return (name.lower()[: digits.start()], int(digits[0])) if digits else (name.lower(), 0)


def _words(name: str) -> str:
    """A name as people read it: codes such as ws1 and td in capitals."""
    first, *others = name.split("-")
    is_code = len(first) <= 2 or first[-1].isdigit()
    return " ".join([first.upper() if is_code else first.capitalize(), *others])


def floors() -> dict[str, Path]:
    """The floors' files by name, in alphabetical order.

    >>> "tiles-2x2" in floors()
    True
    """
    return _files("floors")


def simulations() -> dict[str, Path]:
    """What simulated tiles are made of, and who walks on them: the files by name, in alphabetical order.

    >>> "thesis-tile" in simulations()
    True
    """
    return _files("simulations")


def protocols() -> dict[str, Path]:
    """The protocols of studies: the files by name, in alphabetical order.

    >>> "detection-threshold" in protocols()
    True
    """
    return _files("protocols")


def walks() -> dict[str, Path]:
    """Sample recordings of forces, each with its floor beside it: the files by name, in alphabetical order.

    >>> "corridor" in walks()
    True
    """
    return _files("walks", "csv")


def _files(kind: str, ending: str = "json") -> dict[str, Path]:
    found = (presets_folder() / kind).glob(f"*.{ending}")
    return {path.stem: path for path in sorted(found, key=lambda path: path.stem)}
