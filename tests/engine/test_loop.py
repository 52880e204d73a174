"""The engine's loop: commands at span edges, the same bytes for any block, swaps that cannot be heard."""

import tracemalloc

import numpy as np
import pytest
from loops import FLOOR, loop_of, played
from made_patches import hum, patch_of, rough_step, stepped_bank

from underfoot.clock import FADE
from underfoot.engine.commands import Level, Panic, Play, PressTile, Pulse, Set, Strike, Swap, Tare, Walk
from underfoot.engine.safety import Limits
from underfoot.engine.tile_pulse import PULSE_HZ, PULSE_M_S2, PULSE_S
from underfoot.floor.layout import Floor
from underfoot.nodes import REGISTRY
from underfoot.parameters import Number
from underfoot.patch.node import Input, Output, node

OPEN = Limits(peak=1.0, rms=1.0)


# Frames that are no span edges, nor the edges of any block that the test uses.
AT_ODD_FRAMES = (
    (3_001, Strike("", "t2", 0.7)),
    (4_003, Set("modal-bank", "pitch", 1.4)),
    (5_000, PressTile("t3", 0.05, -0.02, 300.0)),
    (9_999, Level(-6.0)),
    (12_345, "swap"),
    (12_400, "swap back"),
    (12_500, Set("modal-bank", "level", 0.3)),
    (13_999, "swap"),
    (14_001, "swap back in turn"),
    (14_003, Set("modal-bank", "pitch", 0.9)),
    (15_000, Tare()),
    (17_001, PressTile("t3", 0.0, 0.0, 0.0)),
    (20_011, Walk(False)),
    (21_013, Pulse("t4")),
    (26_017, Panic()),
    (27_019, Play(True)),
    (28_021, Walk(True)),
)


@pytest.mark.parametrize("blocks", [[1024], [64], [7], [1, 500, 33, 3000]])
def test_commands_at_odd_frames_give_the_same_bytes_at_any_block_size(blocks):
    def run(blocks):
        loop = loop_of(stepped_bank(), block=max(blocks))
        for frame, command in AT_ODD_FRAMES:
            if isinstance(command, str):
                patch = rough_step() if command == "swap" else stepped_bank()
                command = Swap(patch.dumps(), together=command != "swap back in turn")
            loop.send(command, frame)
        return played(loop, 40_000, blocks), [(done.frame, done.command) for done in loop.applied]

    whole, told = run([128])
    out, again = run(blocks)
    assert all(whole[:, channel].any() for channel in range(4))
    assert out.tobytes() == whole.tobytes()
    assert again == told


def test_commands_act_on_the_next_span_edge_and_say_when():
    loop = loop_of(stepped_bank(), block=100)
    loop.send(Level(-3.0), 33)
    loop.send(Level(-6.0), 64)
    loop.send(Level(1e6), 10)  # no more than 0 dB
    for _ in range(2):
        loop.run(100)
    assert [done.frame for done in loop.applied] == [0, 64, 64, 64]


def test_a_block_however_large_takes_every_sample():
    small = played(loop_of(rough_step(), block=480), 65_536)
    large = played(loop_of(rough_step(), block=65_536), 65_536)
    assert small.any()
    assert small.tobytes() == large.tobytes()


# --- live edits ---


@pytest.mark.parametrize("patch", [stepped_bank(), rough_step(), hum()])
def test_swapping_a_patch_for_itself_cannot_be_heard(patch):
    """States are kept, and the gains of old and new sum to 1: bit for bit the same."""
    plain = played(loop_of(patch), 48_000)
    loop = loop_of(patch)
    loop.send(Swap(patch.dumps()), 11_111)
    loop.send(Swap(patch.dumps()), 11_200)
    loop.send(Swap(patch.dumps()), 30_000)
    assert plain.any()
    assert played(loop, 48_000).tobytes() == plain.tobytes()
    assert len(loop.programs.retired) == 3


def test_another_patch_is_faded_in_over_the_old_one():
    old, new = hum(tone={"frequency": 100.0}), hum(tone={"frequency": 130.0, "amplitude": 2.0})
    edge = 9_600
    loops = [loop_of(p, walking=False, limits=(OPEN,) * 4) for p in (old, new, old)]
    mixed = loops[2]
    replaced = mixed.program
    mixed.send(Swap(new.dumps()), edge)
    before, _, out = (played(loop, 19_200)[:, 0].astype(float) for loop in loops)
    assert out[:edge].tobytes() == before[:edge].tobytes()
    assert mixed.programs.retired[0] is replaced
    # No step is larger than those of the louder tone alone, and than what the fade itself adds.
    steepest = np.abs(np.diff(before)).max() + np.abs(before).max() * 2.0 / FADE
    assert np.abs(np.diff(out)).max() <= steepest


@pytest.mark.parametrize("blocks", [[1024], [7, 500]])
def test_where_both_would_cost_too_much_the_old_one_is_faded_out_first(blocks):
    patch = hum(tone={"frequency": 4_800.0, "amplitude": 2.0})  # so high that the stage behind leaves ramps as they are
    plain = played(loop_of(patch, walking=False), 24_000)[:, 0].astype(float)
    loop = loop_of(patch, block=max(blocks), walking=False)
    replaced = loop.program
    loop.send(Swap(patch.dumps(), together=False), 9_600)
    loop.send(Set("tone", "amplitude", 4.0), 9_700)  # meant for both
    loop.send(Swap(patch.set("tone", "amplitude", 4.0, REGISTRY).dumps()), 9_800)  # has to wait
    out = played(loop, 24_000, blocks)[:, 0].astype(float)
    amplitude = np.interp(np.arange(24_000), [9_728, 9_968], [1.0, 2.0])
    gain = np.interp(np.arange(24_000), [9_600, 10_080, 10_560], [1.0, 0.0, 1.0])
    np.testing.assert_allclose(out[9_000:], (plain * amplitude * gain)[9_000:], atol=2e-3)
    assert loop.programs.retired[0] is replaced
    assert len(loop.programs.retired) == 2


def test_a_number_of_a_patch_that_does_not_play_yet_does_no_harm():
    loop = loop_of(hum())
    for command in (Set("tone", "cutoff", 3.0), Set("tone", "frequency", -1.0), Set("nobody", "level", 1.0)):
        loop.send(command)
    assert played(loop, 480).tobytes() == played(loop_of(hum()), 480).tobytes()


def test_a_number_that_is_set_moves_in_a_ramp():
    loop = loop_of(hum(tone={"frequency": 400.0, "amplitude": 2.0}), walking=False, limits=(OPEN,) * 4)
    loop.send(Set("tone", "amplitude", 8.0), 9_600)
    out = played(loop, 19_200)[:, 0]
    height = np.abs(out).reshape(-1, 240).max(axis=1)  # two periods each
    assert height[39] == pytest.approx(0.1 * height[-1] * 2.5, rel=0.01)
    assert height[41:] == pytest.approx(height[-1], rel=0.01)


def test_what_is_looked_at_goes_on_through_swaps_and_commands():
    patch = hum(tone={"amplitude": 2.0})
    loop = loop_of(patch, block=1024, walking=False, scopes=("tone.out",))
    loop.send(Swap(patch.dumps(), ("tone.out",)), 1_500)
    loop.send(Level(-6.0), 3_333)
    seen = []
    for _ in range(6):
        loop.run(1024)
        seen.append(loop.scope_frames.copy())
    seen = np.concatenate(seen)
    plain = loop_of(patch, block=6144, walking=False, scopes=("tone.out",))
    plain.run(6144)
    np.testing.assert_array_equal(seen, plain.scope_frames)


# --- what must never reach the shaker ---


@node("broken", "Tests")
class Broken:
    """Not a number while more than 400 N are on the tile."""

    force = Input("N")
    high = Number(400.0, 0.0, 1e4, unit="N")
    out = Output("m/s^2")
    muted_by = ("force",)

    def run(force, high, out):
        for i in range(out.size):
            out[i] = np.nan if force[i] > high else 0.001 * force[i]


def test_a_node_that_makes_nan_is_silenced_and_named():
    registry = {**REGISTRY, "broken": Broken}
    patch = hum(tone={"amplitude": 1.0}).add("tile-force", registry).add("broken", registry)
    patch = patch.add("tile-output", registry)
    patch = patch.connect("tile-force.force", "broken.force", registry)
    patch = patch.connect("broken.out", "tile-output1.acceleration", registry)
    loop = loop_of(patch, registry=registry)
    out = played(loop, 48_000)
    assert np.isfinite(out).all()
    ((name, tile, frame),) = loop.program.faults()
    force = np.zeros((4, 4, 48_000))
    other = loop_of(hum())
    for at in range(0, 48_000, 240):
        other.intake.take(at + 240)
        other.intake.fill(at, 240)
        force[:, :, at : at + 240] = other.intake.signals[:, :, :240]
    first = np.flatnonzero((force[0] > 400.0).any(axis=0))[0]
    assert (name, tile) == ("broken", FLOOR.ids[int(np.argmax(force[0, :, first]))])
    assert first - 128 <= frame <= first
    hummed = played(loop_of(hum(tone={"amplitude": 1.0})), 48_000)
    unhurt = [i for i in range(4) if not (force[0, i] > 400.0).any() and not force[0, i].any()]
    np.testing.assert_array_equal(out[:, unhurt], hummed[:, unhurt])


def test_a_pulse_tells_which_tile_is_which_on_its_channel():
    tiles = tuple(
        type(tile)(tile.id, tile.size_m, tile.centre_m, sensors_m=tile.sensors_m, output=channel)
        for tile, channel in zip(FLOOR.tiles, (3, 0, 5, 1), strict=True)
    )
    floor = Floor(tiles)
    assert floor.channels == (3, 0, 5, 1)
    loop = loop_of(patch_of(), floor=floor, walking=False)
    loop.send(Pulse("t3"), 960)
    out = played(loop, 24_000)
    assert out.shape[1] == 6
    assert np.flatnonzero(out.any(axis=0)).tolist() == [5]
    sounding = np.flatnonzero(out[:, 5])
    time_s = np.arange(24_000) / 48_000 - 0.02
    burst = PULSE_M_S2 * np.sin(np.pi * time_s / PULSE_S) ** 2 * np.sin(2.0 * np.pi * PULSE_HZ * time_s)
    expected = np.where((time_s >= 0.0) & (time_s < PULSE_S), burst, 0.0) / Limits().acceleration_per_unit
    assert sounding[0] >= 960
    assert np.abs(out[:, 5] - expected).max() < 0.1 * np.abs(expected).max()  # the DC block turns 60 Hz by 5 degrees


# --- real time ---


def test_ten_thousand_blocks_allocate_nothing():
    loop = loop_of(stepped_bank(), block=64, scopes=("modal-bank.out",))
    for _ in range(3_000):
        loop.run(64)
    loop.applied.clear()
    tracemalloc.start()
    try:
        for _ in range(100):
            loop.run(64)
        before, _ = tracemalloc.get_traced_memory()
        tracemalloc.reset_peak()
        for _ in range(10_000):
            loop.run(64)
        after, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert after - before < 64  # a counter that became a longer number
    assert peak - before < 1024  # one signal of one tile would be 512 bytes


def test_a_patch_that_begins_to_read_where_people_stand_gets_the_same_place_as_one_that_always_did():
    def places(loop, frames):
        out = np.empty((frames, 4), np.float32)
        for at in range(0, frames, 240):
            loop.run(240)
            out[at : at + 240] = loop.scope_frames[:240]
        return out

    reads_place = hum().add("contact", REGISTRY)
    always, later = (loop_of(patch, scopes=scopes) for patch, scopes in ((reads_place, ("contact.x",)), (hum(), ())))
    later.send(Swap(reads_place.dumps(), ("contact.x",)), 24_000)
    wanted, found = places(always, 96_000), places(later, 96_000)
    assert wanted[:24_000].any()
    assert wanted[24_000:].any()
    np.testing.assert_array_equal(found[24_000:], wanted[24_000:])
