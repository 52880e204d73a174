"""The network connection of the window's session: sends its reports, and executes incoming requests."""

import math
import time
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from PySide6.QtCore import QObject, Signal

from underfoot.engine.reports import Health, Report
from underfoot.errors import UnderfootError
from underfoot.floor.footsteps import Step
from underfoot.network.plan import NetworkPlan
from underfoot.widgets.session.controller import SessionController, unchanged
from underfoot.widgets.session.footstep_tracker import ForceUpdate
from underfoot.widgets.session.settings import DEFAULT_ADDRESSES, Settings

if TYPE_CHECKING:
    from underfoot.engine.session import Session
    from underfoot.network.cue_player import CuePlayer
    from underfoot.network.server import Counts, NetworkServer

_HEALTH_DIVISOR = 5  # one of this many reports, which come at 10 Hz
AGAIN_S = 5.0
"""Time after which what could not be served as the session began is tried again: a port that another program has, or an
address that is not there yet."""
QUIET_S = 10.0
"""Time without a refused message after which the next one is said: a sender of wrong ones sends many."""
LENT_MESSAGE = "a study or a scene has the floor, which takes only marks and panic meanwhile"
HEARD_MESSAGE = "a preset or a recording is heard in place of the patch; only marks and panic are taken meanwhile"


class NetworkLink(QObject):
    """Serves the window's session by the settings, which `apply` changes. Another thread handles the sockets."""

    values_set = Signal(object)
    """What other programs have set, by node and parameter, whenever that changes; once a tick, however many came."""

    def __init__(
        self, controller: SessionController, settings: Settings, panic: Callable[[], None], presets: Path
    ) -> None:
        """Create the link; `panic` silences all output of the window, `presets` is the user's own folder of presets."""
        super().__init__(controller)
        self._controller, self._settings, self._panic, self._presets = controller, settings, panic, presets
        self._server: NetworkServer | None = None
        self._player: CuePlayer | None = None
        self._counts: Counts | None = None
        self._reports: list[Report] = []
        self._health_count, self._told = 0, ""
        self._failure, self._again_s = "", 0.0
        self._refused, self._refused_s = 0, -math.inf
        self.values: Mapping[tuple[str, str], object] = {}
        """What other programs have set: it is played in place of the patch's values."""
        bridge = controller.bridge
        controller.opened.connect(self._open)
        bridge.reported.connect(self._reports.extend)
        bridge.forces_tracked.connect(self._send_forces)
        bridge.steps_found.connect(self._send_steps)
        bridge.health_reported.connect(self._send_health)
        bridge.ticked.connect(self._tick)

    @property
    def counts(self) -> "Counts":
        """Messages sent, received and refused since the window was opened."""
        from underfoot.network.server import Counts

        return self._server.counts if self._server is not None else self._counts or Counts()

    @property
    def problem(self) -> str:
        """Why the plan, or part of it, is not possible; "" if all is well."""
        return self._server.problem if self._server is not None else self._failure

    def apply(self, addresses: dict[str, str], on: list[str]) -> None:
        """Use and keep these addresses of `DEFAULT_ADDRESSES`; those named in `on`, and of `plan.FLAGS`, are active.

        Raises `UnderfootError` if that is not possible; then nothing has changed.
        """
        plan = NetworkPlan.chosen(addresses, on)
        self._serve(plan)
        self._failure = ""
        self._settings.network_addresses, self._settings.network_on = dict(addresses), list(on)

    def release(self, ends: Iterable[tuple[str, str]]) -> None:
        """Play the patch's own values of these parameters again, by node and name: a hand has set them."""
        if self._player is not None and self._player.release(ends):
            self._controller.play_patch()
            self._show_values()

    def close(self, *, wait: bool = True) -> None:
        """Stop serving; `wait` until all has ended."""
        if self._server is not None:
            self._server.close(wait=wait)
            self._counts, self._server = self._server.counts, None

    def _open(self) -> None:
        """Serve a newly opened session, and report which data leave this computer; if it cannot be, try again later."""
        self._failure = ""
        try:
            plan = NetworkPlan.chosen(
                {**DEFAULT_ADDRESSES, **self._settings.network_addresses}, self._settings.network_on
            )
            self._serve(plan)
        except UnderfootError as error:
            self._failure = f"nothing is sent to other programs: {error}"
            self._again_s = time.perf_counter() + AGAIN_S
            return
        for line in plan.warnings():
            self._controller.notified.emit(f"Network: {line}.")

    def _serve(self, plan: NetworkPlan) -> None:
        """Serve as planned, or as before if that is not possible."""
        session, before = self._controller.session, self._server
        self.close(wait=False)
        if session is None or not plan.is_anything:
            self._end_cues()
            return
        try:
            self._server = self._make_server(plan, session, before)
        except UnderfootError:
            self._server = self._make_server(before.plan, session, before) if before is not None else None
            raise
        finally:
            if self._server is not None:
                self._play_cues_of(self._server, session)

    def _make_server(self, plan: NetworkPlan, session: "Session", before: "NetworkServer | None") -> "NetworkServer":
        from underfoot.network.server import NetworkServer

        return NetworkServer(plan, session.target.floor, session.target.rate, session.force_rate_hz, before)

    def _play_cues_of(self, server: "NetworkServer", session: "Session") -> None:
        from underfoot.network.cue_player import CuePlayer

        if self._player is not None and self._player.session is session:
            self._player.server = server
            return
        self._reports.clear()
        self._player = CuePlayer(session, server, self._controller.patch, self._panic, self._presets)
        self._controller.transform_patch = self._player.set_base_patch

    def _end_cues(self) -> None:
        """Play the window's own patch again."""
        if self._player is not None and self._player.session is self._controller.session:
            self._controller.transform_patch = unchanged
            self._controller.play_patch()
        self._player = None
        self._show_values()

    def _show_values(self) -> None:
        values = self._player.cued.values if self._player is not None else {}
        if values != self.values:
            self.values = values
            self.values_set.emit(values)

    def _tick(self) -> None:
        if self._server is not None and self._player is not None:
            heard = HEARD_MESSAGE if self._controller.plays_other else ""
            self._player.tick(self._reports, LENT_MESSAGE if self._controller.is_lent else heard)
            self._show_values()
            self._tell_refusal(self._server.counts)
        self._reports.clear()
        if self._failure and time.perf_counter() > self._again_s:
            self._open()
        if self._told != self.problem:
            self._told = self.problem
            if self._server is not None or self._failure:
                self._controller.notified.emit(f"Network: {self._told or 'all is sent and taken again'}.")

    def _tell_refusal(self, counts: "Counts") -> None:
        """Say why a message was refused, once: those that follow it are in the dialog."""
        if counts.refused > self._refused:
            now_s = time.perf_counter()
            if now_s - self._refused_s > QUIET_S:
                self._controller.notified.emit(f"Network: a message was refused: {counts.reason}.")
            self._refused_s = now_s
        self._refused = counts.refused

    def _send_forces(self, update: ForceUpdate) -> None:
        session = self._controller.session
        if self._server is not None and session is not None:
            last_s = float(update.time_s[-1])
            ago_s = self._controller.played_s - last_s
            self._server.show(last_s, ago_s, update.contacts)
            self._server.send_force(last_s, ago_s, update.force_n.sum(axis=2))

    def _send_steps(self, steps: list[Step]) -> None:
        if self._server is not None:
            for step in steps:
                self._server.send_step(step, self._controller.played_s - step.start_s)

    def _send_health(self, health: Health) -> None:
        self._health_count += 1
        session = self._controller.session
        if self._server is not None and session is not None and self._health_count % _HEALTH_DIVISOR == 0:
            self._server.send_health(health, session.why_silent)
