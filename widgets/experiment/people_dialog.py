"""The dialog for simulated participants: their number, seed and true parameters."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from PySide6.QtWidgets import QDialogButtonBox, QWidget

from underfoot.errors import BadValue
from underfoot.experiments.observers import truths_of
from underfoot.experiments.protocol import Protocol
from underfoot.experiments.simulation import SimulationSettings
from underfoot.parameters import Count, Parameter, declared_in
from underfoot.quantities import counted
from underfoot.widgets import theme
from underfoot.widgets.controls.dialog import Dialog
from underfoot.widgets.experiment.field_rows import FieldRows


class _General:
    """The settings common to all studies."""

    people = Count(100, 1, 10_000, doc="How many people take part.")
    seed = Count(1, 0, 2**31, doc="The same seed: the same people.")


_GENERAL = declared_in(_General)


@dataclass(frozen=True)
class SimulatedPeople:
    """A number of simulated participants, and the settings of the simulation."""

    count: int = 100
    settings: SimulationSettings = field(default_factory=SimulationSettings)


class PeopleDialog(Dialog):
    """Edits the simulated participants of a protocol; Use passes them to `use`."""

    def __init__(
        self,
        use: Callable[[SimulatedPeople], object],
        protocol: Protocol,
        people: SimulatedPeople,
        parent: QWidget | None,
    ) -> None:
        super().__init__("Simulated people", parent)
        self._use = use
        given = dict(people.settings.truth)
        truths = truths_of(protocol, given)
        self._truths: dict[str, Parameter] = {name: one for name, (one, _) in truths.items()}
        self._values: dict[str, Any] = {"people": people.count, "seed": people.settings.seed}
        self._values |= {name: value for name, (_, value) in truths.items()}
        self.rows = FieldRows({**_GENERAL, **self._truths}, self._values)
        self.note = theme.paragraph("", "alarm")
        self.buttons = self.button_row(QDialogButtonBox.StandardButton.Cancel)
        self.defaults_button = self.buttons.addButton("Defaults", QDialogButtonBox.ButtonRole.ResetRole)
        self.use_button = self.buttons.addButton("Use", QDialogButtonBox.ButtonRole.AcceptRole)
        self.use_button.setDefault(True)
        column = self.column()
        inside = self.scrolled(column)
        words = theme.paragraph("What is true of everybody who is simulated; estimates are held against it.", "muted")
        for part in (words, self.rows):
            inside.addWidget(part)
        inside.addStretch(1)
        column.addWidget(self.note)
        column.addWidget(self.buttons)
        self.resize(100 * theme.GRID, 48 * theme.GRID)
        self.defaults_button.clicked.connect(self._show_defaults)

    def accept(self) -> None:
        try:
            found = {name: one.check(self._values[name]) for name, one in {**_GENERAL, **self._truths}.items()}
        except BadValue as error:
            self.note.setText(str(error))
            return
        changed = {name: found[name] for name, one in self._truths.items() if found[name] != one.default}
        self._use(SimulatedPeople(found["people"], SimulationSettings(found["seed"], truth=tuple(changed.items()))))
        super().accept()

    def _show_defaults(self) -> None:
        self._use(SimulatedPeople())
        super().accept()


def people_text(people: SimulatedPeople) -> str:
    """Return the text of the button that simulates these people.

    >>> people_text(SimulatedPeople(40, SimulationSettings(truth=(("lapses", 0.1),))))
    'Simulate 40 people, with your settings'
    """
    own = ", with your settings" if people.settings.truth else ""
    return f"Simulate {counted(people.count, 'person', 'people')}{own}"
