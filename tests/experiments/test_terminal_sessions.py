"""What an experimenter types at a session in a terminal, beside answers."""

from contextlib import closing

from made_studies import TD, protocol_text

from underfoot.experiments.store import SessionFile

AGE = {"name": "age", "text": "How old are you?", "kind": "count", "low": 18, "high": 99}


def test_notes_are_confirmed_and_answers_taken_back(typing, tmp_path):
    """A note was kept without a word, and one of no words, too; of a wrong age the report told nothing."""
    method = {"kind": "free-labels", "parameters": {"named": ["TD"]}}
    stage = {"id": "main", "kind": "trials", "method": method}
    study = protocol_text(stages=[stage], participant=[AGE], stimuli={"TD": TD}, present_s=0.1)
    (tmp_path / "a.json").write_text(study)
    command = ["experiment", tmp_path / "a.json", "--participant", "P", "--session", tmp_path / "p.session"]
    typed = (
        ("How old are you", "52"),
        ("Trial 1", "repeat it is 25"),
        ("How old are you", "25"),
        ("Trial 1", "note"),
        ("note shoes changed", ""),
        ("remind you of", "note of a flute"),
        ("remind you of", "a flute"),
    )
    printed = typing(command, typed)
    at = printed.index("Noted: of a flute\n")
    assert printed[at + 1].startswith("What does it remind you of?")
    with closing(SessionFile.open(tmp_path / "p.session")) as file:
        kept = [(dict(entry.answers), entry.spoiled) for entry in file.entries()]
        notes = [(note.entry, note.text) for note in file.notes()]
    assert notes[-2:] == [(1, "answer of participant taken back: it is 25"), (2, "of a flute")]
    assert kept == [({"age": 52}, "it is 25"), ({"age": 25}, ""), ({"label": "a flute"}, "")]
