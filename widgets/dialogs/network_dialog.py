"""The network dialog: which data are sent to other programs and where, and whether these may send cues."""

from collections.abc import Callable
from importlib.util import find_spec

from PySide6.QtCore import QTimer
from PySide6.QtWidgets import QCheckBox, QDialogButtonBox, QGridLayout, QLineEdit, QWidget

from underfoot.errors import UnderfootError
from underfoot.network.plan import FLAGS, NetworkPlan
from underfoot.network.server import Counts
from underfoot.quantities import number
from underfoot.widgets import theme
from underfoot.widgets.controls.dialog import Dialog

_POLL_MS = 250
_DIGITS = 9
_NO_LSL = 'Needs the package pylsl: pip install "underfoot[lsl]".'
ROWS = (
    ("tuio", "TUIO &1.1 to", "Contacts as cursors, 60 times a second, for tables, screens and game engines."),
    ("tuio2", "TUIO &2.0 to", "The same as pointers, with force as pressure: 1 is 1000 N."),
    ("send", "&Messages to", "OSC: contacts in metres and newtons, steps, health, marks."),
    ("listen", "C&ues at", "OSC: other programs play presets on tiles, set values, mark, silence."),
    ("serial_marks", "Marks &from", "A serial line: each line of text, or single byte of a trigger, is a mark."),
)
HINTS = {"serial_marks": "A serial port, as /dev/ttyUSB0 or COM3; 115,200 baud"}
HINT = "HOST:PORT; HOST is an IPv4 address or localhost"
STREAMS = (
    (
        "lsl",
        "&LSL streams",
        "Lab Streaming Layer: force, contacts, steps, marks. Everybody on the network finds them.",
    ),
    ("lsl_marks", "Marks &by LSL", "Each sample of any stream of the type Markers is a mark."),
)


class NetworkDialog(Dialog):
    """Edits addresses and protocols; Apply passes them to `apply(addresses, on)`, which may refuse them.

    `counts` and `problem` are asked for while the dialog is open.
    """

    def __init__(
        self,
        apply: Callable[[dict[str, str], list[str]], None],
        counts: Callable[[], Counts],
        problem: Callable[[], str],
        addresses: dict[str, str],
        on: list[str],
        parent: QWidget | None = None,
    ) -> None:
        super().__init__("Network", parent)
        self._apply_to, self._counts, self._problem = apply, counts, problem
        self.check_boxes: dict[str, QCheckBox] = {}
        self.addresses: dict[str, QLineEdit] = {}
        grid = QGridLayout()
        grid.setHorizontalSpacing(2 * theme.GRID)
        grid.setVerticalSpacing(theme.GRID // 2)
        for row, (name, text, help) in enumerate(ROWS):
            self._add(grid, 3 * row, name, text, help, on=name in on)
            field = self.addresses[name] = QLineEdit(addresses[name])
            field.setAccessibleName(text.replace("&", ""))
            field.setToolTip(HINTS.get(name, HINT))
            field.setPlaceholderText(HINTS.get(name, ""))
            field.textEdited.connect(self._update_note)
            grid.addWidget(field, 3 * row, 1)
        for row, (name, text, help) in enumerate(STREAMS, len(ROWS)):
            self._add(grid, 3 * row, name, text, help if find_spec("pylsl") else _NO_LSL, on=name in on)
        grid.setColumnStretch(1, 1)
        self.note, self.trouble = theme.paragraph("", "alarm"), theme.paragraph("", "alarm")
        self.counters, self.refusal = theme.label("", "value"), theme.paragraph("", "small")
        self.buttons = self.button_row(QDialogButtonBox.StandardButton.Apply, QDialogButtonBox.StandardButton.Close)
        self.apply = self.buttons.button(QDialogButtonBox.StandardButton.Apply)
        self.apply.clicked.connect(self._apply)
        self.apply.setDefault(True)
        column = self.column()
        inside = self.scrolled(column)
        inside.addLayout(grid)
        for line in (self.counters, self.refusal):
            inside.addWidget(line)
        inside.addStretch(1)
        for note in (self.note, self.trouble):
            column.addWidget(note)
        column.addWidget(self.buttons)
        self.resize(80 * theme.GRID, 66 * theme.GRID)
        self._timer = QTimer(self, interval=_POLL_MS)
        self._timer.timeout.connect(self._poll)
        self._timer.start()
        self._poll()
        self._update_note()

    def _add(self, grid: QGridLayout, row: int, name: str, text: str, help: str, *, on: bool) -> None:
        box = self.check_boxes[name] = QCheckBox(text)
        box.setChecked(on)
        box.toggled.connect(self._update_note)
        grid.addWidget(box, row, 0)
        grid.addWidget(theme.paragraph(help, "small"), row + (name not in FLAGS), 1)
        grid.setRowMinimumHeight(row + 2, theme.GRID)

    def values(self) -> tuple[dict[str, str], list[str]]:
        """Return the addresses, and the names of the protocols that are on."""
        texts = {name: field.text().strip() for name, field in self.addresses.items()}
        return texts, [name for name, box in self.check_boxes.items() if box.isChecked()]

    def _update_note(self) -> None:
        """Say what the choice means before it is applied: what leaves this computer, or why it cannot be."""
        addresses, on = self.values()
        try:
            plan = NetworkPlan.chosen(addresses, on)
        except UnderfootError as error:
            self._show_note(str(error))
            return
        self._show_note("\n".join(f"{line[0].upper()}{line[1:]}." for line in plan.warnings()))

    def _apply(self) -> None:
        self._update_note()
        try:
            self._apply_to(*self.values())
        except UnderfootError as error:
            self._show_note(str(error))

    def _show_note(self, text: str) -> None:
        self.note.setText(text)
        self.note.setVisible(bool(text))

    def _poll(self) -> None:
        counts = self._counts()
        sent, received, refused = (number(n, _DIGITS) for n in (counts.sent, counts.received, counts.refused))
        self.counters.setText(f"Sent {sent}   Cues received {received}   Refused {refused}")
        self.refusal.setText(f"Last refused: {counts.reason}" if counts.reason else "")
        why = self._problem()
        self.trouble.setText(f"{why[:1].upper()}{why[1:]}.")
        self.trouble.setVisible(bool(why))
