"""What is clicked is large enough: 24 pixels (WCAG 2.2, 2.5.8)."""

import pytest
from PySide6.QtWidgets import QAbstractButton, QCheckBox, QComboBox, QLineEdit, QPushButton, QRadioButton, QToolButton

from underfoot.parameters import Number
from underfoot.widgets.controls.number_editor import NumberEditor

LEAST_PX = 24


@pytest.mark.parametrize(
    ("kind", "role"),
    [
        (QCheckBox, ""),
        (QRadioButton, ""),
        (QPushButton, "chip"),
        (QToolButton, "chip"),
        (QComboBox, "chip"),
        (QLineEdit, "value"),
        (QLineEdit, "bad"),
    ],
)
def test_it_is_at_least_as_high_as_is_easily_hit(qtbot, kind, role):
    made = kind()
    qtbot.addWidget(made)
    made.setProperty("role", role)
    if isinstance(made, QAbstractButton):
        made.setText("A")
    made.ensurePolished()
    assert made.sizeHint().height() >= LEAST_PX
    if isinstance(made, QPushButton):
        assert made.sizeHint().width() >= LEAST_PX


def test_the_button_beside_a_name_that_resets_it_is_hit_too(qtbot):
    editor = NumberEditor(Number(1.0, 0.0, 2.0))
    qtbot.addWidget(editor)
    editor.set_value(2.0)
    editor.show()
    assert min(editor.reset_button.size().toTuple()) >= LEAST_PX
