"""A stimulus of a protocol: a patch with parameter settings, and its level in m/s^2."""

import math
import os
from collections.abc import Container, Mapping
from difflib import get_close_matches
from functools import lru_cache
from pathlib import Path
from typing import Annotated, Any

import msgspec

from underfoot.errors import BadFile, BadValue, require
from underfoot.files import make_folder, read_large_file, write_file
from underfoot.parameters import FilePath, Number, Parameter
from underfoot.patch import preset_files
from underfoot.patch.file_paths import with_files_kept
from underfoot.patch.node import installed_nodes
from underfoot.patch.patch import Patch, PlacedNode

Level = Annotated[float, msgspec.Meta(ge=0.0, le=200.0)]
Fact = int | float | str
SILENT = Patch(
    title="nothing",
    nodes=(
        PlacedNode("tile", "tile-force"),
        PlacedNode("foot", "contact-envelope"),
        PlacedNode("gain", "gain", parameters={"gain": 0.0}),
        PlacedNode("out", "tile-output"),
    ),
    wires=(("tile.force", "foot.force"), ("foot.out", "gain.signal"), ("gain.out", "out.acceleration")),
)
"""What plays where nothing is felt. It is prepared and put in as any other stimulus, which takes as long: else whoever
waits for the next page, or for the question, would know.
"""
_USUALLY_SCALED = ("gain.gain", "note.amplitude", "knock.level")
"""Numbers to which the acceleration of the presets is proportional."""


class Stimulus(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """A stimulus: a `patch` with `settings`, values by "node.parameter".

    `patch` is a preset's name, a file beside the protocol, or "" for no vibration. `scaled_by` is the parameter,
    "node.parameter", to which acceleration is proportional. `measured_m_s2` is the patch's peak with these settings,
    and `level_m_s2` the peak to be presented. `stiffness_n_mm` is the stiffness of the plate, 0 for no plate. `correct`
    is the right answer, "" if there is none. `factors` are the variables that the analysis compares, such as stiffness
    or waveform.
    """

    patch: str = ""
    settings: Mapping[str, Any] = {}
    scaled_by: str = ""
    measured_m_s2: Annotated[Level, msgspec.Meta(description="The peak with the settings as they are.")] = 0.0
    level_m_s2: Annotated[Level, msgspec.Meta(description="The peak that is wanted of it.")] = 0.0
    stiffness_n_mm: Annotated[
        float, msgspec.Meta(ge=0.0, le=10000.0, description="What the plate is set to first; 0: no plate.")
    ] = 0.0
    correct: Annotated[
        str, msgspec.Meta(description="Answers are scored and fed back; empty: there is none.", title="Right answer")
    ] = ""
    factors: Mapping[str, Fact] = {}

    def peak_m_s2(self, gain_db: float = 0.0) -> float | None:
        """Return the peak acceleration at `gain_db` re its level, in m/s^2; 0 without a patch.

        A patch without `scaled_by` plays as it is: at its level or, without one, its measured peak; None for neither.

        >>> round(Stimulus(patch="stimulus-td", scaled_by="gain.gain", level_m_s2=0.43).peak_m_s2(6.0206), 3)
        0.86
        >>> Stimulus(patch="snow").peak_m_s2(), Stimulus(patch="snow", measured_m_s2=1.5).peak_m_s2(6.0206)
        (None, 1.5)
        """
        if not self.patch:
            return 0.0
        if not self.scaled_by:
            return self.level_m_s2 or self.measured_m_s2 or None
        return self.level_m_s2 * 10.0 ** (gain_db / 20.0)

    def at(self, gain_db: float, folder: Path | None = None) -> Patch:
        """Return the patch with its settings, at `gain_db` re its level; `SILENT` for no vibration."""
        return self.scaled(self.loaded(folder), gain_db)

    def loaded(self, folder: Path | None) -> Patch:
        """Return the patch as its file now is, with its settings; `SILENT` for no vibration."""
        if not self.patch:
            return SILENT
        patch = _loaded(self.patch, folder)
        for name, value in self.settings.items():
            node, _, parameter = name.partition(".")
            patch = patch.set(node, parameter, value)
        if folder is not None:  # files in settings
            patch = with_files_kept(patch, installed_nodes(), folder.absolute(), None)
        return patch

    def scaled(self, patch: Patch, gain_db: float) -> Patch:
        """Return what was `loaded` at `gain_db` re its level."""
        factor = 10.0 ** (gain_db / 20.0)
        if self.scaled_by and self.measured_m_s2 > 0.0:
            factor *= self.level_m_s2 / self.measured_m_s2
        if not self.scaled_by or factor == 1.0:
            return patch
        node, _, parameter = self.scaled_by.partition(".")
        now = patch.node(node).parameters.get(parameter, _declared(patch)[self.scaled_by].default)
        return patch.set(node, parameter, now * factor)

    def check(self, place: str, folder: Path | None, limit_m_s2: float) -> None:
        """Raise `BadValue` if the patch is missing, or a setting or level is invalid. `place` begins the message."""
        for name, value in self.factors.items():
            good = not isinstance(value, float) or math.isfinite(value)
            require(good and bool(name), f"{place}.factors.{name}", value, "text or finite numbers")
        if not self.patch:
            plain = not self.settings and not self.scaled_by and self.level_m_s2 == 0.0
            require(plain, f"{place}.patch", "", "a patch, for a stimulus with settings or a level")
            return
        try:
            patch = _loaded(self.patch, folder)
        except (BadFile, BadValue) as error:
            raise BadValue(f"{place}.patch: {error}") from None
        known = _declared(patch)
        for name in (*self.settings, *([self.scaled_by] if self.scaled_by else [])):
            allowed = f"parameters of the patch: {', '.join(known) or 'none'}"
            require(name in known, f"{place}.settings", name, allowed)
        if self.scaled_by:
            is_number = isinstance(known[self.scaled_by], Number)
            require(is_number, f"{place}.scaled_by", self.scaled_by, "a number of the patch")
            require(self.measured_m_s2 > 0.0, f"{place}.measured_m_s2", self.measured_m_s2, "above 0, with scaled_by")
        within = self.level_m_s2 <= limit_m_s2
        require(within, f"{place}.level_m_s2", self.level_m_s2, f"up to limit_m_s2, {limit_m_s2:g}")
        try:
            self.at(0.0, folder)
        except BadValue as error:
            raise BadValue(f"{place}.settings: {str(error).replace('.parameters.', '.', 1)}") from None


def usually_scaled(parameters: Container[str]) -> str:
    """Return the parameter, "node.parameter", to which acceleration is most likely proportional, or "".

    >>> usually_scaled({"gain.gain": 1.0, "noise.level": 1.0})
    'gain.gain'
    """
    return next((one for one in _USUALLY_SCALED if one in parameters), "")


def parameters_of(name: str, folder: Path | None) -> dict[str, Parameter]:
    """Return the parameters of a patch by "node.parameter". `name` is a preset's, or a file's in `folder`."""
    return _declared(_loaded(name, folder))


def _declared(patch: Patch) -> dict[str, Parameter]:
    types = installed_nodes()
    return {f"{node.id}.{p}": one for node in patch.nodes for p, one in types[node.type].parameters.items()}


def settings_kept(settings: Mapping[str, Any], parameters: Mapping[str, Parameter], folder: Path) -> dict[str, Any]:
    """Return settings with the paths of files in `folder` as absolute ones, for use in another folder."""
    return {
        name: str(folder.absolute() / value) if isinstance(parameters.get(name), FilePath) and value else value
        for name, value in settings.items()
    }


def copy_files_of_settings(stimuli: Mapping[str, Stimulus], before: Path, after: Path) -> None:
    """Copy the sound files that settings name from one folder to another, as far as they are there."""
    for stimulus in stimuli.values():
        parameters = parameters_of(stimulus.patch, after) if stimulus.patch and stimulus.settings else {}
        for name, path in settings_kept(stimulus.settings, parameters, before).items():
            if path != stimulus.settings[name] and Path(path).is_file():
                copy = Path(os.path.normpath(after / stimulus.settings[name]))
                make_folder(copy.parent)
                write_file(copy, read_large_file(path))


def patch_path(name: str, folder: Path | None) -> Path:
    """Return the path of a preset, or of a file in `folder`; raise `BadFile` if there is none."""
    return preset_or_beside("patch", preset_files.patches(), name, folder)


def preset_or_beside(what: str, presets: Mapping[str, Path], name: str, folder: Path | None) -> Path:
    """Return the path of one of these `presets`, or of a file in `folder`; raise `BadFile` if there is none."""
    path = presets.get(name) or path_beside(name, folder or Path(), what)
    try:
        is_file = path.is_file()
    except (OSError, ValueError):
        is_file = False
    if not is_file:
        near = ", ".join(get_close_matches(name, presets, 3, 0.3) or list(presets)[:3])
        raise BadFile(f"there is no {what} {name!r}; allowed: a file beside the protocol, or a preset, such as {near}")
    return path


def path_beside(name: str, folder: Path, what: str = "patch") -> Path:
    """Return the path of a file in `folder` or below, whether it exists or not; raise `BadValue` for one outside."""
    require("\0" not in name, what, name, "a preset's name, or a file's")
    inside = not Path(name).is_absolute() and ".." not in Path(name).parts
    require(inside, what, name, "a preset's name, or a file beside the protocol or below")
    return folder / name


def _loaded(name: str, folder: Path | None) -> Patch:
    """Return the patch of a preset's name or of a file in `folder`; a file is read again only after a change."""
    path = patch_path(name, folder)
    return _read(path, path.stat().st_mtime_ns)


@lru_cache(maxsize=256)
def _read(path: Path, changed: int) -> Patch:
    folder = path.absolute().parent
    return with_files_kept(Patch.load(path), installed_nodes(), folder, None)  # a session has another folder
