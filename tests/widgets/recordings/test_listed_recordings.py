"""What the list of recordings shows of its folder."""

from pathlib import Path

from recordings_shown import recordings_shown

from underfoot.widgets.recordings.recording_list import RecordingList


class Hasty(type(Path())):
    """A path whose file `gone.underfoot` is removed as soon as it was looked at once."""

    def stat(self, **how):
        found = super().stat(**how)
        if self.name == "gone.underfoot":
            self.unlink()
        return found


def test_a_file_that_goes_while_its_folder_is_listed_leaves_the_others(qtbot, folder, monkeypatch):
    monkeypatch.setattr("underfoot.widgets.recordings.workspace.recordings_folder", lambda: Hasty(folder))
    for name in ("a", "gone", "z"):
        (folder / f"{name}.underfoot").write_bytes(b"")
    workspace = recordings_shown(qtbot)
    workspace.recordings.refresh()
    shown = workspace.recordings.list
    assert {shown.item(row).text().split("\n")[0] for row in range(shown.count())} >= {"a", "z"}
    assert not (folder / "gone.underfoot").exists()


def test_a_recording_is_listed_once_it_has_begun(qtbot, folder):
    """The empty file that keeps its name until then could not be opened, and was called damaged."""
    path = folder / "today.underfoot"
    path.touch()
    for written, count in (({path}, 0), ((), 1)):
        made = RecordingList(lambda: folder, [], written.__contains__)
        qtbot.addWidget(made)
        made.refresh()
        listed = made.list.count()
        made.close_down()
        assert listed == count
