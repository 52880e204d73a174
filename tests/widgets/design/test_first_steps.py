"""The three steps of a first start, taken by hand."""

from on_screen import show
from PySide6.QtCore import QPoint, Qt

from underfoot.engine.target import Target
from underfoot.floor.layout import default_floor
from underfoot.widgets.design.first_steps import FirstSteps
from underfoot.widgets.window import MainWindow


def test_three_things_done_by_hand_tick_the_three_steps(qtbot, tmp_path):
    window = MainWindow(tmp_path, Target(default_floor()))
    qtbot.addWidget(window, before_close_func=lambda w: w.leave())
    show(qtbot, window)
    design = window.workspaces["Design"]
    steps = design.canvas.findChild(FirstSteps)
    assert steps.isVisible()
    assert design.canvas.rect().contains(steps.geometry())
    window.controller.stop()
    qtbot.keyClick(window, Qt.Key.Key_Space)
    assert steps.remaining == ["press", "turn"]
    qtbot.mouseClick(design.preview.pad, Qt.MouseButton.LeftButton)
    assert steps.remaining == ["turn"]
    noise = next(node.id for node in design.patch().nodes if node.type == "noise")
    design.canvas.patch_scene.select([noise])
    slider = next(editor.slider for editor in design.inspector.editors.values() if hasattr(editor, "slider"))
    middle = slider.rect().center()
    qtbot.mousePress(slider, Qt.MouseButton.LeftButton, pos=middle)
    qtbot.mouseMove(slider, middle + QPoint(20, 0))
    qtbot.mouseRelease(slider, Qt.MouseButton.LeftButton, pos=middle + QPoint(20, 0))
    assert steps.remaining == []
    qtbot.mouseClick(steps.close_button, Qt.MouseButton.LeftButton)
    assert not steps.isVisible()
    assert window.settings.first_steps_done


def test_they_are_not_shown_again(qtbot, tmp_path):
    window = MainWindow(tmp_path, Target(default_floor()))
    window.settings.first_steps_done = True
    qtbot.addWidget(window, before_close_func=lambda w: w.leave())
    show(qtbot, window)
    assert not window.workspaces["Design"].canvas.findChild(FirstSteps).isVisible()


def test_a_resized_canvas_keeps_them_in_view(qtbot, tmp_path):
    window = MainWindow(tmp_path, Target(default_floor()))
    qtbot.addWidget(window, before_close_func=lambda w: w.leave())
    show(qtbot, window)
    canvas = window.workspaces["Design"].canvas
    window.resize(1024, 640)
    steps = canvas.findChild(FirstSteps)
    qtbot.waitUntil(lambda: canvas.rect().contains(steps.geometry()))
