"""A recording that another program writes, while it is looked at."""

from contextlib import closing

import pytest
from long_recording import write_recording
from recordings_shown import recordings_shown

from underfoot.floor.layout import default_floor
from underfoot.records.recording import Recording
from underfoot.records.recording_writer import Writer


def test_a_recording_that_another_program_writes_grows_and_has_its_steps_when_it_has_ended(
    qtbot, folder, tmp_path, monkeypatch
):
    monkeypatch.setattr("underfoot.widgets.recordings.recording_follower.POLL_MS", 10)
    with Recording(write_recording(tmp_path / "walk.underfoot", 3.0, default_floor(1, 2), vibration=False)) as walk:
        about, pieces = walk.about, list(walk.blocks("force"))
    workspace, shown = recordings_shown(qtbot), []

    def write():
        for first, rows in (pieces.pop(0) for _ in pieces[:6]):
            writer.put("force", first, rows)
        writer.commit()

    def look_and_write():
        length = workspace.facts.full_text.partition("  ·  ")[0]
        shown.append((workspace.axis.length_s, length, workspace.progress.text(), workspace.steps.plot.drawing.note))
        write()

    with closing(Writer(folder / "walk.underfoot", about)) as writer:
        write()
        workspace.reader.opened.connect(write)
        workspace.reader.extended.connect(look_and_write)
        workspace.open_file(folder / "walk.underfoot")
        qtbot.waitUntil(lambda: workspace.steps.count.text() == "4")
    lengths_s, facts, said, notes = zip(*shown, strict=True)
    assert lengths_s == pytest.approx([1.2, 1.8, 2.4, 3.0], abs=0.002)
    assert facts == ("1.2 s", "1.8 s", "2.4 s", "3.0 s")
    assert ({*said}, {*notes}) == ({"recording…"}, {"after the recording"})
