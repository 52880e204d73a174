"""Small files of other programs, built here from their published structure."""

import json

import numpy as np
import soundfile


def haptic(**metadata):
    points = [(0.0, 0.2), (0.1, 0.8), (0.2, 0.4), (0.5, 0.0)]
    amplitude = [{"time": t, "amplitude": a} for t, a in points]
    amplitude[2]["emphasis"] = {"amplitude": 0.9, "frequency": 0.7}
    frequency = [{"time": 0.0, "frequency": 0.0}, {"time": 0.5, "frequency": 1.0}]
    return {
        "version": {"major": 1, "minor": 0, "patch": 0},
        "metadata": {"editor": "Haptics Studio", "project": "Door", **metadata},
        "signals": {"continuous": {"envelopes": {"amplitude": amplitude, "frequency": frequency}}},
    }


def event(kind, time, duration=None, **parameters):
    fields = {"Time": time, "EventType": kind}
    if duration is not None:
        fields["EventDuration"] = duration
    given = [{"ParameterID": name, "ParameterValue": value} for name, value in parameters.items()]
    return {"Event": {**fields, "EventParameters": given}}


def curve(name, time, *points):
    controls = [{"Time": t, "ParameterValue": v} for t, v in points]
    return {"ParameterCurve": {"ParameterID": name, "Time": time, "ParameterCurveControlPoints": controls}}


def ahap(*pattern):
    pattern = pattern or (
        event("HapticTransient", 0.0, HapticIntensity=1.0, HapticSharpness=0.5),
        event("HapticContinuous", 0.2, 0.4, HapticIntensity=1.0, HapticSharpness=0.0),
        curve("HapticIntensityControl", 0.2, (0.0, 1.0), (0.4, 0.5)),
    )
    return {"Version": 1.0, "Metadata": {"Project": "Tap"}, "Pattern": list(pattern)}


def hjif(*bands, **perception):
    keyframes = [
        {"relative_position": 0, "amplitude_modulation": 0.5, "frequency_modulation": 100},
        {"relative_position": 250, "amplitude_modulation": 1.0, "frequency_modulation": 150},
        {"relative_position": 500, "amplitude_modulation": 0.0, "frequency_modulation": 150},
    ]
    channel = {
        "id": 0,
        "description": "sole",
        "gain": 1.0,
        "mixing_coefficient": 1.0,
        "body_part_mask": 0,
        "bands": list(bands) or [band("VectorialWave", keyframes)],
    }
    return {
        "version": "2023",
        "profile": "Main",
        "level": 1,
        "date": "2024-05-01",
        "description": "Buzz",
        "timescale": 1000,
        "avatars": [],
        "perceptions": [
            {
                "id": 0,
                "avatar_id": 0,
                "description": "",
                "perception_modality": "Vibrotactile",
                "effect_library": [],
                "reference_devices": [],
                "channels": [channel],
                **perception,
            }
        ],
        "syncs": [],
    }


def band(kind, keyframes, **effect):
    fields = {"effect_type": "Basis", "position": 0, "phase": 0, "base_signal": "Sine", "keyframes": keyframes}
    return {
        "band_type": kind,
        "lower_frequency_limit": 0,
        "upper_frequency_limit": 1000,
        "effects": [fields | effect],
    }


def macaron():
    def track(scale, *points):
        return {
            "valueScale": scale,
            "data": [{"id": i, "t": t, "value": v, "selected": False} for i, (t, v) in enumerate(points)],
        }

    return {
        "duration": 1000,
        "selected": True,
        "selectedTimeRange": {"active": False, "time1": 0, "time2": 0},
        "parameters": {
            "amplitude": track([0, 1], (200, 0.5), (600, 1.0), (900, 0.0)),
            "frequency": track([50, 500], (0, 250), (600, 50)),
        },
    }


class Syntacts:
    """Signals as Syntacts writes them with cereal: types are numbered by appearance, and named the first time."""

    def __init__(self, names_each_time=False):
        """With `names_each_time`, parts can be combined in any order."""
        self.types, self.names_each_time = [], names_each_time

    def pointer(self, type, model):
        known = type in self.types and not self.names_each_time
        if type not in self.types:
            self.types.append(type)
        number = self.types.index(type) + 1
        head = {"polymorphic_id": number} if known else {"polymorphic_id": number + 2**31, "polymorphic_name": type}
        return {**head, "ptr_wrapper": {"valid": 1, "data": {"Concept": {}, "m_model": model}}}

    def signal(self, type, model, gain=1.0, bias=0.0):
        return {"gain": gain, "bias": bias, "m_ptr": self.pointer(f"tact::Signal::Model<tact::{type}>", model)}

    def sine(self, hertz, kind="Sine"):
        return self.signal(kind, {"IOscillator": {"x": self.signal("Time", {}, gain=2.0 * np.pi * hertz)}})

    def times(self, left, right, kind="Product"):
        return self.signal(kind, {"IOperator": {"lhs": left, "rhs": right}})

    def envelope(self, duration, amplitude=1.0):
        return self.signal("Envelope", {"duration": duration, "amplitude": amplitude})

    def keyed(self, *keys):
        """Keys (time, value, curve)."""
        rows = [
            {
                "key": t,
                "value": {"first": v, "second": {"m_ptr": self.pointer(f"tact::Curve::Model<tact::Curves::{c}>", {})}},
            }
            for t, v, c in keys
        ]
        return self.signal("ASR", {"KeyedEnvelope": {"keys": rows}})

    def sequence(self, *keys):
        rows = [{"t": t, "signal": signal} for t, signal in keys]
        return self.signal("Sequence", {"head": 0.0, "m_keys": rows, "m_length": 1.0})


def syntacts():
    made = Syntacts()
    buzz = made.times(made.sine(175.0), made.keyed((0.0, 0.0, "Instant"), (0.1, 0.8, "Linear"), (0.3, 0.0, "Linear")))
    return {"value0": made.sequence((0.0, buzz), (0.5, made.times(made.sine(80.0, "Square"), made.envelope(0.2, 0.5))))}


SAMPLES = {
    "haptic": ("door.haptic", haptic),
    "ahap": ("tap.ahap", ahap),
    "hjif": ("buzz.hjif", hjif),
    "macaron": ("icon.json", macaron),
    "syntacts": ("signal.json", syntacts),
}
"""File name and content of each format's sample, by its name."""


def put(folder, name):
    """Write the sample of a format into a folder; return its path."""
    if name == "wav":
        path = folder / "sound.wav"
        soundfile.write(path, 0.5 * np.sin(np.arange(4800) * 0.05), 48_000)
        return path
    file, make = SAMPLES[name]
    path = folder / file
    text = json.dumps(make())
    path.write_text(f"data:text/json;charset=utf8, {text}" if name == "macaron" else text)
    return path
