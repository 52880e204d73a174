"""What the list of recordings shows of its folder."""

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
    monkeypatch.setattr("underfoot.widgets.recordings.workspace.recordings_folder", lambda: Hasty(folder))
    for name in ("a", "gone", "z"):
        (folder / f"{name}.underfoot").write_bytes(b"")
    workspace = recordings_shown(qtbot)
    workspace.recordings.refresh()
    shown = workspace.recordings.list
    assert {shown.item(row).text().split("\n")[0] for row in range(shown.count())} >= {"a", "z"}
    assert not (folder / "gone.underfoot").exists()
