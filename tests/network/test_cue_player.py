"""Cues in a running session: from which frame on they are played, what they leave alone, and that they are recorded."""

from contextlib import closing

import numpy as np
import pytest
from free_ports import free_port
from live import live
from made_patches import patch_of
from osc_ends import LOOPBACK, OscEnd

from underfoot.engine.commands import Level, Mark, Panic, Set, Strike, Swap
from underfoot.engine.reports import CommandApplied, PatchRefused
from underfoot.engine.session_replay import ReplayJob
from underfoot.errors import BadValue
from underfoot.network.cue_player import CuePlayer
from underfoot.network.plan import NetworkPlan
from underfoot.network.server import NetworkServer
from underfoot.nodes import REGISTRY
from underfoot.patch.patch import Patch
from underfoot.records.recording import Recording
from underfoot.records.wav import write_wav


def hum():
    """80 Hz on all tiles."""
    patch = Patch(title="hum").add("tone", REGISTRY, frequency=80.0).add("tile-output", REGISTRY)
    return patch.connect("tone.out", "tile-output.acceleration", REGISTRY)


class Stage:
    """A session with a server and a client of it."""

    def __init__(self, playing, server, port, client):
        self.playing, self.server, self.port, self.client = playing, server, port, client
        self.player = CuePlayer(playing.session, server, hum())
        self._taken = 0
        self.marked = []
        """Frame and text of every mark that was answered."""

    def poll(self):
        self.playing.poll()
        reports, self._taken = self.playing.reports[self._taken :], len(self.playing.reports)
        self.player.tick(reports)

    def until(self, holds, what):
        def look():
            self.poll()
            return holds()

        return self.playing.until(look, what)

    def send_message(self, address, *arguments):
        self.client.send_message(self.port, address, *arguments)

    def answer(self, address, number):
        """The answer to the cue of this number."""

        def found():
            return next((rest for n, *rest in self.client.received(address) if n == number), None)

        return self.until(found, f"{address} {number}")

    def panics(self):
        """How many were applied."""
        return sum(isinstance(done.command, Panic) for done in self.playing.of(CommandApplied))

    def frame_of(self, holds):
        """The frame of the newest command of which something holds."""
        return [done.frame for done in self.playing.of(CommandApplied) if holds(done.command)][-1]


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    return tmp_path_factory.mktemp("cues") / "session.underfoot"


@pytest.fixture(scope="module")
def stage(until, recorded):
    """A hum on four simulated tiles, recorded, on which nobody walks."""
    port = free_port()
    plan = NetworkPlan.of(listen=f"{LOOPBACK}:{port}")
    with live(hum(), until, record=recorded, start=False, walker=False) as playing, closing(OscEnd()) as client:
        playing.session.start()
        target = playing.session.target
        with closing(NetworkServer(plan, target.floor, target.rate, playing.session.force_rate_hz)) as server:
            playing.started()
            playing.session.edit(hum(), anew=True)  # starts the compiler
            playing.done(Swap)  # until it plays, a cue is answered with the frame from which it does
            playing.session.send(Level(0.0))
            yield Stage(playing, server, port, client)


def test_a_preset_on_one_tile_is_answered_with_the_frame_from_which_it_plays(stage):
    stage.send_message("/underfoot/play", "stimulus-sp", "t2", -6.0, 11)
    frame, time_s, ago_s = stage.answer("/underfoot/played", 11)
    assert frame == stage.frame_of(lambda command: isinstance(command, Swap))
    assert time_s == frame / 48_000.0
    assert 0.0 <= ago_s < 60.0
    stage.playing.play(20_000)
    played = stage.playing.played(frame + 4_800, 9_600)
    assert np.abs(played[:, [0, 2, 3]]).max() > 0.0, "the others play on"
    assert not np.isnan(played).any()
    assert np.abs(played[2_400:, 1]).max() < 1e-3, "nobody stands on it: the stimulus waits for a foot"


def test_a_strike_behind_a_preset_waits_until_that_plays(stage):
    stage.send_message("/underfoot/play", "tacton-ws1", "t2", 0.0, 21)
    stage.send_message("/underfoot/strike", "t2", 1.0, 22)
    frame, _, _ = stage.answer("/underfoot/played", 21)
    struck, _, _ = stage.answer("/underfoot/played", 22)
    assert struck >= frame
    stage.playing.play(40_000)
    played = stage.playing.played(struck, 24_000)
    assert np.abs(played[:, 1]).max() > 0.01


def test_what_waits_for_a_preset_is_not_answered_by_what_takes_effect_before_it(stage):
    received = stage.server.counts.received
    stage.send_message("/underfoot/play", "tacton-ws1", "t4", 0.0, 17)
    stage.send_message("/underfoot/strike", "t4", 1.0, 18)
    stage.playing.until(lambda: stage.server.counts.received == received + 2, "both came")
    stage.player.tick(())
    stage.playing.session.send(Strike("", "t4", 1.0))  # by hand, in the window
    stage.send_message("/underfoot/play", "tacton-ws1", "t4", -6.0, 15)  # a number of what does not play yet
    frame, *others = (stage.answer("/underfoot/played", number)[0] for number in (17, 18, 15))
    assert min(others) >= frame
    stage.send_message("/underfoot/strike", "t4", 0.5, 19)
    stage.send_message("/underfoot/set", "tone", "frequency", 82.0, 20)
    stage.playing.until(lambda: stage.server.counts.received == received + 5, "both came")
    stage.answer("/underfoot/played", 20)
    done = [one.command for one in stage.playing.of(CommandApplied)]
    assert done.index(Strike("", "t4", 0.5)) < done.index(Set("tone", "frequency", 82.0)), "as they came"
    stage.send_message("/underfoot/stop", "all", 16)
    stage.answer("/underfoot/played", 16)


def test_a_strike_behind_a_preset_does_not_wait_for_the_faders_behind_itself(stage):
    """One of them waited all the time, as long as they moved."""
    swaps, strikes = (len([one for one in stage.playing.of(CommandApplied) if isinstance(one.command, kind)]) + 1
                      for kind in (Swap, Strike))  # fmt: skip
    received = stage.server.counts.received
    stage.send_message("/underfoot/play", "tacton-ws1", "t3", 0.0, 23)
    stage.send_message("/underfoot/strike", "t3", 1.0, 24)
    stage.until(lambda: stage.server.counts.received == received + 2, "both came")
    stage.playing.done(Swap, swaps)  # reported, but not yet to the player
    for thousandths in range(100):  # a hand that drags while it is compiled: of all these edits, only 64 were known
        stage.player.set_base_patch(hum().set("tile-output", "level", thousandths / 1000.0, REGISTRY))
    stage.send_message("/underfoot/set", "tone", "frequency", 81.0, 25)
    stage.playing.until(lambda: stage.server.counts.received == received + 3, "the fader moves")
    stage.player.tick(())
    stage.player.tick([one for one in stage.playing.of(CommandApplied) if isinstance(one.command, Swap)])
    stage.playing.done(Strike, strikes)
    for number in (23, 24, 25):
        stage.answer("/underfoot/played", number)
    stage.playing.session.edit(stage.player.set_base_patch(hum()))
    stage.send_message("/underfoot/stop", "all", 26)
    stage.answer("/underfoot/played", 26)


def test_another_gain_moves_in_a_ramp_without_a_new_program(stage):
    stage.send_message("/underfoot/play", "tacton-ws1", "t2", 0.0, 30)
    stage.answer("/underfoot/played", 30)
    swaps = len([done for done in stage.playing.of(CommandApplied) if isinstance(done.command, Swap)])
    stage.send_message("/underfoot/play", "tacton-ws1", "t2", -12.0, 31)
    frame, _, _ = stage.answer("/underfoot/played", 31)
    assert frame == stage.frame_of(lambda command: isinstance(command, Set) and command.name == "gain")
    assert swaps == len([done for done in stage.playing.of(CommandApplied) if isinstance(done.command, Swap)])
    stage.send_message("/underfoot/play", "tacton-ws1", "t2", -12.0, 32)
    again, _, ago_s = stage.answer("/underfoot/played", 32)
    assert again >= frame
    assert abs(ago_s) < 5.0, "nothing had to be done"


def test_a_value_is_set_and_stop_undoes_it(stage):
    stage.send_message("/underfoot/set", "tone", "frequency", 160, 41)
    frame, _, _ = stage.answer("/underfoot/played", 41)
    assert frame == stage.frame_of(lambda command: command == Set("tone", "frequency", 160.0))
    assert stage.player.cued.values
    stage.send_message("/underfoot/stop", "all", 42)
    frame, _, _ = stage.answer("/underfoot/played", 42)
    assert frame == stage.frame_of(lambda command: isinstance(command, (Set, Swap)))  # a swap if presets play, too
    assert stage.playing.session.patch == hum()


def test_a_value_of_what_a_cue_plays_is_set_by_the_name_that_the_page_says(stage):
    stage.send_message("/underfoot/play", "tacton-impact", "t3", -80.0, 43)
    stage.answer("/underfoot/played", 43)
    stage.send_message("/underfoot/set", "knock--tacton-impact", "stiffness", 2e5, 44)
    frame, _, _ = stage.answer("/underfoot/played", 44)
    assert frame == stage.frame_of(lambda command: command == Set("knock--tacton-impact", "stiffness", 2e5))
    stage.send_message("/underfoot/stop", "all", 45)
    stage.answer("/underfoot/played", 45)


def test_a_mark_is_told_and_recorded_at_its_frame(stage):
    stage.send_message("/underfoot/mark", "trial 1", 51)
    frame, _, _ = stage.answer("/underfoot/played", 51)
    assert frame == stage.frame_of(lambda command: command == Mark("trial 1"))
    stage.marked.append((frame, "trial 1"))


REFUSED = (
    ("/underfoot/play", "granite", "t1", 0.0, 61),
    ("/underfoot/play", "gravel", "t9", 0.0, 62),
    ("/underfoot/set", "nothing", "frequency", 1.0, 63),
    ("/underfoot/set", "tone", "colour", 1.0, 64),
    ("/underfoot/set", "tone", "frequency", 1e9, 65),
    ("/underfoot/set", "tile-output", "tiles", "t1", 66),
    ("/underfoot/strike", "t9", 1.0, 67),
    ("/underfoot/stop", "t9", 68),
)


@pytest.mark.parametrize("cue", REFUSED, ids=lambda cue: " ".join(map(str, cue[:3])))
def test_what_cannot_be_is_refused_and_changes_nothing(stage, cue):
    before = stage.playing.session.patch
    stage.send_message(*cue)
    address, reason = stage.answer("/underfoot/refused", cue[-1])
    assert address == cue[0]
    assert "allowed: " in reason
    assert stage.playing.session.patch == before


def test_a_bad_cue_does_not_spoil_the_good_ones_with_it(stage):
    stage.send_message("/underfoot/set", "tone", "frequency", 90.0, 71)
    stage.send_message("/underfoot/set", "tone", "frequency", 1e9, 72)
    stage.send_message("/underfoot/set", "tone", "amplitude", 0.5, 73)
    stage.answer("/underfoot/refused", 72)
    for number in (71, 73):
        stage.answer("/underfoot/played", number)
    tone = stage.playing.session.patch.node("tone")
    assert tone.parameters == {"frequency": 90.0, "amplitude": 0.5}


def test_an_edit_of_the_floors_own_patch_keeps_the_cues(stage):
    stage.send_message("/underfoot/set", "tone", "frequency", 90.0, 70)
    stage.answer("/underfoot/played", 70)
    stage.playing.session.edit(stage.player.set_base_patch(hum().set("tile-output", "level", 0.5, REGISTRY)))
    assert stage.playing.session.patch.node("tone").parameters["frequency"] == 90.0
    assert stage.playing.session.patch.node("tile-output").parameters["level"] == 0.5
    stage.playing.session.edit(stage.player.set_base_patch(Patch()))
    assert stage.playing.session.patch == Patch()
    stage.playing.session.edit(stage.player.set_base_patch(hum()))
    stage.send_message("/underfoot/stop")
    stage.until(lambda: stage.playing.session.patch == hum(), "all is as it was")


def test_a_patch_that_is_refused_does_not_refuse_a_mark_that_takes_effect(stage):
    received = stage.server.counts.received
    stage.send_message("/underfoot/mark", "kept", 75)
    stage.playing.until(lambda: stage.server.counts.received > received, "the mark")
    stage.player.tick(())  # it goes to the engine
    stage.player.tick([PatchRefused.because("node tone is unknown")])
    frame, _, _ = stage.answer("/underfoot/played", 75)
    assert frame == stage.frame_of(lambda command: isinstance(command, Mark) and command.text == "kept")
    stage.marked.append((frame, "kept"))


def test_a_value_in_a_patch_that_was_refused_is_refused_as_well(stage):
    """It was answered as played, though the patch before it played on."""
    missing = patch_of(("wav-player.out", "tile-output.acceleration"), wav_player={"file": "none.wav"})
    stage.playing.session.edit(stage.player.set_base_patch(missing))
    stage.until(lambda: stage.playing.of(PatchRefused), "the patch is refused")
    stage.send_message("/underfoot/set", "tile-output", "level", 0.5, 79)
    _, reason = stage.answer("/underfoot/refused", 79)
    assert "none.wav" in reason
    stage.send_message("/underfoot/stop")
    stage.playing.session.edit(stage.player.set_base_patch(hum()))


@pytest.mark.parametrize("is_there", [True, False])
def test_a_value_in_a_patch_that_is_being_compiled_is_answered_as_the_patch_is(stage, tmp_path, is_there):
    """It was answered as played at once, by the patch before, which has no such node."""
    file = tmp_path / "hiss.wav"
    if is_there:
        write_wav(file, np.full((4_800, 1), 0.1, np.float32), 48_000)
    own = patch_of(("wav-player.out", "tile-output.acceleration"), wav_player={"file": str(file)})
    received, number = stage.server.counts.received, 84 + is_there
    stage.send_message("/underfoot/set", "wav-player", "amplitude", 0.5, number)
    stage.playing.until(lambda: stage.server.counts.received > received, "the cue")
    stage.playing.session.edit(stage.player.set_base_patch(own))
    stage.player.tick(())
    if is_there:
        frame, _, _ = stage.answer("/underfoot/played", number)
        assert frame == stage.frame_of(lambda command: isinstance(command, Swap) and b"hiss.wav" in command.patch)
    else:
        assert "hiss.wav" in stage.answer("/underfoot/refused", number)[1]
    stage.send_message("/underfoot/stop")
    stage.playing.session.edit(stage.player.set_base_patch(hum()))


def test_a_preset_that_was_refused_is_not_played_with_a_later_cue(stage, tmp_path):
    """The floor's own sound file was gone for a while; each cue after it asked for the refused preset again."""
    file = tmp_path / "hiss.wav"
    write_wav(file, np.full((4_800, 1), 0.1, np.float32), 48_000)
    own = patch_of(("wav-player.out", "tile-output.acceleration"), wav_player={"file": str(file)})
    stage.playing.session.edit(stage.player.set_base_patch(own))
    stage.send_message("/underfoot/play", "stimulus-sp", "t1", 0.0, 81)
    stage.answer("/underfoot/played", 81)
    data = file.read_bytes()
    file.unlink()
    stage.send_message("/underfoot/play", "wood", "t2", 0.0, 82)
    stage.send_message("/underfoot/strike", "t2", 1.0, 87)  # for what is not played
    assert all("hiss.wav" in stage.answer("/underfoot/refused", number)[1] for number in (82, 87))
    file.write_bytes(data)
    stage.send_message("/underfoot/play", "stimulus-sp", "t3", 0.0, 83)
    stage.answer("/underfoot/played", 83)
    patch = stage.playing.session.patch
    assert patch.node("out--stimulus-sp--t1").parameters["tiles"] == "t1+t3"
    assert not [node.id for node in patch.nodes if "--wood" in node.id]
    stage.send_message("/underfoot/stop")
    stage.playing.session.edit(stage.player.set_base_patch(hum()))


def test_a_value_that_is_set_while_a_preset_is_being_swapped_in_is_answered_and_holds_up_no_strike(stage):
    def take(*cue, until_done):
        """Take a cue, and wait until its command takes effect, which the player is not told yet."""
        received = stage.server.counts.received
        stage.send_message(*cue)
        stage.playing.until(lambda: stage.server.counts.received > received, "the cue")
        stage.player.tick(())
        stage.playing.until(lambda: any(until_done(one.command) for one in stage.playing.of(CommandApplied)), cue[0])

    def is_swap(command):
        return isinstance(command, Swap) and command.patch == stage.playing.session.patch.dumps()

    to_120_hz = Set("tone", "frequency", 120.0)
    stage.until(lambda: any(is_swap(done.command) for done in stage.playing.of(CommandApplied)), "the hum")
    take("/underfoot/play", "tacton-ws1", "t2", -3.0, 76, until_done=is_swap)
    take("/underfoot/set", "tone", "frequency", 120.0, 77, until_done=lambda command: command == to_120_hz)
    stage.send_message("/underfoot/strike", "t2", 1.0, 78)
    played, was_set, struck = (stage.answer("/underfoot/played", number)[0] for number in (76, 77, 78))
    assert played == stage.frame_of(lambda command: isinstance(command, Swap))
    assert was_set == stage.frame_of(lambda command: command == to_120_hz)
    assert struck > was_set >= played
    received = stage.server.counts.received
    take("/underfoot/play", "tacton-ws1", "t3", -3.0, 97, until_done=is_swap)
    stage.send_message("/underfoot/set", "tone", "frequency", 121.0, 98)
    stage.playing.until(lambda: stage.server.counts.received == received + 2, "the value")
    stage.player.tick(())
    refused = PatchRefused.because("there is no memory")
    stage.player.tick([refused])  # the preset, and what was set in it
    assert [stage.answer("/underfoot/refused", number)[1] for number in (97, 98)] == [refused.text] * 2
    stage.send_message("/underfoot/stop")
    stage.until(lambda: stage.playing.session.patch == hum(), "all is as it was")


def test_while_a_study_has_the_floor_cues_are_refused_but_marks(stage):
    """Marks that came from other recorders by LSL or a serial line were lost without a word."""
    before = stage.server.counts.received
    stage.send_message("/underfoot/strike", "all", 1.0, 81)
    stage.send_message("/underfoot/mark", "m", 82)
    stage.playing.until(lambda: stage.server.counts.received > before + 1, "both came")
    stage.player.tick([], "a study has the floor")
    _, reason = stage.answer("/underfoot/refused", 81)
    assert reason == "a study has the floor"
    frame, _, _ = stage.answer("/underfoot/played", 82)
    stage.marked.append((frame, "m"))


def test_panic_is_silence_until_somebody_at_the_computer_plays(stage):
    before, panics = stage.server.counts.received, stage.panics()
    stage.send_message("/underfoot/panic")
    stage.playing.until(lambda: stage.server.counts.received > before, "it came")
    stage.player.tick([])
    stage.player.tick([stage.playing.started()])  # an engine that starts meanwhile is silent, too, and answers
    stage.until(lambda: stage.panics() > panics, "panic")
    assert stage.playing.session.memory.status.panic
    silent = stage.frame_of(lambda command: isinstance(command, Panic))

    def answered():
        return sum(number == -1 and at >= silent for number, at, *_ in stage.client.received("/underfoot/played"))

    stage.send_message("/underfoot/panic")
    stage.until(lambda: answered() == 2, "a second one is answered, too, which the engine does not apply")
    stage.send_message("/underfoot/play", "gravel", "t1", 0.0, 91)
    frame, _, _ = stage.answer("/underfoot/played", 91)
    stage.playing.play(12_000)
    assert not stage.playing.played(frame, 9_000).any()
    stage.playing.session.play()


def test_the_recording_of_all_this_has_the_cues_and_replays_to_the_same_bytes(stage, recorded):
    before = stage.panics()
    stage.send_message("/underfoot/set", "tone", "frequency", 95.0, 93)
    stage.send_message("/underfoot/strike", "t1", 1.0, 94)
    for number in (93, 94):
        stage.answer("/underfoot/played", number)
    stage.send_message("/underfoot/panic")
    stage.until(lambda: stage.panics() > before, "panic")
    stage.playing.session.play()
    stage.playing.play(9_600)
    stage.playing.session.stop_recording()
    with Recording(recorded) as recording:
        kinds = {kind for _, kind, _ in recording.commands()}
        marked = [(mark.frame, mark.text) for mark in recording.marks()]
        first, played = recording.vibration()
        assert (first, recording.gaps()) == (0, [])
    assert {"Swap", "Set", "Strike", "Panic"} <= kinds
    assert marked == stage.marked
    assert ReplayJob(recorded, 333).run().samples.tobytes() == played.tobytes()


def test_a_node_that_is_called_as_a_cue_would_be_is_said(stage):
    from underfoot.network.cue_patch import CuedChanges, with_cues

    cued = CuedChanges().playing(["t1"], "gravel", 0.0)
    taken = next(node for node in with_cues(Patch(), cued, ("t1",), REGISTRY).nodes)
    with pytest.raises(BadValue, match=f"{taken.id}.*another id"):
        with_cues(Patch(nodes=(taken,)), cued, ("t1",), REGISTRY)


def test_strikes_are_commands_of_the_engine_for_each_tile(stage):
    before = len([done for done in stage.playing.of(CommandApplied) if isinstance(done.command, Strike)])
    stage.send_message("/underfoot/strike", "all", 0.5, 95)
    stage.answer("/underfoot/played", 95)
    struck = [done.command for done in stage.playing.of(CommandApplied) if isinstance(done.command, Strike)][before:]
    assert struck == [Strike("", tile, 0.5) for tile in ("t1", "t2", "t3", "t4")]
