"""What a parameter's menu has on OSC: the message that sets it, and what is done with a value that was set so."""

import json
from collections.abc import Callable
from typing import NamedTuple

from PySide6.QtGui import QAction, QGuiApplication

from underfoot.network.cues import SetCue
from underfoot.patch.wiring import node_id, port_name
from underfoot.widgets.controls.fields import ParameterEditor, value_text

REMARK = "by OSC"
"""Beside the name of a parameter whose value another program has set."""


class Answers(NamedTuple):
    """What the actions do."""

    keep: Callable[[], object]
    give_back: Callable[[str], object]
    """Takes the parameter, "node.parameter"."""
    notify: Callable[[str], object]


class OscActions:
    """The actions of one parameter, "node.parameter", in the menu of its control."""

    def __init__(self, editor: ParameterEditor, end: str, do: Answers) -> None:
        self._editor, self._end, self._notify = editor, end, do.notify
        self._copying = QAction("Copy its OSC message", editor)
        self._copying.triggered.connect(self._copy)
        self._keeping = QAction("Keep what OSC has set", editor)
        self._keeping.triggered.connect(do.keep)
        self._back = QAction(editor)
        self._back.triggered.connect(lambda: do.give_back(end))
        editor.addAction(self._copying)

    def show(self, own: object, *, is_driven: bool, is_set: bool) -> None:
        """Show whether OSC has set the value, which the patch has as `own`; what a wire drives is not heard so."""
        self._copying.setVisible(not is_driven)
        self._editor.set_mixed("", REMARK if is_set else "")
        if is_set:
            self._back.setText(f"Back to {value_text(self._editor.parameter, own)}")
        if is_set != (self._back in self._editor.actions()):  # a fader comes here sixty times a second
            for action in (self._keeping, self._back):
                (self._editor.addAction if is_set else self._editor.removeAction)(action)

    def _copy(self) -> None:
        """Copy the message that sets the parameter to its present value, as senders of OSC take it."""
        value = self._editor.value()
        shown = f"{value:.6g}" if isinstance(value, float) else json.dumps(value)
        message = f"{SetCue.address} {node_id(self._end)} {port_name(self._end)} {shown}"
        QGuiApplication.clipboard().setText(message)
        self._notify(f"Copied: {message}. It sets the value while Network… takes cues.")
