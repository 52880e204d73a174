"""What a patch gives to ears: a channel of its own behind the tiles', through the same last stage."""

import json

import numpy as np
import pytest
import soundfile
from click.testing import CliRunner

from underfoot.__main__ import cli
from underfoot.devices.simulated_floor import SimulatedFloor
from underfoot.engine.commands import Level, Panic, Play, Swap
from underfoot.engine.loop import Loop, LoopOptions
from underfoot.engine.render import render_source
from underfoot.floor.layout import default_floor
from underfoot.nodes import REGISTRY
from underfoot.patch.patch import Patch

RATE, FRAMES = 48_000, 48_000


def felt(sound_level=0.05, **tone):
    """A tone on all tiles, and the same for ears; without a `sound_level`, only felt."""
    patch = Patch().add("tone", REGISTRY, frequency=300.0, harmonics=(1.0,), **({"amplitude": 2.0} | tone))
    patch = patch.add("tile-output", REGISTRY).connect("tone.out", "tile-output.acceleration", REGISTRY)
    if sound_level is None:
        return patch
    patch = patch.add("sound-output", REGISTRY, level=sound_level)
    return patch.connect("tone.out", "sound-output.sound", REGISTRY)


def play(patch, *commands, block=1024, floor=None, **options):
    source = SimulatedFloor(floor or default_floor(), RATE, walking=False)
    commands = commands or ((0, Play(True)),)
    return render_source(patch, source, FRAMES / RATE, LoopOptions(block=block, **options), commands=commands)


def test_sound_is_one_channel_behind_the_tiles_which_play_as_without_it():
    plain, heard = play(felt(None)), play(felt())
    assert plain.samples.shape == (FRAMES, 4)
    assert heard.samples.shape == (FRAMES, 5)
    np.testing.assert_array_equal(heard.samples[:, :4], plain.samples)


def test_without_a_channel_sound_is_not_run_and_the_tiles_play_the_same():
    patch = felt().add("noise", REGISTRY).add("sound-output", REGISTRY)
    patch = patch.connect("noise.out", "sound-output1.sound", REGISTRY)
    found = play(patch, sound_channel=-1)
    assert set(found.left_out) == {"sound-output", "noise", "sound-output1"}
    np.testing.assert_array_equal(found.samples, play(felt(None)).samples)


def test_sound_is_the_sum_of_all_tiles_in_full_scale():
    """Four tiles with an amplitude of 2 at 0.05 each: 0.4; a tile gives 2 of its 20 m/s^2."""
    samples = play(felt()).samples[FRAMES // 2 :]
    assert np.abs(samples[:, 4]).max() == pytest.approx(0.4, rel=1e-3)
    assert np.abs(samples[:, 0]).max() == pytest.approx(0.1, rel=1e-3)
    only_one = felt().set("sound-output", "tiles", default_floor().ids[1], REGISTRY)
    assert np.abs(play(only_one).samples[FRAMES // 2 :, 4]).max() == pytest.approx(0.1, rel=1e-3)


@pytest.mark.parametrize("block", [1, 7, 32, 480])
def test_sound_has_the_same_bytes_at_any_block_size(block):
    patch = felt()
    commands = (0, Play(True)), (9000, Level(-6.0)), (20_000, Swap(felt(0.02).dumps(), together=True))
    expected = play(patch, *commands)
    np.testing.assert_array_equal(play(patch, *commands, block=block).samples, expected.samples)


def test_limiter_level_and_panic_act_on_sound():
    loud = play(felt(10.0)).samples[:, 4]
    assert 0.3 < np.abs(loud).max() <= 0.95
    softer = play(felt(), (0, Play(True)), (0, Level(-6.0))).samples[FRAMES // 2 :, 4]
    assert np.abs(softer).max() == pytest.approx(0.4 * 10 ** (-6 / 20), rel=1e-3)
    panicked = play(felt(), (0, Play(True)), (9600, Panic())).samples[:, 4]
    assert panicked[:9600].any()
    assert not panicked[9600 + 48 :].any()


def test_sound_does_not_drive_simulated_plates():
    silent_tiles = felt().set("tile-output", "level", 0.0, REGISTRY)
    found = play(silent_tiles, plates=("accelerometer",))
    assert found.samples[:, 4].any()
    assert not found.tiles["accelerometer"].any()
    assert not found.tiles["commanded"].any()
    with_sound, without = (play(felt(level), plates=("accelerometer",)) for level in (0.05, None))
    np.testing.assert_array_equal(with_sound.tiles["accelerometer"], without.tiles["accelerometer"])


def test_no_tile_shares_the_channel_of_sound_whatever_the_floor_says():
    floor = default_floor()
    assert play(felt(), floor=floor, channels=(3, 0, 5, -1)).samples.shape == (FRAMES, 7)


def test_a_patch_that_comes_later_is_heard_where_a_channel_was_kept():
    commands = (0, Play(True)), (4800, Swap(felt().dumps(), together=True)), (24_000, Swap(felt(None).dumps()))
    kept = play(felt(None), *commands, sound_channel=4).samples[:, 4]
    assert not kept[:4800].any()
    assert np.abs(kept[12_000:24_000]).max() == pytest.approx(0.4, rel=1e-3)
    assert np.abs(kept[40_000:]).max() < 1e-6
    assert play(felt(None), *commands).samples.shape == (FRAMES, 4)


def test_silent_sound_sleeps():
    loop = Loop(felt(amplitude=0.0), REGISTRY, SimulatedFloor(default_floor(), RATE, walking=False), LoopOptions())
    loop.send(Play(True))
    assert not loop.play(9600).any()
    assert loop.program.tables.no_sound[0] == 1
    assert loop.program.awake()["sound-output"] == 0


def test_render_writes_sound_as_a_further_channel(tmp_path):
    patch = tmp_path / "patch.json"
    patch.write_bytes(felt().dumps())
    said = CliRunner().invoke(
        cli, ["render", str(patch), "-o", str(tmp_path / "out.wav"), "--force", "none", "--seconds", "0.5", "--json"]
    )
    assert said.exit_code == 0, said.output
    assert soundfile.info(tmp_path / "out.wav").channels == 5
    assert json.loads(said.stdout)["peak"] == pytest.approx(0.4, rel=2e-2)  # the DC block overshoots as the tone begins
