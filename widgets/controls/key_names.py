"""Names of keys in texts, as the system writes them."""

import re

from PySide6.QtCore import Qt
from PySide6.QtGui import QKeySequence

_KEYS = re.compile(r"(?:(?:Ctrl|Alt|Shift)\+)+(?:F\d+|[A-Z][a-z]*|\d|[^\w\s])|\bCtrl\b")
"""Keys with modifiers: their last part is a word, a letter, a digit or a sign. `Shift+arrows` are several. Or the
control key alone, as one that is held while another or the mouse does something."""


def with_native_keys(text: str) -> str:
    """Return a text with its keys, such as Ctrl+P or Ctrl, as the system names them: ⌘P and ⌘ on macOS.

    >>> with_native_keys("Presets (Ctrl+P)") in ("Presets (Ctrl+P)", "Presets (⌘P)")
    True
    """
    portable, native = QKeySequence.SequenceFormat.PortableText, QKeySequence.SequenceFormat.NativeText
    control = QKeySequence(Qt.KeyboardModifier.ControlModifier.value).toString(native).removesuffix("+")
    return _KEYS.sub(lambda found: QKeySequence.fromString(found[0], portable).toString(native) or control, text)
