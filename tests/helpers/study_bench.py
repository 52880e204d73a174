"""The Experiment workspace with the hands of experimenter and participant."""

from made_studies import protocol_text
from PySide6.QtCore import Qt

from underfoot.experiments.store import SessionFile
from underfoot.studies.phase import Phase

LEFT, SLOW_MS = Qt.MouseButton.LeftButton, 240_000


class Bench:
    """The workspace, and the hands of experimenter and participant."""

    def __init__(self, window, qtbot, folder):
        self.window, self.qtbot, self.folder = window, qtbot, folder
        self.workspace = window.workspaces["Experiment"]
        self.workspace.sessions.root = folder / "studies"

    @property
    def runner(self):
        return self.workspace.running.runner

    @property
    def person(self):
        return self.workspace.running.window_of_participant

    def wait(self, holds):
        self.qtbot.waitUntil(lambda: bool(holds()), timeout=SLOW_MS)

    def until(self, *phases):
        self.wait(lambda: self.runner.phase in phases)
        self.wait(lambda: self.person is None or self.person.shown[1] == str(self.runner.phase))

    def click(self, button):
        assert button.isEnabled()
        self.qtbot.mouseClick(button, LEFT)

    def choose_from(self, button, words):
        """Click a button that has a menu, and the choice of these words in it."""
        self.click(button)
        menu = button.menu()
        action = next(action for action in menu.actions() if action.text() == words)
        self.qtbot.mouseClick(menu, LEFT, pos=menu.actionGeometry(action).center())

    def key(self, key):
        self.qtbot.keyClick(self.person, key)

    def rate(self, trials):
        """Begin, feel and rate so many trials by keys, each a step above the middle."""
        for _ in range(trials):
            self.until(Phase.READY)
            self.key(Qt.Key.Key_Space)
            self.until(Phase.ANSWERING)
            self.key(Qt.Key.Key_Right)
            self.key(Qt.Key.Key_Return)

    def choose(self, **protocol):
        """Open a protocol from a file, and begin it for a participant whose id is typed."""
        path = self.folder / "made.json"
        path.write_text(protocol_text(present_s=0.2, **protocol))
        self.workspace.study_list.open_protocol(path)
        self.begin()

    def begin(self, participant="P1"):
        self.type_id(participant)
        self.click(self.workspace.start.begin_button)
        self.wait(lambda: self.person is not None and self.person.isVisible())

    def type_id(self, participant):
        self.workspace.start.participant.clear()
        self.qtbot.keyClicks(self.workspace.start.participant, participant)

    def entries(self, participant="P1"):
        file = SessionFile.open(self.workspace.sessions.root / "made" / f"{participant}.session")
        entries = file.entries()
        file.close()
        return entries
