"""The Scenes workspace by real clicks and keys, on a window that plays the simulated floor."""

import threading

import numpy as np
import pytest
from on_screen import show
from PySide6.QtCore import QPoint, QPointF, Qt
from PySide6.QtGui import QImage, QPainter, QTransform
from PySide6.QtWidgets import QApplication
from windows import design, threads_that_make

from underfoot.engine.commands import Walk
from underfoot.engine.reports import given_up
from underfoot.floor.contacts import ContactTracker
from underfoot.floor.layout import default_floor
from underfoot.scenes import discover
from underfoot.scenes.pictures import Canvas
from underfoot.scenes.shapes import Disc, Lines, box
from underfoot.widgets import theme
from underfoot.widgets.scenes import workspace as scenes_workspace
from underfoot.widgets.scenes.painting import paint_shapes
from underfoot.widgets.scenes.panels import ScenePanel
from underfoot.widgets.session_display import LENT

LEFT = Qt.MouseButton.LeftButton


@pytest.fixture(scope="module")
def window(playing):
    return playing


@pytest.fixture
def scenes(window, qtbot):
    window.main_bar.tabs["Scenes"].click()
    made = window.workspaces["Scenes"]
    window.controller.send(Walk(False))
    yield made
    made.stop()


def start(scenes, qtbot, name):
    scenes.list.list.setCurrentRow(list(scenes.kinds).index(name))
    qtbot.mouseClick(scenes.panel.start, LEFT)
    qtbot.waitUntil(lambda: scenes.stage is not None)
    return scenes.stage.scene


def pixel(scenes, x_m, y_m):
    return scenes.view.to_screen().map(QPointF(x_m, y_m)).toPoint()


def test_a_button_is_pressed_by_a_foot_and_the_patch_comes_back(scenes, window, qtbot):
    session = window.controller.session
    scene = start(scenes, qtbot, "touch-widgets")
    assert session.patch.title == "Touch widgets"
    place = pixel(scenes, scene.button.x_m, scene.button.y_m)
    qtbot.mousePress(scenes.view, LEFT, pos=place)
    qtbot.waitUntil(lambda: scene.button.presses == 1)
    qtbot.waitUntil(lambda: bool(scenes.view.times.display_latency_s))
    qtbot.mouseRelease(scenes.view, LEFT, pos=place)
    qtbot.waitUntil(lambda: not scene.button.held_by)
    qtbot.waitUntil(lambda: "Button up" in scenes.panel.log.toPlainText())
    qtbot.waitUntil(lambda: "pictures a second" in scenes.panel.speed.text())
    assert all(0.0 < late_s < 60.0 for late_s in scenes.view.times.display_latency_s)
    window.controller.set_level(-33.0)  # the level is the window's as ever
    assert session.level_db == -33.0
    assert window.controller.lend() is None  # nobody else gets the session meanwhile
    assert not window.main_bar.target.isEnabled()
    assert window.status.session.endswith(LENT)  # or who looks for his patch in Design finds it silent
    qtbot.mouseClick(scenes.panel.start, LEFT)
    assert scenes.stage is None
    assert not window.status.session.endswith(LENT)
    assert scenes.panel.speed.text() == ""
    assert session.patch.title == "Hiss"
    assert window.main_bar.target.isEnabled()


def test_scenes_and_monitor_agree_on_whether_somebody_walks(scenes, window, qtbot):
    """Each had a state of its own: who stopped the walker in one was told by the other that it walks."""
    session, tabs, walker = window.controller.session, window.main_bar.tabs, window.workspaces["Monitor"].floor.walker
    tabs["Monitor"].click()
    assert not walker.isChecked()
    qtbot.mouseClick(walker, LEFT)
    assert session.target.walker
    tabs["Scenes"].click()
    assert scenes.panel.walker.isChecked()
    qtbot.mouseClick(scenes.panel.walker, LEFT, pos=QPoint(8, scenes.panel.walker.height() // 2))
    assert not session.target.walker


def test_a_scene_ends_the_loop_of_the_patch_and_starts_of_it_are_refused(scenes, window, qtbot):
    """The loop started the patch of whoever had the session: a study's stimulus, too."""
    canvas, bar = design(window).canvas, design(window).listen_bar
    repeats = window.controller.session.repeats
    window.workspaces.choose("Design")
    qtbot.keyClick(canvas, Qt.Key.Key_L)
    assert repeats.are_on
    window.workspaces.choose("Scenes")
    start(scenes, qtbot, "footprints")
    assert not repeats.are_on
    assert not bar.loop.isChecked()
    window.workspaces.choose("Design")
    for key in (Qt.Key.Key_P, Qt.Key.Key_L):
        window.show_message("")
        qtbot.keyClick(canvas, key)
        assert window.status.message == "A study or a scene has the session; end that first."
    assert not bar.loop.isChecked()
    window.workspaces.choose("Scenes")
    qtbot.mouseClick(scenes.panel.start, LEFT)
    assert scenes.stage is None


def test_panic_ends_a_scene(scenes, window, qtbot):
    start(scenes, qtbot, "footprints")
    window.panic()
    assert scenes.stage is None
    assert window.controller.session.patch.title == "Hiss"
    assert window.controller.session.memory.status.panic
    window.controller.play()


def test_a_scene_that_is_started_by_its_button_s_key_is_ended_by_return(scenes, qtbot):
    scenes.list.list.setCurrentRow(list(scenes.kinds).index("footprints"))
    scenes.panel.start.setFocus()
    qtbot.keyClick(scenes.panel.start, Qt.Key.Key_Space)
    qtbot.waitUntil(lambda: scenes.stage is not None)
    qtbot.keyClick(QApplication.focusWidget(), Qt.Key.Key_Return)
    assert scenes.stage is None
    start(scenes, qtbot, "footprints")
    scenes.panel.project.setFocus()
    qtbot.keyClick(scenes.panel.project, Qt.Key.Key_Escape)
    assert QApplication.focusWidget() is scenes.panel.start, "what Escape ended begins again from there"
    scenes.window().controller.play()


def test_a_scene_that_begins_before_the_engine_does_not_compile_in_the_window_s_thread(scenes, qtbot, monkeypatch):
    """The window stood for a minute and more. Here all is compiled: what is seen is who would compile first."""
    made_by = threads_that_make(ContactTracker, monkeypatch)
    start(scenes, qtbot, "touch-widgets")
    assert made_by[0] == "background"
    assert made_by[-1] == threading.main_thread().name


def test_a_parameter_is_changed_while_the_scene_plays(scenes, qtbot):
    scene = start(scenes, qtbot, "footprints")
    box_ = scenes.panel.editors["ground"].box
    box_.setFocus()
    qtbot.keyClick(box_, Qt.Key.Key_S)  # silent goes on to snow or sand
    qtbot.keyClick(box_, Qt.Key.Key_Down)
    box_.activated.emit(box_.currentIndex())
    assert scene.given["ground"] == box_.currentText() != "silent"
    scenes.change("ground", "silent")


def test_a_scene_that_fails_is_ended_and_not_the_window(scenes, window, qtbot):
    scene = start(scenes, qtbot, "frozen-pond")
    scene.step = lambda moment: 1 / 0
    qtbot.waitUntil(lambda: scenes.stage is None)
    assert "ZeroDivisionError" in scenes.panel.state.text()
    assert window.controller.session.patch.title == "Hiss"


def test_a_scene_ends_as_the_engine_is_given_up(scenes, window, qtbot, monkeypatch):
    """The last foot stood in its picture for good, and the target, which is to be chosen again, was locked."""
    controller, session = window.controller, window.controller.session
    start(scenes, qtbot, "footprints")
    with monkeypatch.context() as patch:
        patch.setattr(session, "poll", lambda: [given_up("engine", "signal 9", patch_waits=False)])
        controller.bridge.tick()
    assert scenes.stage is None
    assert scenes.panel.state.text() == "The engine has failed; choose the target again."
    assert window.main_bar.target.isEnabled()
    controller.opened.emit(controller.target)  # as where the workspace is made only now
    assert not scenes.panel.start.isEnabled()
    controller.bridge.detach()  # as where the target is chosen again
    controller.opened.emit(controller.target)
    assert scenes.panel.start.isEnabled()
    controller.bridge.attach(session, session.target.floor, session.target.rate)


def test_a_scene_that_fails_as_a_parameter_is_changed_is_ended(scenes, window, qtbot):
    scene = start(scenes, qtbot, "footprints")
    scene.change = lambda name, value: 1 / 0
    scenes.change("ground", "silent")
    assert scenes.stage is None
    assert "ZeroDivisionError" in scenes.panel.state.text()
    assert window.controller.session.patch.title == "Hiss"


@pytest.mark.parametrize("is_projected", [False, True], ids=["in the pane", "on the floor"])
def test_a_scene_whose_picture_fails_is_ended_and_not_the_program(scenes, window, qtbot, is_projected):
    scene = start(scenes, qtbot, "frozen-pond")
    if is_projected:
        scenes.project()
    scene.shapes = lambda: 1 / 0
    qtbot.waitUntil(lambda: scenes.stage is None)
    assert "ZeroDivisionError" in scenes.panel.state.text()
    assert window.controller.session.patch.title == "Hiss"


@pytest.mark.parametrize("method", ["__init__", "patch"])
def test_a_scene_that_fails_as_it_begins_gives_the_session_back(scenes, window, qtbot, monkeypatch, method):
    class Failing(scenes.kinds["footprints"]):
        """A plug-in's."""

    setattr(Failing, method, lambda *given: 1 / 0)
    monkeypatch.setattr(scenes, "kinds", {**scenes.kinds, "footprints": Failing})
    ask(scenes, qtbot, "footprints")
    qtbot.waitUntil(lambda: "ZeroDivisionError" in scenes.panel.state.text())
    assert scenes.panel.start.isEnabled()
    assert not window.controller.is_lent
    assert window.controller.session.patch.title == "Hiss"


def test_the_projection_is_true_to_scale_follows_keys_and_closes_by_escape(scenes, qtbot):
    scene = start(scenes, qtbot, "touch-widgets")
    qtbot.mouseClick(scenes.panel.project, LEFT)
    view = scenes.projection
    screen = view.screen()
    qtbot.waitUntil(lambda: view.isActiveWindow() and view.size() == screen.size())
    px_per_m = 1e3 * screen.geometry().width() / screen.physicalSize().width()

    def places():
        to_pixels = view.to_pixels()
        return to_pixels.map(QPointF(0.1, 0.1)), to_pixels.map(QPointF(0.3, 0.1))

    left, right = places()
    assert right.x() - left.x() == pytest.approx(0.2 * px_per_m)
    qtbot.keyClick(view, Qt.Key.Key_Plus)
    qtbot.keyClick(view, Qt.Key.Key_Right)
    scaled, _ = places()
    assert scaled != left
    assert scenes.window().settings.projector_scale == pytest.approx(1.01)
    for _ in range(90):
        qtbot.keyClick(view, Qt.Key.Key_Period)
    upper, lower = places()
    assert (lower.x() - upper.x(), lower.y() - upper.y()) == pytest.approx((0.0, 0.2 * 1.01 * px_per_m), abs=1e-6)
    qtbot.keyClick(view, Qt.Key.Key_0)
    assert places() == (left, right)
    corners = np.concatenate([tile.corners_m() for tile in scene.floor.tiles])
    middle = view.to_pixels().map(QPointF(*(0.5 * (corners.min(axis=0) + corners.max(axis=0)))))
    assert (middle.x(), middle.y()) == pytest.approx((view.width() / 2, view.height() / 2))
    qtbot.keyClick(view, Qt.Key.Key_Escape)
    assert scenes.projection is None


def test_a_projector_that_is_plugged_in_or_off_meanwhile_is_offered_or_no_more(scenes):
    app, offered = QApplication.instance(), scenes.panel.screen_choice
    for changed in (app.screenAdded, app.screenRemoved):
        offered.addItem("another projector")
        changed.emit(app.primaryScreen())
        assert offered.count() == len(app.screens())


def test_a_projection_waits_for_its_projector(scenes, qtbot):
    """One that is switched off at night left it before the window, without a pointer, and on no floor the next day."""
    app = QApplication.instance()
    start(scenes, qtbot, "frozen-pond")
    qtbot.mouseClick(scenes.panel.project, LEFT)
    projector = scenes.projection.screen()
    app.screenRemoved.emit(projector)
    assert scenes.projection.isHidden()
    app.screenAdded.emit(projector)
    assert scenes.projection.isFullScreen()
    qtbot.keyClick(scenes.projection, Qt.Key.Key_Escape)
    app.screenAdded.emit(projector)
    assert scenes.projection is None


def test_a_scene_of_the_command_line_plays_and_is_shown_on_the_floor_until_somebody_stops_it(
    window, qtbot, monkeypatch
):
    """An installation with a projector waited for clicks: three after each start of its computer, one after a failure,
    and one where the projector came after the window.
    """
    monkeypatch.setattr(scenes_workspace, "AGAIN_MS", 0)
    controller, app = window.controller, QApplication.instance()
    controller.stop()
    window.workspaces.choose("Monitor")
    window.perform("footprints", {"ground": "snow"})
    scenes = window.workspaces["Scenes"]
    assert scenes.stage is None

    def is_shown():
        return scenes.projection is not None and scenes.projection.isFullScreen()

    controller.opened.emit(controller.target)
    qtbot.waitUntil(is_shown)
    assert scenes.stage.scene.title == scenes.list.list.currentItem().text() == "Footprints"
    assert scenes.stage.scene.given["ground"] == scenes.panel.editors["ground"].value() == "snow"
    assert controller.is_playing
    for is_first in (True, False):  # of a monitor that is switched on later, it must not leave the projector
        scenes.projection.showNormal()
        app.screenAdded.emit(app.primaryScreen())
        assert is_shown() == is_first
    failing = scenes.stage.scene
    failing.step = lambda moment: 1 / 0
    qtbot.waitUntil(lambda: is_shown() and scenes.stage.scene is not failing)
    session = controller.session

    def reopen():  # as it does, with a session that no test leaves behind
        controller.bridge.detach()
        controller.opened.emit(controller.target)
        controller.bridge.attach(session, session.target.floor, session.target.rate)

    monkeypatch.setattr(controller, "reopen", reopen)
    with monkeypatch.context() as patch:
        patch.setattr(session, "poll", lambda: [given_up("engine", "signal 9", patch_waits=False)])
        controller.bridge.tick()
    assert not is_shown()
    qtbot.waitUntil(is_shown)
    scenes.stop()
    controller.opened.emit(controller.target)  # as of another target, chosen by somebody
    assert not scenes.is_making


def test_the_keys_of_the_projection_can_be_read_on_black_in_the_light_palette(scenes, qtbot):
    start(scenes, qtbot, "frozen-pond")
    qtbot.mouseClick(scenes.panel.project, LEFT)
    theme.choose_palette("light")
    try:
        picture = scenes.projection.grab().toImage()
    finally:
        theme.choose_palette("dark")
    rows = range(picture.height() - 4 * theme.GRID, picture.height())
    greys = {picture.pixelColor(x, y).lightness() for y in rows for x in range(picture.width())}
    assert min(greys) == 0
    assert max(greys) > 128
    width, edge = picture.width(), theme.GRID  # of a small projector both ends of the line were cut off
    sides = {picture.pixelColor(x, y).lightness() for y in rows for x in (*range(edge), *range(width - edge, width))}
    assert sides == {0}
    scenes.projection.close()


def test_a_scene_says_that_it_is_not_felt_yet(scenes, qtbot):
    start(scenes, qtbot, "touch-widgets")
    assert scenes.stage.is_felt or scenes.panel.state.text() == "Preparing its vibration…"
    qtbot.waitUntil(lambda: scenes.panel.state.text().startswith("button pressed"))
    assert scenes.stage.is_felt


def test_what_one_scene_did_is_not_said_of_another(scenes, qtbot):
    start(scenes, qtbot, "touch-widgets")
    scenes.panel.add_line("Button down, press 1")
    scenes.panel.show_speed(1.2, [], [])
    assert scenes.panel.speed.text() == "1 picture a second"
    qtbot.mouseClick(scenes.panel.start, LEFT)
    assert scenes.panel.state.text().startswith("button pressed")
    scenes.list.list.setCurrentRow(list(scenes.kinds).index("frozen-pond"))
    panel = scenes.panel
    assert (panel.state.text(), panel.speed.text(), panel.log.toPlainText()) == ("", "", "")
    assert panel.log.placeholderText()  # an empty box said nothing of what it is for
    assert panel.start.isEnabled()


def test_the_window_paints_what_films_have():
    floor = default_floor()
    shapes = [
        box(0.3, 0.3, 0.2, 0.1, "#3fc1c9"),
        Disc(0.4, 0.2, 0.05, "#ffffff", 0.5),
        Disc(0.2, 0.4, 0.06, "#f0a63c", rim_m=0.02),
        Lines(np.array([[[0.1, 0.1], [0.5, 0.45]]]), "#ff6259", 0.01),
    ]
    film = Canvas(floor, 400).paint(shapes).astype(int)
    image = QImage(film.shape[1], film.shape[0], QImage.Format.Format_RGB888)
    image.fill(0)
    corners = np.concatenate([tile.corners_m() for tile in floor.tiles])
    low = corners.min(axis=0) - 0.05
    scale = 400 / (np.ptp(corners[:, 0]) + 0.1)
    painter = QPainter(image)
    to_pixels = QTransform.fromTranslate(0, film.shape[0]).scale(scale, -scale).translate(-low[0], -low[1])
    paint_shapes(painter, shapes, to_pixels)
    painter.end()
    rows = np.frombuffer(image.constBits(), np.uint8).reshape(image.height(), image.bytesPerLine())
    window = rows[:, : 3 * image.width()].reshape(film.shape).astype(int)
    assert np.abs(window - film).mean() < 1.0
    assert (np.abs(window - film).max(axis=2) > 64).mean() < 0.01  # but for edges


def test_tab_goes_down_the_panel_of_a_scene(qtbot):
    """What happened came before the parameters above it, which are made anew for each scene."""
    panel = ScenePanel()
    panel.resize(panel.width(), 800)
    qtbot.addWidget(panel)
    show(qtbot, panel)
    kind = discover()["footprints"]
    panel.show_kind(kind, {name: parameter.check(parameter.default) for name, parameter in kind.parameters.items()})
    panel.start.setFocus()
    passed = []
    while panel.focusWidget() is not panel.log:
        passed.append(panel.focusWidget().mapTo(panel, QPoint()).y())
        qtbot.keyClick(panel.focusWidget(), Qt.Key.Key_Tab)
    assert passed == sorted(passed)
    assert len(passed) > len(kind.parameters) + 1


def test_every_scene_is_listed_with_its_picture(scenes):
    listed = scenes.list.list
    assert [listed.item(row).text() for row in range(listed.count())] == [k.title for k in discover().values()]
    assert not any(listed.item(row).icon().isNull() for row in range(listed.count()))
    assert scenes.view.rect().contains(QPoint(10, 10))


@pytest.fixture
def held_scene(scenes, monkeypatch):
    """Footprints, whose making takes until the event is set, as it does while kernels are compiled."""
    may_go = threading.Event()

    class Held(scenes.kinds["footprints"]):
        def __init__(self, *given):
            may_go.wait(60.0)
            super().__init__(*given)

    monkeypatch.setattr(scenes, "kinds", {**scenes.kinds, "footprints": Held})
    yield may_go
    may_go.set()


def ask(scenes, qtbot, name):
    scenes.list.list.setCurrentRow(list(scenes.kinds).index(name))
    qtbot.mouseClick(scenes.panel.start, LEFT)


def test_another_scene_that_is_chosen_while_one_is_made_plays_instead_of_it(scenes, qtbot, held_scene):
    ask(scenes, qtbot, "footprints")
    assert scenes.panel.state.text() == "Preparing the scene…"
    ask(scenes, qtbot, "frozen-pond")
    held_scene.set()
    qtbot.waitUntil(lambda: scenes.stage is not None)
    assert scenes.stage.scene.title == scenes.panel.title.text() == "Frozen pond"


def test_a_scene_that_is_made_has_what_was_changed_meanwhile_and_does_not_play_after_panic(
    scenes, window, qtbot, held_scene
):
    ask(scenes, qtbot, "footprints")
    window.panic()
    assert scenes.panel.start.isEnabled()
    window.controller.play()
    ask(scenes, qtbot, "footprints")
    scenes.change("ground", "snow")
    held_scene.set()
    qtbot.waitUntil(lambda: scenes.stage is not None)
    assert scenes.stage.scene.given["ground"] == "snow"
    scenes.stop()
    scenes.change("ground", "silent")
    assert not scenes.is_making
