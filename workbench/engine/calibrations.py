"""Which calibrations a session uses: recordings and studies keep it, so that figures can be traced years later."""

from collections.abc import Mapping
from pathlib import Path

import msgspec

from underfoot.devices.transports import TRANSPORTS
from underfoot.engine.commands import TileEqualiser
from underfoot.engine.target import Target
from underfoot.errors import BadFile
from underfoot.floor.profile import Profile
from underfoot.floor.profile_parts import PARTS, InUse
from underfoot.floor.tile_parameters import simulation
from underfoot.records.recording import Recording, is_recording


def calibrations_in_use(target: Target, profiles: Mapping[str, Profile]) -> InUse:
    """Return the calibrations of each tile that a session on `target` uses, without those of `with_responses`.

    Forces and places count where tiles send readings, or did for the recording that is replayed, and the latency where
    it is of this sample rate and block. Each digest takes a millisecond or two.

    >>> from underfoot.floor.layout import default_floor
    >>> from underfoot.floor.profile import Latency
    >>> profile = Profile(tile="t1", latency=Latency(made="2026-05-01", software="0.1", round_trip_ms=20.0))
    >>> calibrations_in_use(Target(default_floor(1, 1), round_trip_frames=960), {"t1": profile})
    {'t1': {'latency': '2026-05-01 971abf691d73'}}
    """
    errs = target.kind == "simulator" and simulation(target.simulation)[0] is not None
    has_readings = errs or target.kind in TRANSPORTS
    found: InUse = {}
    recorded = _of_recording(target)
    for tile in target.floor.ids:
        profile = profiles.get(tile, Profile(tile=tile))
        lag = profile.latency
        is_timed = lag is not None and (lag.rate_hz, lag.block) == (target.rate, target.block)
        used = {
            "fsr": profile.fsr.identity if profile.fsr is not None and has_readings else "",
            "centroid": profile.centroid.identity if profile.centroid is not None and has_readings else "",
            "latency": lag.identity if lag is not None and is_timed and target.round_trip_frames else "",
        }
        found[tile] = recorded.get(tile, {}) | {kind: identity for kind, identity in used.items() if identity}
    return found


def with_responses(in_use: InUse, equalisers: Mapping[str, TileEqualiser]) -> InUse:
    """Return the calibrations in use, with those of the responses that these equalisers are of.

    Parts are in their usual order; tiles without any are left out.

    >>> now = {"t1": TileEqualiser("t1", calibration="2026-05-02 a07be6c51f98")}
    >>> with_responses({"t1": {"latency": "2026-05-01 971abf691d73"}, "t2": {}}, now)
    {'t1': {'response': '2026-05-02 a07be6c51f98', 'latency': '2026-05-01 971abf691d73'}}
    """
    responses = {tile: {"response": one.calibration} for tile, one in equalisers.items() if one.calibration}
    whole = {tile: parts | responses.get(tile, {}) for tile, parts in in_use.items()}
    return {tile: {kind: parts[kind] for kind in PARTS if kind in parts} for tile, parts in whole.items() if parts}


def calibration_texts(equalisers: Mapping[str, TileEqualiser], in_use: InUse) -> dict[str, str]:
    """Return what a recording says of equalisers, `corrections`, and of calibrations, if any is in use."""
    texts = {"corrections": msgspec.json.encode(tuple(equalisers.values())).decode()}
    return texts | ({"calibrations": msgspec.json.encode(in_use).decode()} if in_use else {})


def _of_recording(target: Target) -> InUse:
    """Return the calibrations that made the newtons of the recording that a target replays, tile by tile in order."""
    if target.kind != "replay" or not is_recording(Path(target.source)):
        return {}
    with Recording(target.source) as recording:
        ids = recording.floor.ids
        try:
            known = recording.calibrations
        except BadFile:
            return {}  # its forces can be played without
    recorded = (known.get(tile, {}) for tile in ids)
    of_tiles: list[dict[str, str]] = [{k: one[k] for k in ("fsr", "centroid") if k in one} for one in recorded]
    return dict(zip(target.floor.ids, of_tiles, strict=False))
