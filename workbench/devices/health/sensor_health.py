"""Detection of dead, reversed, saturated, loose or noisy sensors while people walk; `sensor_order` finds swapped ones.

Four sensors under a plate are redundant for force and centroid: on a rigid plate both diagonals carry the same load,
on a flexible one they differ by the product of the load's positions along and across. So each sensor can be predicted
from the other three.

- *Dead*: it stays at rest while the other three carry a load of which it should have a part.
- *Reversed*: it falls below rest while the other three carry such a load.
- *Saturated*: it stays at one reading, at the top of the range or below it, while the load on its tile changes.
- *Stuck*: the same, and it has read more, and less, before.
- *Loose*: it repeatedly falls to rest from one sample to the next while the others do not, and recovers.
- *Noisy*: with nobody on its tile it swings to and fro so far that four such sensors reach the load of a contact.

A sensor is reported only when nothing else explains the readings; a walk with too little evidence reports none. It is
reported again where it was well for a while in between.
"""

import math
from collections import deque
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from underfoot.devices.framing.wire_format import unshifted
from underfoot.devices.health.sensor_order import CONTACT_N, LOADED_N, SensorOrder
from underfoot.floor.layout import Floor
from underfoot.kernels import kernel
from underfoot.quantities import counted

DEAD_S, DEAD_N, ALIVE_N = 1.0, 0.3, 1.0
"""Time for which a sensor must carry less than `DEAD_N` to be dead; `ALIVE_N` is a sign of life. For the same time it
must fall to be reversed.
"""
FLAT_S, FLAT_SAMPLES, FLAT_SHARE, FLATS = 0.020, 8, 0.15, 5
"""A constant reading for this time and number of samples is a fault if the others' load changes by this share
meanwhile, as often in a row at the highest reading so far, or for `DEAD_S`.
"""
FALL_N, FALLS, WITHIN_S, BACK_S = 40.0, 3, 60.0, 0.3
"""A loose sensor loses at least `FALL_N` at once and recovers within `BACK_S`, `FALLS` times within `WITHIN_S`."""
WELL_S = 60.0
"""Time for which a sensor must carry loads without a sign of its fault to be well again."""
NOISY_N, SWINGS, NOISY_S, MEAN_S = CONTACT_N / 4.0, 10, 1.0, 0.1
"""A noisy sensor swings by `NOISY_N` or more about its mean of `MEAN_S`, `SWINGS` times within `NOISY_S`."""

_COARSE = 256
"""Step of the readings of a converter of 8 bits, whose sensors rest at one number while a foot rolls on; where one is
stuck it stays for `STANDS_S`.
"""
STANDS_S, STEADY_N = 60.0, CONTACT_N / 2.0
"""Time for which a tile bears the same to `STEADY_N` between steps, a contact but less than `LOADED_N`: no foot, which
sways.
"""

_DEAD, _SATURATED, _LOOSE, _REVERSED, _NOISY, _MISPLACED = 1, 2, 4, 8, 16, 32
_REST_SHARE = 0.002
_GONE = 0.3  # of the largest load of a contact: less is what sensors still creep after a foot, and tells no place
_SHARE = 0.05  # of what the others carry: a corner whose plate lifts falls, too, by what the plate weighs there

_SENSOR = np.dtype(
    [
        ("rest_n", np.float64),
        ("force_n", np.float64),
        ("reading", np.int64),
        ("lowest", np.int64),
        ("highest", np.int64),
        ("flat_s", np.float64),
        ("flat_samples", np.int64),
        ("flat_others_n", np.float64),
        ("is_counted", np.bool_),
        ("flats", np.int64),
        ("dead_s", np.float64),
        ("reversed_s", np.float64),
        ("fell_s", np.float64),
        ("fell_from_n", np.float64),
        ("falls", np.int64),
        ("first_fall_s", np.float64),
        ("well_s", np.float64),
        ("mean_n", np.float64),
        ("side", np.float64),
        ("swings", np.float64),
        ("swing_n", np.float64),
        ("count_n", np.float64),
    ],
    align=True,
)
"""State of a sensor: its force at rest, its newest force and reading, and the ends of its readings; the time and
samples of a constant reading, the others' load when it began, whether it is among the `flats` so far, all at the
highest; the times for which it looked dead, and reversed; its last fall to rest (-inf: it has recovered), from
which load, how often, and when first; for how long it has been well; its mean, the side of it on which it swung last,
and in these `NOISY_S` how often and how far; newtons a count where it moved last.
"""
_TILE = np.dtype(
    [
        ("is_known", np.bool_),
        ("time_s", np.float64),
        ("peak_n", np.float64),
        ("bits", np.int64),
        ("mean_n", np.float64),
        ("least_n", np.float64),
        ("most_n", np.float64),
        ("watched_s", np.float64),
        ("stands_n", np.float64),
        ("stands_s", np.float64),
    ],
    align=True,
)
"""State of a tile: its last time, the largest load since it was empty, the bits that any reading had, the mean of its
load, and of these `NOISY_S` the least and the largest such mean, and how much has passed; what it bears between steps,
to `STEADY_N`, and for how long (-inf: told, until it is empty).
"""


class _Samples(NamedTuple):
    """Samples of tiles, in order of arrival."""

    tiles: NDArray[np.int64]  # (n,)
    time_s: NDArray[np.float64]  # (n,)
    readings: NDArray[np.int64]  # (n, 4)
    force_n: NDArray[np.float64]  # (n, 4)
    load_n: NDArray[np.float64]  # (n, 4): above the force at rest; written by the kernel


class _State(NamedTuple):
    """State of a floor's sensors."""

    period_s: float
    sensors: NDArray[np.void]  # (tiles, 4)
    tiles: NDArray[np.void]  # (tiles,)
    balance: NDArray[np.float64]  # (tiles, 4): the linear combination of forces that is 0 on a rigid plate
    found: NDArray[np.int64]  # (tiles, 4): faults as bits


class SensorHealth:
    """Monitors the sensors of `floor`, whose tiles send about `rate_hz` samples per second.

    >>> from underfoot.floor.layout import default_floor
    >>> health = SensorHealth(default_floor(1, 1), 1000.0)
    >>> time_s = np.arange(2000) / 1000.0
    >>> force_n = np.where((time_s > 0.5) & (time_s < 1.8), 150.0, 0.0)[:, None] * [1, 0, 1, 1]
    >>> health.feed(np.zeros(2000, int), time_s, time_s, (20 * force_n).astype(int), force_n)
    >>> health.take_notices()
    ['tile t1: sensor 2 is dead (reads 0 while its neighbours carry 450 N)']
    """

    def __init__(self, floor: Floor, rate_hz: float) -> None:
        self.floor = floor
        count = len(floor.tiles)
        self._state = _State(
            period_s=1.0 / rate_hz,
            sensors=np.zeros((count, 4), _SENSOR),
            tiles=np.zeros(count, _TILE),
            balance=np.array([_balance(tile.sensors_m) for tile in floor.tiles]),
            found=np.zeros((count, 4), np.int64),
        )
        self._state.sensors["fell_s"] = self._state.sensors["first_fall_s"] = -np.inf
        self._state.sensors["lowest"] = np.iinfo(np.int64).max
        self._named = np.zeros((count, 4), np.int64)
        self._words: list[dict[tuple[int, int], str]] = [{} for _ in floor.tiles]
        self.faults: dict[tuple[str, int], str] = {}
        """What is wrong with sensors now, by tile and number (1 to 4); replaced, so that other threads may read it."""
        self._order = SensorOrder(floor)
        self._notices: deque[str] = deque(maxlen=100)
        self.feed(np.zeros(0, np.int64), np.zeros(0), np.zeros(0), np.zeros((0, 4), np.int64), np.zeros((0, 4)))

    def feed(
        self,
        tiles: NDArray[np.int64],
        time_s: NDArray[np.float64],
        arrived_s: NDArray[np.float64],
        readings: NDArray[np.int64],
        force_n: NDArray[np.float64],
    ) -> None:
        """Process samples: tile rows (n,), the tiles' own times (n,), arrivals by one clock (n,), readings (n, 4) and
        their forces in newtons.
        """
        load_n = np.empty((len(tiles), 4))
        samples = _Samples(np.ascontiguousarray(tiles), time_s, np.ascontiguousarray(readings), force_n, load_n)
        at, changed = _watch(samples, 0, self._state)
        while changed:
            self._name(int(tiles[at - 1]), load_n[at - 1])
            at, changed = _watch(samples, at, self._state)
        self._order.feed(samples.tiles, time_s, arrived_s, load_n)
        for row, which, line in self._order.take_found():
            is_reversed = self._state.sensors["reversed_s"][row].any()
            if line and (is_reversed or self._state.found[row].any()):
                self._order.forget(row)  # one dead or reversed sensor resembles other faults
                continue
            words = {key: what for key, what in self._words[row].items() if key[1] != _MISPLACED}
            self._words[row] = words | {(sensor, _MISPLACED): line for sensor in which}
            tile = f"tile {self.floor.tiles[row].id}"
            self._notices.append(f"{tile}: {line}" if line else f"{tile}: its sensors are in their places now")
            self._list_faults()
        self._tell_what_stands()

    def _tell_what_stands(self) -> None:
        """Report tiles with a load that is no foot; steps on them are a contact that does not end."""
        tiles = self._state.tiles
        for row in np.flatnonzero(tiles["stands_s"] >= STANDS_S).tolist():
            tiles["stands_s"][row] = -np.inf  # until it is empty
            self._notices.append(
                f"tile {self.floor.tiles[row].id} has borne {tiles['stands_n'][row]:.0f} N for a minute, which hides "
                "steps: is something on it, or has a sensor's zero moved? Tare in Monitor when it is empty"
            )

    def take_notices(self) -> list[str]:
        """Return the faults found since the last call, one line per sensor; of noise, one per tile."""
        notices = []
        while self._notices:
            notices.append(self._notices.popleft())
        return notices

    def _name(self, row: int, load_n: NDArray[np.float64]) -> None:
        """Report what was found with the newest sample of a tile, and forget what has passed."""
        found, sensors, words = self._state.found[row], self._state.sensors[row], self._words[row]
        noisy = sensors[found & _NOISY > 0]
        swing_n, swings = noisy["swing_n"].max(initial=0.0), noisy["swings"].max(initial=0.0)
        new: dict[str, list[int]] = {}
        for sensor in range(4):
            others_n, reading = load_n.sum() - load_n[sensor], int(sensors[sensor]["reading"])
            is_amid = sensors[sensor]["lowest"] < reading < sensors[sensor]["highest"]
            stays = "stuck" if is_amid else "saturated"
            for fault, what in (
                (_NOISY, f"noisy (swings by {swing_n:.0f} N {swings:.0f} times a second with nobody on the tile; "
                         "hum of the mains, or its shaker?)"),
                (_DEAD, f"dead (reads {reading} while its neighbours carry {others_n:.0f} N)"),
                (_REVERSED, f"reversed (it falls while its neighbours carry {others_n:.0f} N)"),
                (_SATURATED, f"{stays} (stays at {reading} while the load on its tile changes{unshifted(reading)})"),
                (_LOOSE, f"loose (fell to nothing {counted(sensors[sensor]['falls'], 'time')} while its tile was "
                         "loaded)"),
            ):  # fmt: skip
                if not found[sensor] & fault:
                    words.pop((sensor, fault), None)
                elif (sensor, fault) not in words and not (fault == _DEAD and self._order.is_swapped(row)):
                    words[sensor, fault] = f"sensor {sensor + 1} is {what}"
                    if not self._named[row, sensor] & fault:
                        new.setdefault(what, []).append(sensor + 1)
            self._named[row, sensor] = found[sensor] | (self._named[row, sensor] & _NOISY)  # shakers come and go
        for what, which in new.items():
            are = f"sensor {which[0]} is" if len(which) == 1 else f"sensors {', '.join(map(str, which))} are"
            self._notices.append(f"tile {self.floor.tiles[row].id}: {are} {what}")
        self._list_faults()

    def _list_faults(self) -> None:
        """Make `faults` anew."""
        faults: dict[tuple[str, int], str] = {}
        for tile, words in zip(self.floor.tiles, self._words, strict=True):
            for (sensor, _), what in sorted(words.items()):
                key = tile.id, sensor + 1
                faults[key] = f"{faults[key]}; {what}" if key in faults else what
        self.faults = faults


def _balance(sensors_m: tuple[tuple[float, float], ...]) -> NDArray[np.float64]:
    """Return the combination of four forces that is 0 on a rigid plate: (1, -1, 1, -1) around a rectangle."""
    places = np.array([[1.0, x, y] for x, y in sensors_m]).T
    null = np.linalg.svd(places)[2][-1]
    return null / np.abs(null).max()


@kernel
def _watch(samples: _Samples, first: int, state: _State) -> tuple[int, bool]:
    """Process samples from number `first` on, up to one that changes what was found, and return how many were
    processed, and whether there is such a one.
    """
    at = first
    while at < len(samples.tiles):
        k = samples.tiles[at]
        tile, sensors, found = state.tiles[k], state.sensors[k], state.found[k]
        reading, force_n, load_n = samples.readings[at], samples.force_n[at], samples.load_n[at]
        now_s = samples.time_s[at]
        known = found[0], found[1], found[2], found[3]
        step_s = now_s - tile.time_s
        if not tile.is_known or not 0.0 < step_s < 2.5 * state.period_s:
            step_s = 0.0
        total_n = _weigh(tile, sensors, force_n, load_n)
        tile.peak_n = max(tile.peak_n, total_n) if total_n >= CONTACT_N else 0.0
        is_loaded = total_n >= _GONE * tile.peak_n
        _find_dead_or_reversed(sensors, load_n, total_n, state.balance[k], step_s if is_loaded else 0.0, found)
        for j in range(4):
            stays_s = STANDS_S if tile.bits & -tile.bits >= _COARSE else DEAD_S
            if _is_saturated(sensors[j], reading[j], load_n[j], total_n - load_n[j], step_s, stays_s):
                found[j] |= _SATURATED
            if step_s > 0.0 and not found[j] & _NOISY and _is_loose(sensors, force_n, now_s, j):
                found[j] |= _LOOSE
            if load_n[j] > CONTACT_N:
                sensors[j].well_s += step_s
                if sensors[j].well_s >= WELL_S:
                    found[j] &= _NOISY
        _find_noise(tile, sensors, force_n, total_n, step_s, found)
        for j in range(4):
            if tile.is_known and reading[j] != sensors[j].reading:
                sensors[j].count_n = abs((force_n[j] - sensors[j].force_n) / (reading[j] - sensors[j].reading))
            tile.bits |= reading[j]
            sensors[j].force_n, sensors[j].reading = force_n[j], reading[j]
            sensors[j].lowest = min(sensors[j].lowest, reading[j])
            if reading[j] > sensors[j].highest:
                sensors[j].highest, sensors[j].flats = reading[j], 0
        tile.time_s, tile.is_known = now_s, True
        at += 1
        if (found[0], found[1], found[2], found[3]) != known:
            return at, True
    return at, False


@kernel
def _weigh(
    tile: np.record, sensors: NDArray[np.void], force_n: NDArray[np.float64], load_n: NDArray[np.float64]
) -> float:
    """Compute the loads of a tile's sensors above rest, and return their sum; unloaded, the rest follows the
    readings.
    """
    total_n, most_n = 0.0, 0.0
    for j in range(4):
        if not tile.is_known:
            sensors[j].rest_n = sensors[j].force_n = force_n[j]
        load_n[j] = force_n[j] - sensors[j].rest_n
        total_n += load_n[j]
        most_n = max(most_n, load_n[j])
    if total_n < CONTACT_N and most_n < CONTACT_N:  # a reversed sensor takes from the sum of a loaded tile
        share = _REST_SHARE if total_n > -CONTACT_N else 1.0  # the tile was loaded when its rest was measured
        for j in range(4):
            sensors[j].rest_n += share * load_n[j]
    return total_n


@kernel
def _find_dead_or_reversed(
    sensors: NDArray[np.void],
    load_n: NDArray[np.float64],
    total_n: float,
    balance: NDArray[np.float64],
    step_s: float,
    found: NDArray[np.int64],
) -> None:
    """Accumulate the time for which a sensor carries nothing of a load of which it should have a part, or falls."""
    for j in range(4):
        plane, product, across = 0.0, 1.0, 1.0
        for i in range(4):
            if i == j:
                continue
            plane -= balance[i] * load_n[i] / balance[j]
            if balance[i] * balance[j] < 0.0:
                product *= max(load_n[i], 0.0)
            else:
                across = max(load_n[i], 1.0)
        expected_n, others_n = min(plane, product / across), total_n - load_n[j]
        least_n = max(_SHARE * others_n, CONTACT_N)
        if load_n[j] > CONTACT_N:
            sensors[j].reversed_s = 0.0
        elif load_n[j] < -least_n and expected_n > CONTACT_N and others_n >= LOADED_N:
            sensors[j].reversed_s += step_s
            sensors[j].well_s = 0.0
            if sensors[j].reversed_s >= DEAD_S:
                found[j] |= _REVERSED
        if abs(load_n[j]) > ALIVE_N:
            sensors[j].dead_s = 0.0
        elif abs(load_n[j]) < DEAD_N and total_n >= LOADED_N and expected_n > least_n:
            sensors[j].dead_s += step_s
            sensors[j].well_s = 0.0
            if sensors[j].dead_s >= DEAD_S:
                found[j] |= _DEAD


@kernel
def _find_noise(
    tile: np.record,
    sensors: NDArray[np.void],
    force_n: NDArray[np.float64],
    total_n: float,
    step_s: float,
    found: NDArray[np.int64],
) -> None:
    """Count how often the sensors swing about their means, and evaluate it every `NOISY_S`."""
    share = min(step_s / MEAN_S, 1.0)
    mean_n: float = tile.mean_n + share * (total_n - tile.mean_n)
    least_n: float = min(tile.least_n, mean_n)
    most_n: float = max(tile.most_n, mean_n)
    watched_s: float = tile.watched_s + step_s
    for j in range(4):
        if tile.watched_s == 0.0:
            sensors[j].swings = sensors[j].swing_n = 0.0
        if not tile.is_known:
            sensors[j].mean_n = force_n[j]
        sensors[j].mean_n += share * (force_n[j] - sensors[j].mean_n)
        off_n = force_n[j] - sensors[j].mean_n
        step_n = (tile.bits & -tile.bits) * sensors[j].count_n
        if abs(off_n) < max(NOISY_N, 1.5 * step_n):
            continue
        sensors[j].swing_n = max(sensors[j].swing_n, abs(off_n))
        if off_n * sensors[j].side <= 0.0:
            sensors[j].side = math.copysign(1.0, off_n)
            sensors[j].swings += 0.5
    tile.mean_n, tile.least_n, tile.most_n, tile.watched_s = mean_n, least_n, most_n, watched_s
    if watched_s < NOISY_S:
        return
    # The rest of noisy sensors may be low by their swings, and a tenth of these is left in the mean.
    swings_n = sensors[0].swing_n + sensors[1].swing_n + sensors[2].swing_n + sensors[3].swing_n
    if most_n - least_n < CONTACT_N + 0.1 * swings_n and most_n < LOADED_N + swings_n:  # nobody is there
        for j in range(4):
            if sensors[j].swings >= SWINGS:
                found[j] |= _NOISY
            else:
                found[j] &= ~_NOISY  # a shaker has stopped
    if least_n < CONTACT_N:  # empty, now or before
        tile.stands_n, tile.stands_s = mean_n, 0.0
    elif most_n - least_n < STEADY_N:  # else there is a step
        if mean_n >= LOADED_N or abs(mean_n - tile.stands_n) >= STEADY_N:
            tile.stands_n, tile.stands_s = mean_n, min(tile.stands_s, 0.0)  # -inf: told already
        tile.stands_s += watched_s
    tile.least_n, tile.most_n, tile.watched_s = mean_n, mean_n, 0.0


@kernel
def _is_saturated(
    sensor: np.record, reading: int, own_n: float, others_n: float, step_s: float, stays_s: float
) -> bool:
    """Whether a sensor's reading has been constant for long, `stays_s`, or often while the others' load changed."""
    if reading != sensor.reading or step_s == 0.0 or own_n < CONTACT_N:
        sensor.flat_samples = 0
        sensor.flat_s = 0.0
        sensor.is_counted = False
        sensor.flat_others_n = others_n
        return False
    flat_samples, flat_s, began_n = sensor.flat_samples + 1, sensor.flat_s + step_s, sensor.flat_others_n
    sensor.flat_samples, sensor.flat_s = flat_samples, flat_s
    has_changed = abs(others_n - began_n) > max(FLAT_SHARE * max(others_n, began_n), CONTACT_N)
    if flat_samples < FLAT_SAMPLES or flat_s < FLAT_S or not has_changed:
        return False
    if not sensor.is_counted:  # where a foot rolls on, a converter of 10 bits rests for a moment, now here, now there
        sensor.flats = sensor.flats + 1 if reading == sensor.highest else 0
        sensor.is_counted = True
    if sensor.flats < FLATS and flat_s < stays_s:
        return False
    sensor.well_s = 0.0
    return True


@kernel
def _is_loose(sensors: NDArray[np.void], force_n: NDArray[np.float64], now_s: float, j: int) -> bool:
    """Whether sensor j alone has fallen to rest and recovered often enough."""
    own = sensors[j]
    moved_n, others_n = force_n[j] - own.force_n, 0.0
    for i in range(4):
        if i != j:
            others_n += abs(force_n[i] - sensors[i].force_n)
    before_n, after_n = own.force_n - own.rest_n, force_n[j] - own.rest_n
    if others_n > 0.25 * abs(moved_n):
        return False
    if before_n >= FALL_N and after_n < 0.2 * before_n:
        own.fell_s, own.fell_from_n = now_s, before_n
    elif now_s - own.fell_s <= BACK_S and abs(before_n) < 0.2 * own.fell_from_n and after_n > 0.5 * own.fell_from_n:
        own.fell_s = -np.inf
        if not 0.0 <= now_s - own.first_fall_s <= WITHIN_S:  # also where the tile's clock began anew
            own.falls, own.first_fall_s = 0, now_s
        own.falls += 1
        own.well_s = 0.0
        return own.falls >= FALLS
    return False
