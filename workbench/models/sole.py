"""What the sole of a foot feels of a vibration: thresholds, sensation level, chance of being noticed, and the shift of
perceived stiffness (docs/models.md#what-the-sole-feels).

The displacement threshold is flat from 20 to 40 Hz, and U-shaped from 40 to 250 Hz (Gu and Griffin 2011, Somatosens.
Mot. Res. 28:86-93, who have shapes for toe, ball and heel); its level is 1.2 um at 200 Hz (Kowalzik et al. 1996, Foot
Ankle Int. 17:629-634). Both pressed a small probe on a bare sole. A whole sole detects smaller vibrations: thresholds
of small probes and of larger areas must not be compared (Gu and Griffin 2013), and the thesis's walkers in hard shoes
noticed the texture of 300 Hz at 0.46 m/s^2 (6.4.2). So there are two thresholds of one shape: `barefoot` at the
probe's level, and `shoe` at the level that makes the thesis's stimulus just noticeable.
"""

import math
from typing import Literal

import numpy as np
from msgspec import Struct
from numpy.typing import ArrayLike, NDArray

from underfoot.arguments import choice, numbers

Footwear = Literal["barefoot", "shoe"]
FOOTWEAR: tuple[Footwear, ...] = ("barefoot", "shoe")
LOW_HZ, FLAT_HZ, BEST_HZ, HIGH_HZ = 20.0, 40.0, 200.0, 250.0
"""Frequencies: lowest measured, end of the flat part, that of the known level, highest measured."""
LEVEL_M = 1.2e-6
"""Displacement threshold of a bare sole at `BEST_HZ`, peak (Kowalzik et al. 1996)."""
SHOE_DB = -25.0
"""Threshold of a whole sole in a hard shoe, relative to a bare sole on a small probe: such that textured noise with
the dynamic envelope (TD) is just noticed at `NOTICED_M_S2` in a step."""
NOTICED_M_S2, NOTICED_SD_M_S2 = 0.46, 0.18
"""Mean and standard deviation over people of the peak acceleration of TD that is noticed half of the time
(thesis 6.4.2)."""
BAND_HZ = tuple(
    float(f) for f in (20, 25, 31.5, 40, 50, 63, 80, 100, 125, 160, 200, 250, 315, 400, 500, 630, 800, 1000)
)
"""Preferred centres of third-octave bands from 20 Hz to 1 kHz (ISO 266)."""
FELT_HZ = (50.0, 750.0)
"""Band that a tile has to reproduce (thesis 4.5.2)."""
WINDOW_S = 0.2
"""Length of the Hann window for levels; windows overlap by half."""
STIFFNESS_N_MM = 90.0
PSE = ((0.0, 100.8), (0.43, 134.5), (0.86, 151.6))
"""Peak acceleration of TD in m/s^2, and the stiffness in N/mm that feels like 90 N/mm without vibration (table 6.3)."""


def threshold_m_s2(frequency_hz: ArrayLike, footwear: Footwear = "barefoot") -> NDArray[np.float64]:
    """Return the peak acceleration of a just detectable sine; above 250 Hz the curve is extrapolated.

    >>> (threshold_m_s2([40.0, 200.0]) / (2 * np.pi * np.array([40.0, 200.0])) ** 2 * 1e6).round(1)  # um
    array([15. ,  1.2])
    """
    choice("footwear", footwear, FOOTWEAR)
    f = np.asarray(frequency_hz, dtype=np.float64)
    ratio = np.maximum(f, FLAT_HZ) / BEST_HZ
    displacement_m = LEVEL_M * 0.5 * (ratio**2 + ratio**-2)
    lower = 10.0 ** (SHOE_DB / 20.0) if footwear == "shoe" else 1.0
    return np.asarray(displacement_m * (2.0 * math.pi * f) ** 2 * lower)


class Felt(Struct, frozen=True):
    """Sensation of a stretch of acceleration.

    Levels are in dB above the threshold, in the window where they are highest. Each frequency is weighted by its power
    over that of the just detectable sine, so the level of a sine is that of its amplitude. Below 0 dB nothing is felt.
    `noticed` is the probability that a person in hard shoes notices the vibration.
    """

    level_db: dict[Footwear, float]
    noticed: float

    def summary(self) -> dict[str, float | None]:
        """Return the levels and the probability, as printed by commands; None where there is no vibration."""
        levels = {f"level_{name}_db": db if math.isfinite(db) else None for name, db in self.level_db.items()}
        return {**levels, "noticed": self.noticed}


def felt(acceleration_m_s2: ArrayLike, rate_hz: float) -> Felt:
    """Return the sensation of acceleration (n,) under the foot, m/s^2.

    >>> sine = 1.895 * np.sin(2 * np.pi * 200.0 * np.arange(9600) / 48000.0)
    >>> found = felt(sine, 48000.0)
    >>> [round(db, 1) for db in found.level_db.values()], found.noticed
    ([0.0, 25.0], 1.0)
    """
    power, frequencies = _power(acceleration_m_s2, rate_hz)
    levels: dict[Footwear, float] = {}
    for footwear in FOOTWEAR:
        inside = (frequencies >= BAND_HZ[0]) & (frequencies <= BAND_HZ[-1])
        square = power[:, inside] @ threshold_m_s2(frequencies[inside], footwear) ** -2
        share = math.sqrt(2.0 * float(square.max(initial=0.0)))
        levels[footwear] = 20.0 * math.log10(share) if share > 1e-12 else -math.inf
    return Felt(levels, chance_noticed(levels["shoe"]))


def band_levels(acceleration_m_s2: ArrayLike, rate_hz: float) -> NDArray[np.float64]:
    """Return the peak amplitude of acceleration (n,) in each band of `BAND_HZ`, where it is largest: shape (bands,).

    >>> levels = band_levels(np.sin(2 * np.pi * 200.0 * np.arange(48000) / 48000.0), 48000.0)
    >>> BAND_HZ[int(levels.argmax())], round(float(levels.max()), 2)
    (200.0, 1.0)
    """
    power, frequencies = _power(acceleration_m_s2, rate_hz)
    step = float(frequencies[1])
    edges = np.concatenate([[BAND_HZ[0] * 2.0 ** (-1 / 6)], np.array(BAND_HZ) * 2.0 ** (1 / 6)]) / step + 0.5
    # Band edges lie between spectral lines: each line counts with its part within the band.
    sums = np.array([np.interp(edges, np.arange(power.shape[1] + 1), np.append(0.0, np.cumsum(row))) for row in power])
    return np.sqrt(2.0 * np.diff(sums, axis=1).max(axis=0, initial=0.0))


def _power(acceleration_m_s2: ArrayLike, rate_hz: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the mean square of each spectral line, [window, line], and the frequencies of the lines."""
    signal = numbers("acceleration_m_s2", acceleration_m_s2)
    size = round(WINDOW_S * rate_hz)
    hop = max(size // 2, 1)
    padded = np.pad(signal, (hop, size))
    window = np.hanning(size + 1)[:-1]
    pieces = np.lib.stride_tricks.sliding_window_view(padded, size)[::hop]
    power = np.abs(np.fft.rfft(pieces * window, axis=1)) ** 2 * (2.0 / (size * float(np.sum(window**2))))
    lines_hz: NDArray[np.float64] = np.arange(size // 2 + 1, dtype=np.float64) * (rate_hz / size)
    return power, lines_hz


def chance_noticed(level_shoe_db: float) -> float:
    """Return the probability that a person in hard shoes notices a vibration of this level; thresholds are normal.

    >>> round(chance_noticed(0.0), 2), round(chance_noticed(-6.0), 2), chance_noticed(-math.inf)
    (0.5, 0.1, 0.0)
    """
    if level_shoe_db == -math.inf:
        return 0.0
    peak = NOTICED_M_S2 * 10.0 ** (level_shoe_db / 20.0)
    return 0.5 * (1.0 + math.erf((peak - NOTICED_M_S2) / (NOTICED_SD_M_S2 * math.sqrt(2.0))))


def felt_stiffness_n_mm(peak_m_s2: float) -> float | None:
    """Return the perceived stiffness of a plate of 90 N/mm with vibration of this peak; None beyond table 6.3.

    A plate of 134.5 N/mm with 0.43 m/s^2 feels like one of 90 N/mm without; without vibration the match was at
    100.8 N/mm, so vibration makes a plate feel softer by 100.8 / 134.5. Linear between the values of the table, for TD.

    >>> felt_stiffness_n_mm(0.0), round(felt_stiffness_n_mm(0.43), 1), felt_stiffness_n_mm(0.9)
    (90.0, 67.4, None)
    """
    peaks, stiffness = zip(*PSE, strict=True)
    if not 0.0 <= peak_m_s2 <= peaks[-1]:
        return None
    return STIFFNESS_N_MM * stiffness[0] / float(np.interp(peak_m_s2, peaks, stiffness))


def felt_in_words(found: Felt) -> str:
    """Return the level over the threshold of a sole in a hard shoe, and who notices it, as text; "" for silence.

    >>> felt_in_words(Felt({"shoe": -0.7, "barefoot": 24.3}, 0.426)), felt_in_words(Felt({"shoe": -math.inf}, 0.0))
    ('1 dB under threshold, noticed by 43 %', '')
    """
    db = found.level_db["shoe"]
    if not math.isfinite(db):
        return ""
    return f"{abs(db):.0f} dB {'over' if db >= 0.0 else 'under'} threshold, noticed by {100.0 * found.noticed:.0f} %"


def stiffness_in_words(peak_m_s2: float) -> str:
    """Return the perceived stiffness of a plate of 90 N/mm with vibration of this peak as text, or "not covered".

    >>> stiffness_in_words(0.43), stiffness_in_words(3.0)
    ('90 N/mm feel like 67 N/mm', 'perceived stiffness: not covered')
    """
    found = felt_stiffness_n_mm(peak_m_s2)
    if found is None:
        return "perceived stiffness: not covered"
    return f"{STIFFNESS_N_MM:.0f} N/mm feel like {found:.0f} N/mm"


def windowed_peak(acceleration_m_s2: ArrayLike, rate_hz: float) -> float:
    """Return a stable peak of noise (n,), as in table 6.1.

    The median of the maxima of 10 ms windows over the stretch of highest amplitude, i.e. the windows that reach half of
    the largest value. The start of the first window is arbitrary and changes the result by up to 2.6 dB, so the median
    over ten starts, a millisecond apart, is taken.

    >>> windowed_peak(np.sin(2 * np.pi * 250.0 * np.arange(4800) / 48000.0), 48000.0).__round__(3)
    1.0
    """
    size = max(round(0.01 * rate_hz), 1)
    signal = np.abs(numbers("acceleration_m_s2", acceleration_m_s2))
    beginnings = range(0, min(size, len(signal) - size + 1), max(size // 10, 1))
    if not beginnings:
        return float(signal.max(initial=0.0))
    return float(np.median([_median_of_windows(signal[begin:], size) for begin in beginnings]))


def _median_of_windows(signal: NDArray[np.float64], size: int) -> float:
    """Return the median of the maxima of windows of `size` samples that reach half of the overall maximum."""
    count = len(signal) // size
    largest = signal[: count * size].reshape(count, size).max(axis=1)
    return float(np.median(largest[largest >= 0.5 * largest.max()]))


def share_in_band(acceleration_m_s2: ArrayLike, rate_hz: float) -> float:
    """Return the share of a signal's (n,) energy within `FELT_HZ`; 0 for silence.

    >>> round(share_in_band(np.sin(2 * np.pi * 200.0 * np.arange(48000) / 48000.0), 48000.0), 3)
    1.0
    """
    signal = numbers("acceleration_m_s2", acceleration_m_s2)
    size = max(signal.size, 1)
    power = np.abs(np.fft.rfft(signal, size)) ** 2
    frequencies = np.fft.rfftfreq(size, 1.0 / rate_hz)
    total = float(power.sum())
    inside = power[(frequencies >= FELT_HZ[0]) & (frequencies <= FELT_HZ[1])].sum()
    return float(inside) / total if total > 0.0 else 0.0
