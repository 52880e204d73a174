"""The participant's window in another language: nothing that the program says there stays English."""

import pytest
from loud_language import NAME, unsaid, write_loud_language
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QApplication, QLabel, QLineEdit, QPushButton, QWidget

from underfoot.studies.phase import Phase

WC = {"patch": "stimulus-wc", "scaled_by": "gain.gain", "measured_m_s2": 6.5, "level_m_s2": 0.5}
MASS = {"name": "mass", "text": "MASS?", "kind": "number", "low": 30.5, "high": 200, "unit": "KG"}
FOOT = {"name": "foot", "text": "FOOT?", "kind": "choice", "options": ["right", "left"]}
COUNT = {"name": "count", "text": "COUNT?", "kind": "count", "high": 10}
LOUD = {"name": "loud", "text": "LOUD?", "kind": "number", "low": -40, "high": 0, "unit": "DB"}
TENS = {"name": "tens", "text": "TENS?", "kind": "choice", "options": ["5 A", "10 B"]}
RETURN, SPACE, RIGHT, FIVE = Qt.Key.Key_Return, Qt.Key.Key_Space, Qt.Key.Key_Right, Qt.Key.Key_5


def trials(kind, parameters, **stage):
    return {"id": kind, "kind": "trials", "most_trials": 1, "method": {"kind": kind, "parameters": parameters}, **stage}


def asks(id, *questions):
    return {"id": id, "kind": "questions", "questions": questions}


class Reader:
    """Who reads every page of the participant's window, what a screen reader says included, and goes on."""

    def __init__(self, bench):
        self.bench, self.read = bench, set()

    def reads(self, *phases):
        """Read the page once it is in one of these phases; all of its words are the language's."""
        self.bench.until(*phases)
        QApplication.processEvents()  # what was added to the page is shown
        window = self.bench.person
        seen = [part for part in window.findChildren(QWidget) if part.isVisibleTo(window)]
        words = {part.text() for part in seen if isinstance(part, QLabel | QPushButton | QLineEdit)}
        words |= {part.placeholderText() for part in seen if isinstance(part, QLineEdit)}
        words |= {text for part in (window, *seen) for text in (part.accessibleName(), part.accessibleDescription())}
        assert [word for text in words for word in unsaid(text)] == []
        self.read |= words

    def types(self, *keys):
        shown = self.bench.person.shown
        for key in keys:
            self.bench.key(key)
        self.bench.wait(lambda: self.bench.person.shown != shown)

    def moves(self, key):
        """Be told to move what is felt, move it, and keep it once the page knows that it was moved."""
        self.bench.key(RETURN)
        self.reads(Phase.PAGE, Phase.ANSWERING)
        self.bench.key(key)
        self.bench.wait(lambda: not self.bench.person.hint.text().startswith("MOVE IT"))
        self.types(RETURN)

    def feels(self):
        """Begin a trial by a key, and read what is asked."""
        self.reads(Phase.READY)
        self.bench.key(SPACE)
        self.reads(Phase.ANSWERING)


@pytest.fixture
def reader(bench):
    write_loud_language(bench.folder)
    return Reader(bench)


def test_questions_are_in_the_studys_language_and_so_is_what_is_refused(reader):
    bench = reader.bench
    stages = [{"id": "consent", "kind": "consent"}, asks("loud", LOUD), asks("count", COUNT), asks("tens", TENS)]
    bench.choose(stages=stages, stimuli={"WC": WC}, participant=[MASS, FOOT], language=NAME)
    reader.reads(Phase.PAGE)
    reader.types(Qt.Key.Key_1)
    reader.reads(Phase.PAGE)
    field = bench.person.form.fields["mass"]
    for typed in ("", "HEAVY", "70,5"):
        bench.qtbot.keyClicks(field, typed)
        bench.click(bench.person.go)
        reader.reads(Phase.PAGE)
        field.selectAll()
    bench.click(bench.person.form.buttons[1])
    bench.click(bench.person.go)
    bench.wait(lambda: bench.person.form.sliders)
    reader.reads(Phase.PAGE)
    bench.key(RETURN)
    reader.reads(Phase.PAGE)
    bench.key(RIGHT)
    reader.reads(Phase.PAGE)
    reader.types(RETURN)
    for _ in (COUNT, TENS):
        bench.wait(lambda: bench.person.form.has_long_numbers)
        reader.reads(Phase.PAGE)
        reader.types(FIVE, RETURN)
    reader.reads(Phase.END)
    assert {
        "PLEASE ANSWER: MASS? (30,5 TO 200 KG)",
        "MASS? THE ANSWER IS 'HEAVY'; ALLOWED: 30,5 TO 200 KG",
        "MOVE THE SLIDER TO ANSWER: LOUD?",
        "−39,2 DB",
    } < reader.read
    assert {"LEFT", "PRESS 1 FOR YES OR 2 FOR NO, OR CLICK.", "TYPE 5 OR 10 AND PRESS RETURN, OR CLICK."} < reader.read
    assert bench.entries()[1].answers == {"mass": 70.5, "foot": "left"}
    assert bench.workspace.experimenter.page.text().startswith("The end: every answer is kept.")


def test_what_is_felt_is_asked_for_in_the_studys_language(reader):
    bench = reader.bench
    stages = [
        {"id": "learn", "kind": "learn"},
        trials("constant-stimuli", {}, feedback=True, practice=True),
        trials("absolute-identification", {"sessions": 1, "repeats": 1}, feedback=True),
        trials("rating", {}, plays=2),
        trials("free-labels", {}, plays=2),
        trials("magnitude-estimation", {}),
        {"id": "rest", "kind": "pause", "seconds": 60},
    ]
    stimuli = {"WC": {**WC, "correct": "yes"}, "X": {"correct": "yes"}}
    bench.choose(stages=stages, stimuli=stimuli, language=NAME)
    reader.reads(Phase.PAGE)
    reader.types(RETURN)
    for keys in ((Qt.Key.Key_2,), (Qt.Key.Key_1,), (RIGHT, RETURN)):
        reader.feels()
        reader.types(*keys)
    for name, words in (("label", "HUM"), ("magnitude", "0,5")):
        reader.feels()
        bench.qtbot.keyClicks(bench.person.form.fields[name], words)
        reader.types(RETURN)
    reader.reads(Phase.PAUSE)
    bench.click(bench.workspace.experimenter.next)
    reader.reads(Phase.END)
    assert "THE LAST ONE: WRONG." in reader.read
    assert bench.entries()[-2].answers == {"magnitude": 0.5}


def test_what_is_moved_is_asked_for_in_the_studys_language(reader):
    bench = reader.bench
    stages = [
        {"id": "level", "kind": "level", "stimulus": "WC"},
        trials("adjustment", {"followed": ["WC"]}),
        trials("adjustment", {"followed": ["WC"], "standard": "S"}) | {"id": "equal", "start": "step"},
    ]
    bench.choose(stages=stages, stimuli={"WC": WC, "S": WC}, language=NAME)
    reader.reads(Phase.PAGE)
    for begins, key, told, moved in (
        (lambda: None, Qt.Key.Key_Up, "IT GOES NO FURTHER", Qt.Key.Key_Down),
        (reader.feels, SPACE, "", RIGHT),
        (reader.feels, SPACE, "THE ONE TO COMPARE WITH", RIGHT),
    ):
        begins()
        bench.key(key)
        bench.wait(lambda told=told: bench.person.title.text() == told)
        reader.moves(moved)
    reader.reads(Phase.END)
    assert {"MOVE IT TO ANSWER: LOWER IT UNTIL YOU ONLY JUST FEEL IT.", "IT GOES NO FURTHER", "MUCH LESS"} < reader.read
    assert {"PLAY IT AGAIN", "PLAY THE OTHER ONE", "THE ONE TO SET", "THE ONE TO COMPARE WITH"} < reader.read


def test_steps_and_answers_by_foot_are_asked_for_in_the_studys_language(reader):
    bench = reader.bench
    foot = {"by": "halves", "tiles": ["t1"]}
    stages = [
        trials("staircases", {"followed": ["WC"], "empty_every": 2}, most_trials=2, practice=True, start="step"),
        trials("constant-stimuli", {}, foot=foot),
    ]
    bench.choose(stages=stages, stimuli={"WC": WC}, language=NAME)
    for _ in range(2):
        reader.reads(Phase.READY)
        bench.key(SPACE)
        reader.reads(Phase.ANSWERING)
        reader.types(Qt.Key.Key_1)
    reader.feels()
    reader.types(Qt.Key.Key_Escape)
    reader.reads(Phase.STOPPED)
    assert "PLEASE SPEAK TO THE EXPERIMENTER." in reader.read
    assert bench.workspace.experimenter.state.text().startswith("Stopped by the participant.")
