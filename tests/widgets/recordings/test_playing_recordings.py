"""Recordings played on the window's session, and opened from the command line."""

import math

import numpy as np
import pytest
from click.testing import CliRunner
from long_recording import write_recording
from PySide6.QtCore import Qt
from windows import LONG_MS, noise_patch, quiet_window

from underfoot.__main__ import cli
from underfoot.errors import BadFile
from underfoot.floor.layout import default_floor
from underfoot.records.force_files import read_force_file
from underfoot.records.recording import Recording
from underfoot.widgets.session.listening import AuditionedOutput


@pytest.fixture(scope="module")
def walk(tmp_path_factory):
    about = {"patch": noise_patch("Recorded").dumps().decode()}
    path = tmp_path_factory.mktemp("walks") / "walk.underfoot"
    return write_recording(path, 3.0, default_floor(1, 2), about=about)


@pytest.fixture
def window(qtbot, tmp_path, patch_folder):
    """A window of the test's own, for whose session others will be opened."""
    made = quiet_window(qtbot, tmp_path / "kept", patch_folder / "hiss.json")
    with qtbot.waitSignal(made.controller.opened, timeout=LONG_MS):
        made.start()
    return made


def test_a_stretch_is_played_through_its_own_patch_and_the_floor_comes_back(window, walk, tmp_path, qtbot):
    controller, without_patch = window.controller, write_recording(tmp_path / "force plates.underfoot", 1.0)
    window.listening.audition(AuditionedOutput("noise", "out"))
    heard = controller.patch
    window.open_file(walk)
    workspace = window.workspaces["Recordings"]
    qtbot.waitUntil(
        lambda: workspace.axis.content is not None and workspace.axis.content.overview is not None, timeout=LONG_MS
    )
    workspace.axis.select(1.0, 1.8)
    played, seen = [], []

    def look(at):
        played.append(at)
        window.listening.set_level("A", 1.0)  # as when its preview in Design is done
        if at >= 1.3:
            session = controller.session
            target, button = session.target, workspace.playback.button
            seen.append((target.kind, target.floor, target.stretch_s, session.patch.title, button.text()))

    workspace.playback.player.moved.connect(look)
    workspace.playback.play_or_stop()
    qtbot.waitUntil(lambda: bool(seen) and not workspace.playback.player.is_playing, timeout=LONG_MS)
    assert seen[0] == ("replay", default_floor(1, 2), (0.9, 1.8), "Recorded", "Stop")
    assert math.isnan(played[-1])
    assert max(at for at in played if math.isfinite(at)) <= 1.8
    assert min(played) >= 1.0
    back = default_floor()
    qtbot.waitUntil(lambda: controller.session is not None and controller.session.target.floor == back, timeout=LONG_MS)
    assert controller.session.patch == heard != window.open_patch.patch  # the node alone, which Design still shows
    assert window.settings.kind == "simulator"

    window.open_file(without_patch)  # and played until another target is chosen: that one stays
    qtbot.waitUntil(
        lambda: workspace.axis.content is not None and workspace.axis.content.overview is not None, timeout=LONG_MS
    )
    workspace.playback.looping.setChecked(True)
    workspace.playback.play_or_stop()
    qtbot.waitUntil(lambda: math.isfinite(workspace.axis.playing_s), timeout=LONG_MS)
    assert (controller.session.target.kind, controller.session.patch) == ("replay", heard)
    window.target_selection.set_floor(2, 2)
    qtbot.waitUntil(lambda: not workspace.playback.player.is_playing, timeout=LONG_MS)
    qtbot.waitUntil(
        lambda: controller.session is not None and controller.session.target.kind == "simulator", timeout=LONG_MS
    )


def test_space_plays_and_stops_the_open_recording_and_what_was_silent_is_silent_again(qtbot, tmp_path, walk):
    window = quiet_window(qtbot, tmp_path / "kept")
    controller = window.controller
    window.open_file(walk)
    workspace = window.workspaces["Recordings"]
    qtbot.waitUntil(lambda: workspace.axis.content is not None)
    player = workspace.playback.player
    workspace.recordings.search.setFocus()
    qtbot.keyClick(workspace.recordings.search, Qt.Key.Key_Space)
    assert (workspace.recordings.search.text(), player.is_playing) == (" ", False)
    for was_playing in (True, False):
        (controller.play if was_playing else controller.stop)()
        for widget in (workspace.playback.patch, workspace.steps.table):
            widget.setFocus()
            qtbot.keyClick(widget, Qt.Key.Key_Space)
            plays = widget is workspace.playback.patch
            assert (player.is_playing, controller.target.kind) == (plays, "replay" if plays else "simulator")
            assert controller.is_playing == (plays or was_playing)
    workspace.steps.comparison_wanted.emit()
    qtbot.keyClick(workspace.comparison, Qt.Key.Key_Space)  # no recording is seen: it is the window's
    assert (player.is_playing, controller.is_playing) == (False, True)


def test_what_is_recorded_is_looked_at_and_gets_its_name_when_it_has_ended(window, qtbot, tmp_path, monkeypatch):
    for module in ("widgets.session.session_recording", "widgets.recordings.workspace"):
        monkeypatch.setattr(f"underfoot.{module}.documents_folder", lambda: tmp_path / "recorded")
    monkeypatch.setattr("underfoot.records.renaming.PATIENCE_S", LONG_MS / 1000)  # the recorder may take its time
    said, controller = [], window.controller
    controller.notified.connect(said.append)
    controller.bridge.notified.connect(said.append)

    def record(on):
        with qtbot.waitSignal(controller.recording.file_changed, timeout=LONG_MS):
            controller.recording.record(on)
        return on and controller.session.recording.absolute()

    window.workspaces.choose("Recordings")
    workspace = window.workspaces["Recordings"]
    path = record(True)
    assert workspace.title.full_text == path.stem
    qtbot.waitUntil(lambda: workspace.axis.content is not None and workspace.axis.length_s > 0.5, timeout=LONG_MS)

    content = workspace.axis.content
    for name in ("Monitor", "Recordings"):
        window.workspaces.choose(name)
    assert workspace.axis.content is content  # shown as it was left

    def rename():
        workspace.recordings.list.setFocus()
        qtbot.keyClick(workspace.recordings.list, Qt.Key.Key_F2)
        qtbot.keyClicks(workspace.recordings.inline, "named")
        qtbot.keyClick(workspace.recordings.inline, Qt.Key.Key_Return)

    assert workspace.steps.plot.drawing.note == "after the recording"  # in the room of a small plot
    rename()
    assert "is being recorded; stop that with Ctrl+R" in workspace.recordings.problem.text()
    workspace.recordings.show_problem("")
    qtbot.keyClick(workspace.recordings.list, Qt.Key.Key_Delete)  # or the trash would have what is still written
    assert "is being recorded; stop that with Ctrl+R" in workspace.recordings.problem.text()
    controller.recording.record(False)
    qtbot.waitUntil(lambda: not workspace.progress.text() and not workspace.surveyor.is_busy, timeout=LONG_MS)
    assert not any("not recorded any further" in line for line in said), said
    rename()
    qtbot.waitUntil(lambda: workspace.title.text() == "named", timeout=LONG_MS)
    window.workspaces.choose("Monitor")
    other = record(True)
    window.workspaces.choose("Recordings")
    assert workspace.title.full_text == other.stem
    record(False)
    workspace.reader.close()
    assert [file.name for file in path.parent.iterdir() if other.stem not in file.name] == ["named.underfoot"]
    with Recording(path.with_stem("named")) as recording:
        first, end = recording.span
        assert end - first > 0.5 * 48_000


def test_a_stretch_is_read_and_one_that_is_empty_is_refused(walk):
    forces, floor = read_force_file(walk, stretch_s=(1.0, 1.5))
    assert floor == default_floor(1, 2)
    np.testing.assert_allclose(forces.time_s, 1.0 + np.arange(500) / 1000.0)
    with pytest.raises(BadFile, match="no force samples there"):
        read_force_file(walk, stretch_s=(7.0, 8.0))


def test_a_file_on_the_command_line_is_opened(walk, monkeypatch, tmp_path):
    opened = []
    monkeypatch.setattr("underfoot.__main__.open_window", lambda *given: opened.append(given) or 0)
    CliRunner().invoke(cli, [str(walk)])
    CliRunner().invoke(cli, ["--recording", str(walk)])
    assert [str(given[3]) for given in opened] == [str(walk)] * 2
