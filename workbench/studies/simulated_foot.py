"""On the simulated floor a key does what a foot would, so that nobody looks for the map first."""

from underfoot.engine.commands import PressTile
from underfoot.studies.phase import Phase
from underfoot.studies.runner import Runner
from underfoot.studies.target import tile_under

_FOOT_N, _STEP_S = 600.0, 0.3


def may_step(runner: Runner) -> bool:
    """Whether a step of the simulated foot is waited for: to begin a presentation, to cross once more, or to press the
    button that is shown."""
    waits = runner.phase in (Phase.READY, Phase.PRESENTING)
    by_foot = runner.page.trial is not None and (runner.page.start != "key" or runner.target is not None)
    return waits and by_foot and runner.session.target.kind == "simulator" and not runner.watch.is_loaded


class SimulatedFoot:
    """Steps onto the first tile, or the button that is shown, and off again once that was seen for a while.

    It stands on the first tile while keys begin what is felt: a patch that follows the force is silent under nobody.
    """

    def __init__(self) -> None:
        self._stepped_s: float | None = None
        self._tile = ""
        self._stands = False

    def step(self, runner: Runner) -> None:
        """Step onto the tile."""
        floor, button = runner.session.target.floor, runner.target
        tile = (tile_under(button.x_m, button.y_m, floor) if button is not None else None) or floor.tiles[0]
        x_m, y_m = tile.to_tile((button.x_m, button.y_m)) if button is not None else (0.0, 0.0)
        self._press(runner, tile.id, float(x_m), float(y_m))

    def tick(self, runner: Runner) -> None:
        """Stand where somebody should, and leave the tile when it is time."""
        stands = _is_to_stand(runner, self._stands)
        if stands and (not self._stands or not runner.watch.contacts):
            self._press(runner, runner.session.target.floor.tiles[0].id, 0.0, 0.0)
        elif not stands and (self._stands or self._was_seen(runner)):
            self.leave(runner)
        self._stands = stands

    def leave(self, runner: Runner) -> None:
        """Leave the tile, if it was stepped on."""
        if self._stepped_s is not None:
            self._stepped_s = None
            runner.session.send(PressTile(self._tile, 0.0, 0.0, 0.0))

    def _was_seen(self, runner: Runner) -> bool:
        """Whether the step was on the floor for a while: on a slow machine it could begin and end between samples."""
        if self._stepped_s is None or not runner.watch.is_loaded:
            return False
        return runner.watch.now_s - self._stepped_s >= _STEP_S

    def _press(self, runner: Runner, tile: str, x_m: float, y_m: float) -> None:
        self._stepped_s, self._tile = runner.watch.now_s, tile
        runner.session.send(PressTile(tile, x_m, y_m, _FOOT_N))


def _is_to_stand(runner: Runner, stands: bool) -> bool:
    """Whether somebody should stand on the simulated floor, who `stands` there or not."""
    page, phase = runner.page, runner.phase
    if runner.session.target.kind != "simulator" or runner.foot is not None:
        return False
    if page.trial is None:
        return phase is Phase.PAGE and page.kind in ("learn", "level")
    if page.start != "key" or not page.trial.intervals:
        return False
    if phase is Phase.WAITING:  # a hint asks to step off, for a plate that moves
        return stands and not runner.hint
    return phase in (Phase.READY, Phase.PRESENTING, Phase.ANSWERING)
