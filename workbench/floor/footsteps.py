"""Footsteps: the figures of gait in a contact, and which foot it was.

A contact is a step if its beginning and end were both seen, it lasted 0.08 to 5 s and it reached 50 N. A person who
stands is a contact and no step; nor is one that the recording's beginning or end, a gap or an untared tile has cut,
because its figures would be of a part. All figures are of the contact's force and of its centroid in the floor's
frame.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from underfoot.errors import require
from underfoot.floor.contacts import Contact
from underfoot.floor.layout import Floor

SHORTEST_S, LONGEST_S, LEAST_N = 0.08, 5.0, 50.0
"""A step lasts longer than the touch of a toe and shorter than standing, and bears weight."""

SPIKE_S = 0.030
"""Where 80 % of the first peak are reached within this of the onset, the loading rate is the impact's: a spike."""

PATH_N, PATH_S = 50.0, 0.025
"""The centroid's path is measured above this force, on its force-weighted mean over this time: noise is no path."""


@dataclass(frozen=True)
class Step:
    """One footstep. A figure that there is not is NaN.

    `tile` took most of the impulse; `side` is left, right or unknown. `contact_ms` is from the first sample at or
    above the on-threshold to the last at or above the off-threshold. `peak1_n` and `peak2_n` are the largest forces
    in the first and the second half of the contact, `valley_n` the least between them, `loading_kn_s` the rise from
    20 to 80 % of the first peak, interpolated between samples and not guarded: `spike` says that it is the impact's.
    `path_mm` is how far the centroid went above 50 N, `net_mm` how far it got. `contact` is its contact's id.

    `person` is who walks, from 1; `cadence_per_min` is from the person's last step to this one, and so are
    `step_length_mm` (middle to middle, along the way), `step_width_mm` (across it) and `double_support_ms`, in which
    both feet are down: below 0 where neither is. `swing_ms` is for how long this foot was in the air before.
    `heading_deg` is where the foot points, counter-clockwise from the floor's x axis, within `heading_error_deg` (one
    standard deviation).
    """

    step: int
    tile: str
    side: str
    start_s: float
    contact_ms: float
    peak1_n: float
    valley_n: float
    peak2_n: float
    impulse_ns: float
    loading_kn_s: float
    path_mm: float
    net_mm: float
    spike: bool = False
    cadence_per_min: float = math.nan
    contact: int = 0
    person: int = 0
    step_length_mm: float = math.nan
    step_width_mm: float = math.nan
    swing_ms: float = math.nan
    double_support_ms: float = math.nan
    heading_deg: float = math.nan
    heading_error_deg: float = math.nan


def is_step(contact: Contact) -> bool:
    """Whether a contact is a step."""
    lasted = SHORTEST_S <= contact.end_s - contact.start_s <= LONGEST_S
    return bool(lasted and not contact.cut and len(contact.force_n) >= 3 and contact.force_n.max() >= LEAST_N)


def measure(contact: Contact, floor: Floor) -> Step:
    """The figures of a contact as step 0, of unknown side. Raises `BadValue` for a curve of fewer than three samples.

    >>> from underfoot.floor.layout import default_floor
    >>> time_s = np.linspace(0.0, 0.6, 601)
    >>> force_n = 700.0 * np.sin(np.pi * time_s / 0.6) + 300.0 * np.sin(3.0 * np.pi * time_s / 0.6) + 20.0
    >>> along_m = 0.2 + 0.2 * time_s
    >>> contact = Contact(1, 0.0, 0.6, (0,), False, -0.001, 0.0, time_s, force_n, along_m, 0.0 * time_s)
    >>> step = measure(contact, default_floor())
    >>> [round(value, 1) for value in (step.contact_ms, step.peak1_n, step.valley_n, step.peak2_n, step.impulse_ns)]
    [600.0, 731.1, 420.0, 731.1, 317.6]
    >>> round(step.loading_kn_s, 1), round(step.path_mm, 1), round(step.net_mm, 1), step.spike
    (6.9, 118.4, 118.4, False)
    """
    time_s, force_n = contact.time_s, contact.force_n
    require(len(time_s) >= 3, "the length of a contact's curve", len(time_s), "3 or more")
    later = int(np.searchsorted(time_s, 0.5 * (time_s[0] + time_s[-1]), side="right"))
    peak1 = int(force_n[:later].argmax())
    peak2 = later + int(force_n[later:].argmax())
    loading_kn_s, loaded_s = _loading(contact, peak1)
    path_m, net_m = _path(contact)
    return Step(
        step=0,
        tile=floor.tiles[contact.tiles[0]].id,
        side="unknown",
        start_s=contact.start_s,
        contact_ms=1e3 * (contact.end_s - contact.start_s),
        peak1_n=float(force_n[peak1]),
        valley_n=float(force_n[peak1 : peak2 + 1].min()),
        peak2_n=float(force_n[peak2]),
        impulse_ns=float(np.trapezoid(force_n, time_s)),
        loading_kn_s=loading_kn_s,
        path_mm=1e3 * path_m,
        net_mm=1e3 * net_m,
        spike=bool(loaded_s - time_s[0] < SPIKE_S),
        contact=contact.id,
    )


def _loading(contact: Contact, peak: int) -> tuple[float, float]:
    """From 20 to 80 % of the first peak, in kN/s, and when 80 % were reached."""
    time_s = np.concatenate([[contact.lead_s], contact.time_s[: peak + 1]])
    force_n = np.concatenate([[contact.lead_n], contact.force_n[: peak + 1]])
    low_n, high_n = 0.2 * force_n[-1], 0.8 * force_n[-1]
    loaded_s = _reached(time_s, force_n, high_n)
    rise_s = loaded_s - _reached(time_s, force_n, low_n)
    return 1e-3 * float(high_n - low_n) / rise_s if rise_s > 0.0 else math.nan, loaded_s


def _reached(time_s: NDArray[np.float64], force_n: NDArray[np.float64], level_n: float) -> float:
    """When a force first reached a level, between the samples about it; NaN if it was there before the first."""
    after = 1 + int(np.argmax(force_n[1:] >= level_n))
    before = after - 1
    if not force_n[before] < level_n:
        return math.nan
    share = (level_n - force_n[before]) / (force_n[after] - force_n[before])
    return float(time_s[before] + share * (time_s[after] - time_s[before]))


def _path(contact: Contact) -> tuple[float, float]:
    """How far the centroid went, and how far it got, in metres."""
    loaded = contact.force_n >= PATH_N
    if not loaded.any():
        return math.nan, math.nan
    force_n = contact.force_n[loaded]
    half_width = round(0.5 * PATH_S / float(np.median(np.diff(contact.time_s))))
    place = np.arange(len(force_n))
    # The mean reaches equally far to both sides, so that it begins and ends where the centroid does.
    half_widths = np.minimum(half_width, np.minimum(place, place[::-1]))
    weight = _moving_sum(force_n, place, half_widths)
    smooth = np.column_stack(
        [_moving_sum(force_n * along[loaded], place, half_widths) / weight for along in (contact.x_m, contact.y_m)]
    )
    return float(np.hypot(*np.diff(smooth, axis=0).T).sum()), float(np.hypot(*(smooth[-1] - smooth[0])))


def _moving_sum(
    values: NDArray[np.float64], place: NDArray[np.intp], half_width: NDArray[np.intp]
) -> NDArray[np.float64]:
    sums = np.concatenate([[0.0], np.cumsum(values)])
    return sums[place + half_width + 1] - sums[place - half_width]
