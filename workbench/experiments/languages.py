"""Languages of participants' pages, in files: the program's by their names, or a laboratory's beside its protocol."""

from collections.abc import Mapping
from difflib import get_close_matches
from pathlib import Path
from string import Formatter

import msgspec

from underfoot.documents import document_format, read_document
from underfoot.errors import BadFile, UnderfootError, require, shown
from underfoot.experiments.stimuli import preset_or_beside
from underfoot.files import read_file
from underfoot.patch import preset_files
from underfoot.phrases import ENGLISH, Language

FORMAT, VERSION = "underfoot-language", 1
EN = "en"
"""The language that has no file, because its phrases stand where they are said."""
LANGUAGES = "languages"
"""The folder beside a person's own protocols in which their languages lie."""


class _Document(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A language in a file. It has all phrases, or those in which it differs from the language that it is `like`.

    `name` is what people call one of the program's.
    """

    name: str = ""
    like: str = ""
    decimal_mark: str = ""
    phrases: Mapping[str, str] = {}


def language_of(name: str, folder: Path | None = None) -> Language:
    """Return the language of this name, or in the file of this name in `folder` or below.

    Raises `BadFile` where there is none, or it lacks a phrase, has one that the program does not say, or other values.

    >>> language_of("fr").say("Go on")
    'Continuer'
    """
    if name == EN:
        return ENGLISH
    path = path_of_language(name, folder)
    found, known = _read(path), _read(next(iter(preset_files.languages().values()))).phrases
    _check(path, found, known)
    like = language_of(found.like) if found.like else ENGLISH
    return Language({**like.phrases, **found.phrases}, found.decimal_mark or like.decimal_mark)


def path_of_language(name: str, folder: Path | None) -> Path:
    """Return the file of a language; raise `BadFile` if there is none."""
    return preset_or_beside("language", {EN: Path(), **preset_files.languages()}, name, folder)


def is_own(name: str) -> bool:
    """Return whether a language is in a file of a person's own.

    >>> is_own("fr"), is_own("languages/fr-short.json")
    (False, True)
    """
    return name not in (EN, *preset_files.languages())


def names_of_languages(folder: Path) -> dict[str, str]:
    """Return the languages that a protocol in `folder` can have, by what people call them.

    >>> names_of_languages(Path("nowhere"))
    {'English': 'en', 'Deutsch': 'de', 'Français': 'fr'}
    """
    found = {"English": EN, **{_read(path).name: name for name, path in preset_files.languages().items()}}
    own = (path for path in sorted((folder / LANGUAGES).glob("*.json")) if document_format(path) == FORMAT)
    return found | {path.stem: path.relative_to(folder).as_posix() for path in own}


def _read(path: Path) -> _Document:
    return read_document(read_file(path), str(path), FORMAT, VERSION, _Document)


def _check(path: Path, found: _Document, known: Mapping[str, str]) -> None:
    """Raise `BadFile` unless the phrases are of the program, with the same values, and none is lacking."""
    presets = (EN, *preset_files.languages())
    try:
        require(found.like in ("", *presets), "like", found.like, f"{', '.join(presets)}, or none")
        require(found.decimal_mark in ("", ".", ","), "decimal_mark", found.decimal_mark, "a point or a comma")
    except UnderfootError as error:
        raise BadFile(f"{path}: $.{error}") from None
    for phrase, words in found.phrases.items():
        if phrase not in known:
            (near,) = get_close_matches(phrase, known, 1, 0.0)
            raise BadFile(f"{path}: $.phrases has {shown(phrase)}; allowed: what the program says, such as {near!r}")
        values = _values_in(phrase)
        if not words.strip() or _values_in(words) != values:
            these = ", ".join(f"{{{name}}}" for name, _, _ in sorted(values)) or "none"
            raise BadFile(f"{path}: {shown(phrase)} is {shown(words)}; allowed: text, with the values {these}")
    lacking = [phrase for phrase in known if phrase not in found.phrases]
    if lacking and not found.like:
        more = f" and {len(lacking) - 1} more phrases" if len(lacking) > 1 else ""
        raise BadFile(f"{path} lacks {shown(lacking[0])}{more}; add it, or name a language that has it as like")


def _values_in(text: str) -> set[tuple[str, str, str]]:
    """Return the values that a phrase takes, with how they would be written; of what is no phrase, another one."""
    try:
        parts = list(Formatter().parse(text))
    except ValueError:
        return {("", "", "")}
    return {(name, form or "", conversion or "") for _, name, form, conversion in parts if name is not None}
