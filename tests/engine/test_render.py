"""A patch played offline: the same bytes for any block, at any rate, and figures of what came out."""

import math
import tracemalloc

import numpy as np
import pytest
from long_recording import write_recording
from made_patches import hum, rough_step, stepped_bank

from underfoot.devices.simulated_floor import SimulatedFloor
from underfoot.engine.commands import Level, Play, PressTile, Set, Strike
from underfoot.engine.loop import LoopOptions
from underfoot.engine.offline import RenderJob
from underfoot.engine.render import render_source
from underfoot.engine.session_replay import ReplayJob
from underfoot.errors import BadValue
from underfoot.floor.layout import default_floor
from underfoot.nodes import REGISTRY
from underfoot.records.recording import Recording

FLOOR = default_floor()
SECONDS = 1.5


def walked(patch, block=1024, seed=None, **commands):
    return render_source(patch, SimulatedFloor(FLOOR), SECONDS, LoopOptions(block=block, seed=seed), **commands)


@pytest.mark.parametrize("patch", [stepped_bank(), rough_step(), hum()])
def test_the_walk_gives_the_same_bytes_for_any_block_size(patch):
    whole = walked(patch).samples
    assert whole.any()
    for block in (7, 64):
        assert walked(patch, block).samples.tobytes() == whole.tobytes()


def test_commands_at_odd_frames_give_the_same_bytes_for_any_block_size():
    commands = (
        (0, Play(True)),
        (5_001, Set("modal-bank", "pitch", 0.7)),
        (9_007, Strike("", "t4", 1.0)),
        (11_111, PressTile("t2", 0.01, 0.02, 250.0)),
        (20_003, Level(-9.0)),
        (30_001, PressTile("t2", 0.0, 0.0, 0.0)),
        (50_021, Play(False)),
    )
    whole = walked(stepped_bank(), commands=commands).samples
    assert whole[:, 1].any()
    assert whole[:, 3].any()
    assert not whole[50_021 + 512 :].any()
    for block in (7, 64):
        assert walked(stepped_bank(), block, commands=commands).samples.tobytes() == whole.tobytes()


def test_the_seed_decides():
    own = walked(rough_step()).samples
    assert walked(rough_step(), seed=rough_step().seed).samples.tobytes() == own.tobytes()
    assert walked(rough_step(), seed=4).samples.tobytes() != own.tobytes()


def test_the_first_foot_comes_down_at_a_fifth_of_a_second():
    out = walked(rough_step()).samples
    first = np.flatnonzero(out.any(axis=1))[0] / 48_000
    assert 0.2 <= first < 0.23


def test_nothing_is_let_out_unless_it_is_asked_for():
    assert not walked(hum(), commands=()).samples.any()


def test_an_empty_floor_puts_everything_to_sleep():
    rendered = render_source(stepped_bank(), SimulatedFloor(FLOOR, walking=False), 0.5)
    assert not rendered.samples.any()
    assert rendered.run == []
    assert set(rendered.asleep) == {"tile-force", "footfall", "join", "strike", "modal-bank", "tile-output"}


def test_the_summary_says_what_came_out():
    rendered = walked(hum(tone={"amplitude": 2.0, "harmonics": (1.0,)}).add("noise", REGISTRY))
    summary = rendered.summary()
    assert summary["peak"] == pytest.approx(0.1, rel=0.1)  # 2 of 20 m/s^2
    assert summary["rms"] == pytest.approx(math.sqrt(np.mean(rendered.samples.astype(float) ** 2)))
    assert summary["seconds"] == SECONDS
    assert 0.0 < summary["times_real_time"] < summary["program_times_real_time"]
    assert summary["nodes"] == {"run": ["tone", "tile-output"], "asleep": [], "left_out": ["noise"]}


def test_another_rate_is_played_at_that_rate():
    tone = hum(tone={"frequency": 100.0, "harmonics": (1.0,)})
    low, high = (
        render_source(tone, SimulatedFloor(FLOOR, rate_hz), 1.0, LoopOptions(rate_hz=rate_hz))
        for rate_hz in (44_100.0, 96_000.0)
    )
    for rendered in (low, high):
        spectrum = np.abs(np.fft.rfft(rendered.samples[:, 0]))
        assert np.argmax(spectrum) == 100
    assert (len(low.samples), len(high.samples)) == (44_100, 96_000)


def test_a_long_rendering_is_written_as_it_is_played_and_not_kept(tmp_path):
    job = RenderJob(hum(), seconds=5.0, options=LoopOptions(plates=("accelerometer",)))
    whole = job.run()
    whole.save(tmp_path / "whole.wav")
    files = {"": tmp_path / "played.wav", "accelerometer": tmp_path / "measured.wav"}
    tracemalloc.start()
    played = RenderJob(hum(), seconds=5.0).run({"": files[""]})
    _, most = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert most < 0.5 * whole.samples.nbytes
    assert files[""].read_bytes() == (tmp_path / "whole.wav").read_bytes()
    assert played.samples.tobytes() == whole.samples.tobytes()
    measured = job.run(files)
    assert measured.tiles["accelerometer"].tobytes() == whole.tiles["accelerometer"].tobytes()
    figures = ("peak", "rms", "accelerometer", "commanded")
    assert [measured.summary()[name] for name in figures] == [whole.summary()[name] for name in figures]


def test_a_long_recording_is_replayed_part_by_part(tmp_path):
    path = write_recording(tmp_path / "long.underfoot", 20.0)
    with Recording(path) as recording:
        whole = recording.force_samples().nbytes
    RenderJob(hum(), seconds=0.1).run()  # loads kernels, which would count
    tracemalloc.start()
    played = ReplayJob(path).run({"": tmp_path / "played.wav"})
    _, most = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert len(played.samples) == 20 * 48_000
    assert most < 0.5 * whole


@pytest.mark.parametrize(
    ("seconds", "options"),
    [(0.0, {}), (math.nan, {}), (1e-5, {}), (1.0, {"block": 0}), (1.0, {"block": 1 << 20}), (1.0, {"rate_hz": 10.0})],
)
def test_what_cannot_be_rendered_is_refused(seconds, options):
    with pytest.raises(BadValue, match="allowed: "):
        render_source(hum(), SimulatedFloor(FLOOR), seconds, LoopOptions(**options))
