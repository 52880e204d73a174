"""A file that cannot be read: what is wrong stands in a dialog, with the place in the file."""

from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from windows import dialog_of, noise_patch, quiet_window

from underfoot.widgets.dialogs.file_error_dialog import FileErrorDialog


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
