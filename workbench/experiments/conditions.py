"""Conditions from a CSV, as other programs for experiments write them: one stimulus per row.

`stimulus` is the name of the stimulus; without this column, names are c1, c2, and so on. `like` names a stimulus of the
protocol whose fields are the defaults. `patch`, `scaled_by`, `measured_m_s2`, `level_m_s2`, `stiffness_n_mm` and
`correct` (in PsychoPy: `corrAns`) are the fields of `Stimulus`. A column "node.parameter" sets a parameter of the
patch. Every other column is a factor, which the analysis compares. An empty cell leaves its field unset.
"""

import math
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import msgspec

from underfoot.csv_tables import read_csv_table
from underfoot.documents import placed
from underfoot.errors import BadFile, BadValue
from underfoot.experiments.columns import NOT_FACTORS
from underfoot.experiments.draft import Draft
from underfoot.experiments.languages import is_own
from underfoot.experiments.protocol import Protocol
from underfoot.experiments.stimuli import Stimulus, parameters_of, patch_path, settings_kept, usually_scaled
from underfoot.experiments.trial_files import value_of
from underfoot.parameters import IDENTIFIER
from underfoot.patch import preset_files

_FIELDS = ("patch", "scaled_by", "measured_m_s2", "level_m_s2", "stiffness_n_mm", "correct")
_WORDS = ("patch", "scaled_by", "correct")
_PSYCHOPY_CORRECT = "corrAns"
_COLUMNS = ("stimulus", "like", *_FIELDS)


def with_conditions(protocol: Protocol, folder: Path, path: Path) -> tuple[Protocol, Path]:
    """Return the protocol with the stimuli of a table instead of those that its methods list, and their folder.

    Patches are presets, or files: the table's own lie beside it, the protocol's in `folder`. Raises `BadFile` with the
    line of a mistake.
    """
    presets, there = preset_files.patches(), path.parent
    draft = Draft.of(protocol, there)
    has_files = is_own(protocol.language) or any(
        one.patch and one.patch not in presets for one in protocol.stimuli.values()
    )
    if has_files and folder.resolve() != there.resolve():
        draft = _Above(draft.raw, Path(os.path.commonpath((folder.resolve(), there.resolve()))))
        draft.take_patches(folder)
    draft.take_conditions(read_conditions(path, draft))
    return draft.checked(), draft.folder


class _Above(Draft):
    """A draft in a folder above all of its files, which stay where they are."""

    def take_patch(self, path: Path) -> str:
        """Return the patch's name in this folder."""
        return path.resolve().relative_to(self.folder).as_posix()

    take_language = take_patch


def read_conditions(path: Path, draft: Draft) -> dict[str, dict[str, Any]]:
    """Return the stimuli of a table as plain values by name, in its order, for use in a draft.

    Copies a patch from the table's folder to the draft's, if the folders differ.
    """
    table = read_csv_table(path, "a table of conditions")
    named = ["correct" if column == _PSYCHOPY_CORRECT else column for column in table.names]
    for column in named:
        _check_column(path, column, named)
    if not table.rows:
        raise BadFile(f"{path} has no conditions; allowed: a header, and a line for each condition")
    limit = draft.raw.get("limit_m_s2")
    limit_m_s2 = float(limit) if isinstance(limit, int | float) else math.inf  # the draft reports a wrong limit
    found: dict[str, dict[str, Any]] = {}
    for number, line in table.rows:
        cells = {column: cell.strip() for column, cell in zip(named, line, strict=True) if cell.strip()}
        name = cells.get("stimulus", f"c{number - 1}")
        try:
            if not IDENTIFIER.fullmatch(name) or name in found:
                raise BadValue(f"stimulus is {name!r}; allowed: letters, digits, - and _, each name once")
            found[name] = _stimulus(name, cells, draft, path.parent)
            msgspec.convert(found[name], Stimulus).check(name, draft.folder, limit_m_s2)
        except msgspec.ValidationError as error:
            raise BadFile(f"{path}, line {number}: {placed(error, found[name]).removeprefix('$.')}") from None
        except (BadValue, BadFile) as error:
            raise BadFile(f"{path}, line {number}: {error}") from None
    return found


def _check_column(path: Path, column: str, header: Sequence[str]) -> None:
    is_plain = column in _COLUMNS or "." in column
    if not column.strip() or header.count(column) > 1:
        raise BadFile(f"{path}, line 1: a column is {column!r}; allowed: a name for each column, each once")
    if not is_plain and column in NOT_FACTORS:
        own = ", ".join(_COLUMNS)
        raise BadFile(
            f"{path}, line 1: a column is {column!r}, which every table of trials has itself; allowed: {own}, "
            "node.parameter, or another name for what is compared"
        )


def _stimulus(name: str, given: Mapping[str, str], draft: Draft, folder: Path) -> dict[str, Any]:
    """Return a row's stimulus as plain values. A level requires a peak that was measured with the same settings."""
    like, known = given.get("like", ""), draft.raw["stimuli"]
    if like and like not in known:
        raise BadValue(f"like is {like!r}; allowed: a stimulus of the protocol ({', '.join(known) or 'none'})")
    made: dict[str, Any] = dict(known[like]) if like else {}
    settings = {column: value_of(cell) for column, cell in given.items() if "." in column}
    factors = {column: _fact(cell) for column, cell in given.items() if column not in _COLUMNS and "." not in column}
    if settings or "patch" in given:
        made |= {"measured_m_s2": 0.0, "level_m_s2": 0.0}  # measured with other settings
    for column in _FIELDS:
        if column in given:
            made[column] = given[column] if column in _WORDS else value_of(given[column])
    made["settings"] = {**made.get("settings", {}), **settings}
    made["factors"] = {**made.get("factors", {}), **factors}
    if not made.get("patch"):
        return made
    if "patch" in given and given["patch"] not in preset_files.patches() and folder != draft.folder:
        made["patch"] = draft.take_patch(patch_path(given["patch"], folder))
    parameters = parameters_of(made["patch"], draft.folder)
    if folder != draft.folder:
        made["settings"] |= settings_kept(settings, parameters, folder)
    made["scaled_by"] = made.get("scaled_by") or usually_scaled(parameters)
    if not made.get("measured_m_s2"):
        if made.get("level_m_s2"):
            raise BadValue(
                f"measured_m_s2 of {name} is missing; allowed: the peak that its level is set from, as --levels "
                "measures it where level_m_s2 is empty"
            )
        made["scaled_by"] = ""  # the patch plays unscaled
    return made


def _fact(cell: str) -> int | float | str:
    value = value_of(cell)
    return cell if isinstance(value, bool) else value
