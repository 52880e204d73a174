"""Two sound cards of 18 channels for ten minutes; the clock of the second is 200 ppm fast.

The test runs in simulated time first, which does not depend on the machine's load, then on two PulseAudio servers. The
program reports the offset of the second card. It is also measured from the output: all tiles have the same tone, and
its phase on each card gives that card's time. If a server had no processor time and its pipe ran empty, its card was
delayed regardless of the program. That time, until both clocks have settled again, is excluded.
"""

import os
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from unittest import mock

import numpy as np
from numpy.typing import NDArray

from underfoot.bench.stress.null_sinks import is_possible, served
from underfoot.bench.stress.outcome import Effort, Outcome, Progress
from underfoot.bench.stress.simulated_cards import SimulatedCards
from underfoot.bench.stress.timed_sinks import TimedSink
from underfoot.bench.stress.valid_files import tone
from underfoot.clock import RATE_HZ
from underfoot.engine.commands import Level, Play
from underfoot.engine.reports import Health
from underfoot.engine.session import Session
from underfoot.engine.target import Target
from underfoot.floor.layout import default_floor
from underfoot.nodes import REGISTRY

USUAL_S, PPM, CHANNELS = 600.0, 200.0, 18
MOST_OFF_S, MOST_WRONG_PPM, LEAST_JUDGED = 1e-3, 20.0, 0.5
"""Allowed error of the second card's delay, both reported and measured; allowed error of the reported clock rate; and
the smallest share of the time that must be tested.
"""
TONE_HZ, STRETCH_S, SETTLED_S, BUFFER_S = 20.0, 0.5, 20.0, 0.04
_TICK_S, _WAIT_S = 0.05, 120.0


def run(effort: Effort, progress: Progress) -> Iterator[Outcome]:
    """Yield results of ten minutes, or `seconds`, after the first twenty seconds; with PulseAudio if installed."""
    seconds = effort.length_s(USUAL_S)
    yield simulated(seconds)
    if not is_possible():
        progress("stress: two_clocks needs PulseAudio")
        return
    with tempfile.TemporaryDirectory() as made:
        sinks = [TimedSink(Path(made), name, CHANNELS, ppm) for name, ppm in (("left", 0.0), ("right", PPM))]
        with served(Path(made), sinks) as environment, mock.patch.dict(os.environ, environment):
            reports = _played(seconds, progress)
        yield _judged(reports, sinks, seconds)


def simulated(seconds: float) -> Outcome:
    """Return the result in simulated time, with requests for blocks up to 4 ms late."""
    cards = SimulatedCards(PPM, SETTLED_S + seconds, CHANNELS)
    cards.run(SETTLED_S)
    settled, ppm = len(cards.offsets_s), []
    for end_s in np.arange(SETTLED_S, SETTLED_S + seconds, 1.0) + 1.0:
        cards.run(end_s)
        ppm.append(cards.card.drift_ppm)
    off_s, told_ppm = float(np.abs(cards.offsets_s[settled:]).max()), float(np.median(ppm))
    found = f"{cards.card.underruns} xruns; {1e3 * off_s:.2f} ms off at most; {told_ppm:.0f} ppm"
    good = off_s <= MOST_OFF_S and abs(told_ppm - PPM) <= MOST_WRONG_PPM and not cards.card.underruns
    return Outcome(f"simulated, clocks {PPM:g} ppm apart", round(seconds), found, good)


def _played(seconds: float, progress: Progress) -> list[tuple[float, Health]]:
    """Run a session that plays a tone on 36 tiles; return its state at 20 Hz of the system's clock, once the clocks
    have settled.
    """
    sound = "; ".join(f"{name}={CHANNELS}" for name in ("left", "right"))
    target = Target(default_floor(6, 6), sound=sound, block=256, latency_s=BUFFER_S)
    session, found = Session(target, tone(TONE_HZ), REGISTRY), list[tuple[float, Health]]()
    try:
        session.start()
        for command in (Level(0.0), Play(True)):
            session.send(command)
        end, next_s = time.perf_counter() + _WAIT_S + 2.0 * seconds, 0.0
        while session.health.frame < (SETTLED_S + seconds) * RATE_HZ and time.perf_counter() < end:
            session.poll()
            time.sleep(_TICK_S)
            health = session.health
            if health.frame >= SETTLED_S * RATE_HZ:
                found.append((time.perf_counter(), health))
            if health.frame >= next_s * RATE_HZ:
                off_ms, ppm = 1e3 * health.cards_offset_s, health.cards_drift_ppm
                progress(f"stress: {next_s:.0f} s played, {health.xruns} xruns, {off_ms:+.3f} ms off, {ppm:+.0f} ppm")
                next_s += 30.0
    finally:
        session.close()
    return found


def _judged(reports: list[tuple[float, Health]], sinks: list[TimedSink], seconds: float) -> Outcome:
    what = f"two cards of {CHANNELS} channels, clocks {PPM:g} ppm apart"
    if not reports:
        return Outcome(what, 0, "it did not play", passed=False)
    starved_s = np.sort([at_s for sink in sinks for at_s in sink.starved_s])
    fit = is_settled(np.array([at_s for at_s, _ in reports]), starved_s)
    late = np.diff([health.xruns for _, health in reports], prepend=reports[0][1].xruns)
    off_s = np.abs([health.cards_offset_s for _, health in reports])[fit]
    ppm = float(np.median([health.cards_drift_ppm for _, health in reports]))
    at_s, all_heard_s = apart_s(sinks[0], sinks[1], len(reports) * _TICK_S)
    offsets_s = all_heard_s[is_settled(at_s, starved_s)]
    if not fit.any() or not len(offsets_s):
        return Outcome(what, round(seconds), f"never settled: pipes ran empty {len(starved_s)} times", passed=False)
    moved_s = np.abs(offsets_s - np.median(offsets_s)).max()
    found = f"{late[fit].sum()} xruns; told {1e3 * off_s.max():.2f} ms off at most, {ppm:.0f} ppm; "
    found += f"heard {1e3 * moved_s:.2f} ms off at most, at {1e3 * reports[-1][1].cards_delay_s:.1f} ms behind; "
    found += f"judged {100.0 * fit.mean():.0f} % of the time: pipes ran empty {len(starved_s)} times"
    good = max(off_s.max(), moved_s) <= MOST_OFF_S and abs(ppm - PPM) <= MOST_WRONG_PPM
    return Outcome(what, round(seconds), found, not late[fit].sum() and good and fit.mean() >= LEAST_JUDGED)


def is_settled(at_s: NDArray[np.float64], starved_s: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return, for each of `at_s`, whether no card starved in the stretch from there on, or in `SETTLED_S` before.

    Both arrays have times of one clock; `starved_s` is ascending.

    >>> is_settled(np.array([99.4, 99.6, 119.9, 120.1]), np.array([100.0]))
    array([ True, False, False,  True])
    """
    before, after = (np.searchsorted(starved_s, at_s + edge_s) for edge_s in (-SETTLED_S, STRETCH_S))
    return np.asarray(before == after)


def apart_s(first: TimedSink, second: TimedSink, seconds: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the times of each half second of the last `seconds`, on the system's clock, and the delay of the second
    card's tone re the first's, in seconds.
    """
    end_s = min(began_s + len(sound) / sink.rate_hz for sink in (first, second) for began_s, sound in (sink.samples(),))
    at_s = np.arange(end_s - 2.0 - seconds, end_s - 2.0, STRETCH_S)
    phases = [_phases(sink, at_s) for sink in (first, second)]
    return at_s, np.unwrap(phases[0] - phases[1]) / (2.0 * np.pi * TONE_HZ)


def _phases(sink: TimedSink, at_s: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the phase of a card's tone in stretches that begin at `at_s` (n,), in seconds of the system's clock."""
    began_s, sound = sink.samples()
    count = round(STRETCH_S * sink.rate_hz)
    found = []
    for begin in np.round((at_s - began_s) * sink.rate_hz).astype(int):
        time_s = began_s + np.arange(begin, begin + count) / sink.rate_hz
        found.append(np.angle(sound[begin : begin + count] @ np.exp(-2j * np.pi * TONE_HZ * time_s)))
    return np.array(found)
