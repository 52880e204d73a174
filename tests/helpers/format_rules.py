"""Requirements of each format on a file, from its published description, independent of the code under test.

- `.haptic`: the data model's README and validation rules (Lofelt SDK, core/datamodel, MIT).
- AHAP: Apple's "Representing haptic patterns in AHAP files", and the limits that the Lofelt SDK keeps (30 s, 16).
- HJIF: the checks of the MPEG reference software's IOJson (MPEGGroup/HapticReferenceSoftware, BSD).

Each function raises `AssertionError` at the first violation.
"""

import re
from itertools import pairwise
from math import isfinite


def haptic(document):
    assert document["version"] == {"major": 1, "minor": 0, "patch": 0}
    assert set(document) == {"version", "metadata", "signals"}
    assert set(document["metadata"]) <= {"editor", "author", "source", "project", "tags", "description"}
    envelopes = document["signals"]["continuous"]["envelopes"]
    amplitude, frequency = envelopes["amplitude"], envelopes.get("frequency", [])
    assert len(amplitude) >= 2
    assert amplitude[-1]["time"] > amplitude[0]["time"]
    for points, name in ((amplitude, "amplitude"), (frequency, "frequency")):
        times = [point["time"] for point in points]
        assert times == sorted(times)
        assert all(isfinite(time) and time >= 0.0 for time in times)
        assert all(set(point) <= {"time", name, "emphasis"} and 0.0 <= point[name] <= 1.0 for point in points)
    for point in amplitude:
        if "emphasis" in point:
            assert point["amplitude"] <= point["emphasis"]["amplitude"] <= 1.0
            assert 0.0 <= point["emphasis"]["frequency"] <= 1.0
    assert all(amplitude[0]["time"] <= point["time"] <= amplitude[-1]["time"] for point in frequency)


AHAP_EVENT = {"HapticIntensity": (0, 1), "HapticSharpness": (0, 1), "AttackTime": (-1, 1), "DecayTime": (-1, 1)}
AHAP_CURVE = {"HapticIntensityControl": (0, 1), "HapticSharpnessControl": (-1, 1)}


def ahap(document):
    assert document["Version"] == 1.0
    assert set(document) <= {"Version", "Metadata", "Pattern"}
    for entry in document["Pattern"]:
        assert len(entry) == 1
        ((kind, fields),) = entry.items()
        assert fields["Time"] >= 0.0
        if kind == "Event":
            assert fields["EventType"] in ("HapticTransient", "HapticContinuous")
            assert set(fields) <= {"Time", "EventType", "EventDuration", "EventParameters"}
            if fields["EventType"] == "HapticContinuous":
                assert 0.0 < fields["EventDuration"] <= 30.0
            for parameter in fields["EventParameters"]:
                low, high = AHAP_EVENT[parameter["ParameterID"]]
                assert low <= parameter["ParameterValue"] <= high
        else:
            assert kind == "ParameterCurve"
            low, high = AHAP_CURVE[fields["ParameterID"]]
            points = fields["ParameterCurveControlPoints"]
            assert 1 <= len(points) <= 16
            assert points[0]["Time"] == 0.0
            assert [point["Time"] for point in points] == sorted(point["Time"] for point in points)
            assert all(low <= point["ParameterValue"] <= high for point in points)


def _unique(items, name="id"):
    ids = [item[name] for item in items]
    assert len(set(ids)) == len(ids)
    assert all(isinstance(id, int) for id in ids)


def hjif(document):
    required = "version profile level date description timescale avatars perceptions syncs"
    assert set(document) == set(required.split())
    assert re.fullmatch(r"\d{4}(-[1-9])?", document["version"])
    assert int(document["version"][:4]) >= 2023
    assert document["profile"] in ("Main", "Simple Parametric")
    assert document["level"] in (1, 2)
    assert re.fullmatch(r"\d{4}-[01]\d-[0-3]\d", document["date"])
    assert 1 <= document["timescale"] <= 48_000
    _unique(document["avatars"])
    _unique(document["perceptions"])
    avatars = {0, *(avatar["id"] for avatar in document["avatars"])}
    for perception in document["perceptions"]:
        assert {"id", "avatar_id", "description", "perception_modality", "channels"} <= set(perception)
        assert {"effect_library", "reference_devices"} <= set(perception)
        assert "effect_semantic_scheme" not in perception  # the reference validator rejects any
        assert perception["avatar_id"] in avatars
        assert perception["perception_modality"] == "Vibrotactile"
        assert len(perception["channels"]) <= (127 if document["level"] == 1 else 65_536)
        _unique(perception["channels"])
        for channel in perception["channels"]:
            assert {"id", "description", "gain", "mixing_coefficient", "body_part_mask", "bands"} <= set(channel)
            assert len(channel["bands"]) <= (7 if document["level"] == 1 else 65_536)
            for band in channel["bands"]:
                _band(band)


def _band(band):
    assert band["band_type"] in ("Transient", "Curve", "VectorialWave", "WaveletWave")
    assert ("curve_type" in band) == (band["band_type"] == "Curve")
    assert ("block_length" in band) == (band["band_type"] == "WaveletWave")
    low, high = band["lower_frequency_limit"], band["upper_frequency_limit"]
    assert isinstance(low, int)
    assert isinstance(high, int)
    assert 0 <= low <= high
    for effect in band["effects"]:
        assert {"effect_type", "position", "phase", "base_signal", "keyframes"} <= set(effect)
        assert effect["base_signal"] in ("Sine", "Square", "Triangle", "SawToothUp", "SawToothDown")
        assert isinstance(effect["position"], int)
        ticks = [key["relative_position"] for key in effect["keyframes"]]
        assert all(isinstance(tick, int) for tick in ticks)
        assert all(before < after for before, after in pairwise(ticks))
        assert all(isinstance(key["frequency_modulation"], int) for key in effect["keyframes"])
        assert all(low <= key["frequency_modulation"] <= high for key in effect["keyframes"])
        assert all(0.0 <= key["amplitude_modulation"] <= 1.0 for key in effect["keyframes"])


RULES = {"haptic": haptic, "ahap": ahap, "hjif": hjif}
"""The rules of each format that is written, by its name."""
