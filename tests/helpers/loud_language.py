"""A language in which the program's words are capitals: small letters on a participant's page are words that have none.

Texts of a protocol are capitals, too; its phrases are those of the language that the program has.
"""

import json
import re

from underfoot.patch import preset_files

NAME = "loud.json"
_KEPT = re.compile(r"\{\w+\}|dB|Ctrl")
"""Values in a phrase, and words that no language has."""


def phrases(name):
    return json.loads(preset_files.languages()[name].read_text())["phrases"]


def loud(text):
    """A text in capitals, but for its values."""
    return "".join(part if _KEPT.fullmatch(part) else part.upper() for part in re.split(f"({_KEPT.pattern})", text))


def write_loud_language(folder):
    """Write the language beside the protocols of a folder."""
    known = {phrase: loud(phrase) for phrase in phrases("fr")}
    text = {"format": "underfoot-language", "version": 1, "decimal_mark": ",", "phrases": known}
    (folder / NAME).write_text(json.dumps(text))


def unsaid(text):
    """The words of a text that the language does not have."""
    return [word for word in re.findall(r"[^\W\d_]+", _KEPT.sub("", text)) if word != word.upper()]
