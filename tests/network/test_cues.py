"""Cues: what may be in them, and the patch that a floor plays with them."""

import math

import numpy as np
import pytest
from made_walks import Foot, corner_forces

from underfoot.engine.commands import Play
from underfoot.engine.loop import Loop
from underfoot.engine.session_replay import RecordedForce
from underfoot.errors import BadValue
from underfoot.floor.layout import default_floor
from underfoot.network.addresses import Address
from underfoot.network.cue_patch import CuedChanges, require_settable, with_cues
from underfoot.network.cues import MarkCue, PanicCue, PlayCue, SetCue, StopCue, StrikeCue, cue_of
from underfoot.network.osc import Message
from underfoot.network.plan import NetworkPlan
from underfoot.nodes import REGISTRY
from underfoot.patch import preset_files
from underfoot.patch.patch import Patch
from underfoot.records.wav import write_wav

FLOOR = default_floor(2, 2)
GRAVEL = Patch.load(preset_files.patches()["gravel"], REGISTRY)
NAN, INFINITE = math.nan, math.inf


def test_cues_are_what_their_messages_say():
    assert cue_of(Message("/underfoot/play", ("snow", "all", -3.5, 7))) == PlayCue("snow", "all", -3.5, 7)
    most = ("snow", "all", 20, 2**31 - 1)  # what an OSC integer can bring back
    assert cue_of(Message("/underfoot/play", most)) == PlayCue(*most)
    assert cue_of(Message("/underfoot/stop")) == StopCue()
    assert cue_of(Message("/underfoot/strike", ("t1",))) == StrikeCue("t1", 1.0)
    assert cue_of(Message("/underfoot/set", ("tone", "frequency", 80))) == SetCue("tone", "frequency", 80)
    assert cue_of(Message("/underfoot/mark", ("begin",))) == MarkCue("begin")
    assert cue_of(Message("/underfoot/mark", ("begin", 7.0))) == MarkCue("begin", 7)  # as Pure Data sends it


BAD = (
    ("/underfoot/nothing",),
    ("/underfoot/play",),
    ("/underfoot/play", "gravel", "t1"),
    ("/underfoot/play", "gravel", "t1", "0"),
    ("/underfoot/play", "gravel", "t1", True),
    ("/underfoot/play", "gravel", "t1", NAN),
    ("/underfoot/play", "gravel", "t1", INFINITE),
    ("/underfoot/play", "gravel", "t1", 20.5),
    ("/underfoot/play", "gravel", "t1", -81),
    ("/underfoot/play", "gravel", 1, 0.0),
    ("/underfoot/play", "gravel", "t1", 0.0, 2**31),
    ("/underfoot/play", "gravel", "t1", 0.0, 0.5),
    ("/underfoot/play", "gravel", "t1", 0.0, 1, 1),
    ("/underfoot/play", "g" * 201, "t1", 0.0),
    ("/underfoot/strike", "t1", NAN),
    ("/underfoot/strike", "t1", 11.0),
    ("/underfoot/set", "tone", "frequency", NAN),
    ("/underfoot/set", "tone", "frequency", -INFINITE),
    ("/underfoot/mark", ""),
    ("/underfoot/mark", "m" * 201),
    ("/underfoot/hello", "you"),
)


@pytest.mark.parametrize("arguments", [(), (1.0,), (0,), (True, "now")])
def test_a_panic_is_one_whatever_a_button_sends_with_it(arguments):
    assert cue_of(Message("/underfoot/panic", arguments)) == PanicCue()


@pytest.mark.parametrize("message", BAD, ids=lambda message: " ".join(str(part)[:12] for part in message))
def test_what_a_cue_cannot_be_is_refused(message):
    address, *arguments = message
    with pytest.raises(BadValue):
        cue_of(Message(address, tuple(arguments)))


@pytest.mark.parametrize("value", [NAN, 1e9, "loud", True, None])
def test_values_are_checked_against_what_the_node_declares(value):
    with pytest.raises(BadValue):
        require_settable(GRAVEL, GRAVEL.nodes[0].id, "level", value, REGISTRY)


def test_no_cue_can_name_a_file():
    patch = Patch().add("wav-player", REGISTRY)
    with pytest.raises(BadValue, match="parameter is 'file'"):
        require_settable(patch, "wav-player", "file", "/etc/passwd", REGISTRY)
    with pytest.raises(BadValue, match="preset"):
        with_cues(GRAVEL, CuedChanges().playing(["t1"], "../floors/tiles-2x2", 0.0), FLOOR.ids, REGISTRY)


@pytest.mark.parametrize("preset", preset_files.patches())
def test_every_preset_can_be_played_on_some_tiles(preset):
    cued = CuedChanges().playing(["t1", "t3"], preset, -6.0).playing(["t2"], preset, 0.0)
    patch = with_cues(GRAVEL, cued, FLOOR.ids, REGISTRY)
    assert patch.check(REGISTRY)
    assert with_cues(GRAVEL, cued.stopped(FLOOR.ids), FLOOR.ids, REGISTRY) == GRAVEL


def test_patches_of_a_folder_are_played_by_the_names_of_their_files_before_presets_of_the_same_name(tmp_path):
    write_wav(tmp_path / "knock.wav", np.full((480, 1), 0.5, np.float32), 48_000)
    own = Patch().add("wav-player", REGISTRY, file="knock.wav").add("tile-output", REGISTRY)
    own = own.connect("wav-player.out", "tile-output.acceleration", REGISTRY)
    for name in ("my knock 2", "wood"):
        own.save(tmp_path / f"{name}.json")
        patch = with_cues(GRAVEL, CuedChanges().playing(["t1"], name, 0.0), FLOOR.ids, REGISTRY, tmp_path)
        (player,) = [node for node in patch.nodes if node.type == "wav-player"]
        assert player.parameters["file"] == (tmp_path / "knock.wav").as_posix()  # the floor's patch has another folder
    cued = CuedChanges().playing(["t1"], "my knock 2", 0.0)
    own.save(tmp_path / "雪.json")
    for tile, name in (("t2", "雪"), ("t3", "wood")):
        cued = cued.playing([tile], name, 0.0)
    patch = with_cues(GRAVEL, cued, FLOOR.ids, REGISTRY, tmp_path)
    assert len([node for node in patch.nodes if node.type == "wav-player"]) == 3
    with pytest.raises(BadValue, match="preset is 'other'; allowed: the presets of Underfoot, and of "):
        with_cues(GRAVEL, CuedChanges().playing(["t1"], "other", 0.0), FLOOR.ids, REGISTRY, tmp_path)


def test_each_preset_is_for_its_own_tiles_and_the_floor_s_outputs_for_what_is_left_of_theirs():
    own = Patch().add("tone", REGISTRY).add("tile-output", REGISTRY, tiles="t1+t2")
    own = own.connect("tone.out", "tile-output.acceleration", REGISTRY)
    cued = CuedChanges().playing(["t2"], "stimulus-sp", 0.0).playing(["t3", "t4"], "tacton-ws1", -6.0)
    patch = with_cues(own, cued, (*FLOOR.ids, "t5"), REGISTRY)
    tiles = {one.id.partition("--")[2]: one.parameters["tiles"] for one in patch.nodes if one.type == "tile-output"}
    assert tiles == {"": "t1", "stimulus-sp--t2": "t2", "tacton-ws1--t3": "t3+t4"}


@pytest.fixture(scope="module")
def steps():
    """A foot on the middle of each tile, one after the other."""
    time_s = np.arange(1800) / 1000.0
    feet = []
    for i, tile in enumerate(FLOOR.tiles):
        x, y = tile.centre_m
        feet.append(Foot(0.1 + 0.35 * i, (x - 0.05, y), (x + 0.05, y)))
    return corner_forces(FLOOR, feet, time_s)


def played(patch, forces):
    at = 48.0 * np.arange(len(forces))
    rows = np.column_stack([at, at, forces.reshape(len(forces), -1)])
    loop = Loop(patch, REGISTRY, RecordedForce([rows], FLOOR, 1000.0))
    loop.send(Play(True))
    return loop.play(80_000)


def test_a_cue_changes_its_tiles_only(steps):
    own = played(GRAVEL, steps)
    cued = played(with_cues(GRAVEL, CuedChanges().playing(["t2"], "wood", 0.0), FLOOR.ids, REGISTRY), steps)
    assert own.any(axis=0).all()
    assert cued.any(axis=0).all()
    assert np.array_equal(cued[:, [0, 2, 3]], own[:, [0, 2, 3]])
    assert not np.array_equal(cued[:, 1], own[:, 1])
    alone = played(
        with_cues(Patch(seed=GRAVEL.seed), CuedChanges().playing(["t2"], "wood", 0.0), FLOOR.ids, REGISTRY), steps
    )
    assert not alone[:, [0, 2, 3]].any()
    assert np.array_equal(alone[:, 1], cued[:, 1])


def test_the_gain_is_in_decibels(steps):
    def at(gain_db):
        cued = CuedChanges().playing(["t1"], "stimulus-sp-half", gain_db)
        return played(with_cues(Patch(), cued, FLOOR.ids, REGISTRY), steps)[:, 0].astype(float)

    loud, soft = at(0.0), at(-20.0)
    assert np.abs(loud).max() > 1e-3
    assert soft == pytest.approx(0.1 * loud, abs=1e-7)


def test_addresses_are_numbers_and_ports():
    assert Address.parse("0.0.0.0:1", "listen") == Address("0.0.0.0", 1)
    assert not Address.parse("0.0.0.0:1", "listen").is_loopback
    for text in ("", ":", "host:1", "127.0.0.1", "127.0.0.1:0", "127.0.0.1:65536", "127.0.0.1:-1", "::1:80", "a:b:c"):
        with pytest.raises(BadValue, match="HOST:PORT"):
            Address.parse(text, "listen")


def test_what_leaves_this_computer_is_warned_of():
    assert not NetworkPlan.of(tuio="localhost:1", tuio2="127.0.0.1:1", listen="127.0.0.2:1", lsl=True).warnings()
    listens, sends = NetworkPlan.of(tuio="10.0.0.1:1", send="10.0.0.1:1", listen="0.0.0.0:2").warnings()
    assert "without a password" in listens
    assert sends.count("10.0.0.1:1") == 1
