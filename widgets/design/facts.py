"""What the inspector says of nodes below their parameters: how many there are, and what they cost."""

from collections.abc import Mapping, Sequence

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QGridLayout, QWidget

from underfoot.engine.reports import Costs
from underfoot.quantities import counted
from underfoot.widgets import theme
from underfoot.widgets.design.scene import percent

UNKNOWN = "–"


class Facts(QWidget):
    """Names, each with a text that can be marked and copied."""

    def __init__(self, *names: str) -> None:
        super().__init__()
        grid = QGridLayout(self)
        grid.setVerticalSpacing(8)
        grid.setContentsMargins(0, 0, theme.GRID, 0)  # as far from the edge as numbers in fields
        grid.setColumnStretch(1, 1)
        self._values = {name: theme.label("") for name in names}
        for row, (name, value) in enumerate(self._values.items()):
            grid.addWidget(theme.label(name, "muted"), row, 0)
            value.setAlignment(Qt.AlignmentFlag.AlignRight)
            value.setWordWrap(True)
            value.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
            value.setFocusPolicy(Qt.FocusPolicy.NoFocus)
            grid.addWidget(value, row, 1)

    def show_facts(self, facts: Mapping[str, str]) -> None:
        """Show the texts of the names that are here; `facts` may have others."""
        for name, value in self._values.items():
            value.setText(facts[name])


def cost_text(costs: Costs | None, ids: Sequence[str]) -> str:
    """Return the share of a block that these nodes take, or why they take none.

    >>> costs = Costs({"a": 0.1, "b": 0.023}, {"a": 2}, ("c",))
    >>> cost_text(costs, ["a", "b", "c"]), cost_text(costs, ["c"]), cost_text(None, ["a"])
    ('12 % of a block', 'none: reaches no output that plays', '–')
    """
    if costs is None or not ids:
        return UNKNOWN
    known = [costs.share[id] for id in ids if id in costs.share]
    if known:
        return f"{percent(sum(known))} of a block"
    return "none: reaches no output that plays" if all(id in costs.left_out for id in ids) else UNKNOWN


def awake_text(costs: Costs | None, id: str, tiles: int) -> str:
    """Return on how many tiles a node is awake; `tiles` is the number of all, 0 if that is not known.

    >>> costs = Costs({"a": 0.1, "b": 0.023}, {"a": 2})
    >>> [awake_text(costs, id, 4) for id in "abc"], awake_text(costs, "a", 0)
    (['2 of 4 tiles', 'asleep', '–'], '2 tiles')
    """
    if costs is None or id not in costs.share:
        return UNKNOWN
    awake = costs.awake.get(id, 0)
    of = f"{awake} of " if tiles else ""
    return of + counted(tiles or awake, "tile") if awake else "asleep"
