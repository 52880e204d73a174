"""The Scenes workspace: choose, adjust, start and stop a scene, shown here and on a projector."""

from collections.abc import Iterator, Mapping
from typing import Any

from PySide6.QtCore import Qt, QTimer
from PySide6.QtGui import QGuiApplication
from PySide6.QtWidgets import QHBoxLayout, QWidget

from underfoot.engine.commands import PressTile, Walk
from underfoot.engine.reports import NOTHING, OutputChanged, Report
from underfoot.engine.session import Session
from underfoot.floor.layout import Floor
from underfoot.scenes import discover
from underfoot.scenes.moments import MOMENT_S
from underfoot.scenes.scene import Scene
from underfoot.scenes.stage import Stage, why_ended
from underfoot.widgets import theme
from underfoot.widgets.background import BackgroundWorker, Task
from underfoot.widgets.controls import true_scale
from underfoot.widgets.controls.scrolled import scrolling
from underfoot.widgets.projecting_workspace import ProjectingWorkspace
from underfoot.widgets.scenes.panels import SceneList, ScenePanel
from underfoot.widgets.scenes.views import PaintTimes, SceneProjection, SceneView
from underfoot.widgets.session.controller import SessionController
from underfoot.widgets.session.footstep_tracker import load_tracking
from underfoot.widgets.session.settings import Settings
from underfoot.widgets.workspace import WorkspaceContext

SHORTCUTS = (
    ("Start or stop the scene", "Return, with the focus on the list"),
    ("Press with a foot, on a simulated floor", "Mouse button"),
    true_scale.SHORTCUT,
)
POLL_MS = 5
"""Interval at which a scene reads force samples; shorter than that of pictures, because its answers are felt."""
AGAIN_MS = 5000
"""Time after which a scene that failed where nobody is begins anew."""
_BESIDE_TICKS = 6
"""Ticks between two paintings of the pane while a projector shows the scene."""
_SPEED_TICKS = 20
"""Ticks between two updates of the latencies shown."""


class ScenesWorkspace(ProjectingWorkspace):
    """Plays one scene on the window's session, instead of the window's patch."""

    shortcuts = SHORTCUTS
    projection: SceneProjection | None

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(Settings(), parent)
        theme.fill(self, "ground")
        self.kinds = discover()
        self._values: dict[str, dict[str, Any]] = {
            name: {key: p.check(p.default) for key, p in kind.parameters.items()} for name, kind in self.kinds.items()
        }
        self.chosen = next(iter(self.kinds))
        self.stage: Stage | None = None
        self._controller: SessionController | None = None
        self._maker = BackgroundWorker(self)
        self._ticks = 0
        self._has_news = False
        self._is_unattended = self._awaits_projector = False
        self._poll_timer = QTimer(self, timerType=Qt.TimerType.PreciseTimer, interval=POLL_MS)
        self._poll_timer.timeout.connect(self._poll)
        self.make(self._parts())

    def _parts(self) -> Iterator[None]:
        self.list = SceneList(self.kinds.values())
        yield
        self.view, self.panel = SceneView(), ScenePanel()
        row = QWidget()
        outer, layout = QHBoxLayout(self), QHBoxLayout(row)
        for line in (outer, layout):
            line.setContentsMargins(0, 0, 0, 0)
            line.setSpacing(0)
        outer.addWidget(scrolling(row))
        layout.addWidget(self.list)
        layout.addWidget(self.view, 1)
        layout.addWidget(self.panel)
        self.focused_first = self.list
        yield
        self._connect()
        self.list.list.setCurrentRow(0)

    # --- as a workspace ---

    def attach(self, context: WorkspaceContext) -> None:
        self._controller, self._settings = context.controller, context.settings
        bridge = context.controller.bridge
        bridge.reported.connect(self._add_reports)
        bridge.ticked.connect(self._tick)
        bridge.output_changed.connect(self._use_output)
        context.controller.opened.connect(self._opened)
        context.controller.released.connect(self.stop)
        app = QGuiApplication.instance()
        assert isinstance(app, QGuiApplication)
        for changed in (app.screenAdded, app.screenRemoved):
            changed.connect(self._show_screens)
        app.screenAdded.connect(self._use_projector)
        self._opened()

    def set_active(self, active: bool) -> None:
        if active:
            self._show_screens()
            self._show_walker()

    def silence(self) -> None:
        """End the scene on panic; the window's patch returns."""
        self.stop()

    def close_down(self) -> None:
        """End the scene."""
        self.stop()
        self._maker.join()

    # --- the choice ---

    def choose(self, name: str) -> None:
        """Choose a scene by its name; another that plays, or is being made, ends."""
        if name != self.chosen:
            self.stop()
        self.chosen = name
        self.panel.show_kind(self.kinds[name], self._values[name])
        self._show_availability()

    def change(self, parameter: str, value: object) -> None:
        """Change a parameter of the chosen scene, also while it plays."""
        self._values[self.chosen][parameter] = value
        if self.stage is not None:
            try:
                self.stage.scene.change(parameter, value)
            except Exception as error:
                self._fail(why_ended(error))

    # --- playing ---

    @property
    def is_making(self) -> bool:
        """Whether a scene is being made, which loads its kernels, and will play then."""
        return self._maker.is_busy

    def start(self) -> None:
        """Make the chosen scene in a thread, then play it; a failure is shown."""
        controller = self._controller
        if controller is None or controller.session is None or self._why_not():
            return
        if self.stage is not None or self.is_making:
            return
        kind, floor, given = self.kinds[self.chosen], controller.session.target.floor, dict(self._values[self.chosen])
        self.panel.state.setText("Preparing the scene…")
        if self.panel.start.hasFocus():
            self.list.list.setFocus()  # where Return ends it; a disabled button would hand the focus to its neighbour
        self.panel.start.setEnabled(False)

        def make(_: Task) -> list[Scene | str]:
            try:
                load_tracking()  # of which the window's thread would wait for what the engine has not compiled yet
                return [kind(floor, given)]
            except Exception as error:
                return [why_ended(error)]

        self._maker.compute(make)

    def perform(self, name: str, given: Mapping[str, Any]) -> None:
        """Play a scene with these parameters, and show it on the screen of the projector, once a session is open.

        For where nobody is: the output is opened, too, and the scene begins anew after a failure, until it is stopped.
        """
        self._values[name].update(given)
        self.list.list.setCurrentRow(list(self.kinds).index(name))
        self.choose(name)
        self._is_unattended, self._awaits_projector = True, len(QGuiApplication.screens()) == 1

    def stop(self) -> None:
        """End the scene, and play the earlier patch; a scene that is being made will not play."""
        self._is_unattended = self._awaits_projector = False
        self._end()

    def _end(self) -> None:
        if self.is_making:
            self._maker.stop()
            self._show_availability()
        stage, self.stage = self.stage, None
        self._close_projection()
        if stage is None or self._controller is None:
            return
        if self._controller.session is stage.session:
            stage.close()
        self._controller.take_back()
        self.view.show_scene(None)
        self._show_availability()
        self.panel.state.setText(stage.scene.state)

    def project(self) -> None:
        """Show the scene at its true size on the chosen screen."""
        if self.stage is None:
            return
        if self.projection is None:
            self.projection = SceneProjection(self.stage.scene, self._settings.placement)
            self.projection.times.clock = self._session_s
            self.projection.failed.connect(self._end_failed, Qt.ConnectionType.QueuedConnection)
            self._follow_projection(self.projection)
        screens = QGuiApplication.screens()
        self.projection.show_on(screens[min(max(self.panel.screen_choice.currentIndex(), 0), len(screens) - 1)])

    def _take(self, made: list[Scene | str]) -> None:
        """Play a scene that has been made, or show why it could not be."""
        (scene,) = made
        if isinstance(scene, str):
            self._fail(scene)
        else:
            self._play(scene)

    def _play(self, scene: Scene) -> None:
        controller = self._controller
        session = controller.lend(only_patch=True) if controller is not None else None
        if controller is None or session is None:
            self._show_availability()
            return
        try:
            for name, value in self._values[self.chosen].items():
                if value != scene.given[name]:
                    scene.change(name, value)  # set while it was made
            self.stage = Stage(session, scene)
        except Exception as error:
            controller.take_back()
            self._fail(why_ended(error))
            return
        self.view.times = PaintTimes()
        self.view.times.clock = self._session_s
        self.view.show_scene(scene)
        if not self.stage.is_felt:
            self.panel.state.setText("Preparing its vibration…")
        self.panel.log.clear()
        self._poll_timer.start()
        self._show_availability()
        if self._is_unattended:
            controller.play()
            self._show_screens()
            self.project()

    def _fail(self, why: str) -> None:
        self._end()
        self._show_availability()
        self.panel.state.setText(why)
        if self._is_unattended:
            QTimer.singleShot(AGAIN_MS, self, self._begin_again)

    def _begin_again(self) -> None:
        """Start a scene that failed where nobody is; a session without an engine is opened anew, which starts it."""
        if self._is_unattended and self._controller is not None:
            (self._controller.reopen if self._controller.bridge.engine_failure else self.start)()

    def _end_failed(self, error: Exception) -> None:
        """End a scene whose picture failed, some time after that was painted."""
        if self.stage is not None:
            self._fail(why_ended(error))

    def _add_reports(self, reports: list[Report]) -> None:
        if self.stage is not None:
            self.stage.take(reports)

    @property
    def _painted(self) -> SceneProjection | SceneView:
        """What shows the scene to whoever steps: the view beside, while the projector is away."""
        return self.projection if self.projection is not None and self.projection.isVisible() else self.view

    def _poll(self) -> None:
        """Step the scene through new force samples."""
        stage = self.stage
        if stage is None:
            self._poll_timer.stop()
            return
        try:
            moments = stage.tick()
        except Exception as error:
            self._fail(why_ended(error))
            return
        painted = self._painted
        for moment in moments:
            for contact in moment.down:
                # Whoever stood there before the scene began, or is told of late, counts from this moment.
                painted.times.add_onset(max(contact.start_s, moment.began_s - MOMENT_S))
        self._has_news |= bool(moments)

    def _tick(self) -> None:
        """Show the scene's state and picture."""
        stage = self.stage
        if stage is None:
            return
        painted = self._painted
        while stage.said:
            self.panel.add_line(stage.said.popleft())
        self._ticks += 1
        if self._has_news:
            self._has_news = False
            if self.projection is not None:
                self.projection.update()
            if self.projection is None or self._ticks % _BESIDE_TICKS == 0:
                self.view.update()
        if stage.is_felt and self._ticks % _SPEED_TICKS == 0:
            self.panel.state.setText(stage.scene.state)
            self.panel.show_speed(painted.times.pictures_per_s, stage.latencies_s, painted.times.display_latency_s)

    # --- the session ---

    def _show_screens(self) -> None:
        self.panel.show_screens([screen.name() or "screen" for screen in QGuiApplication.screens()])

    def _use_projector(self) -> None:
        """Move a scene that began where nobody is, on the only screen, to the first one that comes."""
        if self._awaits_projector and self.projection is not None:
            self._awaits_projector = False
            self.project()

    def _show_walker(self) -> None:
        session = self._session()
        self.panel.walker.setChecked(session is not None and session.target.walker)

    def _session(self) -> Session | None:
        return self._controller.session if self._controller is not None else None

    def _session_s(self) -> float:
        return self._controller.played_s if self._controller is not None else 0.0

    def _use_output(self, report: OutputChanged) -> None:
        """End a scene whose engine is given up: nobody would be seen to leave, and its target could not be chosen."""
        if report.where == NOTHING:
            self._fail(self._why_not())

    def _opened(self) -> None:
        self._end()
        session = self._session()
        floor: Floor | None = session.target.floor if session is not None else None
        self.view.show_floor(floor)
        self.view.can_press = session is not None and session.target.kind == "simulator"
        self.panel.walker.setVisible(self.view.can_press)
        self._show_walker()
        self._show_availability()
        if self._is_unattended:
            self.start()

    def _why_not(self) -> str:
        """Return why no scene can play; "" if one can."""
        if self._controller is None or self._controller.session is None:
            return "The session is not open yet."
        failure = self._controller.bridge.engine_failure
        return f"{failure[:1].upper()}{failure[1:]}." if failure else ""

    def _show_availability(self) -> None:
        self.panel.show_playing(self.stage is not None, self._why_not())

    def _send(self, command: PressTile | Walk) -> None:
        session = self._session()
        if session is not None:
            session.send(command)

    def _connect(self) -> None:
        panel = self.panel
        self.list.chosen.connect(self.choose)
        self.list.list.itemActivated.connect(lambda _: self.stop() if self.stage is not None else self.start())
        panel.start_requested.connect(self.start)
        panel.stop_requested.connect(self.stop)
        panel.project_requested.connect(self.project)
        panel.changed.connect(self.change)
        panel.walker_requested.connect(lambda on: self._send(Walk(on)))
        self.view.failed.connect(self._end_failed, Qt.ConnectionType.QueuedConnection)
        self.view.pressed.connect(lambda *press: self._send(PressTile(*press)))
        self._maker.found.connect(self._take)
