"""On the simulated floor a key can do what a foot would, so that nobody looks for the map first."""

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
    """Steps onto the first tile, or the button that is shown, and off again once that was seen for a while."""

    def __init__(self) -> None:
        self._stepped_s: float | None = None
        self._tile = ""

    def step(self, runner: Runner) -> None:
        """Step onto the tile."""
        floor, button = runner.session.target.floor, runner.target
        tile = (tile_under(button.x_m, button.y_m, floor) if button is not None else None) or floor.tiles[0]
        x_m, y_m = tile.to_tile((button.x_m, button.y_m)) if button is not None else (0.0, 0.0)
        self._stepped_s, self._tile = runner.watch.now_s, tile.id
        runner.session.send(PressTile(tile.id, float(x_m), float(y_m), _FOOT_N))

    def tick(self, runner: Runner) -> None:
        """Leave the tile when it is time: on a slow machine both could fall between two samples."""
        if self._stepped_s is None or not runner.watch.is_loaded:
            return
        if runner.watch.now_s - self._stepped_s >= _STEP_S:
            self.leave(runner)

    def leave(self, runner: Runner) -> None:
        """Leave the tile, if it was stepped on."""
        if self._stepped_s is not None:
            self._stepped_s = None
            runner.session.send(PressTile(self._tile, 0.0, 0.0, 0.0))
