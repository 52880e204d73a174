"""Footsteps: the gait measures of a contact.

A contact is a step if its beginning and end were both seen, it lasted 0.08 to 5 s, and it reached 50 N. A person who
stands is a contact, but no step. A contact that is cut by the ends of the recording, by a gap or by an untared tile is
no step either. All measures are of the contact's force and of its centroid in the floor's frame.
"""

import math

import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

from underfoot.errors import require
from underfoot.floor.contacts import Contact
from underfoot.floor.layout import Floor
from underfoot.floor.shared_loads import LOADED_N

SHORTEST_S, LONGEST_S, LEAST_N = 0.08, 5.0, 50.0
"""Shortest and longest step, and least peak force: excludes the touch of a toe, and standing."""

SPIKE_S = 0.030
"""If 80 % of the first peak are reached within this time, the peak is a spike, the impact of the heel."""

PATH_S = 0.025
"""The centroid's path is measured above `LOADED_N`, on its force-weighted mean over `PATH_S`, to exclude noise."""


def walking_speed_m_s(length_mm: float, cadence_per_min: float) -> float:
    """Return step length times cadence.

    >>> walking_speed_m_s(660.0, 110.0)
    1.21
    """
    return length_mm * cadence_per_min / 6e4


def _percent_bw(measure: str, percent: float = 100.0) -> property:
    """Return a property of a `Step`: a measure, of whose unit one is `percent` of a newton, relative to the weight."""
    return property(lambda step: percent * getattr(step, measure) / step.body_weight_n)


class Step(Struct, frozen=True):
    """One footstep. Measures that cannot be determined are NaN.

    `tile` took most of the impulse; `side` is left, right or unknown. `contact_ms` is from the first sample at or
    above the on-threshold to the last at or above the off-threshold. `peak1_n` and `peak2_n` are the largest forces
    in the first and the second half of the contact, `valley_n` the least between them. `loading_kn_s` is the rise from
    20 to 80 % of the first peak, interpolated between samples; with `spike` it is that of the heel's impact.
    `path_mm` is the length of the centroid's path above 50 N, `net_mm` the distance between its ends. `contact` is the
    id of the contact.

    `person` numbers the walkers from 1. From the person's last step to this one are `cadence_per_min`,
    `step_length_mm` (between the centres, in the direction of walking), `step_width_mm` (across it) and
    `double_support_ms`, with both feet down; negative if neither is. `swing_ms` is this foot's time in the air before.
    All these are NaN if a foot between was not seen, and the first three if the last one was not seen as a whole.
    `heading_deg` is the direction of the foot, counter-clockwise from the floor's x axis, with the standard error
    `heading_error_deg`.

    Of a recording, `left_out` is why a person has left the step out of means, "" if it counts, and `body_weight_n` the
    weight of who made it, as far as it was noted. What was measured stays. `BODY_WEIGHT_MEASURES` are in percent of it.
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
    left_out: str = ""
    body_weight_n: float = math.nan

    @property
    def end_s(self) -> float:
        """When the contact ended."""
        return self.start_s + 1e-3 * self.contact_ms

    @property
    def speed_m_s(self) -> float:
        """Walking speed from the person's last step to this one: step length times cadence."""
        return walking_speed_m_s(self.step_length_mm, self.cadence_per_min)

    @property
    def stance_percent(self) -> float:
        """Share of this foot's gait cycle, the swing before and the contact, in which it is on the ground."""
        return 100.0 * self.contact_ms / (self.swing_ms + self.contact_ms)

    peak1_percent_bw = _percent_bw("peak1_n")
    valley_percent_bw = _percent_bw("valley_n")
    peak2_percent_bw = _percent_bw("peak2_n")
    impulse_percent_bw_s = _percent_bw("impulse_ns")
    loading_percent_bw_per_s = _percent_bw("loading_kn_s", 1e5)


BODY_WEIGHT_MEASURES = tuple(name for name in vars(Step) if "_percent_bw" in name)
"""Measures of a `Step` in percent of the body weight that is noted."""


def is_step(contact: Contact) -> bool:
    """Return whether a contact is a step."""
    lasted = SHORTEST_S <= contact.end_s - contact.start_s <= LONGEST_S
    return bool(lasted and not contact.cut and len(contact.force_n) >= 3 and contact.force_n.max() >= LEAST_N)


def measure(contact: Contact, floor: Floor) -> Step:
    """Return the measures of a contact, as step 0 of unknown side. Raises `BadValue` for fewer than three samples.

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
    """Return the loading rate from 20 to 80 % of the first peak, in kN/s, and the time at which 80 % were reached."""
    time_s = np.concatenate([[contact.lead_s], contact.time_s[: peak + 1]])
    force_n = np.concatenate([[contact.lead_n], contact.force_n[: peak + 1]])
    low_n, high_n = 0.2 * force_n[-1], 0.8 * force_n[-1]
    loaded_s = _reached(time_s, force_n, high_n)
    rise_s = loaded_s - _reached(time_s, force_n, low_n)
    return 1e-3 * float(high_n - low_n) / rise_s if rise_s > 0.0 else math.nan, loaded_s


def _reached(time_s: NDArray[np.float64], force_n: NDArray[np.float64], level_n: float) -> float:
    """Return when a force first reached a level, interpolated between samples; NaN if it began above it."""
    after = 1 + int(np.argmax(force_n[1:] >= level_n))
    before = after - 1
    if not force_n[before] < level_n:
        return math.nan
    share = (level_n - force_n[before]) / (force_n[after] - force_n[before])
    return float(time_s[before] + share * (time_s[after] - time_s[before]))


def _path(contact: Contact) -> tuple[float, float]:
    """Return the length of the centroid's path, and the distance between its ends, in metres."""
    loaded = contact.force_n >= LOADED_N
    if not loaded.any():
        return math.nan, math.nan
    force_n = contact.force_n[loaded]
    half_width = round(0.5 * PATH_S / float(np.median(np.diff(contact.time_s))))
    place = np.arange(len(force_n))
    # The mean is symmetric, so that the smoothed path begins and ends where the centroid does.
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
