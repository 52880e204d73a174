"""What is played is exchanged for something else: from the start again, for the other slot, for one node alone."""

import math

import numpy as np
import pytest
from loops import FLOOR, loop_of, played
from made_patches import hum, patch_of, stepped_bank
from msgspec.structs import replace

from underfoot.clock import FADE
from underfoot.devices.simulated_floor import SimulatedFloor
from underfoot.engine.commands import CancelStart, Play, PressTile, Set, Start, Strike, Swap, from_text, to_text
from underfoot.engine.loop import Loop, LoopOptions
from underfoot.engine.outlines import outlines
from underfoot.engine.preview import longest_s, previewed
from underfoot.engine.render import render_source
from underfoot.engine.reports import COMMANDED, MEASURED
from underfoot.errors import BadValue
from underfoot.nodes import REGISTRY
from underfoot.patch import preset_files
from underfoot.patch.audition import attenuated, auditioned
from underfoot.patch.patch import Patch

RATE = 48_000


def preset(name):
    return Patch.load(preset_files.patches()[name], REGISTRY)


def rhythmic(**rhythm):
    """Two notes of 0.1 s, once, as the patch begins to play."""
    notes = {"notes": ((0, 6, 1.0), (12, 6, 0.5)), "bar": 0.2, "repeats": 1, **rhythm}
    return patch_of(
        ("rhythm.out", "attack-decay.strike"),
        ("attack-decay.out", "tone.amplitude"),
        ("tone.out", "tile-output.acceleration"),
        rhythm=notes,
    )


# --- from the start ---


def swap(patch, **how):
    return Swap(patch.dumps(), **how)


@pytest.mark.parametrize("blocks", [[1024], [7, 500]])
def test_a_rhythm_that_begins_at_once_plays_again_from_the_start(blocks):
    patch, at = rhythmic(), 32 * 900
    loop = loop_of(patch, block=max(blocks), walking=False)
    loop.send(swap(patch), 32 * 600)  # goes on from where it is: it is over, and stays so
    loop.send(swap(patch, anew=True), at)
    out = played(loop, 2 * at, blocks)[:, 0]
    first, between, again = out[: RATE // 4], out[RATE // 2 : at], out[at : at + RATE // 4]
    assert first.any()
    assert np.abs(between).max() < 1e-6  # what the DC block still lets out
    np.testing.assert_allclose(again[FADE:], first[FADE:], atol=2e-4)  # one after the DC block was at rest


@pytest.mark.parametrize("together", [True, False])
def test_a_strike_whose_time_has_not_come_goes_on_in_the_patch_that_follows(together):
    patch = stepped_bank()
    plain, swapped = (loop_of(patch, walking=False) for _ in range(2))
    for loop in (plain, swapped):
        loop.send(Strike("", "t2", 1.0, delay_s=0.5))
    swapped.send(swap(patch, together=together), 32 * 300)
    expected, found = (played(loop, RATE) for loop in (plain, swapped))
    assert expected[RATE // 2 :, 1].any()
    assert found.tobytes() == expected.tobytes()


def test_a_patch_that_begins_anew_has_no_strike_of_the_one_before():
    loop = loop_of(stepped_bank(), walking=False)
    loop.send(Strike("", "t2", 1.0, delay_s=0.5))
    loop.send(swap(stepped_bank(), anew=True), 32 * 300)
    assert not played(loop, RATE).any()


def test_a_start_is_recorded_as_it_was_sent():
    sent = swap(rhythmic(), anew=True, settle_s=0.25)
    assert from_text(*to_text(sent)) == sent
    kind, body = to_text(swap(rhythmic()))
    assert from_text(kind, body.replace(',"anew":false,"settle_s":0.0', "")) == swap(rhythmic())


def test_feet_that_stand_stay_what_they_were_when_it_plays_from_the_start():
    """A step was made once; to begin again is no other."""
    patch = patch_of(
        ("tile-force.force", "footfall.force"),
        ("footfall.onset", "modal-bank.strike"),
        ("modal-bank.out", "tile-output.acceleration"),
    )
    loop = standing(patch)
    loop.send(swap(patch, anew=True), RATE)
    out = played(loop, 2 * RATE)[:, 0]
    assert out[: RATE // 2].any()
    assert not out[RATE:].any()


# --- without a click ---


def standing(patch, **options):
    """A loop on whose first tile somebody stands, and shifts from time to time."""
    loop = loop_of(patch, walking=False, **options)
    for k, force_n in enumerate((350.0, 700.0, 680.0, 705.0, 660.0, 700.0, 690.0, 700.0, 650.0, 700.0)):
        loop.send(PressTile("t1", 0.0, 0.01 * (k % 3), force_n), 4_800 + 9_600 * k)
    return loop


PAIRS = [("gravel", "wood"), ("stimulus-tc", "stimulus-sp"), ("tacton-ws1", "tacton-it1"), ("material-wood", "snow")]


@pytest.mark.parametrize(("a", "b"), PAIRS)
def test_switching_between_a_and_b_under_a_foot_makes_no_step_larger_than_their_own(a, b):
    """Forth and back while the foot shifts. Beyond each signal's own steps there is what the fade adds, of 10 ms."""
    first, second = preset(a), attenuated(preset(b), REGISTRY, 0.5)
    alone = [played(standing(patch), 96_000)[:, 0].astype(float) for patch in (first, second)]
    loop = standing(first)
    at = 38_400, 67_200
    for frame, patch in zip(at, (second, first), strict=True):
        loop.send(swap(patch, settle_s=0.25), frame)
    out = played(loop, 96_000)[:, 0].astype(float)
    highest = max(np.abs(signal[24_000:]).max() for signal in alone)
    own = max(np.abs(np.diff(signal[24_000:])).max() for signal in alone)
    assert np.abs(np.diff(out[36_000:])).max() <= own + 2.0 * highest / FADE
    assert np.abs(out[36_000:]).max() <= 1.05 * highest + 1e-3


@pytest.mark.parametrize("node", ["tile-force", "noise", "strain-rate-envelope", "footfall"])
def test_auditioning_a_node_makes_no_step_larger_than_the_signals_own(node):
    patch = preset("wood")
    id = next(one.id for one in patch.nodes if one.type == node)
    alone = auditioned(patch, REGISTRY, id, peak=700.0 if node == "tile-force" else 1.0).patch
    signals = [played(standing(one), 96_000)[:, 0].astype(float) for one in (patch, alone)]
    loop = standing(patch)
    loop.send(swap(alone, settle_s=0.25), 38_400)
    loop.send(swap(patch, settle_s=0.25), 67_200)
    out = played(loop, 96_000)[:, 0].astype(float)
    highest = max(np.abs(signal[24_000:]).max() for signal in signals)
    own = max(np.abs(np.diff(signal[24_000:])).max() for signal in signals)
    assert np.abs(np.diff(out[36_000:])).max() <= own + 2.0 * highest / FADE


def test_one_that_has_settled_before_need_not_wait():
    """Where every node goes on from where it was, a switch is heard within one fade."""
    soft, loud = hum(tone={"amplitude": 1.0}), hum(tone={"amplitude": 4.0})
    loop = loop_of(soft, walking=False)
    loop.send(swap(loud, settle_s=0.25), 9_600)
    out = np.abs(played(loop, 19_200)[:, 0])
    assert out[9_600 + 2 * FADE : 14_400].max() > 3.0 * out[4_800:9_600].max()


# --- one node alone ---


def heard(patch, strike=""):
    """What the tiles are asked for a second, in which one may be struck."""
    commands = ((0, Play(True)), *([(9_600, Strike("", strike))] if strike else []))
    source = SimulatedFloor(FLOOR, walking=True)
    done = render_source(patch, source, 1.0, LoopOptions(plates=("accelerometer",)), commands=commands)
    return done.tiles["commanded"]


def test_an_acceleration_is_heard_as_it_is_and_on_one_tile():
    patch = preset("gravel")
    id = next(node.id for node in patch.nodes if node.type == "noise")
    found = auditioned(patch, REGISTRY, id, tile="t2")
    assert found.text == "as it is, in m/s²"
    own = patch_of(("noise.out", "tile-output.acceleration"))
    assert heard(found.patch)[:, 1].any() or not heard(own).any()
    assert not heard(found.patch)[:, [0, 2, 3]].any()


def test_a_force_is_the_loudness_of_a_tone_whose_peak_is_stated():
    patch = preset("stimulus-tc")
    id = next(node.id for node in patch.nodes if node.type == "tile-force")
    found = auditioned(patch, REGISTRY, id, peak=350.0)
    assert "200 Hz" in found.text
    assert "350 N" in found.text
    loop = standing(found.patch, block=1024, plates=("accelerometer",))
    most = 0.0
    for _ in range(19):
        loop.run(1024)
        most = max(most, float(np.abs(loop.commanded[:, 0]).max()))
    assert most == pytest.approx(2.0, rel=0.12)  # 700 N, where 350 N is 1 m/s²


def test_events_strike_what_they_lead_to_and_tick_where_they_lead_nowhere():
    patch = patch_of(("strike.out", "modal-bank.strike"), ("modal-bank.out", "tile-output.acceleration"))
    through = auditioned(patch, REGISTRY, "strike")
    assert through.text == "through what its events strike"
    np.testing.assert_array_equal(heard(through.patch, "t1"), heard(patch, "t1"))
    loose = auditioned(Patch().add("strike", REGISTRY), REGISTRY, "strike")
    assert loose.text == "its events as ticks"
    ticks = heard(loose.patch, "t1")
    assert np.abs(ticks[:, 0]).max() == pytest.approx(1.0, rel=0.05)
    assert not ticks[:9_600].any()
    assert not ticks[9_600 + 2_000 :].any()


def test_an_output_is_heard_without_the_others_and_a_muted_node_in_spite_of_it():
    patch = hum().add("noise", REGISTRY).add("tile-output", REGISTRY)
    patch = patch.connect("noise.out", "tile-output1.acceleration", REGISTRY)
    np.testing.assert_array_equal(heard(auditioned(patch, REGISTRY, "tile-output").patch), heard(hum()))
    muted = hum().mark(["tone"], "muted", on=True)
    assert heard(auditioned(muted, REGISTRY, "tone").patch).any()
    assert heard(auditioned(patch.mark(["noise"], "soloed", on=True), REGISTRY, "tone").patch).any()


def test_what_is_played_softer_is_so_by_the_factor():
    np.testing.assert_allclose(heard(attenuated(hum(), REGISTRY, 0.25)), 0.25 * heard(hum()), atol=1e-6)
    assert attenuated(hum(), REGISTRY, 1.0) is hum() or attenuated(hum(), REGISTRY, 1.0) == hum()


# --- previews ---


def test_a_preview_lasts_until_the_patch_has_come_to_its_end():
    tacton = preset("tacton-ws1")
    sink = next(node.id for node in tacton.nodes if node.type == "tile-output")
    force_n, signals, _ = previewed(tacton, (f"{sink}.played",), FLOOR.tiles[3], 0.0, RATE, measures=True)
    sounding = np.flatnonzero(np.abs(signals[f"{sink}.played"]) > 1e-3)
    assert 1.7 < sounding[-1] / RATE < len(force_n) / RATE < 2.2  # three bars of 0.6 s
    assert {len(signals[name]) for name in (f"{sink}.played", COMMANDED, MEASURED)} == {len(force_n)}
    np.testing.assert_allclose(signals[COMMANDED][RATE // 10 :], signals[f"{sink}.played"][RATE // 10 :], atol=1e-5)


def test_a_preview_shows_what_comes_after_what():
    """Drops that begin later than a note is long were beyond its end."""
    patch = Patch().add("attack-decay", REGISTRY, duration=0.5, decay=1.0).add("event-delay", REGISTRY, time=2.0)
    assert longest_s(patch) == pytest.approx(2.0 + 1.1)
    assert longest_s(patch.connect("event-delay.out", "attack-decay.strike", REGISTRY)) == pytest.approx(3.5 + 1.1)


def test_a_preview_shows_what_comes_after_a_time_that_a_wire_brings():
    """A strike that a wire delayed by 2 s was "silent in this step", as the time that was set is 0.1 s."""
    late = Patch().add("event-delay", REGISTRY).add("value", REGISTRY, low=-1.0, high=2.0)
    assert longest_s(late.connect("value.out", "event-delay.time", REGISTRY)) == pytest.approx(2.0 + 1.1)
    turned = Patch().add("event-delay", REGISTRY).add("map", REGISTRY, out_low=30.0, out_high=1.0)
    assert longest_s(turned.connect("map.out", "event-delay.time", REGISTRY)) == 10.0
    unknown = late.add("random-walk", REGISTRY).connect("random-walk.out", "event-delay.time", REGISTRY)
    assert longest_s(unknown) == longest_s(late)


def test_a_preview_without_an_end_lasts_a_step_and_one_that_was_chosen_as_long_as_was_said():
    assert longest_s(hum()) == 0.9
    assert len(previewed(hum(), ("tone.out",), FLOOR.tiles[0], 0.0, RATE)[0]) == round(0.9 * RATE)
    assert len(previewed(hum(), ("tone.out",), FLOOR.tiles[0], 2.0, RATE)[0]) == 2 * RATE


def test_a_node_of_a_plug_in_says_by_itself_how_long_a_preview_takes(monkeypatch):
    swell = replace(REGISTRY["tone"], type="swell", lasts=lambda values: 100.0 / values["frequency"])
    monkeypatch.setitem(REGISTRY, "swell", swell)
    assert longest_s(Patch().add("swell", frequency=50.0)) == longest_s(Patch().add("rhythm", bar=2.0, repeats=1))
    monkeypatch.setitem(REGISTRY, "swell", replace(swell, lasts=lambda values: math.nan))
    with pytest.raises(BadValue, match="lasts of swell is nan; allowed: seconds, 0 or more"):
        longest_s(Patch().add("swell"))


def test_outlines_are_the_extremes_of_what_previews_of_each_node_show():
    patch = preset("material-gravel-coarse")
    bank = next(node.id for node in patch.nodes if node.type == "drawn-bank")
    bundle = next(node.id for node in patch.nodes if node.type == "fibre-bundle")
    signals, events = outlines(patch, (bank, bundle, "no such node"), FLOOR.tiles[0], 0.896, RATE)
    _, frames, rows = previewed(patch, (f"{bank}.out", f"{bundle}.events"), FLOOR.tiles[0], 0.896, RATE)
    stretches, found = frames[f"{bank}.out"].reshape(256, 168), signals[f"{bank}.out"].reshape(256, 2)
    assert found.max() > 0.1
    np.testing.assert_array_equal(found.min(axis=1), stretches.min(axis=1))
    np.testing.assert_array_equal(found.max(axis=1), stretches.max(axis=1))
    assert events[f"{bundle}.events"][:, 1].max() == rows[f"{bundle}.events"][:, 1].max() > 0.0
    assert len(events[f"{bundle}.events"]) <= 256


def test_a_node_that_cannot_be_rendered_hides_no_other_ones_outline():
    patch = hum().add("wav-player", REGISTRY, file="not there.wav")
    signals, _ = outlines(patch, ("tone", "wav-player"), FLOOR.tiles[0], 0.9, RATE)
    assert list(signals) == ["tone.out"]


@pytest.mark.parametrize("blocks", [[64], [7], [1, 500, 33, 3000]])
def test_what_settles_or_begins_anew_gives_the_same_bytes_at_any_block_size(blocks):
    first, second = preset("tacton-ws1"), preset("wood")

    def run(blocks):
        loop = standing(first, block=max(blocks))
        for frame, how in (
            (9_001, swap(second, settle_s=0.05)),
            (9_100, Strike("", "t1")),
            (15_003, swap(second, anew=True)),
            (20_011, swap(first, anew=True, settle_s=0.02)),
            (24_007, swap(second, together=False, settle_s=0.02)),
        ):
            loop.send(how, frame)
        return played(loop, 40_000, blocks).tobytes()

    assert run(blocks) == run([1024])


# --- with the step of a preview ---


def start(patch, frame=0, tile="t1"):
    return Start(patch.dumps(), tile=tile, from_frame=frame)


@pytest.mark.parametrize("name", ["footfalls on wood", "gravel"])
def test_a_start_plays_what_the_preview_shows_of_a_patch_that_force_drives(name):
    patch, at = preset("gravel") if name == "gravel" else stepped_bank(), 48_000
    loop = Loop(patch, REGISTRY, SimulatedFloor(FLOOR, walking=False), LoopOptions(block=480, measures=True))
    loop.send(Play(True))
    loop.play(at)
    loop.send(start(patch), at)
    played_too = loop.play_all(round(0.9 * RATE))
    _, signals, _ = previewed(patch, (), FLOOR.tiles[0], 0.9, RATE, measures=True)
    ours, shown = played_too["commanded"][:, 0], signals[COMMANDED]
    assert np.abs(shown).max() > 0.1
    assert not played_too["commanded"][:, 1:].any()
    if name == "gravel":  # chance is drawn by the frame
        assert np.std(ours) == pytest.approx(np.std(shown), rel=0.2)
    else:
        np.testing.assert_allclose(ours, shown, atol=1e-4 * np.abs(shown).max())


@pytest.mark.parametrize("blocks", [[1024], [7, 500]])
def test_starts_wait_for_their_frame_beside_other_commands_and_replay_to_the_same_bytes(blocks):
    patch, due = stepped_bank(), 32 * 500
    loop = loop_of(patch, block=max(blocks), walking=False)
    played(loop, 3200)
    loop.send(start(patch, due).prepared(loop))
    loop.send(Set("tile-output", "level", 0.3))
    out = played(loop, 2 * due, blocks)
    done = [(one.frame, one.command) for one in loop.applied]
    assert [frame for frame, command in done if isinstance(command, Start)] == [due]
    assert [type(command) for _, command in done] == [Play, Set, Start, Set]  # the built program has the number, too
    again = Loop(patch, REGISTRY, SimulatedFloor(FLOOR, walking=False), LoopOptions(block=640))
    for frame, command in done:
        again.send(from_text(*to_text(command)), frame)
    np.testing.assert_array_equal(played(again, 3200 + 2 * due, [640])[3200:], out)


def test_another_patch_or_its_end_cancels_a_start_that_waits():
    patch = stepped_bank()
    loop = loop_of(patch, walking=False)
    for cancel in (swap(rhythmic()), CancelStart(), start(patch)):
        loop.send(start(patch, loop.frame + 4800))
        loop.send(cancel)
        played(loop, 9600)
    assert [one.command.from_frame for one in loop.applied if isinstance(one.command, Start)] == [0]
