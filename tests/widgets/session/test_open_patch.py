"""The open patch: its file, its folder, the question before it is lost, and its copy that survives a crash."""

import json
from pathlib import Path

import pytest
from on_screen import show
from PySide6.QtCore import QObject, Qt
from PySide6.QtWidgets import QFileDialog, QMessageBox, QToolButton
from windows import LONG_MS, choose_file, design, dialog_of, noise_patch, quiet_window, started_patch

from underfoot.engine.target import Target
from underfoot.floor.layout import default_floor
from underfoot.nodes import REGISTRY
from underfoot.patch import preset_files
from underfoot.patch.file_paths import with_files_kept
from underfoot.patch.patch import Patch
from underfoot.widgets.controls.file_dialog import ask_save
from underfoot.widgets.design.first_steps import SILENT_TEXT, STEPS, FirstSteps
from underfoot.widgets.dialogs.file_error_dialog import FileErrorDialog
from underfoot.widgets.session import settings_file
from underfoot.widgets.session.autosave import Autosave, RecoveredWork
from underfoot.widgets.session.settings import Settings
from underfoot.widgets.session.settings_file import SettingsFile
from underfoot.widgets.window import MainWindow


def test_unsaved_work_survives_a_crash_and_not_a_clean_close(qtbot, tmp_path):
    noise_patch().save(tmp_path / "hiss.json")
    first = quiet_window(qtbot, tmp_path, tmp_path / "hiss.json")
    edited = noise_patch().set("noise", "amplitude", 4.0, REGISTRY)
    design(first).document.edit(edited, "Set amplitude")
    kept = tmp_path / "unsaved" / "work-0.json"
    qtbot.waitUntil(kept.exists)
    # As the system would after a crash: the lock is free, the work is still there.
    first.open_patch.autosave.close()
    second = quiet_window(qtbot, tmp_path)
    assert design(second).patch() == edited
    assert second.open_patch.path == tmp_path / "hiss.json"
    assert second.isWindowModified()
    assert "was not closed normally" in second.status.message
    second.open_patch.save()
    second.close()
    assert not second.isVisible()
    assert not kept.exists()


def test_a_preset_that_the_window_was_started_with_is_not_saved_over(qtbot, tmp_path, monkeypatch):
    monkeypatch.chdir(preset_files.presets_folder())
    window = quiet_window(qtbot, tmp_path, Path("patches", "gravel.json"))  # by path or by name, as `--patch` gives it
    assert window.open_patch.name == "Gravel underfoot"
    assert window.open_patch.path is None  # saving asks for a file
    assert not window.isWindowModified()
    assert window.settings.recent == []


def test_work_that_cannot_be_copied_is_said_once_and_copied_when_it_can_be(qtbot, tmp_path, monkeypatch):
    monkeypatch.setattr("underfoot.widgets.session.open_patch.AUTOSAVE_MS", 10)
    kept = tmp_path / "unsaved" / "work-0.json"
    with started_patch(tmp_path) as (open_patch, said):
        kept.mkdir()
        for amplitude in (1.0, 2.0):
            open_patch.set_patch(noise_patch().set("noise", "amplitude", amplitude, REGISTRY))
            open_patch.write_autosave()
            qtbot.waitUntil(lambda: bool(said))
        kept.rmdir()
        qtbot.waitUntil(lambda: '"amplitude":2.0' in kept.read_text() if kept.is_file() else False)
    assert said == [f"Unsaved work would not survive a crash: {kept} cannot be written: it is a folder"]


def test_a_window_that_is_told_to_leave_keeps_unsaved_work(qtbot, tmp_path):
    first = quiet_window(qtbot, tmp_path)
    design(first).document.edit(noise_patch("Left behind"), "All")
    first.leave()
    assert design(quiet_window(qtbot, tmp_path)).patch().title == "Left behind"


def test_why_there_is_no_sound_stands_at_the_right_and_hides_no_message(qtbot, tmp_path):
    window = MainWindow(tmp_path, Target(default_floor(), sound="no such card"))
    qtbot.addWidget(window, before_close_func=lambda w: w.leave())
    said = []
    window.bridge.notified.connect(said.append)
    show(qtbot, window)
    window.start()
    qtbot.waitUntil(lambda: "no such card" in window.status.session, timeout=LONG_MS)
    assert not any("no such card" in line for line in said)
    assert window.status.session.count("without sound") == 1
    steps = window.findChild(FirstSteps)  # nobody has pressed Space, and nothing has sounded
    for text, left in ((STEPS["press"], "press"), (STEPS["turn"], "turn"), ("", "play")):
        assert (steps.remaining[0], steps.text.text()) == ("play", f"{SILENT_TEXT} {text}".strip())
        steps.mark_done(left)


def test_keys_come_back_to_the_window_when_a_question_is_answered(qtbot, tmp_path):
    window = quiet_window(qtbot, tmp_path)
    design(window).document.edit(noise_patch(), "All")
    window.close()
    question = dialog_of(window, QMessageBox)
    qtbot.waitUntil(question.isActiveWindow)
    qtbot.keyClick(question, Qt.Key.Key_Escape)
    qtbot.waitUntil(window.isActiveWindow)


def test_the_first_key_on_a_new_patch_goes_to_the_canvas(qtbot, tmp_path):
    window = quiet_window(qtbot, tmp_path)
    design(window).preview.pad.setFocus()
    window.actions_by_name["new"].trigger()
    qtbot.waitUntil(lambda: window.focusWidget() is design(window).canvas)


def test_closing_asks_about_unsaved_work(qtbot, tmp_path):
    window = quiet_window(qtbot, tmp_path)
    design(window).document.edit(noise_patch(), "All")
    window.close()
    assert window.isVisible()
    question = dialog_of(window, QMessageBox)
    qtbot.mouseClick(question.button(QMessageBox.StandardButton.Discard), Qt.MouseButton.LeftButton)
    assert not window.isVisible()
    assert Settings.load(tmp_path).window_bytes


def test_what_is_discarded_for_a_file_that_is_not_chosen_is_still_unsaved(qtbot, tmp_path):
    window = quiet_window(qtbot, tmp_path)
    design(window).document.edit(noise_patch(), "All")
    window.actions_by_name["open"].trigger()
    question = dialog_of(window, QMessageBox)
    qtbot.mouseClick(question.button(QMessageBox.StandardButton.Discard), Qt.MouseButton.LeftButton)
    qtbot.keyClick(dialog_of(window, QFileDialog), Qt.Key.Key_Escape)
    assert window.isWindowModified()
    window.close()
    assert window.isVisible()
    dialog_of(window, QMessageBox).reject()


def test_a_file_that_another_program_changed_is_replaced_only_after_a_question(qtbot, tmp_path):
    path = tmp_path / "hiss.json"
    noise_patch().save(path)
    window = quiet_window(qtbot, tmp_path, path)
    path.write_text(json.dumps(json.loads(path.read_text())))  # other white space alone is no change
    for amplitude in (4.0, 5.0):
        design(window).document.edit(noise_patch().set("noise", "amplitude", amplitude, REGISTRY), "Set amplitude")
        window.actions_by_name["save"].trigger()
        assert not window.isWindowModified()
    for theirs, ours in ((noise_patch("Theirs").dumps(), "Ours"), (b"{ half a fi", "Still ours")):
        path.write_bytes(theirs)
        design(window).document.edit(noise_patch(ours), "Name it")
        window.actions_by_name["save"].trigger()
        question = dialog_of(window, QMessageBox)
        assert "hiss.json” was changed by another program or window. Replace it" in question.text()
        qtbot.keyClick(question, Qt.Key.Key_Escape)
        assert window.isWindowModified()
        assert path.read_bytes() == theirs
        window.actions_by_name["save"].trigger()
        question = dialog_of(window, QMessageBox)
        qtbot.mouseClick(question.button(QMessageBox.StandardButton.Yes), Qt.MouseButton.LeftButton)
        assert Patch.load(path, REGISTRY).title == ours
        assert not window.isWindowModified()
    path.unlink()
    window.actions_by_name["save"].trigger()
    assert Patch.load(path, REGISTRY).title == "Still ours"


def test_settings_are_in_their_file_while_the_window_is_open(qtbot, tmp_path):
    window = quiet_window(qtbot, tmp_path)
    window.settings.remember_file(tmp_path / "hiss.json")
    qtbot.waitUntil(lambda: Settings.load(tmp_path).recent == [str(tmp_path / "hiss.json")], timeout=LONG_MS)
    window.close()
    assert Settings.load(tmp_path).recent == [str(tmp_path / "hiss.json")]


def test_settings_of_two_windows_are_kept(qtbot, tmp_path, monkeypatch):
    monkeypatch.setattr(settings_file, "LOOK_MS", 1)
    paths = [str(tmp_path / f"{name}.json") for name in ("first", "second", "third")]
    owner = QObject()
    one, two = (SettingsFile(tmp_path, pytest.fail, owner) for _ in range(2))
    for window, path in zip((one, two, one), paths, strict=True):
        window.settings.remember_file(Path(path))
        qtbot.waitUntil(lambda path=path: path in Settings.load(tmp_path).recent)
    one.settings.theme = "light"
    two.settings.stars = ["gravel.json"]
    two.settings.forget_file(Path(paths[1]))
    one.close()
    two.close()
    kept = Settings.load(tmp_path)
    assert (kept.recent, kept.theme, kept.stars) == ([paths[2], paths[0]], "light", ["gravel.json"])


def test_settings_written_at_the_same_time_are_kept(qtbot, tmp_path, monkeypatch):
    monkeypatch.setattr(settings_file, "LOOK_MS", 1)
    Settings().save(tmp_path)
    owner = QObject()
    files = [SettingsFile(tmp_path, pytest.fail, owner) for _ in range(3)]
    expected = set()
    for turn in range(5):
        for number, file in enumerate(files):
            file.settings.stars = [*file.settings.stars, f"{number}-{turn}.json"]
            expected.add(f"{number}-{turn}.json")
        qtbot.waitUntil(lambda: expected == set(Settings.load(tmp_path).stars), timeout=LONG_MS)
    for file in files:
        file.close()
    assert set(Settings.load(tmp_path).stars) == expected


def test_settings_that_could_not_be_written_are_written_once_they_can_be(qtbot, tmp_path, monkeypatch):
    """A change while the disk was full waited for another change, or for the end of the window."""
    monkeypatch.setattr(settings_file, "LOOK_MS", 1)
    (tmp_path / "data").touch()  # in the place of the folder
    owner, said = QObject(), []
    file = SettingsFile(tmp_path / "data", said.append, owner)
    file.settings.theme = "light"
    file.save()
    assert len(said) == 1
    (tmp_path / "data").unlink()
    qtbot.waitUntil(lambda: Settings.load(tmp_path / "data").theme == "light", timeout=LONG_MS)
    file.close()


def test_two_windows_keep_their_work_apart(tmp_path):
    one, two = Autosave(tmp_path), Autosave(tmp_path)
    one.write(RecoveredWork(noise_patch("One"), None))
    two.write(RecoveredWork(noise_patch("Two"), tmp_path / "two.json"))
    assert one.recover(REGISTRY).patch.title == "One"
    assert two.recover(REGISTRY).path == tmp_path / "two.json"
    two.close()
    three = Autosave(tmp_path)
    assert three.recover(REGISTRY).patch.title == "Two"
    three.put_aside()
    assert three.recover(REGISTRY) is None
    four = Autosave(tmp_path)
    assert four.recover(REGISTRY).patch.title == "Two"


def test_work_is_put_aside_also_when_every_place_is_taken(tmp_path):
    """It was called kept, and gone with the next edit."""
    titles = {f"Work {number}" for number in range(16)}
    before = [(Autosave(tmp_path), title) for title in titles]
    for autosave, title in before:
        autosave.write(RecoveredWork(noise_patch(title), None))
    for autosave, _ in before:
        autosave.close()
    one = Autosave(tmp_path)
    one.put_aside()
    assert one.recover(REGISTRY) is None
    after = [Autosave(tmp_path) for _ in range(16)]
    assert {autosave.recover(REGISTRY).patch.title for autosave in after} == titles


@pytest.mark.parametrize("is_asked_for", [False, True])
def test_work_that_cannot_be_read_is_kept_beside_the_next_and_that_is_said(qapp, tmp_path, is_asked_for):
    """As that of another version: the next copy replaced it."""
    noise_patch().save(tmp_path / "hiss.json")
    left = b'{"format": "underfoot-work", "patch": {"version": 99}, "path": ""}'
    for name in ("unreadable-1.json", "unreadable-2.json"):
        work = tmp_path / "unsaved" / "work-0.json"
        work.parent.mkdir(exist_ok=True)
        work.write_bytes(left)
        with started_patch(tmp_path, tmp_path / "hiss.json" if is_asked_for else None) as (open_patch, said):
            assert work.with_name(name).read_bytes() == left
            assert said[-1].endswith(f"work-0.json cannot be read; it is kept as {name}")
            open_patch.set_patch(noise_patch("Edited"))


@pytest.mark.parametrize("text", ["", "{", "[1]", "\udcff".encode(errors="surrogateescape").decode("latin-1")])
def test_settings_that_cannot_be_read_are_the_first_ones_and_kept_beside_them(qtbot, tmp_path, text):
    """As after an edit by hand: recent files and stars were gone with the next start, and nothing said so."""
    (tmp_path / "settings.json").write_text(text)
    assert Settings.load(tmp_path) == Settings()
    owner = QObject()
    file = SettingsFile(tmp_path, pytest.fail, owner)
    assert len(file.refused) == 1
    file.close()
    assert (tmp_path / file.refused[0].rpartition(" ")[2]).read_text() == text
    assert Settings.load(tmp_path) == file.settings == Settings()


def test_a_setting_that_is_not_allowed_is_the_usual_one_and_that_is_said(qtbot, tmp_path):
    """A rate or a block of 0 ended the engine at each start, and a text in its place all other settings with it; a
    level that no number of tenths can hold was an error of Python's.
    """
    given = {"rate": 0, "block": 10**9, "sound": "a; a", "level_db": 1e308, "text_size": "big", "stars": ["g.json"]}
    (tmp_path / "settings.json").write_text(json.dumps(given, indent=1))
    refused = [line.partition("$.")[2] for line in Settings.read(tmp_path)[1]]
    window = quiet_window(qtbot, tmp_path)  # which writes the file anew when it may
    assert window.settings == Settings(stars=["g.json"], first_steps_done=True)
    said = dialog_of(window, FileErrorDialog).error_text.text()
    assert said == "Line 6: text_size is 'big'; allowed: a whole number; 100 is used"
    assert refused == [
        "sound: sound device is 'a; a'; allowed: each card once; '' is used",
        "rate is 0; allowed: a whole number >= 8000; 48000 is used",
        "block is 1000000000; allowed: a whole number <= 8192; 128 is used",
        "level_db is 1e+308; allowed: a number <= 0.0; -30.0 is used",
        "text_size is 'big'; allowed: a whole number; 100 is used",
    ]
    window.close()
    assert Settings.read(tmp_path) == (window.settings, [])


def test_the_name_offered_for_a_patch_can_be_a_file_s_whatever_its_title(qtbot, tmp_path):
    window = quiet_window(qtbot, tmp_path)
    window.settings.folder = str(tmp_path)
    design(window).document.edit(noise_patch('Ice/snow: "R&D"?'), "All")
    window.open_patch.save()
    dialog_of(window, QFileDialog).accept()
    assert window.open_patch.path == tmp_path / "Ice-snow- -R&D--.json"
    assert window.open_patch.path.exists()


def test_the_first_save_offers_the_documents_and_the_next_where_that_ended(qtbot, tmp_path, monkeypatch):
    """A desktop starts it anywhere; Qt offered where a dialog had begun, again and again."""
    monkeypatch.setattr("underfoot.widgets.controls.file_dialog.ended_in", [])
    monkeypatch.setattr("platformdirs.user_documents_dir", lambda: str(tmp_path))  # nothing was recorded there yet
    window = quiet_window(qtbot, tmp_path / "kept")
    design(window).document.edit(noise_patch("Ice"), "All")
    window.open_patch.save()
    dialog = dialog_of(window, QFileDialog)
    assert dialog.selectedFiles() == [str(tmp_path / "Ice.json")]
    dialog.selectFile(str(tmp_path / "kept" / "Ice.json"))
    dialog.accept()
    table = ask_save(window, "A table", "trials.csv", "", ".csv", print)
    assert table.selectedFiles() == [str(tmp_path / "kept" / "trials.csv")]
    table.reject()


def test_save_as_begins_with_the_name_of_the_file(qtbot, tmp_path):
    noise_patch("Hiss of rain").save(tmp_path / "hiss-3.json")
    window = quiet_window(qtbot, tmp_path / "kept", tmp_path / "hiss-3.json")
    window.actions_by_name["save as"].trigger()
    dialog = dialog_of(window, QFileDialog)
    assert dialog.selectedFiles() == [str(tmp_path / "hiss-3.json")]
    dialog.reject()


def test_sound_files_are_stored_relative_to_the_patch_and_stay_the_same_files(qtbot, tmp_path):
    rain = tmp_path / "sounds" / "rain.wav"
    rain.parent.mkdir()
    rain.touch()
    window = quiet_window(qtbot, tmp_path / "kept")
    window.open_patch.new()
    workspace = design(window)
    workspace.document.edit(Patch().add("wav-player", REGISTRY), "Add")
    workspace.canvas.patch_scene.select(["wav-player"])
    look = next(b for b in workspace.inspector.findChildren(QToolButton) if b.accessibleName() == "Look for a file")

    def chosen():
        choose_file(window, rain, lambda: qtbot.mouseClick(look, Qt.MouseButton.LeftButton))
        return workspace.patch().node("wav-player").parameters["file"]

    def stored():
        file = workspace.patch().node("wav-player").parameters["file"]
        assert window.open_patch.is_saved
        assert window.open_patch.patch == workspace.patch() == Patch.load(window.open_patch.path, REGISTRY)
        return file

    save_as = window.actions_by_name["save as"].trigger
    below = str(rain.relative_to(tmp_path))
    assert chosen() == str(rain)
    choose_file(window, tmp_path / "storm.json", save_as)
    assert stored() == below
    assert chosen() == below
    choose_file(window, tmp_path / "calm.json", save_as)
    assert stored() == below
    (tmp_path / "elsewhere").mkdir()
    choose_file(window, tmp_path / "elsewhere" / "storm.json", save_as)
    assert stored() == chosen() == str(rain)
    choose_file(window, rain.parent / "storm.json", save_as)
    assert stored() == rain.name
    window.open_patch.read(tmp_path / "storm.json")
    assert stored() == below


def test_a_path_that_belongs_to_no_folder_stays_as_it_was_typed(tmp_path):
    patch = Patch().add("wav-player", REGISTRY).set("wav-player", "file", "rain.wav", REGISTRY)
    assert with_files_kept(patch, REGISTRY, None, tmp_path) == patch
    assert with_files_kept(patch, REGISTRY, Path("/caf\udce9"), None) == patch  # no patch can have it: not UTF-8


def test_a_patch_that_was_rescued_knows_its_folder(qtbot, tmp_path):
    noise_patch().save(tmp_path / "hiss.json")
    first = quiet_window(qtbot, tmp_path, tmp_path / "hiss.json")
    design(first).document.edit(noise_patch("Edited"), "All")
    first.leave()
    folders = []
    second = quiet_window(qtbot, tmp_path)
    second.open_patch.folder_changed.connect(folders.append)
    assert second.open_patch.folder == tmp_path
    assert not second.open_patch.is_saved
    second.open_patch.save()
    assert second.open_patch.is_saved
    second.open_patch.new()
    assert folders == [None]


def test_a_patch_that_reads_files_outside_its_folder_is_opened_once_the_person_says_so(qtbot, tmp_path):
    strange = tmp_path / "download"
    strange.mkdir()
    patch = Patch(title="From a stranger").add("wav-player", REGISTRY, file="../secret.wav")
    patch.save(strange / "strange.json")
    (strange / "linked.wav").symlink_to(tmp_path / "secret.wav")
    patch.set("wav-player", "file", "linked.wav", REGISTRY).save(strange / "linked.json")
    with started_patch(tmp_path) as (open_patch, _):
        before = open_patch.patch
        for name in ("strange.json", "linked.json"):
            open_patch.open(strange / name)
            question = dialog_of(open_patch.parent(), QMessageBox)
            assert "outside its own folder" in question.text()
            assert question.textFormat() == Qt.TextFormat.PlainText
            qtbot.mouseClick(question.button(QMessageBox.StandardButton.Cancel), Qt.MouseButton.LeftButton)
            assert open_patch.patch == before
        open_patch.open(strange / "strange.json")
        question = dialog_of(open_patch.parent(), QMessageBox)
        assert str(tmp_path / "secret.wav") in question.text()
        qtbot.mouseClick(question.button(QMessageBox.StandardButton.Open), Qt.MouseButton.LeftButton)
        assert open_patch.patch == patch
        open_patch.new()
        open_patch.open(strange / "strange.json")  # not asked a second time
        assert open_patch.patch == patch


def test_work_left_by_a_crash_is_kept_when_the_file_of_the_start_is_opened_after_a_question(qtbot, tmp_path):
    with started_patch(tmp_path) as (first, _):
        first.set_patch(noise_patch("Left behind"))
    folder = tmp_path / "patches"
    folder.mkdir()
    Patch(title="Outside").add("wav-player", REGISTRY, file="../rain.wav").save(folder / "outside.json")
    with started_patch(tmp_path, folder / "outside.json") as (second, said):
        assert second.patch.title == "Left behind"
        second.write_autosave()
        question = dialog_of(second.parent(), QMessageBox)
        qtbot.mouseClick(question.button(QMessageBox.StandardButton.Open), Qt.MouseButton.LeftButton)
        assert second.patch.title == "Outside"
        assert "Unsaved work from last time is kept" in said[-1]
    with started_patch(tmp_path) as (third, _):
        assert third.patch.title == "Left behind"


def test_a_patch_that_the_person_saved_is_opened_without_a_question(qtbot, tmp_path):
    window = quiet_window(qtbot, tmp_path)
    own = Patch(title="Own").add("wav-player", REGISTRY, file=str(tmp_path / "sounds" / "own.wav"))
    design(window).document.edit(own, "All")
    (tmp_path / "patches").mkdir()
    choose_file(window, tmp_path / "patches" / "own.json", window.open_patch.save_as)
    qtbot.waitUntil(lambda: window.open_patch.is_saved)
    window.open_patch.new()
    window.open_patch.open(tmp_path / "patches" / "own.json")
    assert window.open_patch.patch == own


def typing(qtbot, window, id, text):
    """Type into the only number of a node, without an end."""
    canvas = design(window).canvas
    canvas.patch_scene.select([id])
    field = design(window).inspector.editors["amplitude"].field
    qtbot.mouseClick(field, Qt.MouseButton.LeftButton)
    field.selectAll()
    qtbot.keyClicks(field, text)
    return field


def test_what_is_being_typed_is_saved(qtbot, tmp_path):
    path = tmp_path / "hiss.json"
    noise_patch().save(path)
    window = quiet_window(qtbot, tmp_path / "kept", path)
    field = typing(qtbot, window, "noise", "0.25")
    qtbot.keyClick(field, Qt.Key.Key_S, Qt.KeyboardModifier.ControlModifier)
    assert Patch.load(path, REGISTRY).node("noise").parameters["amplitude"] == 0.25
    assert field.hasFocus()
    canvas = design(window).canvas
    canvas.setFocus()
    canvas.edit_title("noise")
    qtbot.keyClicks(canvas.inline, "Rain")
    qtbot.keyClick(canvas.inline, Qt.Key.Key_S, Qt.KeyboardModifier.ControlModifier)
    assert Patch.load(path, REGISTRY).node("noise").label == "Rain"
    assert not window.isWindowModified()


def test_what_is_open_now_is_said_whatever_workspace_is_shown(qtbot, tmp_path):
    noise_patch().save(tmp_path / "hiss.json")
    window = quiet_window(qtbot, tmp_path / "kept")
    window.workspaces.choose("Monitor")
    window.show_message("gone.json cannot be read")
    window.open_patch.open(tmp_path / "hiss.json")
    assert window.status.message == "hiss.json is open."
    qtbot.keyClick(window, Qt.Key.Key_N, Qt.KeyboardModifier.ControlModifier)
    assert window.status.message == "A new patch is open."


def test_what_is_being_typed_is_asked_for_when_the_window_is_closed(qtbot, tmp_path):
    path = tmp_path / "hiss.json"
    noise_patch().save(path)
    window = quiet_window(qtbot, tmp_path / "kept", path)
    typing(qtbot, window, "noise", "0.25")
    window.close()
    assert window.isVisible()
    question = dialog_of(window, QMessageBox)
    assert question.textFormat() == Qt.TextFormat.PlainText  # whatever the title
    qtbot.mouseClick(question.button(QMessageBox.StandardButton.Save), Qt.MouseButton.LeftButton)
    assert not window.isVisible()
    assert Patch.load(path, REGISTRY).node("noise").parameters["amplitude"] == 0.25
