"""`underfoot levels`: commanded, measured and felt levels of patches on a loaded tile."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from underfoot.commands.compiling import report_compiling
from underfoot.commands.ending import interrupted_by_signals
from underfoot.commands.files import RUN_CODE
from underfoot.commands.options import FIGURES_AS_JSON, command
from underfoot.commands.telling import tell
from underfoot.options import argument, option, shared

if TYPE_CHECKING:
    from underfoot.engine.levels import Level, PatchLevels


@dataclass(frozen=True)
class LevelsOptions:
    """Options of the command; None if not given."""

    patches: tuple[Path, ...] = argument("patches", metavar="[PATCH]...", required=False)
    profile: Path | None = option("Profile of the tile; by default none.")
    simulation: Path | None = option("Parameter file of the simulated tile.", presets="simulations")
    run_code: bool = shared(RUN_CODE)
    as_json: bool = shared(FIGURES_AS_JSON)


@command(LevelsOptions)
def levels(options: LevelsOptions) -> None:
    """Report commanded, measured and felt levels of one adult step; by default for all presets."""
    from underfoot.engine.levels import levels_of
    from underfoot.floor.profile import Profile
    from underfoot.floor.tile_parameters import TileParameters
    from underfoot.nodes import REGISTRY
    from underfoot.patch import preset_files
    from underfoot.patch.patch import Patch

    of_tile = Profile.load(options.profile) if options.profile else None
    if of_tile is not None and of_tile.response is None:
        tell(f"{options.profile} has no part of vibration: the levels are those without it")
    made_of = TileParameters.load(options.simulation) if options.simulation else None
    stems = [path.stem for path in options.patches]
    files = {path.stem if stems.count(path.stem) == 1 else str(path): path for path in options.patches}
    files = files or preset_files.patches()
    read = {name: Patch.load(path, REGISTRY) for name, path in files.items()}
    found: dict[str, PatchLevels] = {}
    with interrupted_by_signals(), report_compiling():
        for name, patch in read.items():
            found[name] = levels_of(patch, files[name].parent, of_tile, made_of)
            if len(read) > 1:
                tell(f"{len(found)} of {len(read)}: {name}")
    if options.as_json:
        print(json.dumps({name: one.data() for name, one in found.items()}))
    else:
        print("\n".join(_table(found)))


def _table(found: "dict[str, PatchLevels]") -> list[str]:
    """Return one line per patch."""
    width = max(len(name) for name in found)
    head = f"{'':{width}}  {'commanded, m/s²':>15} {'measured, m/s²':>15} {'under foot':>15}"
    lines = [f"{head} {'in band':>8} {'felt':>7} {'headroom':>9} {'noticed':>8} {'like':>11}"]
    for name, one in found.items():
        columns = " ".join(f"{_words(level):>15}" for level in (one.commanded, one.measured, one.under_foot))
        db = one.measured.level_db
        felt = "silent" if db is None else f"{db:+.0f} dB"
        share = f"{100.0 * one.measured.share_in_band:.0f} %"
        headroom = "limited" if one.headroom_db < 0.1 else f"{one.headroom_db:.0f} dB"
        noticed = f"{100.0 * one.measured.noticed:.0f} %"
        like = "not covered" if one.feels_like_n_mm is None else f"{one.feels_like_n_mm:.0f} N/mm"
        lines.append(f"{name:{width}}  {columns} {share:>8} {felt:>7} {headroom:>9} {noticed:>8} {like:>11}")
    return [*lines, *_LEGEND]


_LEGEND = (
    "peak: median of the largest values of loud 10 ms, as in table 6.1; beside it the RMS of the loudest 0.12 s;",
    "in band: share of measured energy, 50 to 750 Hz; felt: level above the threshold in a hard shoe; headroom: drive",
    "below the limiter; noticed: share of people in such shoes who notice it; like: stiffness that a plate of 90 N/mm",
    "feels like, where table 6.3 covers it, up to 0.86 m/s²",
)


def _words(level: "Level") -> str:
    return f"{level.peak_m_s2:.2f} {level.rms_m_s2:6.2f}"
