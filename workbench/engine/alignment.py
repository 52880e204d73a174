"""Delay of accelerometer input on a card behind the played signal, and the frame at which it changes.

A sound server that runs late loses frames or repeats silence without notice; from then on the input has another delay.
The played signal is known, so the delay is the maximum of the cross-correlation.
"""

import numpy as np
from numpy.typing import NDArray

LEAST_MATCH = 0.6
"""Correlation, of at most 1, below which no delay is returned: the tile is silent, or something else shakes it."""
_BETTER = 0.25
"""Least gain in correlation over the present delay. A steady tone matches at each of its periods; then the delay has
not changed.
"""
NEAR_S = 0.0005
"""Largest change in seconds that is put down to the plate: its phase depends on the load."""


def delay_of(
    played: NDArray[np.float32], recorded: NDArray[np.float32], expected: int, near: int, *, is_new: bool = False
) -> int | None:
    """Return the delay in frames of `recorded` (n,) behind `played`: `expected` or another; None if undetermined.

    `played` (n + most,) is what was played during `recorded` and for `most` frames before; `most` is the largest delay
    that can be found. Changes of at most `near` frames are ignored, unless `is_new`: the expected delay was found next
    to a jump.

    >>> played = np.random.default_rng(1).standard_normal(6000).astype(np.float32)
    >>> [delay_of(played, 0.1 * played[at : at + 4000], 1000, 24) for at in (1000, 990, 489)]
    [1000, 1000, 1511]
    """
    most = len(played) - len(recorded)
    size = 1 << (len(played) - 1).bit_length()
    product = np.fft.irfft(np.fft.rfft(played, size) * np.conj(np.fft.rfft(recorded, size)), size)[: most + 1]
    energy = np.cumsum(np.append(0.0, played.astype(np.float64) ** 2))
    of_played = energy[len(recorded) :] - energy[: -len(recorded)]
    # Where little was played, anything would match.
    least = max(0.01 * float(of_played.max()), 1e-12)
    match = product / np.sqrt(np.maximum(of_played, least) * max(float(np.dot(recorded, recorded)), 1e-12))
    best, first = int(np.argmax(match)), max(most - expected - near, 0)
    around = match[first : most - expected + near + 1]
    if match[best] < LEAST_MATCH:
        return None
    if not len(around) or match[best] >= around.max() + _BETTER:
        return most - best
    return most - first - int(np.argmax(around)) if is_new else expected


def split(
    before: NDArray[np.float32], behind: NDArray[np.float32], recorded: NDArray[np.float32], extra: int = 0
) -> int:
    """Return the frame up to which `recorded` (n,) matches `before`; from `extra` frames later it matches `behind`.

    >>> played = np.random.default_rng(1).standard_normal(6000).astype(np.float32)
    >>> early, late = played[1000:5000], played[1511:5511]
    >>> split(early, late, 0.1 * np.append(early[:1234], late[1234:]))
    1234
    """
    at = 0
    for _ in range(3):  # iterate: the gain between the two depends on the frame, and the frame on the gain
        rest = min(at + extra, len(recorded))
        played = np.concatenate([before[:at], behind[rest:]])
        energy = max(float(np.dot(played, played)), 1e-12)
        gain = float(np.dot(played, np.append(recorded[:at], recorded[rest:]))) / energy
        error_before, error_behind = (
            np.append(0.0, np.cumsum((recorded - gain * one).astype(np.float64) ** 2)) for one in (before, behind)
        )
        rests = np.minimum(np.arange(len(recorded) + 1) + extra, len(recorded))
        at = int(np.argmin(error_before - error_behind[rests]))
    return at
