"""Nodes on a program against closed forms, SciPy and tight solutions: the whole way from wire to output."""

import numpy as np
import pytest
import soundfile
from scipy import signal
from solved_blow import solved_blow

from underfoot.devices.simulated_floor import SimulatedFloor
from underfoot.engine.loop import Loop, LoopOptions
from underfoot.engine.preview import previewed
from underfoot.floor.layout import default_floor
from underfoot.models.signals.waveshaping import peak_bound
from underfoot.nodes import REGISTRY
from underfoot.patch.patch import Patch
from underfoot.patch.program import Program

RATE = 48_000.0
TILE = ("t1",)


def play(patch, scope, frames=9_600, force=None, strikes=(), folder=None):
    """The frames of one output; strikes are (session frame, strength)."""
    program = Program(patch, REGISTRY, TILE, rate=RATE, block=960, scopes=[scope], folder=folder)
    for frame, strength in strikes:
        program.strike("", TILE[0], frame, strength)
    out = np.zeros(frames)
    for at in range(0, frames, 960):
        if force is not None:
            program.engine_signals["force_n"][0, :960] = force[at : at + 960]
        program.run(at, 960)
        out[at : at + 960] = program.scope[scope][0, :960]
    return out


def chain(*types, **parameters):
    """Nodes in a row, the first output of each on the first input of the next; parameters are of the last."""
    patch = Patch()
    for i, type in enumerate(types):
        patch = patch.add(type, REGISTRY, **(parameters if i == len(types) - 1 else {}))
        if i:
            source, target = REGISTRY[types[i - 1]].outputs[0].name, REGISTRY[type].inputs[0].name
            patch = patch.connect(f"{types[i - 1]}.{source}", f"{type}.{target}", REGISTRY)
    return patch


def test_tone_is_the_direct_sum_of_its_harmonics():
    harmonics = [1.0, 0.5, -0.25, 0.125]
    heard = play(chain("tone", frequency=70.0, harmonics=harmonics, amplitude=3.0), "tone.out")
    time = np.arange(9_600) / RATE
    direct = sum(a * np.sin(2 * np.pi * (k + 1) * 70.0 * time) for k, a in enumerate(harmonics))
    assert np.allclose(heard, 3.0 * direct / peak_bound(harmonics), rtol=0, atol=1e-11)


@pytest.mark.parametrize(
    ("type", "parameters", "kind", "edge"),
    [
        ("low-pass", {"cutoff": 300.0}, "lowpass", 300.0),
        ("high-pass", {"cutoff": 60.0}, "highpass", 60.0),
        ("band-pass", {"centre": 250.0, "width": 100.0}, "bandpass", None),
    ],
)
def test_filters_are_bilinear_butterworth(type, parameters, kind, edge):
    force = np.zeros(9_600)
    force[0] = 1.0
    heard = play(chain("tile-force", type, **parameters), f"{type}.out", force=force)
    if edge is not None:
        expected = signal.sosfilt(signal.butter(2, edge, kind, fs=RATE, output="sos"), force)
    else:
        _, measured = signal.freqz(heard, worN=2 * np.pi * np.array([250.0, 100.0, 1000.0]) / RATE)
        assert abs(measured[0]) == pytest.approx(1.0, abs=1e-4)
        assert abs(measured[1:]).max() < 0.5
        return
    assert np.linalg.norm(heard - expected) <= 1e-7 * np.linalg.norm(expected)  # the row slept below 1e-9


def test_strain_rate_envelope_peaks_where_the_layer_does():
    force = np.zeros(9_600)
    force[960:] = 750.0
    heard = play(chain("tile-force", "strain-rate-envelope"), "strain-rate-envelope.out", force=force)
    omega = 2 * np.pi * 12.5
    time = (np.arange(8_640) + 0.5) / RATE  # the bilinear step comes between two frames
    assert heard.max() == pytest.approx(1.0, abs=1e-4)
    assert (heard.argmax() - 960) / RATE == pytest.approx(12.73e-3, abs=5e-5)
    assert np.allclose(heard[960:], np.e * omega * time * np.exp(-omega * time), atol=1e-4)


def test_force_envelope_is_proportional():
    force = np.linspace(0.0, 1500.0, 9_600)
    heard = play(chain("tile-force", "force-envelope"), "force-envelope.out", force=force)
    assert np.allclose(heard, force / 750.0)


def test_modal_bank_rings_as_its_modes_from_the_event_on():
    modes = [[180.0, 40.0, 1.0], [310.0, 90.0, 0.5]]
    bank = chain("strike", "modal-bank", modes=modes, pitch=1.5, decay=0.8)
    heard = play(bank, "modal-bank.out", strikes=[(100.0, 2.0)])
    time = np.arange(9_500) / RATE
    expected = sum(2.0 * a * np.exp(-0.8 * b * time) * np.sin(2 * np.pi * 1.5 * f * time) for f, b, a in modes)
    assert not heard[:100].any()
    assert np.abs(heard[100:1_600] - expected[:1_500]).max() < 1e-12
    assert np.abs(heard[100:] - expected).max() < 2e-5  # modes are let go below 1e-5 m/s^2


@pytest.mark.parametrize(("stiffness", "exponent"), [(1e4, 1.5), (1e7, 1.5), (1e11, 1.8)])
def test_impact_is_the_tight_solution_to_the_error_that_was_asked(stiffness, exponent):
    """docs/models.md#impacts: hammer of 20 g at 1 m/s, mu 0.3 s/m, ten modes; the force is the mean over each frame."""
    modes = [[100.0 * (i + 1) ** 1.2, 20.0 + 5.0 * i, 0.1, 1.0] for i in range(10)]
    error = 1e-4
    patch = chain(
        "strike", "impact", velocity=1.0, mass=0.02, stiffness=stiffness, exponent=exponent, damping=0.3,
        error=error, modes=modes, pitch=1.25, decay=2.0,
    )  # fmt: skip
    frames = 2_400
    heard = play(patch, "impact.force", frames=2_880, strikes=[(0.0, 1.0)])[:frames]
    played = np.transpose(modes) * [[1.25], [2.0], [1.0], [1.0]]
    impulse, *_ = solved_blow(0.02, 1.0, stiffness, exponent, 0.3, played, np.arange(frames + 1) / RATE)
    expected = np.diff(impulse) * RATE
    # The force is a derivative of what the error is asked of: of first order smaller steps, hence the factor.
    assert np.linalg.norm(heard - expected) <= 300.0 * error * np.linalg.norm(expected)
    assert heard.sum() / RATE == pytest.approx(impulse[-1], rel=20.0 * error)
    assert heard.min() >= 0.0


def test_wav_player_plays_the_file_at_its_own_pitch(tmp_path):
    time = np.arange(4_410) / 44_100
    soundfile.write(tmp_path / "tone.wav", 0.5 * np.sin(2 * np.pi * 200.0 * time), 44_100, subtype="DOUBLE")
    patch = chain("wav-player", file="tone.wav", amplitude=10.0)
    heard = play(patch, "wav-player.out", frames=4_800, folder=tmp_path)
    expected = 5.0 * np.sin(2 * np.pi * 200.0 * np.arange(4_800) / RATE)
    assert np.abs(heard - expected)[100:-100].max() < 0.01


@pytest.mark.parametrize(("own", "count"), [(44_100, 4_001), (22_050, 2_001), (96_000, 9_001), (44_101, 4_001)])
def test_wav_player_plays_a_file_in_its_own_time_whatever_its_length(own, count, tmp_path):
    """Of 4001 samples at 44.1 kHz the last lies between two frames, and all others where they belong."""
    sound = np.sin(2 * np.pi * 250.0 * np.arange(count) / own)
    soundfile.write(tmp_path / "tone.wav", sound, own, subtype="DOUBLE")
    patch = chain("strike", "wav-player", file="tone.wav", mode="at events", amplitude=1.0)
    heard = play(patch, "wav-player.out", frames=9_600, folder=tmp_path, strikes=[(1_000.0, 1.0)])[1_000:]
    frames = int(np.ceil(count * RATE / own))
    inside = slice(240, frames - 240)  # 5 ms from its ends, where what is not band-limited rings
    expected = np.sin(2 * np.pi * 250.0 * np.arange(frames) / RATE)
    assert np.abs(heard[:frames] - expected)[inside].max() < 0.002
    assert not heard[frames:].any()


def test_a_sound_that_is_started_again_does_not_click_and_is_itself_5_ms_later(tmp_path):
    sound = np.sin(2 * np.pi * 250.0 * np.arange(9_600) / RATE)
    soundfile.write(tmp_path / "tone.wav", sound, int(RATE), subtype="DOUBLE")
    patch = chain("strike", "wav-player", file="tone.wav", mode="at events", amplitude=1.0)
    starts = [(0.0, 1.0), (1_008.5, 1.0), (1_056.0, 1.0)]  # at a crest, and at one while the former fades
    heard = play(patch, "wav-player.out", folder=tmp_path, strikes=starts)
    assert np.abs(np.diff(heard)).max() < np.abs(np.diff(sound)).max() + 2.0 / 240
    np.testing.assert_array_equal(heard[1_056 + 240 :], sound[: 9_600 - 1_056][240:])
    dense = play(patch, "wav-player.out", folder=tmp_path, strikes=[(48.0 * k, 1.0) for k in range(20)])
    dense = [dense, play(patch, "wav-player.out", folder=tmp_path, strikes=[(40.0 + k, 1.0) for k in range(900)])]
    assert np.abs(dense).max() <= 1.0 + 1e-9


@pytest.mark.parametrize(("own", "tone_hz"), [(24_000, 12_000.0), (96_000, 24_000.0)])
def test_a_loop_keeps_the_amplitude_of_what_lies_at_half_of_either_rate(own, tone_hz, tmp_path):
    soundfile.write(tmp_path / "loop.wav", 0.3 * np.cos(2 * np.pi * tone_hz * np.arange(960) / own), own, "DOUBLE")
    heard = play(chain("wav-player", file="loop.wav", amplitude=1.0), "wav-player.out", frames=4_800, folder=tmp_path)
    assert heard == pytest.approx(0.3 * np.cos(2 * np.pi * tone_hz * np.arange(4_800) / RATE), abs=1e-9)


def test_a_recorded_tap_does_not_sound_again_at_its_end(tmp_path):
    """It begins at full height, as trimmed files do, and has long died away."""
    time = np.arange(500) / 1_000.0
    soundfile.write(tmp_path / "tap.wav", np.exp(-100.0 * time) * np.cos(240.0 * np.pi * time), 1_000, subtype="DOUBLE")
    patch = chain("strike", "wav-player", file="tap.wav", mode="at events", amplitude=1.0)
    heard = play(patch, "wav-player.out", frames=24_000, folder=tmp_path, strikes=[(0.0, 1.0)])
    assert np.abs(heard[-2_400:]).max() < 1e-3


def test_footfall_comes_its_wait_after_the_crossing_with_the_loading_as_strength():
    force = np.clip((np.arange(9_600) - 1_000.5) * 0.5, 0.0, 700.0)  # 24 kN/s
    patch = chain("tile-force", "footfall", "modal-bank", modes=[[480.0, 100.0, 1.0]])
    patch = patch.set("footfall", "threshold", 30.0, REGISTRY).set("footfall", "wait", 0.005, REGISTRY)
    patch = patch.set("footfall", "reference", 24_000.0, REGISTRY)
    heard = play(patch, "modal-bank.out", force=force)
    onset = 1_000.5 + 60.0 + 240.0
    first = int(np.flatnonzero(heard)[0])
    assert first == int(onset) + 1  # a bank rings from the frame of the event on, and begins at sin(0)
    peak = np.abs(heard).max()
    time = np.arange(4_800) / RATE
    assert peak == pytest.approx(np.abs(np.exp(-100.0 * time) * np.sin(2 * np.pi * 480.0 * time)).max(), rel=0.02)


@pytest.mark.parametrize("wait", [0.0005, 0.005])
@pytest.mark.parametrize("rate", [8_000, 48_000])
def test_a_footfall_has_the_loading_rate_of_its_wait_as_strength_wherever_it_begins_in_a_frame(wait, rate):
    patch = chain("tile-force", "footfall", wait=wait, reference=20_000.0)
    for begin in np.linspace(100.0, 101.0, 8):
        program = Program(patch, REGISTRY, TILE, rate=rate, block=1_600, scopes=["footfall.onset"])
        program.engine_signals["force_n"][0, :1_600] = np.maximum(np.arange(1, 1_601) - begin, 0.0) * 20_000.0 / rate
        program.run(0, 1_600)
        ((_, strength, *_),) = program.events("footfall.onset")
        assert strength == pytest.approx(1.0, abs=1e-6)


def test_only_a_rise_whose_beginning_was_seen_is_a_footfall():
    program = Program(
        chain("tile-force", "footfall"),
        REGISTRY,
        TILE,
        rate=RATE,
        block=9_600,
        scopes=["footfall.onset", "footfall.lift_off"],
    )
    frames = np.arange(9_600)
    program.engine_signals["force_n"][0] = np.interp(
        frames, [100, 340, 4_000, 4_240, 5_000, 5_240], [0, 600, 600, 0, 0, 600]
    )
    program.engine_signals["cut"][0] = frames <= 388
    program.run(0, 9_600)
    ((time, *_),) = program.events("footfall.onset")
    assert 5_000 < time < 5_300
    assert program.events("footfall.lift_off")[:, 0] == [4_235]  # the first frame below 15 N, of the foot that stood


def test_a_rhythm_has_one_note_a_step_the_loudest():
    notes = ((6.2, 3, 0.3), (5.8, 2.4, 0.9), (0, 4, 1.0), (6, 5, 0.3))
    patch = Patch().add("rhythm", REGISTRY, notes=notes, bar=0.1, repeats=1)
    program = Program(patch, REGISTRY, TILE, rate=RATE, block=4_800, scopes=["rhythm.out"])
    program.run(0, 4_800)
    np.testing.assert_allclose(program.events("rhythm.out")[:, :3], [[0.0, 1.0, 4 / 240], [1_200.0, 0.9, 2 / 240]])


@pytest.mark.parametrize("bar", [0.1, 0.25, 0.7])
def test_a_rhythm_goes_on_from_where_it_is_at_the_pace_of_another_bar(bar):
    patch = Patch().add("rhythm", REGISTRY, notes=((0, 4, 1.0), (12, 4, 0.5)), bar=0.4, repeats=3)
    program = Program(patch, REGISTRY, TILE, rate=RATE, block=4_800, scopes=["rhythm.out"])
    onsets = []
    for frame in range(0, 144_000, 4_800):
        if frame == 24_000:  # a quarter of the second bar
            program.set("rhythm", "bar", bar, frame)
        program.run(frame, 4_800)
        onsets += [time / RATE for time in program.events("rhythm.out")[:, 0]]
    expected = [0.0, 0.2, 0.4, *(0.5 + np.array([0.25, 0.75, 1.25]) * bar)]
    np.testing.assert_allclose(onsets, expected, atol=240 / RATE)  # the ramp in which a number moves


def test_a_rhythm_follows_a_wire_to_its_bar_beat_by_beat():
    patch = chain("tile-force", "map", high=1_000.0, out_low=0.4, out_high=0.8)
    patch = patch.add("rhythm", REGISTRY, notes=((0, 4, 1.0), (12, 4, 0.5)), repeats=0)
    patch = patch.connect("map.out", "rhythm.bar", REGISTRY)
    program = Program(patch, REGISTRY, TILE, rate=RATE, block=48_000, scopes=["rhythm.out"])
    program.engine_signals["force_n"][0] = np.linspace(0.0, 1_000.0, 48_000, endpoint=False)
    program.run(0, 48_000)
    onsets = program.events("rhythm.out")[:, 0] / RATE
    expected = np.exp(0.2 * np.arange(4)) - 1.0  # the integral of 1 / (0.4 + 0.4 t) is 2.5 log(1 + t) bars
    np.testing.assert_allclose(onsets, expected, atol=32 / RATE)  # a bar is read every 32 frames


def test_noise_fills_its_band_and_texture_has_its_rate_of_bursts():
    heard = play(chain("noise", low=50.0, high=700.0, amplitude=2.0), "noise.out", frames=96_000)
    assert heard.std() == pytest.approx(2.0, rel=0.1)
    frequency, power = signal.welch(heard, RATE, nperseg=4_096)
    inside = power[(frequency > 100) & (frequency < 500)].mean()
    assert inside > 100 * power[frequency > 4_000].mean()
    heard = play(chain("texture", interval=0.2, centre=800.0, width=500.0), "texture.out", frames=480_000)
    frequency, power = signal.welch(heard, RATE, nperseg=4_096)
    assert frequency[power.argmax()] == pytest.approx(800.0, abs=100.0)
    loud = np.abs(heard) > 0.05 * np.abs(heard).max()
    bursts = np.count_nonzero(np.diff(np.flatnonzero(loud)) > 960) + 1
    assert 25 <= bursts <= 65  # Poisson with mean 50 in 10 s, some too close to tell apart


def test_a_wave_reaches_each_tile_after_its_distance_over_its_speed():
    floor, speed_m_s = default_floor(2, 3), 10.0
    patch = Patch().add("rhythm", REGISTRY, notes=((0, 1, 1.0),), repeats=1).add("tile-place", REGISTRY, from_x=0.2)
    patch = patch.add("map", REGISTRY, high=3.0, out_high=3.0 / speed_m_s).add("event-delay", REGISTRY)
    patch = patch.add("modal-bank", REGISTRY).add("tile-output", REGISTRY)
    for source, target in (
        ("rhythm.out", "event-delay.strike"),
        ("tile-place.distance", "map.signal"),
        ("map.out", "event-delay.time"),
        ("event-delay.out", "modal-bank.strike"),
        ("modal-bank.out", "tile-output.acceleration"),
    ):
        patch = patch.connect(source, target, REGISTRY)
    loop = Loop(patch, REGISTRY, SimulatedFloor(floor), LoopOptions(block=9_600, scopes=("modal-bank.out",)))
    loop.run(9_600)
    distance_m = np.array([np.hypot(tile.centre_m[0] - 0.2, tile.centre_m[1]) for tile in floor.tiles])
    expected = np.floor(distance_m / speed_m_s * RATE) + 1  # a bank rings from the frame after its event on
    assert (loop.scope_frames != 0.0).argmax(axis=0).tolist() == expected.tolist()
    _, signals, _ = previewed(patch, ("tile-place.distance",), floor.tiles[4], 0.1, RATE)
    assert signals["tile-place.distance"][-1] == pytest.approx(distance_m[4])
