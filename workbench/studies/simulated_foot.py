"""A simulated foot that keys control on the simulated floor, so that users need not step on the map."""

from underfoot.engine.commands import PressTile
from underfoot.studies.phase import Phase
from underfoot.studies.runner import Runner

_FOOT_N, _STEP_S = 600.0, 0.3


def may_step(runner: Runner) -> bool:
    """Return whether the runner waits for a step of the simulated foot: to start a presentation, to cross the tile
    again, to feel what is moved, or to press the button.
    """
    waits = runner.phase in (Phase.READY, Phase.PRESENTING) or runner.adjusting is not None
    by_foot = runner.page.trial is not None and (runner.page.start != "key" or runner.target is not None)
    return waits and by_foot and runner.session.target.kind == "simulator" and not runner.watch.is_loaded


class SimulatedFoot:
    """Steps onto the first tile or the current button, and leaves after the contact was detected for some time.

    It also stands on the first tile during presentations started by a key, because patches driven by force need a load.
    """

    def __init__(self) -> None:
        self._stepped_s: float | None = None
        self._tile = ""
        self._stands = False

    def step(self, runner: Runner) -> None:
        """Step onto the tile."""
        floor, button = runner.session.target.floor, runner.target
        tile = (floor.tile_at((button.x_m, button.y_m)) if button is not None else None) or floor.tiles[0]
        x_m, y_m = tile.to_tile((button.x_m, button.y_m)) if button is not None else (0.0, 0.0)
        self._press(runner, tile.id, float(x_m), float(y_m))

    def tick(self, runner: Runner) -> None:
        """Step onto the tile if the trial needs a standing foot, and leave it when that is due."""
        stands = _is_to_stand(runner, self._stands)
        if stands and (not self._stands or not runner.watch.contacts):
            self._press(runner, runner.session.target.floor.tiles[0].id, 0.0, 0.0)
        elif not stands and (self._stands or self._was_seen(runner)):
            self.leave(runner)
        self._stands = stands

    def leave(self, runner: Runner) -> None:
        """Leave the tile, if the foot is on it."""
        if self._stepped_s is not None:
            self._stepped_s = None
            runner.session.send(PressTile(self._tile, 0.0, 0.0, 0.0))

    def _was_seen(self, runner: Runner) -> bool:
        """Return whether the contact was detected for some time; on a slow machine it could fall between samples."""
        if self._stepped_s is None or not runner.watch.is_loaded:
            return False
        return runner.watch.now_s - self._stepped_s >= _STEP_S

    def _press(self, runner: Runner, tile: str, x_m: float, y_m: float) -> None:
        self._stepped_s, self._tile = runner.watch.now_s, tile
        runner.session.send(PressTile(tile, x_m, y_m, _FOOT_N))


def _is_to_stand(runner: Runner, stands: bool) -> bool:
    """Return whether the foot should stand on the floor; `stands` is its current state."""
    page, phase = runner.page, runner.phase
    if runner.session.target.kind != "simulator" or runner.foot is not None:
        return False
    if page.trial is None:
        return phase is Phase.PAGE and page.kind in ("learn", "level")
    if page.start != "key" or not page.trial.intervals:
        return False
    if phase is Phase.WAITING:  # a hint asks the participant to step off while the plate moves
        return stands and not runner.hint
    return phase in (Phase.READY, Phase.PRESENTING, Phase.ANSWERING)
