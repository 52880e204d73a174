"""Which calibrations a session uses: recordings and studies keep it, so that figures can be traced years later."""

from collections.abc import Mapping

import msgspec

from underfoot.devices.transports import TRANSPORTS
from underfoot.engine.commands import TileEqualiser
from underfoot.engine.target import Target
from underfoot.floor.profile import Profile
from underfoot.floor.profile_parts import PARTS, InUse
from underfoot.floor.tile_parameters import simulation


def calibrations_in_use(
    target: Target, profiles: Mapping[str, Profile], equalisers: Mapping[str, TileEqualiser]
) -> InUse:
    """Return the calibrations that a session on `target` uses, tiles without one left out.

    `profiles` are as they were when it began, and `equalisers` as they are now. Forces and places count where tiles
    send readings, and the latency where it is of this sample rate and block.

    >>> from underfoot.floor.layout import default_floor
    >>> from underfoot.floor.profile import Latency
    >>> profile = Profile(tile="t1", latency=Latency(made="2026-05-01", software="0.1", round_trip_ms=20.0))
    >>> calibrations_in_use(Target(default_floor(), round_trip_frames=960), {"t1": profile}, {})
    {'t1': {'latency': '2026-05-01 971abf691d73'}}
    """
    errs = target.kind == "simulator" and simulation(target.simulation)[0] is not None
    has_readings = errs or target.kind in TRANSPORTS
    found: InUse = {}
    for tile in target.floor.ids:
        profile = profiles.get(tile, Profile(tile=tile))
        lag, equaliser = profile.latency, equalisers.get(tile)
        is_timed = lag is not None and (lag.rate_hz, lag.block) == (target.rate, target.block)
        used = {
            "fsr": profile.fsr.identity if profile.fsr is not None and has_readings else "",
            "centroid": profile.centroid.identity if profile.centroid is not None and has_readings else "",
            "response": equaliser.calibration if equaliser is not None else "",
            "latency": lag.identity if lag is not None and is_timed and target.round_trip_frames else "",
        }
        if parts := {kind: used[kind] for kind in PARTS if used.get(kind)}:
            found[tile] = parts
    return found


def calibration_texts(equalisers: Mapping[str, TileEqualiser], in_use: InUse) -> dict[str, str]:
    """Return what a recording says of equalisers, `corrections`, and of calibrations, if any is in use."""
    texts = {"corrections": msgspec.json.encode(tuple(equalisers.values())).decode()}
    return texts | ({"calibrations": msgspec.json.encode(in_use).decode()} if in_use else {})
