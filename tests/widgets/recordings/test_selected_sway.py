"""The sway of who stands is told of a selected range."""

from swayed import swayed

from underfoot.records.recording import Recording


def test_the_sway_in_the_selected_range_is_told_where_somebody_stands(workspace, folder, qtbot):
    path = swayed(folder / "stood.underfoot")
    workspace.open_file(path)
    qtbot.waitUntil(lambda: workspace.axis.content is not None)
    told = workspace.readout.text
    workspace.axis.select(0.0, 13.0)  # before it is known where somebody stands
    workspace.axis.select(3.0, 13.0)
    qtbot.waitUntil(lambda: "s selected, 10.000 s  ·  sway path 6" in told.full_text)
    workspace.axis.select(0.0, 10.0)
    assert "sway" not in told.full_text
    workspace.axis.select(4.0, 9.0)
    qtbot.waitUntil(lambda: "s selected, 5.000 s  ·  sway path 3" in told.full_text)
    content = workspace.axis.content
    known, content.balance = content.balance, bytearray()
    workspace.axis.select(5.0, 8.0)
    content.balance = known  # which comes while it is computed without
    workspace.readout.describe_selection()
    qtbot.waitUntil(lambda: "s selected, 3.000 s  ·  sway path 1" in told.full_text)
    with Recording(path) as recording:
        recording.note_body_weight(0, 700.0, "typed")
        workspace.reader.notes_read.emit(recording.notes())  # with which all is shown anew
    qtbot.waitUntil(lambda: "s selected, 3.000 s  ·  sway path 1" in told.full_text)
