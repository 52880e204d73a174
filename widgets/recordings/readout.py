"""The values at the cursor: as text in N, m/s², Hz and dB, and on the floor."""

import math
from contextlib import suppress
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QObject

from underfoot.errors import UnderfootError
from underfoot.floor.contacts import OngoingContact
from underfoot.floor.layout import Floor
from underfoot.floor.profile_parts import PARTS, lines_of
from underfoot.quantities import counted, fixed, quantity
from underfoot.records.jumps import jumps_in
from underfoot.records.recording import Recording
from underfoot.records.survey import Survey
from underfoot.records.sway import sway_of
from underfoot.widgets import theme
from underfoot.widgets.background import BackgroundWorker
from underfoot.widgets.controls.elided_label import ElidedLabel
from underfoot.widgets.floor_map import FloorMap
from underfoot.widgets.recordings.reader import CursorValues, OpenedRecording, RecordingReader, Vibration
from underfoot.widgets.recordings.timeline import Axis
from underfoot.widgets.recordings.tracks import RecordingContent, time_text


class CursorReadout(QObject):
    """Shows the values at the cursor of `axis` in `text` and on `map`, on which a tile is selected."""

    def __init__(self, axis: Axis, reader: RecordingReader, parent: QObject) -> None:
        super().__init__(parent)
        self._axis, self._reader = axis, reader
        self._values, self._found = "", ""
        self._looks = BackgroundWorker(self)
        self._looks.found.connect(lambda found: self._show_found(*found))
        self.text = ElidedLabel("small")
        self.text.setFixedHeight(4 * theme.GRID)
        self.text.setContentsMargins(2 * theme.GRID, 0, 0, 0)
        self.map = FloorMap()
        axis.cursor_moved.connect(self._request)
        axis.selected.connect(self.describe_selection)
        axis.tile_chosen.connect(self.choose_tile)
        self.map.tile_chosen.connect(self._choose_on_map)
        reader.cursor_values_read.connect(self._show)

    def clear(self) -> None:
        """Show no values, and no floor."""
        self._values = ""
        self._describe()
        self.map.clear()

    def close_down(self) -> None:
        """Wait for what is being computed."""
        self._looks.join()

    def describe_selection(self) -> None:
        """Compute the sway in the selected stretch, if somebody stands there, or the jumps, and show the rest
        meanwhile."""
        self._found = ""
        self._describe()
        if (asked := self._of_stretch()) is not None:
            self._looks.compute(lambda _: [asked, _stretch_text(*asked)])

    def choose_tile(self, row: int) -> None:
        """Show the vibration of a tile, by its row of the floor."""
        content = self._axis.content
        if content is None:
            return
        self._axis.choose_tile(row)
        tile = content.opened.floor.tiles[row].id
        if self.map.chosen_tile() != tile:
            self.map.choose_tile(tile)
        self._request(self._axis.cursor_s)

    def _choose_on_map(self, tile: str) -> None:
        content = self._axis.content
        if content is not None and tile in content.opened.floor.ids:
            self.choose_tile(content.opened.floor.index(tile))

    def _request(self, time_s: float) -> None:
        if self._axis.content is not None:
            opened = self._axis.content.opened
            self._reader.request_cursor_values(opened.first + time_s * opened.rate, self._axis.view.tile)

    def _show(self, values: CursorValues) -> None:
        content = self._axis.content
        if content is None:
            return
        opened, overview = content.opened, content.overview
        time_s = (values.frame - opened.first) / opened.rate
        baseline_n = overview.baseline_n if overview is not None else np.zeros(len(opened.floor.tiles) + 1)
        self._values = readout_text(opened.floor, values, baseline_n, time_s)
        self._describe()
        loads, contacts = np.zeros(len(opened.floor.tiles)), list[OngoingContact]()
        if values.corners_n is not None:
            loads = np.nan_to_num(values.corners_n.sum(axis=1) - baseline_n[:-1])
            contacts = contacts_at(content, time_s)
        self.map.set_loads(loads, np.zeros(len(loads), bool))
        self.map.set_contacts(contacts, time_s)
        self.map.update()

    def _of_stretch(self) -> tuple[Path, Survey, tuple[float, float]] | None:
        """Return what sway and jumps are told of: the recording, what is known of its loads, the selected stretch."""
        content, stretch = self._axis.content, self._axis.selection
        if content is None or stretch is None:
            return None
        return content.opened.path, Survey([*content.contacts], balance=content.balance), stretch

    def _show_found(self, asked: tuple[Path, Survey, tuple[float, float]], text: str) -> None:
        if asked != self._of_stretch():
            self.describe_selection()  # another one was selected meanwhile, or more is known
            return
        self._found = text
        self._describe()

    def _describe(self) -> None:
        """Show the selected stretch and the values at the cursor; a screen reader says them with the time axis."""
        parts = [self._values]
        if (stretch := self._axis.selection) is not None:
            begin, end, length = (time_text(time_s) for time_s in (*stretch, stretch[1] - stretch[0]))
            parts[:0] = [f"{begin} to {end} selected, {length}", self._found]
        self.text.set_full_text("  ·  ".join(filter(None, parts)))
        self._axis.setAccessibleDescription(self.text.full_text)


def facts_of(opened: OpenedRecording) -> tuple[str, str]:
    """Return a recording's length, notes of its steps, tiles, target and calibrations when it was begun, and details of
    calibrations and body weights. Its end is cut off where there is no room."""
    used = dict.fromkeys(PARTS.get(kind, kind) for parts in opened.calibrations.values() for kind in parts)
    weights, left_out = opened.notes.body_weights, len(opened.notes.left_out)
    facts = (
        time_text(opened.length_s, 0.1),
        *(f"{f'person {one.person} ' if one.person else ''}weighs {fixed(one.weight_n)} N" for one in weights),
        f"{counted(left_out, 'step')} left out" if left_out else "",
        counted(len(opened.floor.tiles), "tile"),
        opened.about.get("target", ""),
        f"{', '.join(used)} calibrated" if used else "",
    )
    details = [f"Body weight {one.weight_n:.1f} N: {one.source}" for one in weights]
    return "  ·  ".join(filter(None, facts)), "\n".join([*details, *lines_of(opened.calibrations)])


def _stretch_text(path: Path, surveyed: Survey, stretch: tuple[float, float]) -> str:
    """Return the sway in a stretch as text, or else its jumps, of several the highest; "" where there is neither."""
    with suppress(UnderfootError):
        return str(sway_of(surveyed.balance, *stretch))
    with suppress(UnderfootError), Recording(path) as recording:
        if found := jumps_in(recording, surveyed, *stretch):
            highest = str(max(found, key=lambda one: one.flight_height_mm))
            return highest if len(found) == 1 else f"{counted(len(found), 'jump')}, the highest: {highest}"
    return ""


def readout_text(floor: Floor, values: CursorValues, baseline_n: NDArray[np.floating], time_s: float) -> str:
    """Return one line: time, force of all tiles and of the selected one, its commanded and measured vibration.

    >>> from underfoot.floor.layout import default_floor
    >>> corners = np.array([[400.0, 700.0, 200.0, 100.0], [0.0, 0.0, 0.0, 0.0]])
    >>> values = CursorValues(0.0, 0, corners, {"commanded": Vibration(0.5, -9.03, 200.0)})
    >>> readout_text(default_floor(1, 2), values, np.zeros(3), 1.5)
    '1.500 s  ·  all tiles 1\\u202f400 N  ·  tile t1 1\\u202f400 N  ·  commanded 0.5 m/s² at 200 Hz, −9.0 dB'
    >>> corners[0] = np.nan
    >>> readout_text(default_floor(1, 2), CursorValues(0.0, 0, corners), np.zeros(3), 1.5)
    '1.500 s  ·  all tiles 0 N  ·  tile t1 lost this sample'
    """
    parts = [time_text(time_s)]
    if values.corners_n is None:
        parts.append("no force sample here")
    else:
        loads = values.corners_n.sum(axis=1) - baseline_n[:-1]
        parts.append(f"all tiles {fixed(float(np.nansum(loads)))} N")
        is_lost = bool(np.isnan(values.corners_n[values.tile]).any())
        load = "lost this sample" if is_lost else f"{fixed(float(np.nan_to_num(loads[values.tile])))} N"
        parts.append(f"tile {floor.tiles[values.tile].id} {load}")
    parts += [f"{source} {vibration_text(one)}" for source, one in values.vibration.items()]
    return "  ·  ".join(parts)


def contacts_at(content: RecordingContent, time_s: float) -> list[OngoingContact]:
    """Return the contacts at `time_s` of the recording, each with its centroid and person."""
    begun, over = (content.spans_s[:, column] for column in (0, 1))
    found = []
    for place in np.flatnonzero((begun <= time_s) & (time_s <= over)).tolist():
        contact = content.contacts[place]
        number = content.number_of.get(contact.id)
        person = content.steps[number].step.person if number is not None else 0
        if contact.places:
            found.append(OngoingContact(contact.id, *contact.at(time_s), contact.tiles, contact.start_s, person))
    return found


def vibration_text(one: Vibration) -> str:
    """Return peak acceleration, strongest frequency, and level in dB re 1 m/s² as text.

    >>> vibration_text(Vibration(0.0, -math.inf, math.nan))
    'still'
    """
    if not math.isfinite(one.level_db):
        return "still"
    return f"{quantity(one.peak_m_s2, 'm/s^2')} at {fixed(one.frequency_hz)} Hz, {fixed(one.level_db, 1)} dB"
