"""Simulated floors on several computers: the errors of clock synchronisation, and their effect on contacts.

`python -m underfoot.bench.hosts` prints the table of docs/hosts.md.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from underfoot.clock import RATE_HZ
from underfoot.devices.device_clock import DeviceClocks, arrival_frame, observe
from underfoot.devices.simulated_floor import SimulatedFloor
from underfoot.floor.layout import default_floor
from underfoot.floor.tile_parameters import simulation
from underfoot.floor.tracking import ON_N

MESSAGE_HZ = 60.0
"""Rate at which contacts are sent."""
PROBE_S, PROBES = 5.0, 10
"""Lab Streaming Layer: interval in seconds between clock probes, and probes per round, the fastest of which counts."""


@dataclass(frozen=True)
class NetworkLink:
    """A network path between two computers, in seconds.

    `minimum_s` is the least delay of a message, `mean_queue_s` the mean queueing delay added to it, and `asymmetry_s`
    the excess of the forward over the return delay.
    """

    minimum_s: float
    mean_queue_s: float
    asymmetry_s: float = 0.0

    def request_delays_s(self, rng: np.random.Generator, count: int) -> NDArray[np.float64]:
        """Draw the delays of messages, (count,)."""
        return self.minimum_s + self.asymmetry_s + rng.exponential(self.mean_queue_s, count)

    def reply_delays_s(self, rng: np.random.Generator, count: int) -> NDArray[np.float64]:
        """Draw the delays of answers, (count,)."""
        return self.minimum_s + rng.exponential(self.mean_queue_s, count)


LINKS = {
    "a dedicated switch": NetworkLink(0.05e-3, 0.05e-3),
    "a busy network": NetworkLink(0.2e-3, 0.5e-3, 0.1e-3),
    "wireless": NetworkLink(1.5e-3, 3e-3, 0.5e-3),
}


def by_round_trips(link: NetworkLink, drift_ppm: float, seconds: float) -> NDArray[np.float64]:
    """Return the errors of another computer's clock, estimated from round trips, before each new round of probes.

    In seconds. Half of a round trip is taken as the delay, and the result holds until the next round.

    >>> bool(abs(by_round_trips(NetworkLink(1e-3, 0.0), 50.0, 60.0)).max() < 0.251e-3)
    True
    """
    rng = np.random.default_rng(1)
    errors = []
    for _ in range(round(seconds / PROBE_S)):
        request_delays_s, reply_delays_s = link.request_delays_s(rng, PROBES), link.reply_delays_s(rng, PROBES)
        fastest = int(np.argmin(request_delays_s + reply_delays_s))
        error_s = 0.5 * (request_delays_s[fastest] - reply_delays_s[fastest])
        errors.append(error_s - 1e-6 * drift_ppm * PROBE_S)
    return np.array(errors)


def by_arrivals(link: NetworkLink, drift_ppm: float, seconds: float) -> NDArray[np.float64]:
    """Return the errors if only messages with their sender's time arrive, and Underfoot's clock for tiles maps them.

    The delay itself cannot be observed: it is part of the error.
    """
    rng, clocks = np.random.default_rng(1), DeviceClocks(1, float(RATE_HZ))
    sent_s = np.arange(0.0, seconds, 1.0 / MESSAGE_HZ)
    shown_us = 1e6 * sent_s / (1.0 + 1e-6 * drift_ppm)
    errors = []
    for at_s, us, way_s in zip(sent_s, shown_us, link.request_delays_s(rng, len(sent_s)), strict=True):
        observe(clocks.table[0], 0, us, RATE_HZ * (at_s + way_s), float(RATE_HZ))
        errors.append(arrival_frame(clocks.table[0], us, float(RATE_HZ)) / RATE_HZ - at_s)
    return np.array(errors[len(errors) // 4 :])


def centroid_errors_m(late_s: float) -> NDArray[np.float64]:
    """Return the errors in metres of a foot's centroid if half of a 6 x 6 floor is on a computer `late_s` late.

    One for each sample of ten seconds in which a foot of four people is on both halves.
    """
    source = SimulatedFloor(default_floor(6, 6), RATE_HZ, people=simulation("people=4")[1])
    parts = []
    for end in range(480, 10 * RATE_HZ, 480):
        parts.append(source.forces[: source.pull(end)].copy())
    forces = np.maximum(np.concatenate(parts), 0.0)
    places = np.array([[tile.to_floor(np.array(at)) for at in tile.sensors_m] for tile in source.floor.tiles])
    late_samples = round(late_s * source.rate_hz)
    errors = []
    for row in range(6):
        left, right = 6 * row + 2, 6 * row + 3
        truth, shifted = forces[late_samples:, [left, right]], forces[late_samples:, [left, right]].copy()
        shifted[:, 1] = forces[: len(forces) - late_samples, right]
        on = (truth.sum(axis=2) > ON_N).all(axis=1) & (shifted.sum(axis=2) > ON_N).all(axis=1)
        at = places[[left, right]]
        middle, moved = (
            np.einsum("nks,ksx->nx", one[on], at) / one[on].sum(axis=(1, 2))[:, None] for one in (truth, shifted)
        )
        errors.append(np.hypot(*(moved - middle).T))
    return np.concatenate(errors)


def text() -> str:
    """Return the tables, for a terminal."""
    lines = ["clocks 50 ppm apart, 600 s; 95 % of errors, ms"]
    lines.append(f"{'':24}{'round trips':>14}{'arrivals':>14}")
    for name, link in LINKS.items():
        errors_s = (way(link, 50.0, 600.0) for way in (by_round_trips, by_arrivals))
        found = [1e3 * np.percentile(np.abs(one), 95) for one in errors_s]
        lines.append(f"{name:24}{found[0]:14.2f}{found[1]:14.2f}")
    lines.append("a foot on the seam of two hosts; 95 % of errors of its centroid")
    for late_s in (0.001, 0.002, 0.005, 0.016):
        lines.append(f"{1e3 * late_s:6.0f} ms late{1e3 * np.percentile(centroid_errors_m(late_s), 95):14.1f} mm")
    return "\n".join(lines)


if __name__ == "__main__":
    print(text())
