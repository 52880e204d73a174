"""Files of other programs as patches: what they say, what of them is lost, and what is wrong with bad ones."""

import json
import random

import foreign_files as made
import numpy as np
import pytest
from mutations import mutated

from underfoot.errors import BadFile, UnderfootError
from underfoot.exchange.format import Export, read_foreign_patch
from underfoot.exchange.formats import FORMATS, READ, to_read
from underfoot.exchange.syntacts_curves import shaped
from underfoot.exchange.syntacts_signals import Reading, types_in
from underfoot.nodes import REGISTRY
from underfoot.patch.patch import Patch

FULL = 5.0
"""m/s^2 at a file's full scale."""


def read(folder, name, document):
    """What comes of a document in a file of this format."""
    path = folder / made.SAMPLES[name][0]
    path.write_text(json.dumps(document))
    return read_foreign_patch(to_read(path, name), path)


def curves(imported):
    """The points of each breakpoint envelope, [point, 3]."""
    return [np.array(n.parameters["points"]) for n in imported.patch.nodes if n.type == "breakpoints"]


def at(points, time_s, column):
    return np.interp(time_s, points[:, 0], points[:, column])


@pytest.mark.parametrize("format", READ, ids=lambda format: format.name)
def test_a_file_becomes_a_patch_that_plays_at_each_footfall(tmp_path, format):
    path = made.put(tmp_path, format.name)
    assert to_read(path).name == format.name
    imported = read_foreign_patch(format, path)
    assert Patch.loads(imported.patch.dumps(), REGISTRY).dumps() == imported.patch.dumps()
    played = Export(imported.patch, seconds=1.5).acceleration_by_tile["t1"]
    assert 0.1 < np.abs(played).max() < 2.0 * 2.0 * FULL
    assert not played[: round(0.05 * 48_000)].any()


# --- .haptic ---


def test_haptic_amplitude_frequency_and_emphasis(tmp_path):
    imported = read(tmp_path, "haptic", made.haptic())
    envelope, emphasis = curves(imported)
    np.testing.assert_allclose(at(envelope, [0.0, 0.05, 0.1, 0.35], 1), FULL * np.array([0.2, 0.5, 0.8, 0.2]))
    np.testing.assert_allclose(at(envelope, [0.0, 0.5], 2), [55.0, 200.0])
    assert emphasis[:, 1].max() == FULL * 0.9
    assert emphasis[0, 0] == 0.2
    assert imported.patch.title == "Door"


def test_a_level_in_the_description_is_the_patchs(tmp_path):
    quiet = curves(read(tmp_path, "haptic", made.haptic(description="1 is 0.5 m/s^2")))[0]
    assert quiet[:, 1].max() == pytest.approx(0.4)


# --- AHAP ---


def test_ahap_intensity_is_squared_curves_multiply_and_sharpness_is_a_frequency(tmp_path):
    continuous, transient = curves(read(tmp_path, "ahap", made.ahap()))
    inside = np.linspace(0.201, 0.599, 50)
    expected = FULL * (1.0 - 0.5 * (inside - 0.2) / 0.4) ** 2
    np.testing.assert_allclose(at(continuous, inside, 1), expected, atol=0.02)
    np.testing.assert_allclose(at(continuous, inside, 2), 65.0)
    assert transient[:, 1].max() == FULL
    assert transient[0, 2] == 65.0 + 0.5 * 235.0


def test_ahap_events_that_overlap_play_together_and_curves_keep_their_last_value(tmp_path):
    document = made.ahap(
        made.curve("HapticSharpnessControl", 0.1, (0.0, 0.0), (0.1, 0.5)),
        made.event("HapticContinuous", 0.0, 0.5, HapticIntensity=0.5, HapticSharpness=0.25),
        made.event("HapticContinuous", 0.3, 0.5, HapticIntensity=1.0),
    )
    first, second = curves(read(tmp_path, "ahap", document))
    np.testing.assert_allclose(at(first, [0.05, 0.4], 2), [65.0 + 0.25 * 235.0, 65.0 + 0.75 * 235.0], atol=0.6)
    assert at(first, 0.4, 1) == pytest.approx(FULL * 0.25)
    assert at(second, 0.7, 1) == pytest.approx(FULL)


# --- HJIF ---


def test_hjif_keyframes_gain_and_title(tmp_path):
    document = made.hjif()
    document["perceptions"][0]["channels"][0]["gain"] = 0.5
    document["description"] = f"Gravel; wet; 1 is {FULL:g} m/s^2"  # as our own files have it: title, then scale
    imported = read(tmp_path, "hjif", document)
    assert imported.patch.title == "Gravel; wet"
    (points,) = curves(imported)
    np.testing.assert_allclose(at(points, [0.001, 0.25, 0.375], 1), FULL * np.array([0.25, 0.5, 0.25]), atol=0.01)
    np.testing.assert_allclose(at(points, [0.125, 0.4], 2), [125.0, 150.0])


def test_hjif_takes_effects_from_the_library_and_tells_what_it_cannot_play(tmp_path):
    keyframes = [{"relative_position": t, "amplitude_modulation": 1.0, "frequency_modulation": 90} for t in (0, 100)]
    document = made.hjif(
        made.band("VectorialWave", [], effect_type="Reference", id=7, position=200),
        {**made.band("Curve", keyframes), "curve_type": "Cubic"},
        made.band("WaveletWave", []),
        effect_library=[{"id": 7, "effect_type": "Basis", "base_signal": "Sine", "keyframes": keyframes}],
    )
    imported = read(tmp_path, "hjif", document)
    (points,) = curves(imported)
    assert points[:, 0].min() == pytest.approx(0.2)
    assert points[:, 0].max() == pytest.approx(0.3)
    assert {"bands of type Curve", "bands of type WaveletWave"} <= set(imported.losses)


# --- Macaron ---


def test_curves_with_more_points_than_a_node_are_named_where_detail_is_lost(tmp_path):
    document = made.macaron()
    level = document["parameters"]["amplitude"]["data"]
    time_ms = np.linspace(0.0, 900.0, 4101).tolist()
    level[:] = [{"t": t, "value": t / 900.0} for t in time_ms]
    assert not any("points" in line for line in read(tmp_path, "macaron", document).losses)  # they are on a line
    rough = [*np.random.default_rng(1).uniform(0.0, 1.0, 3901).tolist(), *(100 * [0.5, 0.5015])]
    level[:] = [{"t": t, "value": value} for t, value in zip(time_ms, rough, strict=True)]
    assert any("a node has at most 4000" in line for line in read(tmp_path, "macaron", document).losses)


def test_macaron_holds_before_the_first_keyframe_and_behind_the_last(tmp_path):
    (points,) = curves(read(tmp_path, "macaron", made.macaron()))
    np.testing.assert_allclose(at(points, [0.0, 0.4, 0.95], 1), FULL * np.array([0.5, 0.75, 0.0]))
    np.testing.assert_allclose(at(points, [0.0, 0.3, 0.9], 2), [250.0, 150.0, 50.0], atol=1e-3)


# --- Syntacts ---


def sampled(signal, time_s):
    """A signal by Syntacts' own definitions, from the tree that was read."""
    curve, _ = Reading({}, types_in(signal)).sum_of(signal, 0)
    return curve(time_s)


def test_syntacts_signals_have_the_values_that_its_definitions_give():
    time_s = np.arange(0.0, 0.6, 1e-3) + 1e-5
    tact = made.Syntacts(names_each_time=True)
    buzz = tact.times(tact.sine(100.0), tact.envelope(0.2, 0.5))
    np.testing.assert_allclose(
        sampled(buzz, time_s), np.where(time_s <= 0.2, 0.5 * np.sin(200.0 * np.pi * time_s), 0.0), atol=1e-9
    )
    twice = tact.signal("Repeater", {"signal": buzz, "repetitions": 2, "delay": 0.1})
    later = np.where((time_s >= 0.3) & (time_s <= 0.5), 0.5 * np.sin(200.0 * np.pi * (time_s - 0.3)), 0.0)
    np.testing.assert_allclose(sampled(twice, time_s), sampled(buzz, time_s) + later, atol=1e-9)
    slow = tact.signal("Stretcher", {"signal": buzz, "factor": 2.0})
    np.testing.assert_allclose(sampled(slow, time_s), sampled(buzz, time_s / 2.0), atol=1e-9)
    ring = tact.times(tact.sine(200.0), tact.sine(25.0))
    expected = np.sin(400.0 * np.pi * time_s) * np.sin(50.0 * np.pi * time_s)
    np.testing.assert_allclose(sampled(ring, time_s), expected, atol=1e-9)


def test_syntacts_terms_become_voices_of_their_own_waves(tmp_path):
    imported = read(tmp_path, "syntacts", made.syntacts())
    sine, square = curves(imported)
    np.testing.assert_allclose(at(sine, [0.05, 0.1, 0.2], 1), FULL * np.array([0.4, 0.8, 0.4]), atol=0.02)
    np.testing.assert_allclose(at(sine, [0.1, 0.2], 2), 175.0, atol=0.1)
    np.testing.assert_allclose(at(square, [0.5, 0.69], 2), 80.0, atol=0.1)
    tones = [node for node in imported.patch.nodes if node.type == "tone"]
    assert len(tones[1].parameters["harmonics"]) > 5


@pytest.mark.parametrize(
    ("name", "share", "value"),
    # values by the program itself, version 1.3
    [("Linear", 0.3, 0.3), ("Quadratic::In", 0.5, 0.25), ("Cubic::InOut", 0.25, 0.0625), ("Elastic::Out", 0.5, 1.0)],
)
def test_curves_from_key_to_key(name, share, value):
    assert shaped(name, np.array([0.0, share, 1.0])).tolist() == pytest.approx([0.0, value, 1.0], abs=1e-3)


def test_expressions_are_not_computed(tmp_path):
    tact = made.Syntacts()
    signal = tact.times(tact.signal("Expression", {"expr": "sin(t)"}), tact.envelope(1.0))
    with pytest.raises(BadFile, match="no vibration"):
        read(tmp_path, "syntacts", {"value0": signal})


# --- what is lost ---


EXTRAS = {
    "haptic": (("metadata", "author"), "metadata.author"),
    "ahap": (("Pattern", 0, "Event", "Waveform"), "Pattern.Event.Waveform"),
    "hjif": (("perceptions", 0, "channels", 0, "body_part_target"), "perceptions.channels.body_part_target"),
    "macaron": (("parameters", "pan"), "parameters.pan"),
}


@pytest.mark.parametrize("name", EXTRAS)
def test_every_field_that_is_not_read_is_told(tmp_path, name):
    document = made.SAMPLES[name][1]()
    assert read(tmp_path, name, document).losses == ()
    way, told = EXTRAS[name]
    inside = document
    for key in way[:-1]:
        inside = inside[key]
    inside[way[-1]] = ["x"]
    assert read(tmp_path, name, document).losses == (told,)


# --- bad files ---


BAD = {
    "not JSON": ("haptic", b"{", "is not JSON"),
    "not finite": ("macaron", b'{"duration": 1e999}', "$.duration is inf; allowed: finite numbers"),
    "other version": ("haptic", b'{"version": {"major": 2}}', "$.version.major is 2; allowed: 1"),
    "loud": (
        "haptic",
        json.dumps(made.haptic()).replace("0.8", "1.8").encode(),
        "$.signals.continuous.envelopes.amplitude[1].amplitude",
    ),
    "beyond a tone": (
        "haptic",
        json.dumps(made.haptic(description="1 is 205.319 m/s^2")).encode(),
        "it asks for 164 m/s^2; allowed: at most 100",
    ),
    "nested": ("ahap", b'{"Pattern": ' + b"[" * 100 + b"]" * 100 + b"}", "nested deeper than 64"),
    "deep signals": ("syntacts", b'{"value0": ' * 5000 + b"0" + b"}" * 5000, "nested deeper than 600"),
    "no signal": ("syntacts", b'{"value0": {}}', "has no m_ptr"),
    "no end": ("ahap", json.dumps(made.ahap(made.event("HapticContinuous", 0.0))).encode(), "EventDuration is missing"),
}


@pytest.mark.parametrize("name", BAD)
def test_what_is_wrong_is_said_with_its_place(tmp_path, name):
    format, data, message = BAD[name]
    path = tmp_path / made.SAMPLES[format][0]
    path.write_bytes(data)
    with pytest.raises(BadFile) as error:
        read_foreign_patch(FORMATS[format], path)
    assert message in str(error.value)
    assert str(path) in str(error.value)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("format", READ, ids=lambda format: format.name)
def test_changed_files_are_read_or_refused_in_one_line(tmp_path, format):
    path = made.put(tmp_path, format.name)
    whole = path.read_bytes()
    for seed in range(150):
        path.write_bytes(mutated(whole, random.Random(seed)))
        patch, said = None, ""
        try:
            patch = read_foreign_patch(format, path).patch
        except UnderfootError as error:
            said = str(error)
        assert "\n" not in said, seed
        assert len(said) < 600, seed
        assert patch is None or Patch.loads(patch.dumps(), REGISTRY).dumps() == patch.dumps(), seed
