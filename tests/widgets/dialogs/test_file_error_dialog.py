"""A file that cannot be read: what is wrong stands in a dialog, with the place in the file."""

from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from windows import choose_file, dialog_of, noise_patch, quiet_window

from underfoot.widgets.dialogs.file_error_dialog import FileErrorDialog
from underfoot.widgets.session.open_patch import PATCH_FILES


def test_a_file_of_another_kind_that_is_chosen_is_refused_where_one_looks(qtbot, tmp_path):
    window = quiet_window(qtbot, tmp_path / "kept")
    png = b"\x89PNG\r\n\x1a\n" + bytes(400)
    for name, content, says in (
        ("picture.png", png, f"It is not JSON: it is not UTF-8 text{PATCH_FILES}"),
        ("other.json", b'{"name": "of another program"}', "Line 1: format is null; allowed: 'underfoot-patch'"),
        ("empty.json", b"", "Line 1: it is not JSON: expecting value: line 1 column 1"),
    ):
        path, before = tmp_path / name, window.open_patch.patch
        path.write_bytes(content)
        choose_file(window, path, window.actions_by_name["open"].trigger)
        dialog = dialog_of(window, FileErrorDialog)
        assert (dialog.file.text(), dialog.error_text.text()) == (str(path), says)
        assert window.status.message.startswith(str(path))
        assert window.open_patch.patch is before
        QTest.keyClick(dialog, Qt.Key.Key_Escape)
        assert not dialog.isVisible()


def test_an_import_that_cannot_be_read_is_refused_there_too(qtbot, tmp_path):
    window = quiet_window(qtbot, tmp_path / "kept")
    path = tmp_path / "noise.haptic"
    path.write_bytes(b"\xff" * 256)
    choose_file(window, path, window.actions_by_name["import"].trigger)
    qtbot.waitUntil(lambda: any(one.isVisible() for one in window.findChildren(FileErrorDialog)))
    dialog = dialog_of(window, FileErrorDialog)
    assert dialog.file.text() == str(path)
    assert dialog.error_text.text() == "It is not JSON: it is not UTF-8 text"


def test_forces_that_cannot_be_read_are_refused_there_too(qtbot, tmp_path):
    window = quiet_window(qtbot, tmp_path / "kept")
    path = tmp_path / "walk.csv"
    path.write_bytes(bytes(range(256)))
    choose_file(window, path, lambda: window.main_bar.target_chosen.emit("file"))
    assert (
        dialog_of(window, FileErrorDialog).error_text.text()
        == "It is not a force CSV: it is not UTF-8 text; save it as CSV, UTF-8"
    )


def test_a_patch_that_cannot_be_read_is_shown_at_its_place(qtbot, tmp_path):
    window = quiet_window(qtbot, tmp_path)
    path = tmp_path / "bad.json"
    noise_patch().save(path)
    path.write_text(path.read_text().replace('"version": 1', '"version": "one"', 1))
    number = next(k for k, line in enumerate(path.read_text().splitlines(), 1) if "one" in line)
    before = window.open_patch.patch
    window.open_patch.read(path)
    dialog = dialog_of(window, FileErrorDialog)
    assert dialog.file.text() == str(path)
    assert dialog.error_text.text() == f"Line {number}: version is 'one'; allowed: 1"
    assert f'▸{number:5}   "version": "one"' in dialog.lines.text()
    assert window.status.message == f"{path}, line {number}: version is 'one'; allowed: 1"
    assert window.open_patch.patch is before
    QTest.keyClick(dialog, Qt.Key.Key_Escape)
    assert not dialog.isVisible()
