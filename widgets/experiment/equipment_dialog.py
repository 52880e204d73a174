"""The equipment of studies in this window: plate, masking sound, trigger, LSL streams."""

from collections.abc import Callable, Mapping
from importlib.util import find_spec

import msgspec
from PySide6.QtGui import QHideEvent, QShowEvent
from PySide6.QtWidgets import (
    QCheckBox,
    QComboBox,
    QDialogButtonBox,
    QGridLayout,
    QLineEdit,
    QPushButton,
    QWidget,
)

from underfoot.devices.plate import SIMULATED, split_plate
from underfoot.devices.sound import Card
from underfoot.devices.transports.serial import SerialTransport
from underfoot.engine.card_search import CardSearch
from underfoot.errors import BadValue, UnderfootError
from underfoot.experiments.protocol import Sounds
from underfoot.floor.layout import default_floor
from underfoot.studies.equipment import EquipmentChoice
from underfoot.widgets import theme
from underfoot.widgets.background import BackgroundWorker, Task
from underfoot.widgets.controls.choice_box import name_control
from underfoot.widgets.controls.dialog import Dialog
from underfoot.widgets.controls.file_dialog import ask_file

DEFAULT_DEVICE = "the default device"
_TRIED_HZ = 1000.0


class EquipmentDialog(Dialog):
    """Edits the equipment; Use passes it to `use`. Try opens all selected equipment and closes it again.

    `calibrated` is the suggestion for an empty plate field: `PORT:FILE` of the plate that was calibrated last.
    """

    def __init__(
        self,
        use: Callable[[EquipmentChoice], object],
        choice: EquipmentChoice,
        parent: QWidget | None = None,
        calibrated: str = "",
    ) -> None:
        super().__init__("Equipment of studies", parent)
        self._use = use
        self.check_boxes = {
            "plate": QCheckBox("&Stiffness plate at"),
            "masking": QCheckBox("&Masking sound on"),
            "trigger": QCheckBox("T&rigger at"),
            "lsl": QCheckBox("&LSL streams"),
        }
        self.plate, self.trigger, self.masking = _ports(SIMULATED), _ports(), QComboBox()
        self.calibration = QLineEdit()
        self.calibration.setPlaceholderText("its calibration, plate.json")
        self.calibration.setAccessibleName("Calibration of the plate")
        self.look = QPushButton("Look…")
        self.look.clicked.connect(self._look)
        self.masking.addItem(DEFAULT_DEVICE)
        self.note = theme.paragraph("", "alarm")
        self.buttons = self.button_row(QDialogButtonBox.StandardButton.Cancel)
        self.try_out = self.buttons.addButton("Try", QDialogButtonBox.ButtonRole.ActionRole)
        self.use_button = self.buttons.addButton("Use", QDialogButtonBox.ButtonRole.AcceptRole)
        self.use_button.setDefault(True)
        self._lay_out()
        self._show(choice, calibrated)
        for box in self.check_boxes.values():
            box.toggled.connect(self._enable)
        self._enable()
        self.try_out.clicked.connect(self._try_out)
        self._cards, self.search = CardSearch(), BackgroundWorker(self)
        self.search.found.connect(self._show_devices)
        self.trial = BackgroundWorker(self)
        self.trial.found.connect(self._show_trial)
        self.trial.failed.connect(self._show_failure)

    def showEvent(self, event: QShowEvent) -> None:
        super().showEvent(event)
        self._cards = cards = CardSearch()
        self.search.compute(lambda _: cards.find())  # a sound server that hangs is waited for

    def hideEvent(self, event: QHideEvent) -> None:
        self._cards.give_up()
        self.trial.stop()  # which closes again what it opens
        self.search.stop()
        self.search.join()
        super().hideEvent(event)

    def choice(self) -> EquipmentChoice:
        """Return the selected equipment; raise `BadValue` if something is missing."""
        plate = trigger = ""
        if self.check_boxes["plate"].isChecked():
            port, calibration = self.plate.currentText().strip(), self.calibration.text().strip()
            plate = f"{port}:{calibration}" if calibration else port
            split_plate(plate)
        if self.check_boxes["trigger"].isChecked():
            trigger = self.trigger.currentText().strip()
            if not trigger:
                raise BadValue("trigger is ''; allowed: a serial port, as /dev/ttyUSB0 or COM3")
        device = "" if self.masking.currentText() == DEFAULT_DEVICE else self.masking.currentText()
        masking = device if self.check_boxes["masking"].isChecked() else None
        return EquipmentChoice(plate, masking, trigger, self.check_boxes["lsl"].isChecked())

    def accept(self) -> None:
        try:
            chosen = self.choice()
            chosen.check()
        except UnderfootError as error:
            self._show_note(str(error), "alarm")
            return
        self._use(chosen)
        super().accept()

    def _try_out(self) -> None:
        """Open the equipment in a thread: a sound server that hangs is waited for, and a card takes its time, too."""
        try:
            chosen = self.choice()
        except UnderfootError as error:
            self._show_note(str(error), "alarm")
            return

        def opened(_: Task) -> list[str]:
            chosen.opened(Sounds(noise="pink"), default_floor(), _TRIED_HZ).close()
            return [f"Opened: {chosen.text}." if chosen.text else "Nothing is chosen."]

        self._set_trying(True)
        self._show_note("Opening…", "muted")
        self.trial.compute(opened)

    def _set_trying(self, on: bool) -> None:
        """Let nothing else open what is being tried."""
        for button in (self.try_out, self.use_button):
            button.setDisabled(on)

    def _show_trial(self, lines: list[str]) -> None:
        self._set_trying(False)
        self._show_note(lines[0], "good")

    def _show_failure(self, why: str) -> None:
        self._set_trying(False)
        self._show_note(why, "alarm")

    def _show_devices(self, cards: list[Card]) -> None:
        for name in dict.fromkeys(card.name for card in cards):
            if self.masking.findText(name) < 0:
                self.masking.addItem(name)

    def _show_note(self, text: str, role: str) -> None:
        theme.set_role(self.note, role)
        self.note.setText(text)

    def _show(self, choice: EquipmentChoice, calibrated: str) -> None:
        if plate := choice.plate or calibrated:
            port, path = split_plate(plate)
            self.plate.setCurrentText(port)
            self.calibration.setText(path)
        self.trigger.setCurrentText(choice.trigger)
        if choice.masking and self.masking.findText(choice.masking) < 0:
            self.masking.addItem(choice.masking)
        self.masking.setCurrentText(choice.masking or DEFAULT_DEVICE)
        on = {"plate": choice.plate, "masking": choice.masking is not None, "trigger": choice.trigger}
        for name, box in self.check_boxes.items():
            box.setChecked(bool(on.get(name, choice.lsl)))

    def _enable(self) -> None:
        for name, parts in {
            "plate": (self.plate, self.calibration, self.look),
            "masking": (self.masking,),
            "trigger": (self.trigger,),
        }.items():
            for part in parts:
                part.setEnabled(self.check_boxes[name].isChecked())

    def _look(self) -> None:
        title, filter = "Calibration of the plate", "Calibrations (*.json)"
        ask_file(self, title, filter, lambda path: self.calibration.setText(str(path)))

    def _lay_out(self) -> None:
        grid = QGridLayout()
        grid.setHorizontalSpacing(2 * theme.GRID)
        grid.setVerticalSpacing(theme.GRID // 2)
        grid.setColumnStretch(1, 1)
        controls = {"plate": self.plate, "masking": self.masking, "trigger": self.trigger}
        helps = {
            "plate": "Goes to each stimulus's stiffness, in 4 s, never under a load. A simulated one has "
            "40 to 160 N/mm, and needs no calibration. Others: see Calibrate, Stiffness.",
            "masking": "The protocol's noise and metronome, for headphones; where the protocol has none, nothing.",
            "trigger": "A byte for each begin (1), onset (2), end (3), answer (4) and stop (5), at 115,200 baud.",
            "lsl": "Markers and forces as streams of the Lab Streaming Layer."
            if find_spec("pylsl") is not None
            else 'Needs the package pylsl: pip install "underfoot[lsl]".',
        }
        row = 0
        for name, box in self.check_boxes.items():
            grid.addWidget(box, row, 0)
            if name in controls:
                name_control(controls[name], box.text().replace("&", ""))
                grid.addWidget(controls[name], row, 1, 1, 2)
            if name == "plate":
                row += 1
                grid.addWidget(self.calibration, row, 1)
                grid.addWidget(self.look, row, 2)
            row += name != "lsl"
            grid.addWidget(theme.paragraph(helps[name], "small"), row, 1, 1, 2)
            grid.setRowMinimumHeight(row + 1, theme.GRID)
            row += 2
        column = self.column()
        inside = self.scrolled(column)
        inside.addLayout(grid)
        inside.addStretch(1)
        column.addWidget(self.note)
        column.addWidget(self.buttons)
        self.resize(72 * theme.GRID, 54 * theme.GRID)


def choice_of_settings(kept: Mapping[str, str | bool | None]) -> EquipmentChoice:
    """Return the equipment in the window's settings; none if they cannot be read.

    >>> choice_of_settings({"trigger": "COM3"}).text, choice_of_settings({"lsl": "maybe"}).text
    ('trigger', '')
    """
    try:
        found = msgspec.convert(dict(kept), EquipmentChoice)
        if found.plate:
            split_plate(found.plate)
    except (msgspec.ValidationError, BadValue):
        return EquipmentChoice()
    return found


def _ports(*others: str) -> QComboBox:
    box = QComboBox()
    box.setEditable(True)
    box.addItems([*others, *SerialTransport.suggestions()])
    box.setCurrentText("")
    line = box.lineEdit()
    if line is not None:
        line.setPlaceholderText("a serial port, as /dev/ttyACM0")
    return box
