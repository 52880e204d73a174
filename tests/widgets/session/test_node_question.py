"""Opening a patch with a node in a file beside it: the question, the answer, and the node that is missing."""

from long_recording import write_recording
from made_studies import protocol_text
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QMessageBox
from windows import LONG_MS, choose_file, design, dialog_of, hiss, quiet_window

from underfoot.floor.layout import default_floor
from underfoot.nodes import REGISTRY
from underfoot.patch.effective import without_missing
from underfoot.patch.patch import Patch
from underfoot.patch.preset_files import OWN, Preset
from underfoot.widgets.session.settings import Settings


def answer(qtbot, window, word):
    """Click the button of this word in the question that is asked."""
    question = dialog_of(window, QMessageBox)
    button = next(one for one in question.buttons() if one.text() == word)
    qtbot.mouseClick(button, Qt.MouseButton.LeftButton)
    return question


def preset(path):
    """A preset that the user saved."""
    return Preset(path, OWN, path.stem, path.stem)


def test_a_node_is_run_and_offered_once_the_person_has_agreed(qtbot, beside):
    window = quiet_window(qtbot, beside.folder / "kept")
    offered = design(window).palette_panel.list
    window.open_patch.open(beside.patch)
    assert beside.runs == 0
    question = answer(qtbot, window, "Run it")
    assert str(beside.file) in question.text()
    assert f"{beside.file.stat().st_size:,} bytes" in question.text()
    assert "with your rights" in question.informativeText()
    assert beside.runs == 1
    design(window).palette_panel.field.setText("hum of mine")
    assert offered.current() == "hum-of-mine"
    design(window).canvas.patch_scene.select(["hum"])
    assert design(window).inspector.editors["strength"].value() == 2.5
    window.open_patch.new()
    window.open_patch.open(beside.patch)  # not asked a second time
    assert window.open_patch.patch.title == "Hum"
    assert not question.isVisible()
    window.settings.save(beside.folder)
    assert len(Settings.load(beside.folder).run_code) == 1


def test_another_file_is_asked_about_again_and_is_what_is_run_then(qtbot, beside):
    window = quiet_window(qtbot, beside.folder / "kept")
    window.open_patch.open(beside.patch)
    answer(qtbot, window, "Run it")
    first = REGISTRY["hum-of-mine"]
    beside.write(sign="-1.0")
    window.open_patch.open(beside.patch)
    assert beside.runs == 1
    answer(qtbot, window, "Do not")
    assert REGISTRY["hum-of-mine"].missing  # the file that was agreed to is not there any more
    assert beside.runs == 1
    beside.write(sign="-2.0")
    window.open_patch.open(beside.patch)
    answer(qtbot, window, "Run it")
    assert beside.runs == 2
    assert REGISTRY["hum-of-mine"] is not first


def test_without_consent_the_node_is_missing_says_why_and_is_saved_as_it_is(qtbot, beside):
    window = quiet_window(qtbot, beside.folder / "kept")
    window.open_patch.open(beside.patch)
    answer(qtbot, window, "Do not")
    assert beside.runs == 0
    assert "hum-of-mine is missing" in window.status.message
    assert "nobody has agreed" in window.status.message
    before = beside.patch.read_bytes()
    patch = window.open_patch.patch
    assert [node.id for node in without_missing(patch, REGISTRY).nodes] == ["out"]
    assert [node.id for node in window.controller.patch.nodes] == ["out"]
    design(window).palette_panel.field.setText("hum of mine")
    assert design(window).palette_panel.list.current() == ""
    design(window).canvas.patch_scene.select(["hum"])
    design(window).document.edit(patch.move({"hum": (10.0, 0.0)}), "Move")
    window.open_patch.save()
    assert Patch.unchecked(beside.patch.read_bytes(), "saved") == Patch.unchecked(before, "first").move(
        {"hum": (10.0, 0.0)}
    )


def test_a_broken_file_and_work_that_was_left_behind_lose_nothing(qtbot, beside):
    beside.file.write_text("1 / 0")
    first = quiet_window(qtbot, beside.folder / "kept", beside.patch)
    answer(qtbot, first, "Run it")
    assert "ZeroDivisionError: division by zero" in first.status.message
    patch = first.open_patch.patch
    edited = patch.move({"hum": (10.0, 0.0)})
    design(first).document.edit(edited, "Move")
    first.leave()
    REGISTRY.pop("hum-of-mine")  # as in a new process
    second = quiet_window(qtbot, beside.folder / "kept")
    assert second.open_patch.patch == edited


def test_a_preset_that_is_listened_to_is_asked_about_first(qtbot, beside):
    window = quiet_window(qtbot, beside.folder / "kept")
    plain = beside.patch.with_name("plain.json")
    hiss().save(plain)
    browsing = design(window).browsing
    browsing._side.presets.heard.emit(preset(plain))
    assert window.controller.patch.title == "Hiss"  # it needs no custom node: no question
    browsing._side.presets.heard.emit(preset(beside.patch))
    assert beside.runs == 0
    answer(qtbot, window, "Do not")
    assert "needs" in window.status.message
    assert window.controller.patch.title == "Hiss"
    beside.write(sign="-1.0")
    browsing._side.presets.heard.emit(preset(beside.patch))
    answer(qtbot, window, "Run it")
    assert beside.runs == 1
    assert window.controller.patch.title == "Hum"
    assert len(Settings.load(beside.folder / "kept").run_code) == 1  # at once: the window may be killed


def test_a_recording_is_asked_about_before_it_is_played_through_its_own_patch(qtbot, beside):
    window = quiet_window(qtbot, beside.folder / "kept")
    desk = window.workspaces["Recordings"]
    about = {"patch": beside.patch.read_text(), "folder": str(beside.folder)}
    window.open_file(write_recording(beside.folder / "a.underfoot", 0.5, default_floor(1, 1), about=about))
    qtbot.waitUntil(lambda: desk.content is not None, timeout=LONG_MS)
    desk.play_or_stop()
    assert beside.runs == 0
    assert not desk.player.is_playing
    answer(qtbot, window, "Run it")
    assert beside.runs == 1
    assert desk.player.is_playing
    assert window.controller.patch.title == "Hum"


def test_a_study_is_asked_about_and_a_copy_of_it_takes_the_node_along(qtbot, beside):
    protocol = beside.folder / "study.json"
    protocol.write_text(protocol_text(title="Hums", stimuli={"hum": {"patch": "hum.json"}}))
    window = quiet_window(qtbot, beside.folder / "kept")
    desk = window.workspaces["Experiment"]
    desk.open_protocol(protocol)
    assert beside.runs == 0
    answer(qtbot, window, "Run it")
    assert beside.runs == 1
    assert desk.study.protocol.title == "Hums"
    desk.make_own()
    copied = beside.folder / "kept" / "protocols" / "patches" / "nodes" / beside.file.name
    assert copied.read_bytes() == beside.file.read_bytes()
    assert desk.maker.draft.first_mistake() == ""


def test_a_study_of_ones_own_waits_for_the_answer_when_its_page_is_opened(qtbot, beside):
    beside.folder.joinpath("study.json").write_text(protocol_text(title="Hums", stimuli={"a": {"patch": "hum.json"}}))
    kept = beside.folder / "kept"
    kept.mkdir()
    (kept / "protocols").symlink_to(beside.folder)
    window = quiet_window(qtbot, kept)
    desk = window.workspaces["Experiment"]
    assert "Hums" not in [study.protocol.title for study in desk.studies]
    window.show_workspace("Experiment")
    answer(qtbot, window, "Run it")
    assert "Hums" in [study.protocol.title for study in desk.studies]


def test_a_patch_that_is_saved_elsewhere_takes_its_node_along_and_writes_over_no_other(qtbot, beside):
    window = quiet_window(qtbot, beside.folder / "kept")
    window.open_patch.open(beside.patch)
    answer(qtbot, window, "Run it")
    save_as = window.actions_by_name["save as"].trigger
    for name in ("first", "second"):
        (beside.folder / name).mkdir()
    other = beside.folder / "second" / "nodes" / beside.file.name
    other.parent.mkdir()
    other.write_text("# mine")
    choose_file(window, beside.folder / "first" / "hum.json", save_as)
    assert (beside.folder / "first" / "nodes" / beside.file.name).read_bytes() == beside.file.read_bytes()
    assert window.status.message == f"Saved as {beside.folder / 'first' / 'hum.json'}"
    choose_file(window, beside.folder / "second" / "hum.json", save_as)
    assert other.read_text() == "# mine"
    assert "is another one, and stays" in window.status.message
