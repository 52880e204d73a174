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
    with Recording(write_recording(tmp_path / "walk.underfoot", 4.2, default_floor(1, 2), vibration=False)) as walk:
        about, blocks = walk.about, list(walk.blocks("force"))
    pieces, after = blocks[:30], blocks[30:]
    workspace, shown, ends = recordings_shown(qtbot), [], []

    def write():
        for first, rows in (pieces.pop(0) for _ in pieces[:6]):
            writer.put("force", first, rows)
        writer.commit()

    def look_and_write():
        length, says = workspace.facts.full_text.partition("  ·  ")[0], workspace.progress.text()
        shown.append((workspace.axis.length_s, length, says, workspace.steps.count.text()))
        assert not workspace.surveyor.is_busy
        workspace.axis.set_view(0.2, 0.4)
        workspace.axis.set_cursor(0.3)
        write()

    with closing(Writer(folder / "walk.underfoot", about)) as writer:  # with nothing in it yet
        workspace.reader.opened.connect(write)
        workspace.reader.extended.connect(look_and_write)
        workspace.follower.ended.connect(lambda: ends.append(workspace.progress.text()))
        workspace.open_file(folder / "walk.underfoot")
        qtbot.waitUntil(lambda: workspace.steps.count.text() == "4")
        pieces += after  # its writer was held up
        write()
        qtbot.waitUntil(lambda: workspace.steps.count.text() == "6")
    lengths_s, facts, said, counts = zip(*shown, strict=True)
    assert lengths_s == pytest.approx([0.6, 1.2, 1.8, 2.4, 3.0, 3.6, 4.2], abs=0.002)
    assert facts == ("0.6 s", "1.2 s", "1.8 s", "2.4 s", "3.0 s", "3.6 s", "4.2 s")
    assert workspace.readout.map.chosen_tile() == "t2"  # which was loaded first
    view = workspace.axis.view
    assert (view.begin_s, view.end_s, workspace.axis.cursor_s) == pytest.approx((0.2, 0.4, 0.3))
    assert ({*said}, ends) == ({"recording…"}, ["", ""])
    assert counts == (*["none yet"] * 5, *["4 so far"] * 2)
