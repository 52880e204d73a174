"""What the list of recordings shows of its folder."""

import os
import time
from pathlib import Path

from recordings_shown import recordings_shown


class Hasty(type(Path())):
    """A path whose file `gone.underfoot` is removed as soon as it was looked at once."""

    def stat(self, **how):
        found = super().stat(**how)
        if self.name == "gone.underfoot":
            self.unlink()
        return found


def test_a_file_that_goes_while_its_folder_is_listed_leaves_the_others(qtbot, folder, monkeypatch):
    monkeypatch.setattr("underfoot.widgets.recordings.workspace.documents_folder", lambda: Hasty(folder))
    for name in ("a", "gone", "z"):
        (folder / f"{name}.underfoot").write_bytes(b"?")
    workspace = recordings_shown(qtbot)
    workspace.recordings.refresh()
    shown = workspace.recordings.list
    assert {shown.item(row).text().split("\n")[0] for row in range(shown.count())} >= {"a", "z"}
    assert not (folder / "gone.underfoot").exists()


def test_a_recording_is_listed_once_it_has_begun(workspace, folder, qtbot):
    """The empty file with which a window keeps its name until then cannot be opened, and was called damaged.

    It may be another window's. Where no recording begins, a fault of the disk took it.
    """
    path = folder / "today.underfoot"
    for data, age_s, count in ((b"", 0.0, 0), (b"?", 0.0, 1), (b"", 3600.0, 1)):
        path.write_bytes(data)
        os.utime(path, (time.time() - age_s,) * 2)
        workspace.recordings.refresh()
        assert workspace.recordings.list.count() == count
    qtbot.waitUntil(lambda: workspace.recordings.list.item(0).text() == "today\ncannot be read")
