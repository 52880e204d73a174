"""The Calibrate workspace on the screen, with the small calibration of `calibrate_samples`, and its user."""

from calibrate_samples import CALIBRATIONS, weighing
from on_screen import show
from PySide6.QtCore import Qt

from underfoot.engine.target import Target
from underfoot.floor.layout import default_floor
from underfoot.widgets.calibrate.measuring import Pace
from underfoot.widgets.calibrate.workspace import CalibrateWorkspace
from underfoot.widgets.session.settings import Settings

LEFT = Qt.MouseButton.LeftButton


class CalibrateDriver:
    """A workspace on the screen, with methods to operate it."""

    def __init__(self, qtbot, root, *, kind="simulator", gate=None, failure=None):
        self.qtbot, self.made, self.said, self.written, self.wanted = qtbot, [], [], [], []
        self.settings = Settings()
        hardware = kind == "serial"
        self.workspace = made = CalibrateWorkspace(
            root, self.settings, CALIBRATIONS, Pace(0.0, 0.0), weighing(self.made, hardware, gate, failure)
        )
        qtbot.addWidget(made, before_close_func=lambda w: w.close_down())
        made.notified.connect(self.said.append)
        made.profile_changed.connect(lambda *what: self.written.append(what))
        made.release_requested.connect(lambda: self.wanted.append("release"))
        made.reopen_requested.connect(lambda: self.wanted.append("reopen"))
        made.set_target(Target(default_floor(), kind=kind))
        made.resize(1280, 726)
        show(qtbot, made)
        self.click(made.choice.cards["response"])

    @property
    def wizard(self):
        return self.workspace.wizard

    @property
    def page(self):
        return self.wizard.snapshot.page.key if self.wizard.snapshot else ""

    def click(self, widget):
        """Click a button, which may have to wait for the rig before it is enabled."""
        assert widget.isVisible()
        self.wait(widget.isEnabled)
        self.qtbot.mouseClick(widget, LEFT)

    def wait(self, holds):
        self.qtbot.waitUntil(lambda: bool(holds()))

    def begin(self):
        self.click(self.workspace.overview.begin)
        self.wait(lambda: self.page == "setup")

    def go(self, page):
        """Click Continue, whatever its label, until this page is shown."""
        while self.page != page:
            before = self.wizard.snapshot.page
            self.click(self.wizard.going)
            self.wait(
                lambda before=before: (self.page, self.wizard.snapshot.page.questions) != (before.key, before.questions)
            )

    def files(self):
        return sorted(path.name for path in self.workspace.profiles.folder.rglob("*") if path.is_file())

    def file(self, tile="t1"):
        """Return the file of a tile's profile, in an existing folder."""
        self.workspace.profiles.folder.mkdir(parents=True, exist_ok=True)
        return self.workspace.profiles.folder / f"{tile}.json"
