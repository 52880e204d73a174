"""Workspaces: how they are found, and that the window follows what they declare."""

import subprocess
import sys

import pytest
from on_screen import show
from PySide6.QtCore import Qt, QTimer
from PySide6.QtGui import QAction, QKeySequence
from PySide6.QtWidgets import QLabel
from windows import dialog_of, quiet_window

from underfoot.engine.target import Target
from underfoot.errors import BadFile
from underfoot.floor.layout import default_floor
from underfoot.widgets import workspace_stack
from underfoot.widgets.dialogs.shortcuts import ShortcutsDialog, keys_of
from underfoot.widgets.session.settings import Settings
from underfoot.widgets.window import MainWindow
from underfoot.widgets.workspace import Workspace, WorkspaceDeclaration, discover


def test_names_and_keys_differ_and_tabs_are_in_the_order_of_keys():
    found = discover()
    assert len({declared.name for declared in found}) == len({declared.key for declared in found}) == len(found)
    assert [declared.key for declared in found] == sorted(declared.key for declared in found)
    assert found[0].name == "Design"


def test_finding_workspaces_does_not_import_what_they_are_made_of():
    code = (
        "import sys\n"
        "from underfoot.widgets.workspace import discover\n"
        "discover()\n"
        "names = 'design', 'monitor', 'calibrate'\n"
        "print([name for name in names if f'underfoot.widgets.{name}.workspace' in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


class Whole(Workspace):
    """A workspace that uses all that a workspace can."""

    shortcuts = (("Do the whole", "W"),)

    def __init__(self, context, parent):
        super().__init__(parent)
        self.folder, self.context, self.events = context.folder, None, []
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.action = QAction("Do the whole", self)

    def attach(self, context):
        self.context = context
        self.patch_at_first = context.open_patch.patch

    def menu_actions(self):
        return [self.action]

    def set_active(self, active):
        self.events.append(active)

    def silence(self):
        self.events.append("silent")

    def close_down(self):
        self.events.append("closed")


def test_the_window_follows_what_a_workspace_declares(qtbot, tmp_path, monkeypatch):
    declared = WorkspaceDeclaration("Whole", "Ctrl+9", Whole, focus="drawing")
    monkeypatch.setattr(workspace_stack, "discover", lambda: (*discover(), declared))
    window = MainWindow(tmp_path, Target(default_floor()))
    qtbot.addWidget(window, before_close_func=lambda w: w.leave())
    show(qtbot, window)
    window.workspaces.create_all()
    whole = window.workspaces["Whole"]
    assert (whole.folder, whole.context.controller) == (tmp_path, window.controller)
    assert whole.patch_at_first == window.open_patch.patch
    assert whole.patch_at_first.nodes
    assert list(window.main_bar.tabs) == [declared.name for declared in workspace_stack.discover()]
    assert whole.action in window.menu.actions()
    qtbot.keyClick(window, Qt.Key.Key_9, Qt.KeyboardModifier.ControlModifier)
    assert window.workspaces.chosen == "Whole"
    assert whole.isVisible()
    qtbot.mouseClick(window.main_bar.tabs["Design"], Qt.MouseButton.LeftButton)
    assert window.workspaces.chosen == "Design"
    whole.notified.emit("A line")
    assert window.status.message == "A line"
    whole.warnings_changed.emit(["A warning"])
    qtbot.mouseClick(window.main_bar.warnings, Qt.MouseButton.LeftButton)
    assert window.workspaces.chosen == "Whole"
    window.panic()
    qtbot.keyClick(window, Qt.Key.Key_F1)
    texts = [label.text() for label in dialog_of(window, ShortcutsDialog).findChildren(QLabel)]
    at = texts.index("WHOLE, WITH THE FOCUS ON THE DRAWING")
    assert texts[at + 1 : at + 3] == ["Do the whole", "W"]
    window.leave()
    assert whole.events == [False, True, False, True, "silent", "closed"]


class Failing(Workspace):
    """A workspace of which a part cannot be made while `fails`."""

    fails = True

    def __init__(self, context, parent):
        super().__init__(parent)
        self.make(self.parts())

    def parts(self):
        yield
        if self.fails:
            raise BadFile("the disk is full")
        self.is_whole = True


@pytest.mark.parametrize("is_opened", [True, False])
def test_a_workspace_of_which_a_part_fails_is_made_anew_when_it_is_opened_again(
    qtbot, tmp_path, monkeypatch, is_opened
):
    declared = WorkspaceDeclaration("Failing", "Ctrl+9", Failing)
    monkeypatch.setattr(workspace_stack, "discover", lambda: (declared, *discover()))
    Settings(workspace="Design").save(tmp_path)
    stack = quiet_window(qtbot, tmp_path).workspaces
    with pytest.raises(BadFile):
        stack.choose("Failing") if is_opened else [stack.create_next() for _ in range(9)]
    assert stack.chosen == "Design"
    monkeypatch.setattr(Failing, "fails", False)
    stack.choose("Failing")
    assert stack["Failing"].is_whole  # the half of it was shown


def test_keys_that_no_keyboard_has_are_not_listed(qapp):
    """Under X11, Cut is F20, too: a key of Sun's keyboards; and a key Cut, of a few others."""
    cut, other = QAction("Cut…"), QAction("Other")
    cut.setShortcuts([QKeySequence(keys) for keys in ("F20", "Ctrl+X", "Shift+Del", "Cut")])
    other.setShortcut(QKeySequence("F16"))
    assert keys_of([cut, other]) == [("Cut", "Ctrl+X, Shift+Del")]


def test_the_code_of_a_workspace_is_imported_in_parts():
    code = (
        "import sys; from underfoot.widgets.workspace import discover\n"
        "declared = {one.name: one for one in discover()}['Experiment']\n"
        "before, parts, most = len(sys.modules), 0, 0\n"
        "while declared.load():\n"
        "    ours = [name for name in sys.modules if name.startswith('underfoot.')]\n"
        "    parts, most, before = parts + 1, max(most, len(ours) - before if parts else 0), len(ours)\n"
        "print(parts, most, 'underfoot.widgets.experiment.workspace' in sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=120, check=True)
    parts, most, is_loaded = done.stdout.split()
    assert int(parts) > 50
    assert int(most) < 20, "so many modules at once stop the window"
    assert is_loaded == "True"


def test_a_workspace_that_is_only_built_is_attached_when_it_is_shown_and_when_the_window_closes(qtbot, tmp_path):
    Settings(workspace="Monitor").save(tmp_path)
    window = quiet_window(qtbot, tmp_path)
    stack = window.workspaces

    def built():
        for _ in range(200):
            for workspace in stack.findChildren(Workspace, options=Qt.FindChildOption.FindDirectChildrenOnly):
                if stack.indexOf(workspace) < 0:
                    return workspace
            stack.create_next()
        raise AssertionError("no workspace is built before it is attached")

    window.hide()  # then it would show again what was built meanwhile, over the workspace that is chosen
    shown = built()
    window.show()
    assert not shown.isVisible()
    timers = stack.findChildren(QTimer, options=Qt.FindChildOption.FindDirectChildrenOnly)
    assert [timer.isActive() for timer in timers] == [True], "each request continues by itself"
    assert not hasattr(shown, "inspector")
    window.workspaces.choose("Design")
    assert window.workspaces["Design"] is shown
    assert shown.inspector.isVisible()
    waited_for, parts = built(), 0
    window.grab()  # --screenshot, which also resizes what is hidden
    while stack.indexOf(waited_for) < 0:
        stack.create_next()
        parts += 1
    assert waited_for is window.workspaces["Calibrate"]
    assert parts > 3, "to make all of it at once would stop the window"
    left = built()
    assert not hasattr(left, "running")
    window.leave()
    assert left is window.workspaces["Experiment"]
    assert stack.indexOf(left) >= 0
    assert not left.running.has_participant


@pytest.mark.parametrize(
    ("name", "order"),
    [
        ("Design", ["Nodes", "Search nodes", "Canvas", "Loop", "Copy A to B", "Waveform", "Title"]),
        ("Monitor", ["Walker", "Floor from above", "Follow", "Levels", "Clear", "Footsteps"]),
    ],
)
def test_tab_goes_from_left_to_right_and_down(qtbot, tmp_path, name, order):
    window = quiet_window(qtbot, tmp_path)
    window.workspaces.choose(name)
    stops, stop = [], window.nextInFocusChain()
    while stop is not window:
        is_within = window.workspaces[name].isAncestorOf(stop) and stop.isVisible()
        if is_within and stop.focusPolicy() & Qt.FocusPolicy.TabFocus:
            stops.append(stop.accessibleName() or getattr(stop, "text", str)())
        stop = stop.nextInFocusChain()
    assert sorted(order, key=stops.index) == order
