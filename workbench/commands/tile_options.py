"""The options of every command that calibrates a tile: which tile, and where the result goes."""

import json
from dataclasses import dataclass, replace
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING

from underfoot.commands.files import require_folders_writable, require_outputs_writable
from underfoot.commands.options import FIGURES_AS_JSON
from underfoot.commands.telling import tell
from underfoot.errors import BadFile
from underfoot.files import stem_of
from underfoot.options import option, shared

if TYPE_CHECKING:
    from underfoot.calibration.result import Result
    from underfoot.floor.layout import Floor, Tile
    from underfoot.floor.profile import Profile


@dataclass(frozen=True)
class TileOptions:
    """Options that choose the tile, and where the result is written."""

    floor: Path | None = option(
        "Floor JSON with the tile and its sensors; by default the default floor.", None, presets="floors"
    )
    tile: str = option("The tile; by default the only one in the file, or the floor's first.", "")
    serial: str = option("The tile's serial number, stored in its profile.", "")
    operator: str = option("Operator's name for the report; by default the account name.", "")
    conditions: str = option("Instruments with their serial numbers, temperature, for profile and report.", "")
    seed: int = option("Seed of the simulated tile and hand.", 1)
    profile: Path | None = option("Profile JSON to read and write; its other parts are kept.", None, is_written=True)
    report: Path | None = option("Folder for a page with pictures, figures and raw data.", None)
    as_json: bool = shared(FIGURES_AS_JSON)

    def require_writable(self) -> None:
        """Raise `BadFile` before the work, and not after it, where profile or report cannot be written."""
        require_outputs_writable(self.profile)
        require_folders_writable(self.report)

    def chosen(self) -> "tuple[Floor, Tile]":
        """Return the floor and the tile of the options, by default the default floor and its first tile."""
        from underfoot.floor.layout import Floor, default_floor

        floor = default_floor() if self.floor is None else Floor.load(self.floor)
        return floor, floor.tiles[floor.index(self.tile) if self.tile else 0]

    def known(self, tile: str) -> "Profile":
        """Return the tile's profile to update, or an empty one; `BadFile` for another tile's profile."""
        from underfoot.floor.profile import Profile, load_for_tile

        if self.profile is None or not self.profile.exists():
            return Profile(tile=tile, serial=self.serial)
        return load_for_tile(self.profile, tile, self.serial)

    def conclude(self, result: "Result", known: "Profile") -> None:
        """Conclude with a result: write the report, then the profile, and print.

        What was measured is not lost with a file: each is written, and all is printed, before `BadFile` is raised.
        """
        from underfoot.calibration.results.drift import drift

        result = result.with_origin(simulated=result.is_simulated, conditions=self.conditions)
        new, failure = result.apply(known), None
        for write in (self._write_report, self._write_profile):
            try:
                write(result, new)
            except BadFile as error:
                failure = failure or error
        changed = drift(result.part, known.part(result.kind))
        self._print(replace(result, warnings=(*result.warnings, *filter(None, [changed]))))
        if failure is not None:
            raise failure

    def keep(self, measured: "Result", tile: str, *, by_hand: bool) -> None:
        """Write the report of what was `measured` without a conclusion; `by_hand`, to a new folder if none is named."""
        from underfoot.floor.profile import Profile

        options = self
        if self.report is None and by_hand:
            stem = stem_of(f"{tile} {measured.kind}", measured.kind)
            folders = (Path(stem if n == 1 else f"{stem}-{n}") for n in count(1))
            options = replace(self, report=next(folder for folder in folders if not folder.exists()))
        if options.report is None:
            return
        try:
            noted = measured.with_origin(simulated=measured.is_simulated, conditions=self.conditions)
            options._write_report(noted, Profile(tile=tile, serial=self.serial))
            tell(f"what was measured is in {options.report}")
        except BadFile as error:
            tell(error)

    def _write_report(self, result: "Result", new: "Profile") -> None:
        from underfoot.calibration.files.report import write_report

        if self.report is not None:
            write_report(result, self.report, new, operator=self.operator)

    def _write_profile(self, _: "Result", new: "Profile") -> None:
        from underfoot.calibration.files.plate_profiles import write_plate_file

        if self.profile is not None:
            new.save(self.profile)
            write_plate_file(new, self.profile)

    def _print(self, result: "Result") -> None:
        from underfoot.calibration.files.report import figures
        from underfoot.calibration.results.labels import label_of

        if self.as_json:
            print(json.dumps(figures(result)))
            return
        print(result.verdict)
        for name, value, unit in result.quantities:
            print(f"{label_of(name)}: {value:.4g} {unit}".rstrip())
        for warning in result.warnings:
            tell(warning)
