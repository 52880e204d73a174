"""Results of a latency measurement: figures, a verdict, its distribution, and the profile's part."""

from datetime import date

import numpy as np

from underfoot.calibration.result import Result
from underfoot.calibration.results.labels import title_of
from underfoot.calibration.science.clicks import ClickDelays
from underfoot.drawing import Drawing, Series
from underfoot.floor.profile import Latency

STEADY_MS = 0.5
"""Largest jitter, as a standard deviation, that counts as steady."""
_LEAST_DRIFT, _LEFT = 5e-6, 0.3
"""Growth of the delay, s per s, that clocks of two cards have, and the share of the jitter that it leaves."""
METHOD = (
    "Clicks of 1 ms are played at random intervals of 18 to 30 ms and recorded. Each is aligned with the mean of all "
    "responses by the peak of their cross-correlation, between samples by a parabola; the delay is that of the moment "
    "at which the mean response reaches a tenth of its peak. It is the round trip: output and input together. "
    "The round trip is the median; 99 of 100 clicks came within the next figure. Jitter is the standard deviation."
)


def result_of(found: ClickDelays, rate_hz: int, block: int, tile: str = "") -> Result:
    """Return the result of round-trip delays, for the profile of `tile`; for any tile's if there is none."""
    ms = 1e3 * found.delay_s
    median, high, worst = float(np.median(ms)), float(np.quantile(ms, 0.99)), float(ms.max())
    jitter = float(np.std(ms))
    quantities = (
        ("round_trip_ms", median, "ms"),
        ("round_trip_99_ms", high, "ms"),
        ("round_trip_worst_ms", worst, "ms"),
        ("jitter_ms", jitter, "ms"),
        ("clicks", float(len(ms) + found.lost), ""),
        ("lost", float(found.lost), ""),
    )
    drift_ppm = _drift_ppm(found)
    good = jitter <= STEADY_MS and found.lost == 0 and not drift_ppm
    verdict = (
        f"What is played comes back after {median:.2f} ms: 99 of 100 clicks within {high:.2f} ms, all within "
        f"{worst:.2f} ms."
    )
    if not good:
        verdict += _trouble(found, jitter, drift_ppm)
    part = Latency(
        made=date.today().isoformat(),
        reference="the output, looped to the input",
        error=round(jitter, 4),
        error_allowed=STEADY_MS,
        error_unit="ms",
        good=good,
        verdict=verdict,
        figures={name: float(f"{value:.6g}") for name, value, _ in quantities},
        round_trip_ms=round(median, 4),
        rate_hz=rate_hz,
        block=block,
    )
    return Result(
        kind="latency",
        title=title_of("latency", tile),
        quantities=quantities,
        verdict=verdict,
        good=good,
        drawings=_drawings(found),
        raw=(("delays", "played_s,delay_ms", np.stack([found.played_s, ms], axis=1)),),
        part=part,
        tile=tile,
        method=f"{METHOD} It holds at {rate_hz} Hz in blocks of {block} frames, as it was measured.",
    )


def _trouble(found: ClickDelays, jitter_ms: float, drift_ppm: float) -> str:
    """Return in words why a round trip is not steady, and what to do."""
    if drift_ppm:
        return (
            f" Output and input drift apart by {abs(drift_ppm):.0f} ppm, as two cards do with clocks of their own: "
            "no round trip of theirs lasts. Use one card for both."
        )
    clicks = len(found.delay_s) + found.lost
    why = f"{found.lost} of {clicks} clicks were lost" if found.lost else f"it wavers by {jitter_ms:.2f} ms"
    return f" It is not steady: {why}. Take longer blocks, or another device."


def _drift_ppm(found: ClickDelays) -> float:
    """Return how fast the delay grows, where that is what makes it waver; else 0."""
    if len(found.delay_s) < 3:
        return 0.0
    growth, begin = np.polyfit(found.played_s, found.delay_s, 1)
    wavers = float(np.std(found.delay_s))
    left = float(np.std(found.delay_s - growth * found.played_s - begin))
    return 1e6 * float(growth) if abs(growth) > _LEAST_DRIFT and left < _LEFT * wavers else 0.0


def _drawings(found: ClickDelays) -> tuple[Drawing, ...]:
    """Return a histogram of the delays, and the delay over time."""
    ms = 1e3 * found.delay_s
    counts, edges = np.histogram(ms, bins=max(int(np.sqrt(len(ms))), 8))
    middles = 0.5 * (edges[:-1] + edges[1:])
    often = Series("", middles, counts.astype(np.float64), "stems", "vibration")
    over = Series("", found.played_s, ms, "dots", "vibration")
    return (
        Drawing("How often each delay came", "round trip, ms", "clicks", (often,)),
        Drawing("Delay over time", "time, s", "round trip, ms", (over,)),
    )
