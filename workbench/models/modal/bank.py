"""Modal banks (equation 3.4): parallel resonances, each with frequency, decay and amplitude.

`struck_bank` is for sparse excitation, `driven_bank` for dense excitation; both run in real time, row by row.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from underfoot.arguments import number, numbers
from underfoot.errors import require
from underfoot.models.modal import driven_bank, phasors, struck_bank
from underfoot.models.signals.events import event_list

_FLOOR = 1e-15
"""Amplitude that may be dropped offline, relative to the largest: below the resolution of float64."""

_FRAMES_AN_EVENT = 16
"""Cost of an event, in frames driven at audio rate."""


def ring(
    frequencies_hz: ArrayLike, decays_per_s: ArrayLike, amplitudes: ArrayLike, excitation: ArrayLike, rate: float
) -> NDArray[np.float64]:
    """Return the response of modes to a signal: one value per frame of `excitation`, in units of amplitude.

    An excitation of 1 in one frame gives, from that frame on, the sum of a exp(-b t) sin(2 pi f t) (equation 3.4).
    Frequencies f (Hz), decays b (1/s) and amplitudes a have one value per mode; f and b are at least 0. A mode at or
    above half the rate is left out, because it would alias. Exact to 1e-9 after 10 s, for frequencies above 1e-4 of the
    rate. Raises `BadValue`.

    >>> ring([12_000.0], [0.0], [2.0], [0, 1, 0, 0, 0], rate=48_000.0).round(9) + 0.0
    array([ 0.,  0.,  2.,  0., -2.])
    """
    frequencies, decays, weights = checked_modes(
        frequencies_hz=frequencies_hz, decays_per_s=decays_per_s, amplitudes=amplitudes
    )
    signal = numbers("excitation", excitation)
    rate = number("rate", rate, 1e-6, 1e12, "1e-6 to 1e12 Hz")
    order = np.argsort(decays, kind="stable")
    modes = np.array([frequencies, decays, weights])[:, order]
    floor = _FLOOR * float(np.abs(weights).max() * np.abs(signal).max(initial=0.0))
    out = np.empty_like(signal)
    frames = np.flatnonzero(signal)
    if _FRAMES_AN_EVENT * frames.size < signal.size:
        sizes = phasors.sizes(weights.size)
        coefficients, state = struck_bank.COEFFICIENTS.zeros(**sizes), struck_bank.STATE.zeros(row=sizes["row"])
        struck_bank.design(np.ascontiguousarray(modes), 1.0, 1.0, rate, floor, coefficients)
        strikes = event_list(*((float(frame), float(signal[frame])) for frame in frames))
        struck_bank.ring(strikes, 0, coefficients, state, out)
    else:
        sizes = driven_bank.sizes(weights.size)
        coefficients, state = driven_bank.COEFFICIENTS.zeros(**sizes), driven_bank.STATE.zeros(**sizes)
        driven_bank.design(np.ascontiguousarray(modes), rate, floor, coefficients)
        driven_bank.ring(signal, 0, coefficients, state, out)
    return out


def checked_modes(**lists: ArrayLike) -> list[NDArray[np.float64]]:
    """Return lists of one finite number per mode as arrays; checks the ranges of frequencies, decays and masses.

    >>> checked_modes(frequencies_hz=[100.0, 250.0], decays_per_s=[8.0, -1.0])
    Traceback (most recent call last):
    underfoot.errors.BadValue: decays_per_s is [8.0, -1.0]; allowed: 0 or more
    """
    arrays = {name: numbers(name, values) for name, values in lists.items()}
    first = next(iter(arrays))
    for name, values in arrays.items():
        require(values.size > 0, name, values.tolist(), "a list with a number for each mode")
        require(
            values.size == arrays[first].size, name, values.tolist(), f"{arrays[first].size} numbers, as {first} has"
        )
        if name in ("frequencies_hz", "decays_per_s"):
            require(bool((values >= 0.0).all()), name, values.tolist(), "0 or more")
        if name == "masses_kg":
            require(bool((values > 0.0).all()), name, values.tolist(), "above 0")
    return list(arrays.values())
