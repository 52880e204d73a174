"""On the simulated floor a key can do what a foot would, so that nobody looks for the map first."""

from underfoot.engine.commands import PressTile
from underfoot.studies.phase import Phase
from underfoot.studies.runner import Runner

_FOOT_N, _STEP_S = 600.0, 0.3


def may_step(runner: Runner) -> bool:
    """Whether a step of the simulated foot is waited for: to begin a presentation, or to cross once more."""
    waits = runner.phase in (Phase.READY, Phase.PRESENTING) and runner.target is None
    by_foot = runner.page.trial is not None and runner.page.start != "key"
    return waits and by_foot and runner.session.target.kind == "simulator" and not runner.watch.is_loaded


class SimulatedFoot:
    """Steps onto the first tile, and off it again once that was seen and has lasted a while."""

    def __init__(self) -> None:
        self._stepped_s: float | None = None

    def step(self, runner: Runner) -> None:
        """Step onto the tile."""
        self._stepped_s = runner.watch.now_s
        self._press(runner, _FOOT_N)

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
            self._press(runner, 0.0)

    @staticmethod
    def _press(runner: Runner, force_n: float) -> None:
        session = runner.session
        session.send(PressTile(session.target.floor.tiles[0].id, 0.0, 0.0, force_n))
