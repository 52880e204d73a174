"""Presets on disk: patches, floors, simulated tiles, protocols and languages; and a user's own patches."""

import re
from collections.abc import Iterable, Sequence
from functools import cache
from pathlib import Path

import msgspec
from msgspec import Struct

from underfoot import presets
from underfoot.errors import BadFile, UnderfootError
from underfoot.files import path_of, read_file, stem_of
from underfoot.patch.patch import Patch


def presets_folder() -> Path:
    """Return the folder of presets, in a checkout or in an installed wheel.

    >>> (presets_folder() / "patches" / "gravel.json").is_file()
    True
    """
    return Path(presets.__file__).parent


def patches(own: Path | None = None) -> dict[str, Path]:
    """Return the patch files by name, in alphabetical order; behind them those in the folder `own`, by the names of
    their files, which replace others of the same name.

    >>> "gravel" in patches()
    True
    """
    mine = sorted(own.glob("*.json")) if own is not None else []
    return {**_files("patches"), **{path.stem: path for path in mine}}


def open_patch(name: str | Path) -> Patch:
    """Load the preset of this name, or a patch file; `BadFile` if there is neither, or the file is no patch.

    >>> open_patch("gravel")
    <Patch 'Gravel underfoot': 15 nodes, 16 wires>
    """
    found = path_of(name)
    if found.suffix != ".json" and not found.is_file():
        if str(name) not in patches():
            raise BadFile(f"there is no patch {str(name)!r}; allowed: a file, or one of {', '.join(patches())}")
        found = patches()[str(name)]
    return Patch.load(found)


FAMILIES = {"material": "Materials", "stimulus": "Thesis stimuli", "tacton": "Tactons"}
"""Families of presets, by the first word of their names."""
OWN = "My presets"
"""Family of the user's own presets."""


class _Header(msgspec.Struct):
    """Description in a patch file, besides its nodes."""

    title: str = ""
    comment: str = ""
    author: str = ""
    tags: tuple[str, ...] = ()


class Preset(Struct, frozen=True):
    """Preset patch: its file, its family ("" for none), and the description in the file.

    `name` is unique within its family.
    """

    path: Path
    family: str
    name: str
    title: str
    comment: str = ""
    author: str = ""
    tags: tuple[str, ...] = ()

    @property
    def is_user_preset(self) -> bool:
        """Whether it is the user's own, which can be deleted."""
        return self.family == OWN

    def rank(self, text: str) -> int:
        """Return how well it matches all words of `text`: 0 is best, -1 if a word does not occur.

        Matches in title and name rank before tags and family, and those before comment and author; in each, whole words
        rank before beginnings, and those before other parts.

        >>> ice = Preset(Path("ice.json"), "Materials", "Ice", "Ice", "It cracks.", tags=("brittle",))
        >>> ice.rank("ice"), ice.rank("brittle"), ice.rank("brit"), ice.rank("crack"), ice.rank("sand")
        (0, 3, 4, 7, -1)
        """
        places = [(self.name, self.title), (self.family, *self.tags), (self.comment, self.author)]
        ranks = [_rank_of(word, places) for word in text.lower().split()]
        return -1 if -1 in ranks else sum(ranks)


def all_presets(user_folder: Path | None = None) -> list[Preset]:
    """Return the program's presets, and those in the folder `user_folder`, by family and name. Other files are skipped.

    >>> next(preset.title for preset in all_presets() if preset.name == "Ice")
    'Ice'
    """
    mine = sorted(user_folder.glob("*.json")) if user_folder is not None else []
    found = [*_of_program(), *(_preset(path, OWN, "") for path in mine)]
    order = ["", OWN, *FAMILIES.values()]
    there = (preset for preset in found if preset is not None)
    return sorted(there, key=lambda preset: (order.index(preset.family), _in_number_order(preset.name)))


def families() -> dict[str, dict[str, Path]]:
    """Return the program's patches by family, "" for those without one; each by its name.

    >>> list(families()), list(families()["Tactons"])[-2:]
    (['', 'Materials', 'Thesis stimuli', 'Tactons'], ['WS7', 'WS8'])
    """
    found: dict[str, dict[str, Path]] = {"": {}, **{name: {} for name in FAMILIES.values()}}
    for preset in all_presets():
        found[preset.family][preset.name] = preset.path
    return found


def file_of(title: str, user_folder: Path) -> Path:
    """Return the file for the user's own preset with this title.

    >>> file_of("Ice, thin!", Path("mine")).as_posix()
    'mine/ice-thin.json'
    """
    return user_folder / f"{stem_of(title, 'preset')}.json"


def ranked(presets: Iterable[Preset], text: str) -> list[Preset]:
    """Return the presets that match `text`, the best first; ties, and all without text, keep their order."""
    fitting = [(preset.rank(text), preset) for preset in presets]
    return [preset for rank, preset in sorted(fitting, key=lambda found: found[0]) if rank >= 0]


def _rank_of(word: str, places: Sequence[tuple[str, ...]]) -> int:
    """Return the rank of a match: the field, and whether it is a whole word, a beginning or a part; -1 for none."""
    for at, texts in enumerate(places):
        known = " ".join(texts).lower()
        if word in known:
            words = re.findall(r"\w+", known)
            how = 0 if word in words else 1 if any(one.startswith(word) for one in words) else 2
            return 3 * at + how
    return -1


@cache
def _of_program() -> list[Preset | None]:
    """Return the program's presets, which are read once: menu, list and each form of a stimulus show them all."""
    found = []
    for name, path in patches().items():
        first, _, rest = name.partition("-")
        family = FAMILIES.get(first, "")
        found.append(_preset(path, family, _words(rest if family else name)))
    return found


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
    """Return a name in readable form: codes such as ws1 and td in capitals."""
    first, *others = name.split("-")
    is_code = len(first) <= 2 or first[-1].isdigit()
    return " ".join([first.upper() if is_code else first.capitalize(), *others])


def floors() -> dict[str, Path]:
    """Return the floor files by name, in alphabetical order.

    >>> "tiles-2x2" in floors()
    True
    """
    return _files("floors")


def simulations() -> dict[str, Path]:
    """Return the files of simulated tiles and walkers by name, in alphabetical order.

    >>> "thesis-tile" in simulations()
    True
    """
    return _files("simulations")


def protocols() -> dict[str, Path]:
    """Return the protocols of studies: files by name, in alphabetical order.

    >>> "detection-threshold" in protocols()
    True
    """
    return _files("protocols")


def languages() -> dict[str, Path]:
    """Return the languages of participants' pages besides English: files by name, in alphabetical order.

    >>> "fr" in languages()
    True
    """
    return _files("languages")


def walks() -> dict[str, Path]:
    """Return sample force recordings, each with its floor beside it: files by name, in alphabetical order.

    >>> "corridor" in walks()
    True
    """
    return _files("walks", "csv")


def _files(kind: str, ending: str = "json") -> dict[str, Path]:
    return dict(_found(kind, ending))


@cache
def _found(kind: str, ending: str) -> tuple[tuple[str, Path], ...]:
    """Return names and files; a study asks for those of patches hundreds of times."""
    return tuple(sorted((path.stem, path) for path in (presets_folder() / kind).glob(f"*.{ending}")))
