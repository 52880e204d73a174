"""The jumps in a selected range are told."""

from jumped import FLIGHT_S, TAKE_OFF_S, jumped


def test_the_height_of_a_jump_in_the_selected_range_is_told(workspace, folder, qtbot):
    workspace.open_file(jumped(folder / "jumped.underfoot"))
    qtbot.waitUntil(lambda: workspace.axis.content is not None and bool(workspace.axis.content.balance))
    told = workspace.readout.text
    workspace.axis.select(3.0, 7.0)
    qtbot.waitUntil(lambda: "4.000 s  ·  jump 259 mm by flight of 460 ms, 2" in told.full_text)
    assert "mm by impulse" in told.full_text
    workspace.axis.select(3.0, TAKE_OFF_S + 0.5 * FLIGHT_S)
    assert "jump" not in told.full_text
