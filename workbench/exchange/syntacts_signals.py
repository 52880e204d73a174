"""Signals of Syntacts (Pezent and others 2020) as functions of time, and as voices.

A signal is a tree of oscillators with a phase, envelopes, sums, products, and time transformations. It is decomposed
into terms: at most one oscillation times a level, both sampled over time. The product of two sines is the sum of two
at the difference and the sum of their frequencies, which is exact; in other products the second factor counts as a
level.
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np

from underfoot.errors import BadValue
from underfoot.exchange.syntacts_curves import shaped
from underfoot.exchange.voices import Voice, analysed, simplify_points
from underfoot.kernels import Floats

Curve = Callable[[Floats], Floats]
"""Values at times."""

LONGEST_S = 60.0
"""Signals without an end are cut here, as Syntacts does when it writes sound files."""
MOST_TERMS, DEEPEST = 2000, 60
_STEP_S = 1e-3
_NUMBER = 0x7FFFFFFF
"""The bit above indicates that the name follows."""
_OSCILLATORS = {"Sine": "sine", "Square": "square", "Saw": "saw", "Triangle": "triangle"}


@dataclass(frozen=True)
class Term:
    """An oscillation of a `phase` (radians over time; None: no oscillation) times a `level`, between two times."""

    level: Curve
    start_s: float = 0.0
    end_s: float = np.inf
    phase: Curve | None = None
    wave: str = ""
    duty: float = 0.5

    def moved(self, factor: float, shift_s: float) -> "Term":
        """Return the term stretched by `factor` and delayed by `shift_s`. A negative factor reverses it."""

        def then(curve: Curve) -> Curve:
            return lambda t: curve((t - shift_s) / factor)

        ends = sorted((factor * self.start_s + shift_s, factor * self.end_s + shift_s))
        return replace(
            self, level=then(self.level), phase=self.phase and then(self.phase), start_s=ends[0], end_s=ends[1]
        )


@dataclass
class Reading:
    """The signals of one file; `lost` collects what cannot be played."""

    lost: dict[str, None]
    names: dict[int, str]
    """Types by their numbers, from `types_in`."""

    # --- the tree ---

    def parts(self, signal: object) -> tuple[str, Any, float, float]:
        """Return the type of a signal, its fields, its gain and its bias."""
        if not isinstance(signal, dict) or not isinstance(signal.get("m_ptr"), dict):
            raise BadValue("a signal has no m_ptr; allowed: what Syntacts exports as JSON")
        pointer = signal["m_ptr"]
        name = self._type(pointer)
        wrapper = pointer.get("ptr_wrapper")
        data = wrapper.get("data") if isinstance(wrapper, dict) else None
        model = data.get("m_model") if isinstance(data, dict) else None
        if not isinstance(model, dict):
            raise BadValue(f"a signal of type {name[:60]} has no fields")
        kind = name.rpartition("<")[2].rstrip(">").rpartition("::")[2]
        return kind, model, number_in(signal, "gain", 1.0), number_in(signal, "bias", 0.0)

    def terms(self, signal: object, depth: int = 0) -> tuple[list[Term], float]:
        """Return the terms of a signal, and its length in seconds."""
        if depth > DEEPEST:
            raise BadValue(f"signals stand within one another more than {DEEPEST} deep")
        kind, model, gain, bias = self.parts(signal)
        terms, length_s = self._terms(kind, model, depth)
        if len(terms) > MOST_TERMS:
            raise BadValue(f"it has more than {MOST_TERMS} parts")
        if len(terms) == 1 and terms[0].phase is None and not terms[0].wave:
            one = terms[0]
            return [replace(one, level=lambda t: gain * one.level(t) + bias)], length_s
        scaled = [replace(term, level=_times(term.level, gain)) for term in terms]
        if bias:
            scaled.append(Term(lambda t: np.full_like(t, bias), 0.0, length_s))
        return scaled, length_s

    def _terms(self, kind: str, model: object, depth: int) -> tuple[list[Term], float]:
        if kind in _OSCILLATORS:
            phase, _ = self.sum_of(field_of(model, "IOscillator", "x"), depth)
            return [Term(_one, phase=phase, wave=_OSCILLATORS[kind])], np.inf
        if kind == "Pwm":
            turns = 2.0 * np.pi * number_in(model, "frequency", 1.0)
            duty = min(max(number_in(model, "dutyCycle", 0.5), 0.01), 0.99)
            return [Term(_one, phase=lambda t: turns * t, wave="square", duty=duty)], np.inf
        if kind == "Noise":
            return [Term(_one, wave="noise")], np.inf
        if kind == "Samples":
            return self._samples(model)
        if kind == "Expression":
            self.lost["expressions, which are not computed"] = None
            return [], np.inf
        if kind in ("Sum", "Product"):
            operands = field_of(model, "IOperator")
            left, right = (self.terms(field_of(operands, side), depth + 1) for side in ("lhs", "rhs"))
            if kind == "Sum":
                return left[0] + right[0], max(left[1], right[1])
            pairs = [pair for a in left[0] for b in right[0] for pair in _pairs(a, b)]
            if len(pairs) > len(left[0]) * len(right[0]):
                self.lost["at which moment the beats of two multiplied sines are loudest"] = None
            return [self._product(a, b) for a, b in pairs], min(left[1], right[1])
        if kind in ("Sequence", "Repeater", "Stretcher", "Reverser"):
            return self._in_time(kind, model, depth)
        level, length_s = self._level(kind, model, depth)
        return [Term(level, 0.0, length_s)], length_s

    def _product(self, a: Term, b: Term) -> Term:
        """Multiply two terms, at most one of which oscillates."""
        carrier, other = (a, b) if a.wave else (b, a)
        if a.wave and b.wave:
            self.lost["products of two oscillators that are no sines: the second is left out"] = None
        level = carrier.level
        return replace(
            carrier,
            level=lambda t: level(t) * other.level(t),
            start_s=max(a.start_s, b.start_s),
            end_s=min(a.end_s, b.end_s),
        )

    def sum_of(self, signal: object, depth: int) -> tuple[Curve, float]:
        """Return a signal as a function of time, including oscillators: for phases and envelopes."""
        terms, length_s = self.terms(signal, depth + 1)

        def curve(t: Floats) -> Floats:
            return np.sum([_value(term, t) for term in terms], axis=0) if terms else np.zeros_like(t)

        return curve, length_s

    def _in_time(self, kind: str, model: object, depth: int) -> tuple[list[Term], float]:
        if kind == "Sequence":
            found: list[Term] = []
            for key in list_in(model, "m_keys"):
                start_s = number_in(key, "t", 0.0)
                terms, length_s = self.terms(field_of(key, "signal"), depth + 1)
                found += [_within(term.moved(1.0, start_s), start_s, start_s + length_s) for term in terms]
            return found, max((term.end_s for term in found), default=0.0)
        terms, length_s = self.terms(field_of(model, "signal"), depth + 1)
        if kind == "Stretcher":
            factor = number_in(model, "factor", 1.0)
            if factor <= 0.0:
                raise BadValue(f"a stretcher's factor is {factor:g}; allowed: above 0")
            return [term.moved(factor, 0.0) for term in terms], factor * length_s
        if kind == "Reverser":
            length_s = min(length_s, LONGEST_S)
            return [_within(term.moved(-1.0, length_s), 0.0, length_s) for term in terms], length_s
        count, delay_s = int(min(number_in(model, "repetitions", 1.0), 1e6)), number_in(model, "delay", 0.0)
        each_s = length_s + delay_s
        if not 0.0 < each_s < np.inf:
            return terms, length_s
        count = max(min(count, int(LONGEST_S / each_s) + 1), 0)
        if count * len(terms) > MOST_TERMS:
            raise BadValue(f"it has more than {MOST_TERMS} parts")
        copies = [
            _within(t.moved(1.0, k * each_s), k * each_s, k * each_s + length_s) for k in range(count) for t in terms
        ]
        return copies, length_s * count + delay_s * max(count - 1, 0)

    # --- signals without oscillation ---

    def _level(self, kind: str, model: object, depth: int) -> tuple[Curve, float]:
        if kind == "Scalar":
            value = number_in(model, "value", 1.0)
            return lambda t: np.full_like(t, value), np.inf
        if kind == "Time":
            return lambda t: t, np.inf
        if kind == "Ramp":
            initial, rate = number_in(model, "initial", 1.0), number_in(model, "rate", 0.0)
            return lambda t: initial + rate * t, number_in(model, "duration", np.inf)
        if kind == "Envelope":
            height = number_in(model, "amplitude", 1.0)
            return lambda t: np.full_like(t, height), number_in(model, "duration", 0.1)
        if kind == "ExponentialDecay":
            top, decay = number_in(model, "amplitude", 1.0), number_in(model, "decay", 6.9)
            if top <= 0.001 or decay <= 0.0:
                raise BadValue(
                    f"an exponential decay has amplitude {top:g} and decay {decay:g}; allowed: above 0.001 and 0"
                )
            return lambda t: top * np.exp(-decay * np.maximum(t, 0.0)), float(-np.log(0.001 / top) / decay)
        if kind in ("KeyedEnvelope", "ASR", "ADSR"):
            return self._keyed(model if kind == "KeyedEnvelope" else field_of(model, "KeyedEnvelope"))
        if kind == "SignalEnvelope":
            inner, _ = self.sum_of(field_of(model, "signal"), depth)
            height = number_in(model, "amplitude", 1.0)
            return lambda t: 0.5 * height * (inner(t) + 1.0), number_in(model, "duration", 1.0)
        if kind == "PolyBezier":
            return _bezier(list_in(model, "points"))
        raise BadValue(f"it has a signal of type {kind[:60]}; allowed: those of Syntacts 1.3")

    def _keyed(self, model: object) -> tuple[Curve, float]:
        keys = []
        for one in list_in(model, "keys"):
            value = field_of(one, "value")
            keys.append((number_in(one, "key", 0.0), number_in(value, "first", 0.0), self._curve_name(value)))
        keys.sort(key=lambda key: key[0])
        if not keys:
            raise BadValue("an envelope has no keys")

        def curve(t: Floats) -> Floats:
            found = np.full_like(t, keys[0][1])
            for (begin_s, low, _), (end_s, high, name) in pairwise(keys):
                inside = (t > begin_s) & (t <= end_s)
                share = shaped(name, (t[inside] - begin_s) / max(end_s - begin_s, 1e-12))
                found[inside] = low + (high - low) * share
            return found

        return curve, keys[-1][0]

    def _curve_name(self, value: object) -> str:
        return self._type(field_of(value, "second", "m_ptr")).partition("Curves::")[2].rstrip(">")

    def _type(self, pointer: Mapping[str, object]) -> str:
        number = pointer.get("polymorphic_id")
        name = self.names.get(number & _NUMBER) if isinstance(number, int) else None
        if name is None:
            raise BadValue("a signal does not say its type")
        return name

    def _samples(self, model: object) -> tuple[list[Term], float]:
        """Approximate samples by a single oscillation."""
        rate_hz = number_in(model, "m_sampleRate", 44_100.0)
        values = list_in(field_of(model, "m_samples", "ptr_wrapper"), "data")
        if not 100.0 <= rate_hz <= 192_000.0 or len(values) < 2 or not all(isinstance(v, int | float) for v in values):
            raise BadValue("samples have no rate from 100 to 192000 Hz, or are no numbers")
        points = analysed(np.clip(np.array(values, float), -1e6, 1e6), rate_hz)
        turns = np.concatenate([[0.0], np.cumsum(0.5 * np.diff(points[:, 0]) * (points[1:, 2] + points[:-1, 2]))])
        self.lost["the waveform of samples: amplitude and frequency are kept"] = None
        phase: Curve = lambda t: 2.0 * np.pi * np.interp(t, points[:, 0], turns)  # noqa: E731
        length_s = len(values) / rate_hz
        return [Term(lambda t: np.interp(t, points[:, 0], points[:, 1]), 0.0, length_s, phase, "sine")], length_s


def voices_of(signal: object, lost: dict[str, None]) -> list[Voice]:
    """Return the voices of a signal; successive terms of one wave form one voice."""
    terms, length_s = Reading(lost, types_in(signal)).terms(signal)
    if length_s > LONGEST_S:
        lost[f"what comes after {LONGEST_S:g} s"] = None
    lanes: list[tuple[Term, list[Floats]]] = []
    for term in sorted(terms, key=lambda term: term.start_s):
        if not term.wave:
            lost["what does not oscillate: an offset"] = None
            continue
        points = _points(term, min(term.end_s, length_s, LONGEST_S))
        if not points.size:
            continue
        for first, parts in lanes:
            if (first.wave, first.duty) == (term.wave, term.duty) and parts[-1][-1, 0] <= points[0, 0]:
                parts.append(points)
                break
        else:
            lanes.append((term, [points]))
    return [Voice(np.concatenate(parts), first.wave, first.duty) for first, parts in lanes]


def types_in(raw: object) -> dict[int, str]:
    """Return types by their numbers: a type is named at its first occurrence, and has only its number later."""
    found: dict[int, str] = {}
    waiting = [raw]
    while waiting:
        value = waiting.pop()
        if isinstance(value, dict):
            number, name = value.get("polymorphic_id"), value.get("polymorphic_name")
            if isinstance(number, int) and isinstance(name, str):
                found[number & _NUMBER] = name
            waiting += value.values()
        elif isinstance(value, list):
            waiting += value
    return found


def _points(term: Term, end_s: float) -> Floats:
    """Return a term's amplitude and frequency over time; empty where it is silent."""
    start_s = max(term.start_s, 0.0)
    if not start_s < end_s:
        return np.zeros((0, 3))
    count = max(int((end_s - start_s) / _STEP_S) + 1, 2)
    times = np.linspace(start_s, end_s, count)
    inside = times.clip(start_s + 1e-9, end_s - 1e-9)
    level = np.abs(term.level(inside))
    frequency = np.zeros_like(times)
    if term.phase is not None:
        ahead, behind = (inside + 1e-6).clip(None, end_s), (inside - 1e-6).clip(start_s)
        frequency = np.abs(term.phase(ahead) - term.phase(behind)) / (ahead - behind) / (2.0 * np.pi)
    points = np.column_stack([times, level, frequency])
    if not np.isfinite(points).all():
        raise BadValue("it has values that are not finite")
    if level.max() <= 1e-6:
        return np.zeros((0, 3))
    edges = points[[0, -1]].copy()
    edges[:, 1] = 0.0
    return np.concatenate([edges[:1], simplify_points(points, 2e-3 * level.max(), 0.5), edges[1:]])


def _pairs(a: Term, b: Term) -> Iterable[tuple[Term, Term]]:
    """Return the pairs whose products sum to the product of two terms: for two sines, half the cosines of both
    phases.
    """
    if not (a.wave == b.wave == "sine" and a.phase and b.phase):
        return ((a, b),)
    first, second = a.phase, b.phase
    quarter = 0.5 * np.pi
    level = replace(b, phase=None, wave="", level=_times(b.level, 0.5))
    return (
        (replace(a, phase=lambda t: first(t) - second(t) + quarter), level),
        (replace(a, phase=lambda t: first(t) + second(t) - quarter), level),
    )


def _value(term: Term, t: Floats) -> Floats:
    inside = (t >= term.start_s) & (t <= term.end_s)
    if term.phase is None:
        return np.where(inside, term.level(t), 0.0)
    phase = term.phase(t)
    wave = np.sin(phase)
    if term.wave == "square":
        wave = np.where((phase / (2.0 * np.pi)) % 1.0 < term.duty, 1.0, -1.0)
    elif term.wave == "triangle":
        wave = 2.0 / np.pi * np.arcsin(wave)
    elif term.wave == "saw":
        wave = 2.0 * ((phase / (2.0 * np.pi)) % 1.0) - 1.0
    return np.where(inside, term.level(t) * wave, 0.0)


def _within(term: Term, start_s: float, end_s: float) -> Term:
    return replace(term, start_s=max(term.start_s, start_s), end_s=min(term.end_s, end_s))


def _times(level: Curve, factor: float) -> Curve:
    return lambda t: factor * level(t)


def _one(t: Floats) -> Floats:
    return np.ones_like(t)


def _bezier(points: list[Any]) -> tuple[Curve, float]:
    """Join cubic Bezier curves from point to point, sampled finely and interpolated linearly."""
    if len(points) < 2:
        return lambda t: np.zeros_like(t), 0.0
    u = np.linspace(0.0, 1.0, 16)
    weights = np.array([(1 - u) ** 3, 3 * (1 - u) ** 2 * u, 3 * (1 - u) * u**2, u**3])
    curve = []
    for left, right in pairwise(points):
        corners = [field_of(one, name) for one, name in ((left, "p"), (left, "cpR"), (right, "cpL"), (right, "p"))]
        curve.append(
            np.array([(number_in(corner, "t", 0.0), number_in(corner, "y", 0.0)) for corner in corners]).T @ weights
        )
    times, values = np.concatenate(curve, axis=1)
    times = np.maximum.accumulate(times)
    return lambda t: np.interp(t, times, values, 0.0, 0.0), float(times[-1])


# --- fields ---


def field_of(raw: object, *names: str) -> dict[str, Any]:
    """Return a nested field; raise `BadValue` if it is missing, or not an object."""
    found: Any = raw
    for name in names:
        found = found.get(name) if isinstance(found, dict) else None
        if not isinstance(found, dict):
            raise BadValue(f"{name} is missing or no object")
    return found


def list_in(raw: object, name: str) -> list[Any]:
    """Return a list by its name; raise `BadValue` if it is missing."""
    value = raw.get(name) if isinstance(raw, dict) else None
    if not isinstance(value, list) or len(value) > 10_000_000:
        raise BadValue(f"{name} is missing or no list")
    return value


def number_in(raw: object, name: str, otherwise: float) -> float:
    """Return a number by its name; raise `BadValue` if it is not one."""
    value = raw.get(name, otherwise) if isinstance(raw, dict) else otherwise
    if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) <= 1e9:
        if value == np.inf:
            return float(np.inf)
        raise BadValue(f"{name} is {str(value)[:40]!r}; allowed: numbers from -1e9 to 1e9")
    return float(value)
