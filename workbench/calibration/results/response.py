"""Results of a frequency response: figures, verdict, warnings, the profile's part, pictures and raw data."""

import math
from collections.abc import Mapping
from datetime import date

import numpy as np
from numpy.typing import NDArray

from underfoot.calibration.reference import uncertain_by
from underfoot.calibration.result import Result
from underfoot.calibration.results.labels import title_of
from underfoot.calibration.science.acceleration_uncertainty import acceleration_uncertainty, tones_over_sweeps
from underfoot.calibration.science.response import (
    ALLOWED_DB,
    INNER_HZ,
    ResponseMeasurements,
    change_db,
    flatness_db,
    is_reversed,
    usable_band_hz,
)
from underfoot.calibration.science.tones import TONE_HZ, DistortionOverLevel
from underfoot.calibration.science.transfer_function import ORDERS, SweepMeasurement, within
from underfoot.drawing import Drawing, ReferenceLine, series
from underfoot.floor.profile import Response
from underfoot.kernels import Floats
from underfoot.models.filtering import equaliser
from underfoot.models.filtering.equaliser import BAND_HZ

METHOD = (
    "The response is the spectrum of the recording over that of the sweep; its impulse response is cut off after "
    "half a second. Its spread is the standard deviation over the passes; its noise is what the silent parts of the "
    "recording would have given. Harmonics of an exponential sweep arrive ahead of the response and are measured "
    "separately. The level is the mean of the decibels over log frequency, 50 to 750 Hz; flatness is half the range "
    "of the decibels from 60 to 700 Hz. The equaliser is designed by the least p-th norm, for the response under one "
    "load; measured again means that the sweep was played through it, under that load. Levels at the band's edges "
    "are in dB re the tile's level; a change is the largest from 60 to 700 Hz. Distortion is that of the sweep, and "
    f"of tones of rising level, at {TONE_HZ:g} Hz. The noise floor is the RMS of silence."
)
_OF_ACCELERATION = (
    " The expanded uncertainty (k = 2) is of the acceleration at the accelerometer's place, of a stimulus of 60 to 700 "
    "Hz that drives the shaker at most as hard as the sweeps did, under the load of the equaliser. It is twice the "
    "root of the sum of four squares: half of the accelerometer's own expanded uncertainty; the standard deviation of "
    "the mean over the passes, or what noise does to it; the deviation from flat that was measured again; and by "
    f"how much the gain of tones of all levels at {TONE_HZ:g} Hz is off that of the sweeps, as shakers compress, and "
    "gains wander (the latter three root mean squares). On 24 simulated tiles, with an accelerometer of 1 % and gains "
    "that wander by up to 3 % from recording to recording, 96 % of tones of all levels were within it (66 % on the "
    "worst tile). Another person on the tile, another place on it, louder stimuli, and a shaker that is warmer or "
    "colder than it was are not in it."
)
"""Measured with `ResponseProcedure`, seeds 1 to 24, sweeps at 0.1 to 0.45 of full scale, nobody or a person on it."""
LOAD_NAMES = {"none": "nothing on it", "standing": "standing in the middle", "corner": "a foot on a corner"}
_WITH = {"none": "nobody on it", "standing": "a person in the middle", "corner": "a foot on a corner"}
_MOST_DISTORTION = 0.10
"""Distortion, as a share, above which a warning is given."""
_MOST_CHANGE = 0.03
"""Change of the gain from the first sweeps to the loudest tone, as a share, above which a warning is given."""
_LEAST_SNR_DB = 20.0
"""Below it, noise can change a response by 1 dB."""
_OUTSTANDING = 10.0
"""From this factor on over the median of noise, a peak is more than its chance: that of white noise is 3 to 4."""
_HZ, _DB_LABEL = "frequency, Hz", "dB re 1 m/s^2 at full scale"
_SPAN_HZ = (20.0, 2000.0)
_KEPT_AN_OCTAVE = 48
"""Points per octave of the response that a profile stores."""
_COLOURS = {"none": "vibration", "standing": "force", "corner": "events"}
_ORDER_COLOURS = dict(zip(ORDERS, ("force", "events", "contact", "muted"), strict=True))


def result_of(found: ResponseMeasurements, tile: str = "") -> Result:
    """Return the result of a frequency response, for the profile of `tile`; for any tile's if there is none."""
    quantities = quantities_of(found)
    values = {name: value for name, value, _ in quantities}
    after = "flatness_measured_db" if found.again is not None else "flatness_computed_db"
    warnings = _warnings(found, values)
    good = values[after] <= ALLOWED_DB
    low, high = values["usable_low_hz"], values["usable_high_hz"]
    text = "measured again through the equaliser" if found.again is not None else "computed, not measured again"
    verdict = (
        f"With {_WITH[found.load]}, flat within {values[after]:.2f} dB from {INNER_HZ[0]:g} to {INNER_HZ[1]:g} Hz "
        f"({text}; {values['flatness_before_db']:.1f} dB before). {_otherwise(found, values)} "
        f"Usable from {low:.0f} to {high:.0f} Hz. A full-scale signal gives {found.level:.3g} m/s^2."
    )
    if (uncertain := values.get("acceleration_expanded_percent")) is not None:
        band = f"{INNER_HZ[0]:g} to {INNER_HZ[1]:g} Hz"
        verdict += f" Accelerations of {band} are uncertain by {uncertain:.2g} % (k = 2)."
    if not good:
        verdict += f" That is not flat enough (allowed: {ALLOWED_DB:g} dB): choose a higher order, or repair the tile."
    part = _part(found, values, after, good, verdict)
    return Result(
        kind="response",
        title=title_of("response", tile),
        quantities=quantities,
        verdict=verdict,
        good=good,
        warnings=warnings,
        drawings=drawings_of(found),
        raw=(
            *_raw(found.sweeps, found.sensitivity, found.tones),
            ("equaliser", "b0,b1,b2,a0,a1,a2", found.sections),
        ),
        part=part,
        tile=tile,
        method=METHOD + _OF_ACCELERATION * ("acceleration_expanded_percent" in values) + _level_words(found),
    )


def _level_words(found: ResponseMeasurements) -> str:
    """Return at what level the sweeps were played, which is that of the last tone; nothing without tones."""
    return "" if found.tones is None else f" Sweeps had a peak of {found.tones.drive[-1]:.3g} of full scale."


def inconclusive(
    measured: Mapping[str, SweepMeasurement],
    sensitivity: float,
    tones: DistortionOverLevel | None,
    reason: str,
    drawings: tuple[Drawing, ...],
    tile: str,
) -> Result:
    """Return the responses alone, which led to no equaliser for this reason."""
    raw = _raw(measured, sensitivity, tones)
    return Result("response", title_of("response", tile), (), reason, good=False, drawings=drawings, raw=raw)


def _otherwise(found: ResponseMeasurements, values: Mapping[str, float]) -> str:
    """Return in words how far the response is from flat under other loads, as far as they were measured."""
    others = {load: who for load, who in _WITH.items() if load != found.load}
    known = [
        f"up to {values[f'{load}_changes_db']:.1f} dB with {others[load]}" for load in others if load in found.loads
    ]
    if not known:
        return f"How far off it is with {' or '.join(others.values())} was not measured."
    return f"It is off by {', and by '.join(known)}."


def quantities_of(found: ResponseMeasurements) -> tuple[tuple[str, float, str], ...]:
    """Return name, value and unit of all measured quantities."""
    basis = found.basis
    f = basis.frequencies_hz
    before, computed = found.relative_db(basis.magnitude), found.relative_db(found.computed)
    after_f, after = f, computed
    if found.again is not None:
        after_f, after = found.again.frequencies_hz, found.relative_db(found.again.magnitude)
    low, high = np.clip(usable_band_hz(after_f, after), 0.0, (found.again or basis).swept_hz[1])
    plain_low, plain_high = np.clip(usable_band_hz(f, before), 0.0, basis.swept_hz[1])
    inside = within(f, BAND_HZ)
    boost = float(np.max(np.abs(equaliser.gain(found.sections, f[inside], found.rate_hz))))
    quantities = [
        ("acceleration_per_unit", found.level, "m/s^2"),
        ("flatness_before_db", flatness_db(f, before), "dB"),
        ("flatness_computed_db", flatness_db(f, computed), "dB"),
    ]
    if found.again is not None:
        quantities.append(("flatness_measured_db", flatness_db(after_f, after), "dB"))
    uncertain = acceleration_uncertainty(found)
    quantities += [(f"acceleration_{name}_percent", value, "%") for name, value in uncertain.items()]
    quantities += [(f"at_{edge:g}_hz_db", float(np.interp(edge, after_f, after)), "dB") for edge in BAND_HZ]
    quantities += [
        ("usable_low_hz", low, "Hz"),
        ("usable_high_hz", high, "Hz"),
        ("usable_low_before_hz", plain_low, "Hz"),
        ("usable_high_before_hz", plain_high, "Hz"),
        ("most_gain_db", 20.0 * math.log10(boost), "dB"),
        ("latency_ms", 1000.0 * basis.latency_s, "ms"),
        ("snr_db", basis.snr_db(*INNER_HZ), "dB"),
        ("passes", float(basis.passes), ""),
    ]
    if basis.passes > 1:
        inner = within(f, INNER_HZ)
        quantities.append(("spread_db", float(np.mean(basis.spread_db[inner])), "dB"))
    others = [load for load in found.loads if load != found.load]
    quantities += [(f"{load}_changes_db", change_db(found, load), "dB") for load in others]
    for k in ORDERS:
        share = np.interp(TONE_HZ, f, basis.distortion[k])
        if np.isfinite(share):
            quantities.append((f"distortion_{k}_percent", 100.0 * float(share), "%"))
    if found.tones is not None:
        quantities.append(("thd_loudest_percent", 100.0 * float(found.tones.thd[-1]), "%"))
        quantities.append(("loudest_ms2", float(found.tones.acceleration[-1]), "m/s^2"))
    noise = found.noise if math.isfinite(found.noise) else basis.noise_rms
    if math.isfinite(noise):
        quantities.append(("noise_floor_ms2", found.sensitivity * noise, "m/s^2"))
    return tuple((name, float(value), unit) for name, value, unit in quantities)


def _warnings(found: ResponseMeasurements, values: Mapping[str, float]) -> tuple[str, ...]:
    """Return reasons to inspect the result before use."""
    lines = []
    if values["most_gain_db"] > 15.0:
        lift = values["most_gain_db"]
        loudest = 0.95 * found.level / 10.0 ** (lift / 20.0)
        lines.append(
            f"the equaliser amplifies by up to {lift:.0f} dB; at that frequency the limiter allows {loudest:.2g} m/s^2"
        )
    snr_db, at_hz = _least_snr(found)
    if snr_db < _LEAST_SNR_DB:
        lines.append(
            f"at {at_hz:.0f} Hz the signal-to-noise ratio is only {snr_db:.0f} dB, and the response not sure: play it "
            "louder, or look for a source such as hum of the mains"
        )
    if "spread_db" in values and values["spread_db"] > 0.5:
        lines.append(f"passes differ by {values['spread_db']:.1f} dB; is something loose?")
    if values.get("thd_loudest_percent", 0.0) > 100.0 * _MOST_DISTORTION:
        lines.append(f"the loudest tone has {values['thd_loudest_percent']:.0f} % of harmonic distortion")
    if is_reversed(found.loads.get("none", found.basis)):
        lines.append(
            "a positive signal moves the accelerometer against its axis: are the wires of the shaker swapped, or does "
            "the accelerometer point down? Where all tiles of a floor say so, all is well; else this one moves against "
            "the others"
        )
    if found.tones is not None and abs(warmed := tones_over_sweeps(found, found.tones)[-1] - 1.0) > _MOST_CHANGE:
        way = "fallen" if warmed < 0.0 else "risen"
        lines.append(
            f"the gain has {way} by {100.0 * abs(warmed):.0f} % since the first sweeps, and m/s^2 with it: does the "
            "shaker warm up, or is it loose? Let it play for some minutes, and measure again"
        )
    changed = _level_change_db(found)
    if abs(changed) > ALLOWED_DB:
        way = "higher" if changed > 0.0 else "lower"
        lines.append(
            f"measured again, the level is {abs(changed):.1f} dB {way}, and m/s^2 with it: did a gain or the "
            "accelerometer's place change?"
        )
    if found.basis.passes == 1:
        lines.append("one pass only: neither the spread of the response is known, nor whether samples were lost")
    return tuple(lines)


def _least_snr(found: ResponseMeasurements) -> tuple[float, float]:
    """Return the smallest signal-to-noise ratio of all sweeps in the equaliser's band, dB, and its frequency.

    The median over the band would not show a hum, which is at single frequencies.
    """
    least = []
    for one in found.sweeps.values():
        f = one.frequencies_hz
        inside = within(f, BAND_HZ)
        snr_db = _db(one.magnitude[inside]) - _db(np.nan_to_num(one.noise[inside]))
        least.append((float(snr_db.min()), float(f[inside][snr_db.argmin()])))
    return min(least)


def _level_change_db(found: ResponseMeasurements) -> float:
    """Return how far the level that was measured again is above the computed one, over `INNER_HZ`, dB."""
    if found.again is None:
        return 0.0
    f = found.basis.frequencies_hz
    inside = within(f, INNER_HZ)
    again = np.interp(f, found.again.frequencies_hz, found.again.magnitude)
    return float(np.mean(found.relative_db(again[inside]) - found.relative_db(found.computed[inside])))


def _part(found: ResponseMeasurements, values: Mapping[str, float], after: str, good: bool, verdict: str) -> Response:
    """Return the profile's part."""
    basis = found.basis
    low = max(float(basis.frequencies_hz[0]), 0.4 * BAND_HZ[0])
    high = min(float(basis.frequencies_hz[-1]), 3.0 * BAND_HZ[1])
    grid = np.geomspace(low, high, max(round(_KEPT_AN_OCTAVE * math.log2(high / low)), 2))
    grid = grid[within(grid, basis.swept_hz)]
    magnitude = found.sensitivity * np.interp(grid, basis.frequencies_hz, basis.magnitude)
    return Response(
        made=date.today().isoformat(),
        reference=f"accelerometer, {found.sensitivity:g} m/s^2 a full-scale input"
        + uncertain_by(found.reference_percent, "%"),
        error=round(values[after], 4),
        error_allowed=ALLOWED_DB,
        error_unit="dB",
        good=good,
        verdict=verdict,
        figures={name: float(f"{value:.6g}") for name, value in values.items() if math.isfinite(value)},
        frequencies_hz=tuple(float(f"{value:.6g}") for value in grid),
        magnitude=tuple(float(f"{value:.6g}") for value in magnitude),
        acceleration_per_unit=float(f"{found.level:.6g}"),
        equaliser=tuple(tuple(section) for section in found.sections.tolist()),
        rate_hz=found.rate_hz,
        band_hz=(values["usable_low_hz"], values["usable_high_hz"]),
        load=found.load,
    )


def drawings_of(found: ResponseMeasurements) -> tuple[Drawing, ...]:
    """Return load states, correction, spread and noise, distortion by order and over level."""
    basis = found.basis
    drawn = [loads_drawn(found.loads, found.sensitivity), _correction_drawn(found)]
    f, shown = _shown(basis.frequencies_hz)
    inner = [
        series("response", f, _db(found.sensitivity * basis.magnitude)[shown]),
        series("noise", f, _db(found.sensitivity * basis.noise)[shown], colour="muted"),
    ]
    if basis.passes > 1:
        for sign in (-1.0, 1.0):
            edge = _db(found.sensitivity * basis.magnitude) + sign * basis.spread_db
            inner.append(series("" if sign > 0 else "spread", f, edge[shown], "dashed", "force"))
    drawn.append(Drawing("Response, its spread and its noise", _HZ, _DB_LABEL, tuple(inner), x_log=True))
    orders = [
        series(f"harmonic {k}", f, 100.0 * basis.distortion[k][shown], colour=_ORDER_COLOURS[k])
        for k in ORDERS
        if np.isfinite(basis.distortion[k]).any()
    ]
    if orders:
        drawn.append(
            Drawing("Distortion by order", _HZ, "of the fundamental, %", tuple(orders), x_log=True, y_log=True)
        )
    if found.tones is not None:
        tones = series("", found.tones.acceleration, 100.0 * found.tones.thd, "line", "force")
        drawn.append(Drawing(f"Distortion at {TONE_HZ:g} Hz", "level, m/s^2", "THD, %", (tones,), x_log=True))
    return tuple(drawn)


def loads_drawn(loads: Mapping[str, SweepMeasurement], sensitivity: float) -> Drawing:
    """Draw the load states side by side (thesis figure 4.13)."""
    lines = []
    for load, measured in loads.items():
        f, shown = _shown(measured.frequencies_hz)
        line = _db(sensitivity * measured.magnitude)[shown]
        lines.append(series(LOAD_NAMES.get(load, load), f, line, colour=_COLOURS.get(load, "muted")))
    return Drawing("Response by load", _HZ, _DB_LABEL, tuple(lines), x_log=True)


def noise_drawn(silence: Floats, rate_hz: float, sensitivity: float) -> Drawing:
    """Draw the spectrum of recorded silence: hum of the mains is a peak at 50 or 60 Hz and their multiples."""
    window = np.hanning(silence.size)
    rms = sensitivity * math.sqrt(2.0) * np.abs(np.fft.rfft(window * (silence - silence.mean()))) / window.sum()
    f, shown = _shown(np.asarray(np.fft.rfftfreq(silence.size, 1.0 / rate_hz), dtype=np.float64))
    line = np.maximum(rms[shown], 1e-12)
    title, at_hz = f"Noise floor: {sensitivity * float(np.std(silence)):.2g} m/s^2 RMS", float(f[line.argmax()])
    stands_out = line.max() > _OUTSTANDING * np.median(line)
    return Drawing(
        f"{title}, strongest at {at_hz:.0f} Hz" if stands_out else title,
        _HZ,
        "RMS at each frequency, m/s^2",
        (series("", f, line),),
        x_log=True,
        y_log=True,
        lines=(ReferenceLine("x", at_hz, dashed=True),) if stands_out else (),
    )


def _correction_drawn(found: ResponseMeasurements) -> Drawing:
    """Draw the response before and after (thesis figure 4.14)."""
    basis = found.basis
    f, shown = _shown(basis.frequencies_hz)
    lines = [
        series("before", f, found.relative_db(basis.magnitude)[shown], colour="muted"),
        series(f"computed, order {found.order}", f, found.relative_db(found.computed)[shown], "dashed", "force"),
    ]
    if found.again is not None:
        again, kept = _shown(found.again.frequencies_hz)
        lines.append(series("measured again", again, found.relative_db(found.again.magnitude)[kept]))
    return Drawing("Before and after the equaliser", _HZ, "dB re the tile's level", tuple(lines), x_log=True)


def _shown(frequencies_hz: Floats) -> tuple[Floats, NDArray[np.bool_]]:
    """Return the frequencies to draw, and their mask."""
    inside = within(frequencies_hz, _SPAN_HZ)
    return frequencies_hz[inside], inside


def _db(magnitude: Floats) -> Floats:
    return np.asarray(20.0 * np.log10(np.maximum(magnitude, 1e-12)))


def _raw(
    measured: Mapping[str, SweepMeasurement], sensitivity: float, tones: DistortionOverLevel | None
) -> tuple[tuple[str, str, Floats], ...]:
    """Return tables of the responses, by load or "again", and the distortion over level."""
    tables = []
    for name, one in measured.items():
        columns = [
            one.frequencies_hz,
            sensitivity * one.magnitude,
            np.degrees(np.angle(one.transfer)),
            one.spread_db,
            sensitivity * one.noise,
            one.coherence,
            *(one.distortion[k] for k in ORDERS),
        ]
        header = "frequency_hz,magnitude_m_s2,phase_deg,spread_db,noise_m_s2,coherence," + ",".join(
            f"harmonic_{k}" for k in ORDERS
        )
        tables.append(("equalised" if name == "again" else name, header, np.stack(columns, axis=1)))
    if tones is not None:
        columns = [tones.drive, tones.acceleration, tones.thd]
        tables.append(("distortion-over-level", "drive,acceleration_m_s2,thd", np.stack(columns, axis=1)))
    return tuple(tables)
