"""The presets beside the canvas, tried with keys and mouse."""

import threading
from pathlib import Path

import numpy as np
import pytest
from made_patches import hum
from on_screen import show
from PySide6.QtCore import QPoint, Qt
from PySide6.QtGui import QContextMenuEvent
from PySide6.QtTest import QSignalSpy
from PySide6.QtWidgets import QApplication, QMenu, QMessageBox

from underfoot.engine.levels import levels_of
from underfoot.engine.preset_pictures import PresetPicture
from underfoot.nodes import REGISTRY
from underfoot.patch import preset_files
from underfoot.patch.patch import Patch
from underfoot.widgets.design import preset_pictures
from underfoot.widgets.design.preset_panel import PresetPanel


@pytest.fixture
def own(tmp_path):
    folder = tmp_path / "presets"
    folder.mkdir()
    (folder / "humming.json").write_bytes(hum().dumps().replace(b'"title": ""', b'"title": "Humming"'))
    (folder / "broken.json").write_text('{"title": 3}')
    return folder


@pytest.fixture
def panel(qtbot, own):
    panel = PresetPanel()
    panel.bind(own, [])
    qtbot.addWidget(panel)
    panel.resize(220, 700)
    panel.refresh()
    show(qtbot, panel)
    yield panel
    panel.close_down()


def names(panel):
    return [preset.name for preset in panel.list.presets()]


def test_words_narrow_the_list_to_what_says_them(panel, qtbot):
    assert len(names(panel)) == len(preset_files.patches()) + 1
    qtbot.keyClicks(panel.field, "sand dry")
    assert names(panel) == ["Sand dry"]
    panel.field.selectAll()
    qtbot.keyClicks(panel.field, "no such thing")
    assert names(panel) == []
    assert panel.about.text() == "No preset has these words."


def test_titles_come_before_tags_and_those_before_comments_whole_words_before_parts(tmp_path):
    says = {
        "a": ("Ice rink", "", "sand"),
        "b": ("Sandal", "sand", ""),
        "c": ("Dry sand", "", ""),
        "d": ("Ice", "sand", ""),
    }
    presets = [
        preset_files.Preset(tmp_path / name, "", title, title, comment, tags=(tags,))
        for name, (title, tags, comment) in says.items()
    ]
    assert [preset.title for preset in preset_files.ranked(presets, "sand")] == [
        "Dry sand",
        "Sandal",
        "Ice",
        "Ice rink",
    ]
    assert [preset.title for preset in preset_files.ranked(presets, "ice sand")] == ["Ice", "Ice rink"]


def test_ones_own_are_there_and_what_is_no_patch_is_left_out(panel, qtbot):
    mine = panel.filters.buttons()[2]
    qtbot.mouseClick(mine, Qt.MouseButton.LeftButton)
    assert names(panel) == ["Humming"]


def test_a_preset_is_heard_when_one_rests_on_it_and_escape_goes_back(panel, qtbot):
    heard = QSignalSpy(panel.audition_changed)
    panel.field.setFocus()
    for _ in range(3):
        qtbot.keyClick(panel.field, Qt.Key.Key_Down)
    qtbot.waitUntil(lambda: heard.count() == 1)  # not the two that were passed by
    assert heard.at(0)[0].name == "Wood"
    qtbot.keyClick(panel.field, Qt.Key.Key_Escape)
    assert heard.at(1)[0] is None


def test_nothing_is_heard_while_hear_is_off(panel, qtbot):
    qtbot.mouseClick(panel.audition_button, Qt.MouseButton.LeftButton)
    heard = QSignalSpy(panel.audition_changed)
    panel.field.setFocus()
    qtbot.keyClick(panel.field, Qt.Key.Key_Down)
    qtbot.wait(300)
    assert heard.count() == 0
    assert panel.list.current().name == "Gravel"


def test_enter_opens_what_was_found(panel, qtbot):
    qtbot.keyClicks(panel.field, "ice")
    with qtbot.waitSignal(panel.chosen) as chosen:
        qtbot.keyClick(panel.field, Qt.Key.Key_Return)
    assert chosen.args[0].path == preset_files.patches()["material-ice"]


def test_a_star_is_kept(panel, qtbot):
    item = panel.list.item(0)
    place = panel.list.visualItemRect(item)
    qtbot.mouseClick(
        panel.list.viewport(), Qt.MouseButton.LeftButton, pos=QPoint(place.right() - 4, place.center().y())
    )
    with qtbot.waitSignal(panel.chosen) as chosen:
        qtbot.keyClick(panel.list, Qt.Key.Key_Return)
    assert chosen.args[0].name == "Gravel"
    qtbot.mouseClick(panel.filters.buttons()[1], Qt.MouseButton.LeftButton)
    assert names(panel) == ["Gravel"]
    panel.list.setFocus()
    panel.list.step(1)
    qtbot.keyClick(panel.list, Qt.Key.Key_Asterisk)
    assert names(panel) == []


def test_only_ones_own_can_be_deleted_and_only_after_a_question(panel, qtbot, own):
    said = QSignalSpy(panel.notified)
    panel.list.setFocus()
    panel.list.step(1)
    qtbot.keyClick(panel.list, Qt.Key.Key_Delete)
    assert "came with the program" in said.at(said.count() - 1)[0]
    qtbot.keyClicks(panel.field, "humming")
    panel.list.setFocus()
    panel.list.step(1)
    qtbot.keyClick(panel.list, Qt.Key.Key_Delete)
    box = panel.findChild(QMessageBox)
    assert "Humming" in box.text()
    qtbot.keyClick(box, Qt.Key.Key_Escape)
    assert (own / "humming.json").exists()
    qtbot.keyClick(panel.list, Qt.Key.Key_Delete)
    box = next(box for box in panel.findChildren(QMessageBox) if box.isVisible())
    qtbot.mouseClick(box.button(QMessageBox.StandardButton.Yes), Qt.MouseButton.LeftButton)
    assert not (own / "humming.json").exists()
    assert names(panel) == []


def test_a_right_click_on_a_preset_offers_what_keys_do(panel, qtbot):
    presets, rows = panel.list, {}
    for row in range(presets.count()):
        rows[presets.item(row).text()] = presets.item(row)

    def texts(name, use=""):
        place = presets.visualItemRect(rows[name]).center()
        qtbot.mouseClick(presets.viewport(), Qt.MouseButton.RightButton, pos=place)
        at = presets.viewport().mapToGlobal(place)
        QApplication.sendEvent(presets.viewport(), QContextMenuEvent(QContextMenuEvent.Reason.Mouse, place, at))
        menu = next((menu for menu in presets.findChildren(QMenu) if menu.isVisible()), None)
        found = [action.text().partition("\t")[0] for action in menu.actions()] if menu else []
        if use:
            action = menu.actions()[found.index(use)]
            qtbot.mouseClick(menu, Qt.MouseButton.LeftButton, pos=menu.actionGeometry(action).center())
        elif menu:
            menu.close()
        return found

    assert texts("Gravel") == ["Open", "Put into the patch", "Keep under ★"]
    assert texts("MATERIALS") == []
    with qtbot.waitSignal(panel.insertion_requested) as asked:
        texts("Gravel", "Put into the patch")
    assert asked.args[0].name == "Gravel"
    presets.scrollToItem(rows["Humming"])
    assert texts("Humming", "Delete…")[-1] == "Delete…"
    question = panel.findChild(QMessageBox)
    assert "Humming" in question.text()
    question.reject()
    with qtbot.waitSignal(presets.starred) as starred:
        texts("Humming", "Keep under ★")
    assert starred.args[0].name == "Humming"


def test_pictures_come_and_say_what_the_levels_say(panel, qtbot):
    path = preset_files.patches()["stimulus-wc"]
    came = []
    panel.pictures.arrived.connect(lambda *picture: came.append(picture))  # a waiter would be gone before the next one
    qtbot.waitUntil(lambda: bool(came))
    from underfoot.engine.preset_pictures import picture_of

    levels = levels_of(Patch.load(path, REGISTRY))
    picture = picture_of(path)
    assert picture.peak_m_s2 == pytest.approx(levels.commanded.peak_m_s2, rel=0.05)
    assert picture.envelope.max() == 1.0


def test_kept_pictures_are_there_without_a_process(qtbot, monkeypatch):
    from underfoot.engine.preset_pictures import picture_of

    paths = list(preset_files.patches().values())[:3]
    kept = [picture_of(path).peak_m_s2 for path in paths]
    given = []
    monkeypatch.setattr(preset_pictures, "in_parallel", lambda work, jobs, *_, **__: given.append(jobs))
    pictures, came = preset_pictures.PresetPictures(), []
    pictures.arrived.connect(lambda path, picture: came.append((path, picture.peak_m_s2)))
    pictures.ask(paths)
    qtbot.waitUntil(lambda: len(came) == len(paths) or bool(given))
    pictures.close()
    assert came == list(zip(paths, kept, strict=True))
    assert given == []


def test_what_is_said_to_be_heard_is_heard(panel, qtbot):
    said = QSignalSpy(panel.notified)
    panel.list.setFocus()
    panel.list.step(1)
    qtbot.waitUntil(lambda: said.count() == 1)
    assert said.at(0)[0].startswith(f"Hearing {panel.list.current().title}.")
    qtbot.keyClick(panel.list, Qt.Key.Key_Escape)
    assert said.at(1)[0] == "Hearing your patch again."
    panel.list.setFocus()
    panel.list.step(1)
    qtbot.keyClick(panel.list, Qt.Key.Key_Return)
    assert "undo brings your patch back" in said.at(said.count() - 1)[0]


def test_what_is_asked_for_while_pictures_are_computed_comes_after_them(qtbot, monkeypatch):
    given, may_end = [], threading.Event()

    def computed(work, jobs, *_, **__):
        given.append(jobs)
        assert may_end.wait(60.0)
        yield from enumerate([PresetPicture(np.zeros(96), 1.0, None)] * len(jobs))

    monkeypatch.setattr(preset_pictures, "in_parallel", computed)
    monkeypatch.setattr(preset_pictures, "kept_picture", lambda path: None)
    monkeypatch.setattr(preset_pictures, "SETTLED_S", 0.0)
    pictures, came = preset_pictures.PresetPictures(), []
    pictures.arrived.connect(lambda path, picture: came.append(path))
    old, new = Path("old.json"), Path("new.json")
    pictures.ask([old])
    qtbot.waitUntil(lambda: given == [[old]])
    pictures.ask([old, new])
    may_end.set()
    qtbot.waitUntil(lambda: came == [old, new])
    pictures.close()
