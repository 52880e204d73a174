"""Previews of the open patch: requests to the session's compiler, and the answer to the newest request of each kind."""

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

from PySide6.QtCore import QObject, Signal

from underfoot.engine.reports import Distributions, ErrorCurveDrawn, Outlines, Preview
from underfoot.floor.layout import Tile
from underfoot.patch.effective import without_missing
from underfoot.patch.node import Registry
from underfoot.patch.patch import Patch
from underfoot.widgets.session.bridge import Bridge

if TYPE_CHECKING:
    from underfoot.engine.session import Session


class Previews(QObject):
    """Requests previews from the present session, if there is one; answers to earlier requests are dropped."""

    preview_computed = Signal(object, str)
    """The last `Preview` requested, and its node."""
    distributions_computed = Signal(object)
    """`Distributions` of the node whose distributions were requested last."""
    outlines_computed = Signal(object)
    """The last `Outlines` requested."""
    errors_measured = Signal(object)
    """`ErrorCurveDrawn` of the last node requested, again after each point."""

    def __init__(
        self, bridge: Bridge, session: Callable[[], "Session | None"], registry: Registry, parent: QObject
    ) -> None:
        super().__init__(parent)
        self._session, self._registry = session, registry
        self._preview_ticket, self._preview_node = 0, ""
        self._distributions_ticket = self._errors_ticket = self._outlines_ticket = 0
        bridge.reported.connect(self._emit_answers)

    def request_preview(
        self, patch: Patch, node: str, tile: Tile, seconds: float = 0.0, *, distributions: bool = False, name: str = ""
    ) -> None:
        """Request the response of a patch's node to one step on a tile: `preview_computed` delivers it.

        `seconds` as in `Session.preview`. With `distributions`, `distributions_computed` delivers them after it.
        `preview_computed` uses `name`, by default the node's id.
        """
        session = self._session()
        if session is not None:
            known = without_missing(patch, self._registry)
            self._preview_ticket = session.preview(known, node, seconds, tile, distributions=distributions)
            self._preview_node = name or node
            self._distributions_ticket = self._preview_ticket if distributions else self._distributions_ticket

    def request_outlines(self, patch: Patch, nodes: Sequence[str], tile: Tile, seconds: float) -> None:
        """Request thumbnails of nodes' responses to one step on a tile: `outlines_computed` delivers them."""
        session = self._session()
        if session is not None:
            self._outlines_ticket = session.outline(without_missing(patch, self._registry), nodes, seconds, tile)

    def measure_errors(self, patch: Patch, node: str) -> None:
        """Measure a node's run time over error until the next request: `errors_measured` delivers the curve."""
        session = self._session()
        if session is not None:
            self._errors_ticket = session.measure_errors(without_missing(patch, self._registry), node)

    def _emit_answers(self, reports: list[object]) -> None:
        for report in reports:
            match report:
                case Preview(ticket) if ticket == self._preview_ticket:
                    self.preview_computed.emit(report, self._preview_node)
                case Distributions(ticket) if ticket == self._distributions_ticket:
                    self.distributions_computed.emit(report)
                case Outlines(ticket) if ticket == self._outlines_ticket:
                    self.outlines_computed.emit(report)
                case ErrorCurveDrawn(ticket) if ticket == self._errors_ticket:
                    self.errors_measured.emit(report)
