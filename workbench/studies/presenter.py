"""Presentation of stimuli through a running session: switching of patches, and the played signal, frame by frame."""

from collections import deque
from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from underfoot.engine.commands import Level, Strike, Swap
from underfoot.engine.reports import CommandApplied, OutputChanged, PatchRefused, Report, Started
from underfoot.engine.rings import Reader
from underfoot.engine.session import Session
from underfoot.floor.profile import NOMINAL_ACCELERATION, profiles_of
from underfoot.patch.patch import Patch

IDLE = Patch(title="between stimuli")
AUDIBLE = 1e-5
"""Threshold of vibration, as a share of full scale. A fade of 480 frames begins below it."""
PRESENTED_S, WAITED_S = 60.0, 10.0
"""Length of the played signal that is kept during a presentation, and otherwise; one second of 36 tiles takes 14 MB."""
SETTLED_S = 0.3
"""Time before a presentation in which nothing is heard, so that its excerpt contains nothing of the previous one, and
in which what follows the force settles under the feet that stand there."""


class Presenter:
    """Puts patches into a session in succession, and tracks the frame from which each plays.

    `take` receives the session's reports, and `read` reads the played signal; neither blocks.
    """

    def __init__(self, session: Session, *, is_felt: bool = True) -> None:
        """Present through a session; `is_felt` says whether anything will be: only then does a silent card matter."""
        self.session, self._is_felt = session, is_felt
        tiles, rate = len(session.target.floor.tiles), session.target.rate
        self._played = _Kept(Reader(session.memory.vibration), tiles, rate)
        self._measured = _Kept(Reader(session.memory.measured), tiles, rate)
        profiles = profiles_of(session.target.profiles, session.target.floor)
        self.full_scale = np.array(
            [
                profiles[tile.id].acceleration_per_unit if tile.id in profiles else NOMINAL_ACCELERATION
                for tile in session.target.floor.tiles
            ]
        )
        """The acceleration at full scale of each tile, m/s^2."""
        self._requested = session.patch, session.scopes
        self._awaited = [session.patch.dumps()]  # patches with whose swap the requested one plays
        self.since_frame: int | None = 0
        """The frame from which the wanted patch plays; None until it does."""
        self.problem = ""
        """Why a patch is not played; "" where all is well."""

    @property
    def _silence(self) -> str:
        """Why nothing would be felt; "" where all cards play, or nothing is to be."""
        return self.session.silence if self._is_felt else ""

    def begin(self) -> None:
        """Set the session's level to 0 dB and start playback, so that stimuli play at their own levels."""
        self.session.send(Level(0.0))
        self.session.play()

    def request(self, patch: Patch, scopes: tuple[str, ...] = (), *, anew: bool = False) -> None:
        """Request that this patch plays as soon as possible; `scopes` and `anew` as in `Swap`."""
        self.problem = self._silence
        if (patch, scopes) == self._requested:
            return
        if anew or scopes != self.session.scopes or self.session.moved_numbers(patch) is None:  # is swapped
            self.since_frame, self._awaited = None, []
        elif self.since_frame is not None:  # otherwise its program is being swapped in, with this or the former number
            self.since_frame, self._awaited = self.session.health.frame, []
        self._requested = patch, scopes
        self._awaited.append(patch.dumps())
        self.session.edit(patch, scopes, anew=anew)

    def has_settled(self) -> bool:
        """Return whether the requested patch has been playing for `SETTLED_S`."""
        since, rate = self.since_frame, self.session.target.rate
        return since is not None and self.session.health.frame - since >= SETTLED_S * rate

    def strike(self, tile: str) -> None:
        """Send an event by hand to one tile, for nodes that wait for one."""
        self.session.send(Strike("", tile))

    def take(self, reports: Iterable[Report]) -> None:
        """Process the session's reports."""
        for report in reports:
            match report:
                case CommandApplied(frame, Swap(patch)) if patch in self._awaited:
                    self.since_frame = frame
                case Started():
                    self.problem = self._silence
                    if self.since_frame is None:  # what was requested while no engine ran is not swapped in
                        requested, scopes = self._requested
                        self.session.edit(requested, scopes, anew=True)
                case OutputChanged():
                    self.problem = self._silence
                case PatchRefused(said):
                    self.problem = said

    def read(self, keep_s: float = PRESENTED_S) -> None:
        """Read the signals played and measured since the last call, and keep the last `keep_s` seconds."""
        self._played.read(keep_s)
        self._measured.read(keep_s)

    @property
    def end_frame(self) -> int:
        """The frame after the last one read."""
        return self._played.end_frame

    @property
    def measured_until(self) -> int:
        """The frame after the last accelerometer sample; 0 without accelerometers."""
        return self._measured.end_frame

    def played(self, first: int, end: int) -> tuple[int, NDArray[np.float64]]:
        """Return the number of the first frame, and the signal played from `first` to `end` (exclusive), m/s^2 [frame,
        tile].
        """
        begin, frames = self._played.between(first, end)
        return begin, frames * self.full_scale

    def measured(self, first: int, end: int) -> tuple[int, NDArray[np.float64]]:
        """Return the same of the accelerometers, m/s^2 [frame, tile]; no frames without accelerometers."""
        return self._measured.between(first, end)

    def onset_frame(self, first: int, end: int) -> int | None:
        """Return the first frame from `first` to `end` (exclusive) with vibration; None if there is none."""
        begin, played = self.played(first, end)
        loud = np.flatnonzero((np.abs(played) > AUDIBLE * self.full_scale).any(axis=1))
        return begin + int(loud[0]) if len(loud) else None


class _Kept:
    """The latest frames of a ring."""

    def __init__(self, reader: Reader, tiles: int, rate: int) -> None:
        self._reader, self._tiles, self._rate = reader, tiles, rate
        self._parts: deque[tuple[int, NDArray[np.float32]]] = deque()

    @property
    def end_frame(self) -> int:
        return self._parts[-1][0] + len(self._parts[-1][1]) if self._parts else 0

    def read(self, keep_s: float) -> None:
        first, frames = self._reader.read()
        if not len(frames):
            return
        self._parts.append((first, frames.copy()))
        oldest = first + len(frames) - round(keep_s * self._rate)
        while self._parts and self._parts[0][0] + len(self._parts[0][1]) < oldest:
            self._parts.popleft()

    def between(self, first: int, end: int) -> tuple[int, NDArray[np.float64]]:
        """Return the number of the first available frame, and the frames from `first` to `end` (exclusive), [frame,
        tile].
        """
        parts: list[NDArray[np.float32]] = []
        begin = first
        for at, frames in self._parts:
            inside = frames[max(first - at, 0) : max(end - at, 0)]
            if len(inside):
                begin = begin if parts else max(at, first)
                parts.append(inside)
        if not parts:
            return first, np.zeros((0, self._tiles))
        return begin, np.concatenate(parts).astype(np.float64)
