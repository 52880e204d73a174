"""Invariants of nodes for any input: no energy from nothing, no tension in contacts, no output beyond declared bounds.

Each function checks one node of a patch that ran, and returns the violation, or "". One that needs a parameter that a
wire drives, or an absent signal, returns "".
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from underfoot.models.stick_slip.quantile_table import LONGEST
from underfoot.nodes.impacts import FASTEST_M_S

_SLACK = 1.0 + 1e-6
_NOTHING = 1e-30
"""Sums of squares below this are rounding, or what is dropped at sleep (1e-9 per frame)."""


@dataclass(frozen=True)
class NodeSignals:
    """Input and output of one node on one tile: signals [frames] and events [events, 3] by port name.

    Parameters that a wire drives are not among `values`.
    """

    rate: float
    values: Mapping[str, Any]
    inputs: Mapping[str, NDArray[np.float64]]
    outputs: Mapping[str, NDArray[np.float64]]
    events_in: Mapping[str, NDArray[np.float64]]
    events_out: Mapping[str, NDArray[np.float64]]


def broken_invariant(type: str, seen: NodeSignals) -> str:
    """Return the invariant that a node of `type` broke, with figures; "" if none is known or none was broken.

    >>> loud, quiet = {"signal": np.ones(8)}, {"signal": np.full(8, 0.1)}
    >>> seen = NodeSignals(48e3, {"depth": 0.5}, quiet, {"out": loud["signal"]}, {}, {})
    >>> broken_invariant("roughness", seen)
    'gives 1 at frame 0, outside what it promises'
    """
    if type not in INVARIANTS:
        return ""
    try:
        return INVARIANTS[type](seen)
    except KeyError:  # a port without a wire, or a parameter with one
        return ""


def _energy_bounded(given: NDArray[np.float64], got: NDArray[np.float64], gain: float) -> str:
    """The output energy of a stable linear filter is at most its input energy times its largest gain squared."""
    scale = max(float(np.abs(given).max(initial=0.0)), float(np.abs(got).max(initial=0.0)), 1e-9)
    came, went = float(np.sum((given / scale) ** 2)), float(np.sum((got / scale) ** 2))
    lost_in_sleep = got.size * (1e-9 / scale) ** 2
    if went > came * (gain * _SLACK) ** 2 + lost_in_sleep + _NOTHING:
        times = math.sqrt(went / came) / gain if came > 0.0 else math.inf
        return f"puts out {times:.6g} times what its gain of {gain:.6g} allows (RMS)"
    return ""


def _require_constant(seen: NodeSignals, *names: str) -> None:
    """Only a constant filter keeps the invariant: a state carried into another band may ring louder."""
    for name in names:
        seen.values[name]


def _resonant(seen: NodeSignals) -> str:
    q = seen.values["q"]
    _require_constant(seen, "cutoff")
    gain = 1.0 if q <= math.sqrt(0.5) else q / math.sqrt(1.0 - 0.25 / (q * q))
    return _energy_bounded(seen.inputs["signal"], seen.outputs["out"], gain)


def _band_pass(seen: NodeSignals) -> str:
    _require_constant(seen, "centre", "width")
    return _energy_bounded(seen.inputs["signal"], seen.outputs["out"], 1.0)


def _strain_rate(seen: NodeSignals) -> str:
    values = seen.values
    w0 = 2.0 * math.pi * min(values["frequency"], 0.49 * seen.rate)
    gain = 1.0 / (2.0 * values["damping"] * w0 * values["mass"])
    return _energy_bounded(seen.inputs["force"], seen.outputs["out"], gain)


def _within(signal: NDArray[np.float64], low: float | NDArray[np.float64], high: float | NDArray[np.float64]) -> str:
    outside = (signal < low) | (signal > high)
    if outside.any():
        at = int(np.argmax(outside))
        return f"gives {signal[at]:.6g} at frame {at}, outside what it promises"
    return ""


def _contact(seen: NodeSignals) -> str:
    return _within(seen.outputs["out"], 0.0, 1.0)


def _roughness(seen: NodeSignals) -> str:
    most = (1.0 + seen.values["depth"]) * _SLACK * np.abs(seen.inputs["signal"])
    return _within(seen.outputs["out"], -most, most)


def _tone(seen: NodeSignals) -> str:
    most = _SLACK * seen.values["amplitude"]
    return _within(seen.outputs["out"], -most, most)


def _scale(seen: NodeSignals) -> str:
    """From the first frame at which its input is not 0: before that it is asleep."""
    ends = seen.values["out_low"], seen.values["out_high"]
    slack = 1e-9 * max(map(abs, ends))
    woken = np.cumsum(seen.inputs["signal"] != 0.0) > 0
    return _within(seen.outputs["out"][woken], min(ends) - slack, max(ends) + slack)


def _modal_bank(seen: NodeSignals) -> str:
    strikes = np.abs(seen.events_in["strike"][:, 1]).sum()
    amplitudes = sum(abs(mode[2]) for mode in seen.values["modes"])
    most = _SLACK * seen.values["level"] * amplitudes * strikes + 1e-9
    return _within(seen.outputs["out"], -most, most)


def _random_bank(seen: NodeSignals) -> str:
    """The squares of its amplitudes sum to 1, so the amplitudes sum to at most the square root of their number."""
    strikes = np.abs(seen.events_in["strike"][:, 1]).sum()
    most = _SLACK * seen.values["level"] * math.sqrt(seen.values["modes"]) * strikes + 1e-9
    return _within(seen.outputs["out"], -most, most)


def _stick_slip(seen: NodeSignals) -> str:
    """A block without pressure does not move, and no slip lasts longer than its table."""
    pressed = seen.inputs["force"] > 0.0
    loose = np.where(pressed, 0.0, seen.outputs["acceleration"])
    if loose.any():
        return (
            f"gives {loose[np.argmax(loose != 0.0)]:.6g} at frame {np.argmax(loose != 0.0)}, where nothing presses it"
        )
    events = seen.events_out.get("events", np.empty((0, 3)))
    longest = LONGEST / (2.0 * math.pi * seen.values["frequency"])
    if (events[:, 1] < 0.0).any() or (events[:, 2] > longest * _SLACK).any():
        return f"gives a slip of strength {events[:, 1].min():.6g} and length {events[:, 2].max():.6g} s"
    return ""


def _impact(seen: NodeSignals) -> str:
    """A hammer never pulls, and never leaves with more energy than all blows so far supplied: impulse <= m (v + w)."""
    force, mass = seen.outputs["force"], seen.values["mass"]
    if force.min(initial=0.0) < 0.0:
        return f"pulls with {force.min():.6g} N"
    speeds = np.clip(seen.values["velocity"] * seen.events_in["strike"][:, 1], 0.0, FASTEST_M_S)
    most = mass * float(np.sum(speeds + np.sqrt(np.cumsum(speeds**2))))
    impulse = float(force.sum()) / seen.rate
    if impulse > most * _SLACK + 1e-15:
        return f"gives an impulse of {impulse:.6g} N s where its blows allow {most:.6g}"
    return ""


def _most_work(
    force: NDArray[np.float64], moved: NDArray[np.float64], frames: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the most work of a force by each of `frames`, F x, if it is constant after one frame; else infinity."""
    steady = np.flatnonzero(force)
    if steady.size == 0 or np.ptp(force[steady[0] :]) > 0.0 or force[-1] < 0.0 or moved.min(initial=0.0) < 0.0:
        return np.full(frames.size, math.inf)
    at = np.clip(np.floor(frames).astype(np.int64), 0, moved.size - 1)
    return force[-1] * moved[at]


def _released(energy: NDArray[np.float64], work: NDArray[np.float64]) -> str:
    total = np.cumsum(energy)
    above = total > work * _SLACK + 1e-300
    if above.any():
        at = int(np.argmax(above))
        return f"has set free {total[at]:.6g} by event {at}, and the load has done work of {work[at]:.6g}"
    return ""


def _slip(seen: NodeSignals) -> str:
    events, values = seen.events_out["events"], seen.values
    energy = np.minimum(events[:, 1], 1e150) ** 2 * max(values["most"], 1.001 * values["least"])
    return _released(energy, _most_work(seen.inputs["force"], seen.outputs["displacement"], events[:, 0]))


def _bundle(seen: NodeSignals) -> str:
    """For exact bundles only: chains that stiffen while stretched gain energy, as in the thesis."""
    values, events = seen.values, seen.events_out["events"]
    if values["model"] != "exact" or values["softness"] < 0.1 or values["loudness"] < 1e-3:
        return ""
    thresholds, n, k, scale = values["thresholds"], values["fibres"], values["shape"], values["scale"]
    share = 0.25 if thresholds == "uniform" else k ** (-1.0 / k) * math.exp(-1.0 / k)
    stress = seen.inputs["force"] * (n * values["stiffness"] * scale * share / values["strength"])
    unit = 0.5 * values["stiffness"] * scale**2
    energy = unit * (events[:, 1] / values["loudness"]) ** (1.0 / values["softness"])
    return _released(energy, _most_work(stress, seen.outputs["strain"], events[:, 0]))


INVARIANTS: Mapping[str, Callable[[NodeSignals], str]] = {
    "low-pass": _resonant,
    "high-pass": _resonant,
    "band-pass": _band_pass,
    "strain-rate-envelope": _strain_rate,
    "contact-envelope": _contact,
    "roughness": _roughness,
    "tone": _tone,
    "scale": _scale,
    "modal-bank": _modal_bank,
    "drawn-bank": _random_bank,
    "stick-slip": _stick_slip,
    "impact": _impact,
    "slip": _slip,
    "fibre-bundle": _bundle,
}
"""The invariants by node type."""
