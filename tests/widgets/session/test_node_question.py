"""Opening a patch with a node in a file beside it: the question, the answer, and the node that is missing."""

from long_recording import write_recording
from made_studies import protocol_text
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QMessageBox
from windows import LONG_MS, choose_file, design, dialog_of, noise_patch, quiet_window, started_patch

from underfoot.floor.layout import default_floor
from underfoot.nodes import REGISTRY
from underfoot.patch.effective import without_missing
from underfoot.patch.patch import Patch
from underfoot.patch.preset_files import OWN, Preset
from underfoot.quantities import number
from underfoot.widgets.session.settings import Settings


def answer(qtbot, window, word):
    """Click the button of this word in the question that is asked."""
    question = dialog_of(window, QMessageBox)
    button = next(button for button in question.buttons() if button.text() == word)
    qtbot.mouseClick(button, Qt.MouseButton.LeftButton)
    return question


def preset(path):
    """A preset that the user saved."""
    return Preset(path, OWN, path.stem, path.stem)


def test_a_node_is_run_and_offered_once_the_person_has_agreed(qtbot, own_node):
    window = quiet_window(qtbot, own_node.folder / "kept")
    offered = design(window).node_palette.list
    own_node.file.write_text(own_node.file.read_text() + 1000 * "#")
    window.open_patch.open(own_node.patch)
    assert own_node.runs == 0
    question = answer(qtbot, window, "Run it")
    assert str(own_node.file) in question.text()
    assert f"{number(own_node.file.stat().st_size, 9)} bytes" in question.text()  # as numbers are written everywhere
    assert "with your rights" in question.informativeText()
    assert own_node.runs == 1
    design(window).node_palette.field.setText("hum of mine")
    assert offered.current() == "hum-of-mine"
    design(window).canvas.patch_scene.select(["hum"])
    assert design(window).inspector.editors["strength"].value() == 2.5
    window.open_patch.new()
    window.open_patch.open(own_node.patch)  # not asked a second time
    assert window.open_patch.patch.title == "Hum"
    assert not question.isVisible()
    window.settings.save(own_node.folder)
    assert len(Settings.load(own_node.folder).run_code) == 1


def test_the_preview_of_a_patch_that_is_opened_again_is_of_its_node_as_it_is_now(qtbot, own_node):
    """Mended and opened again, what was said of the mistake stayed there."""
    window = quiet_window(qtbot, own_node.folder / "kept")
    window.open_patch.open(own_node.patch)
    with qtbot.waitSignal(design(window).previews.preview_requested):
        answer(qtbot, window, "Run it")
    own_node.write(sign="-1.0")
    window.open_patch.open(own_node.patch)
    with qtbot.waitSignal(design(window).previews.preview_requested):
        answer(qtbot, window, "Run it")


def test_another_file_is_asked_about_again_and_is_what_is_run_then(qtbot, own_node):
    with started_patch(own_node.folder / "kept") as (open_patch, _):
        open_patch.open(own_node.patch)
        answer(qtbot, open_patch.parent(), "Run it")
        first = REGISTRY["hum-of-mine"]
        own_node.write(sign="-1.0")
        open_patch.open(own_node.patch)
        assert own_node.runs == 1
        answer(qtbot, open_patch.parent(), "Do not")
        assert REGISTRY["hum-of-mine"].missing  # the file that was agreed to is not there any more
        assert own_node.runs == 1
        own_node.write(sign="-2.0")
        open_patch.open(own_node.patch)
        answer(qtbot, open_patch.parent(), "Run it")
        assert own_node.runs == 2
        assert REGISTRY["hum-of-mine"] is not first


def test_without_consent_the_node_is_missing_says_why_and_is_saved_as_it_is(qtbot, own_node):
    window = quiet_window(qtbot, own_node.folder / "kept")
    window.open_patch.open(own_node.patch)
    answer(qtbot, window, "Do not")
    assert own_node.runs == 0
    assert "hum-of-mine is missing" in window.status.message
    assert "nobody has agreed" in window.status.message
    before = own_node.patch.read_bytes()
    patch = window.open_patch.patch
    assert [node.id for node in without_missing(patch, REGISTRY).nodes] == ["out"]
    assert [node.id for node in window.controller.patch.nodes] == ["out"]
    design(window).node_palette.field.setText("hum of mine")
    assert design(window).node_palette.list.current() == ""
    design(window).canvas.patch_scene.select(["hum"])
    design(window).document.edit(patch.move({"hum": (10.0, 0.0)}), "Move")
    window.open_patch.save()
    assert Patch.unchecked(own_node.patch.read_bytes(), "saved") == Patch.unchecked(before, "first").move(
        {"hum": (10.0, 0.0)}
    )


def test_a_broken_file_and_work_that_was_left_behind_lose_nothing(qtbot, own_node):
    own_node.file.write_text("1 / 0")
    first = quiet_window(qtbot, own_node.folder / "kept", own_node.patch)
    answer(qtbot, first, "Run it")
    assert "ZeroDivisionError: division by zero" in first.status.message
    patch = first.open_patch.patch
    edited = patch.move({"hum": (10.0, 0.0)})
    design(first).document.edit(edited, "Move")
    first.leave()
    REGISTRY.pop("hum-of-mine")  # as in a new process
    second = quiet_window(qtbot, own_node.folder / "kept")
    assert second.open_patch.patch == edited


def test_a_preset_that_is_listened_to_is_asked_about_first(qtbot, own_node):
    window = quiet_window(qtbot, own_node.folder / "kept")
    plain = own_node.patch.with_name("plain.json")
    noise_patch().save(plain)
    presets = design(window).side.presets
    presets.audition_changed.emit(preset(plain))
    assert window.controller.patch.title == "Hiss"  # it needs no custom node: no question
    presets.audition_changed.emit(preset(own_node.patch))
    assert own_node.runs == 0
    answer(qtbot, window, "Do not")
    assert "needs" in window.status.message
    assert window.controller.patch.title == "Hiss"
    own_node.write(sign="-1.0")
    presets.audition_changed.emit(preset(own_node.patch))
    answer(qtbot, window, "Run it")
    assert own_node.runs == 1
    assert window.controller.patch.title == "Hum"
    assert len(Settings.load(own_node.folder / "kept").run_code) == 1  # at once: the window may be killed


def test_a_recording_is_asked_about_before_it_is_played_through_its_own_patch(qtbot, own_node):
    window = quiet_window(qtbot, own_node.folder / "kept")
    about = {"patch": own_node.patch.read_text(), "folder": str(own_node.folder)}
    window.open_file(write_recording(own_node.folder / "a.underfoot", 0.5, default_floor(1, 1), about=about))
    desk = window.workspaces["Recordings"]
    qtbot.waitUntil(lambda: desk.axis.content is not None, timeout=LONG_MS)
    desk.playback.play_or_stop()
    assert own_node.runs == 0
    assert not desk.playback.player.is_playing
    answer(qtbot, window, "Run it")
    assert own_node.runs == 1
    assert desk.playback.player.is_playing
    assert window.controller.patch.title == "Hum"


def test_a_study_is_asked_about_and_a_copy_of_it_takes_the_node_along(qtbot, own_node):
    protocol = own_node.folder / "study.json"
    protocol.write_text(protocol_text(title="Hums", stimuli={"hum": {"patch": "hum.json"}}))
    window = quiet_window(qtbot, own_node.folder / "kept")
    window.workspaces.choose("Experiment")
    desk = window.workspaces["Experiment"]
    desk.study_list.open_protocol(protocol)
    assert own_node.runs == 0
    answer(qtbot, window, "Run it")
    assert own_node.runs == 1
    assert desk.study_list.study.protocol.title == "Hums"
    desk.protocol_editor.make_copy(desk.study_list.study)
    copied = own_node.folder / "kept" / "protocols" / "patches" / "nodes" / own_node.file.name
    assert copied.read_bytes() == own_node.file.read_bytes()
    assert desk.protocol_editor.draft.first_mistake() == ""


def test_a_study_of_ones_own_waits_for_the_answer_when_its_page_is_opened(qtbot, own_node):
    own_node.folder.joinpath("study.json").write_text(protocol_text(title="Hums", stimuli={"a": {"patch": "hum.json"}}))
    kept = own_node.folder / "kept"
    kept.mkdir()
    (kept / "protocols").symlink_to(own_node.folder)
    window = quiet_window(qtbot, kept)
    window.workspaces.choose("Experiment")
    desk = window.workspaces["Experiment"]
    assert "Hums" not in [study.protocol.title for study in desk.study_list.studies]
    answer(qtbot, window, "Run it")
    assert "Hums" in [study.protocol.title for study in desk.study_list.studies]


def test_a_patch_that_is_saved_elsewhere_takes_its_node_along_and_writes_over_no_other(qtbot, own_node):
    with started_patch(own_node.folder / "kept") as (open_patch, said):
        open_patch.open(own_node.patch)
        answer(qtbot, open_patch.parent(), "Run it")
        for name in ("first", "second"):
            (own_node.folder / name).mkdir()
        other = own_node.folder / "second" / "nodes" / own_node.file.name
        other.parent.mkdir()
        other.write_text("# mine")
        choose_file(open_patch.parent(), own_node.folder / "first" / "hum.json", open_patch.save_as)
        assert (own_node.folder / "first" / "nodes" / own_node.file.name).read_bytes() == own_node.file.read_bytes()
        assert said[-1] == f"Saved as {own_node.folder / 'first' / 'hum.json'}"
        choose_file(open_patch.parent(), own_node.folder / "second" / "hum.json", open_patch.save_as)
        assert other.read_text() == "# mine"
        assert "is another one, and stays" in said[-1]


def test_a_patch_is_saved_though_its_node_is_another_one_meanwhile(qtbot, own_node):
    with started_patch(own_node.folder / "kept") as (open_patch, _):
        open_patch.open(own_node.patch)
        answer(qtbot, open_patch.parent(), "Run it")
        edited = open_patch.patch.move({"hum": (10.0, 0.0)})
        open_patch.set_patch(edited)
        plain = own_node.patch.with_name("plain.json")
        noise_patch().save(plain)
        open_patch.switch()
        open_patch.read(plain)
        own_node.file.write_text(own_node.file.read_text().replace("strength", "level"))
        open_patch.read(plain)  # in the other slot, with a node of which the first patch cannot be
        answer(qtbot, open_patch.parent(), "Run it")
        open_patch.switch()
        open_patch.save()
        assert Patch.unchecked(own_node.patch.read_bytes(), "saved") == edited
