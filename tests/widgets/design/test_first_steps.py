"""The three steps of a first start, taken by hand."""

from on_screen import show
from PySide6.QtCore import QPoint, Qt

from underfoot.engine.target import Target
from underfoot.floor.layout import default_floor
from underfoot.widgets.design.first_steps import ALL_DONE_TEXT, STEPS, FirstSteps
from underfoot.widgets.window import MainWindow


def test_three_things_done_by_hand_tick_the_three_steps(qtbot, tmp_path):
    window = MainWindow(tmp_path, Target(default_floor()))
    qtbot.addWidget(window, before_close_func=lambda w: w.leave())
    show(qtbot, window)
    design = window.workspaces["Design"]
    steps = design.findChild(FirstSteps)
    assert steps.isVisible()
    assert steps.text.text() == STEPS["play"]
    window.controller.stop()
    qtbot.keyClick(window, Qt.Key.Key_Space)
    assert steps.remaining == ["press", "turn"]
    qtbot.mouseClick(design.preview.pad, Qt.MouseButton.LeftButton)
    assert steps.remaining == ["turn"]
    assert steps.text.text() == STEPS["turn"]
    assert "drag the slider" in STEPS["turn"]  # a drag on the number itself selects its text
    noise = next(node.id for node in design.patch().nodes if node.type == "noise")
    design.canvas.patch_scene.select([noise])
    slider = next(editor.slider for editor in design.inspector.editors.values() if hasattr(editor, "slider"))
    middle = slider.rect().center()
    qtbot.mousePress(slider, Qt.MouseButton.LeftButton, pos=middle)
    qtbot.mouseMove(slider, middle + QPoint(20, 0))
    qtbot.mouseRelease(slider, Qt.MouseButton.LeftButton, pos=middle + QPoint(20, 0))
    assert steps.remaining == []
    assert steps.text.text() == ALL_DONE_TEXT
    assert window.settings.first_steps_done
    qtbot.mouseClick(steps.close_button, Qt.MouseButton.LeftButton)
    assert not steps.isVisible()


def test_first_steps_are_put_away_by_hand(qtbot, tmp_path):
    window = MainWindow(tmp_path, Target(default_floor()))
    qtbot.addWidget(window, before_close_func=lambda w: w.leave())
    show(qtbot, window)
    steps = window.workspaces["Design"].findChild(FirstSteps)
    qtbot.mouseClick(steps.close_button, Qt.MouseButton.LeftButton)
    assert not steps.isVisible()
    assert window.settings.first_steps_done


def test_first_steps_that_are_done_are_not_shown_again(qtbot, tmp_path):
    window = MainWindow(tmp_path, Target(default_floor()))
    window.settings.first_steps_done = True
    qtbot.addWidget(window, before_close_func=lambda w: w.leave())
    show(qtbot, window)
    assert not window.workspaces["Design"].findChild(FirstSteps).isVisible()


def test_first_steps_cover_nothing_and_no_word_of_them_is_cut_in_the_smallest_window(qtbot, tmp_path):
    window = MainWindow(tmp_path, Target(default_floor()))
    qtbot.addWidget(window, before_close_func=lambda w: w.leave())
    window.setMinimumSize(0, 0)  # the screen of the tests is 800 wide
    window.resize(1024, 640)
    show(qtbot, window)
    canvas, steps = window.workspaces["Design"].canvas, window.findChild(FirstSteps)
    for step in list(steps.remaining):
        qtbot.waitUntil(lambda: steps.text.height() >= steps.text.heightForWidth(steps.text.width()))
        assert steps.text.text() == STEPS[step]
        assert steps.mapTo(window, steps.rect().bottomLeft()).y() < canvas.mapTo(window, canvas.rect().topLeft()).y()
        steps.mark_done(step)
