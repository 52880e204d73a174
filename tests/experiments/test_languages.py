"""Languages of participants' pages: whole, of what the program says, and kept with a session."""

import ast
import json
import re
from contextlib import closing
from pathlib import Path

import pytest
from loud_language import phrases
from made_studies import first_answers, made_protocol, protocol_text, walked

from underfoot.errors import BadFile, BadValue
from underfoot.experiments.draft import Draft
from underfoot.experiments.languages import language_of, names_of_languages
from underfoot.experiments.protocol import Protocol
from underfoot.experiments.questions import typed_answer, yes_or_no
from underfoot.experiments.store import SessionFile
from underfoot.experiments.study import Study
from underfoot.parameters import Number, ask
from underfoot.patch import preset_files

FRENCH, ROOT = language_of("fr"), Path(__file__).resolve().parents[2]
SAID_IN = ("workbench/parameters.py", "workbench/commands/participant.py", "workbench/experiments/**/*.py",
           "workbench/studies/*.py", "widgets/experiment/*.py")  # fmt: skip


def own(folder, **fields):
    """Write a laboratory's language beside its protocols, and return its name."""
    (folder / "languages").mkdir(exist_ok=True)
    text = {"format": "underfoot-language", "version": 1, **fields}
    (folder / "languages" / "ours.json").write_text(json.dumps(text))
    return "languages/ours.json"


def texts_in(*nodes):
    """The texts in a source, or in parts of it."""
    found = (one for node in nodes for one in ast.walk(node))
    return {one.value for one in found if isinstance(one, ast.Constant) and isinstance(one.value, str)}


def said_by(node):
    """The texts of a part of a source that participants are to read: a hint, or what is to be said."""
    match node:
        case ast.Call(func=ast.Name(id="Phrase" | "say")) | ast.Call(func=ast.Attribute(attr="_words" | "say")):
            return texts_in(*node.args[:1])
        case ast.Assign(targets=[target]) if "hint" in ast.unparse(target):
            return texts_in(node.value)
        case ast.FunctionDef(name=name, body=[_, *rest]) if "hint" in name:
            return texts_in(*rest)
    return set()


def test_languages_have_what_the_program_says_to_participants_and_nothing_else():
    """What is not marked in the sources, as a page's title, the pages show: tests of the window and of the terminal."""
    trees = [ast.parse(path.read_text()) for place in SAID_IN for path in sorted(ROOT.glob(place))]
    said = set().union(*(said_by(node) for tree in trees for node in ast.walk(tree)))
    said = {text for text in said if re.match(r"[A-Z{]", text) and re.search("[a-z]", re.sub("{.*?}", "", text))}
    assert {"Now back.", "It goes on by itself."} <= said
    for name in preset_files.languages():
        language_of(name)  # which refuses one that lacks some, or has other values
        assert said <= phrases(name).keys() == phrases("fr").keys() <= texts_in(*trees)


def test_the_programs_words_are_the_languages_and_the_protocols_and_answers_stay():
    protocol = made_protocol("constant-stimuli", {"blocks": 1, "question": "Senti ?"}, feedback=True)
    pages = walked(Study(protocol, "P1"), first_answers)
    (felt,) = pages[0].questions
    assert [FRENCH.say(text) for text in (felt.doc, *felt.options)] == ["Senti ?", "oui", "non"]
    assert [typed_answer(felt, text, FRENCH) for text in ("oui", "o", "2")] == ["yes", "yes", "no"]
    assert typed_answer(yes_or_no("felt", ""), "y") == "yes"
    mass = ask("mass", Number(70.0, 30.5, 200.0, doc="Votre poids ?", unit="kg"))
    assert typed_answer(mass, "70,5 kg", FRENCH) == 70.5
    with pytest.raises(BadValue, match=r"allowed: 30\.5 to 200 kg") as refused:
        typed_answer(mass, "lourd", FRENCH)
    assert FRENCH.say(*refused.value.args) == "Votre poids ? La réponse est 'lourd'\u00a0; permis\u00a0: 30,5 à 200 kg"
    assert protocol.without_words() == Protocol.loads(protocol.dumps()).without_words()


@pytest.mark.parametrize(
    ("fields", "why"),
    [
        (
            {"phrases": {"Go on": "Weiter"}},
            f"ours.json lacks 'One moment' and {len(phrases('fr')) - 2} more phrases; add it, or name a",
        ),
        ({"like": "fr", "phrases": {"Go onn": "X"}}, "phrases has 'Go onn'; allowed: what the program says, such as"),
        ({"like": "fr", "phrases": {"Go on": ""}}, "'Go on' is ''; allowed: text, with the values none"),
        ({"like": "fr", "phrases": {"Trial {number}": "Essai"}}, "is 'Essai'; allowed: text, with the values {number}"),
        ({"like": "fr", "phrases": {"Trial {number}": "{number:9}"}}, "allowed: text, with the values {number}"),
        ({"like": "fr", "phrases": {"Trial {number}": "{"}}, "is '{'; allowed: text, with the values {number}"),
        ({"like": "es"}, "$.like is 'es'; allowed: en, de, fr, or none"),
        ({"decimal_mark": "x"}, "$.decimal_mark is"),
    ],
)
def test_what_is_wrong_in_a_language_is_one_line(fields, why, tmp_path):
    with pytest.raises(BadFile) as refused:
        Protocol.loads(protocol_text(language=own(tmp_path, **fields)), "p.json", tmp_path)
    assert str(refused.value).startswith("p.json: $.language: ")
    assert why in str(refused.value)
    assert "\n" not in str(refused.value)


def test_a_language_that_is_not_there_is_refused(tmp_path):
    for name in ("es", "../fr.json"):
        with pytest.raises(BadFile, match=r"\$.language: .*; allowed: "):
            Protocol.loads(protocol_text(language=name), folder=tmp_path)


def test_a_session_keeps_the_words_that_it_was_begun_with_and_a_copy_of_a_study_takes_them(tmp_path):
    name = own(tmp_path, like="fr", phrases={"Go on": "On continue"})
    assert names_of_languages(tmp_path)["ours"] == name  # the form offers it
    protocol = Protocol.loads(protocol_text(language=name), folder=tmp_path)
    SessionFile.create(tmp_path / "a.session", protocol, "P1", tmp_path).close()
    (tmp_path / "copies").mkdir()
    copy = Draft.of(protocol, tmp_path / "copies")
    copy.take_patches(tmp_path)
    own(tmp_path, like="de")
    with closing(SessionFile.open(tmp_path / "a.session")) as file:
        assert not file.is_of(protocol, tmp_path)
        begun, folder = file.as_begun(tmp_path)
        kept = language_of(begun.language, folder)
    for found in (kept, language_of(copy.raw["language"], copy.folder)):
        assert (found.say("Go on"), found.say("yes"), found.number("0.5")) == ("On continue", "oui", "0,5")
    copy.folder = tmp_path / "copies"
    copy.raw["language"] = name
    copy.take_patches(tmp_path)  # another of that name
    assert copy.raw["language"] == "languages/ours-2.json"
