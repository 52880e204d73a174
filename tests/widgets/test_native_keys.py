"""Keys in texts are those of the system: macOS has no Ctrl+P."""

from PySide6.QtCore import QCoreApplication, QTranslator
from PySide6.QtWidgets import QLabel, QWidget
from windows import quiet_window


class OfAnotherSystem(QTranslator):
    """Calls the control key what Qt calls it on macOS."""

    def translate(self, context, text, *further):
        return "⌘" if (context, text) == ("QShortcut", "Ctrl") else None


def test_no_text_of_the_window_names_a_key_as_another_system_does(qtbot, tmp_path):
    translator = OfAnotherSystem()
    QCoreApplication.installTranslator(translator)
    window = quiet_window(qtbot, tmp_path)
    window.actions_by_name["keys"].trigger()
    texts = [widget.toolTip() for widget in window.findChildren(QWidget)]
    texts += [label.text() for label in window.findChildren(QLabel)]
    QCoreApplication.removeTranslator(translator)
    assert [text for text in texts if "Ctrl" in text] == []
    assert {"⌘+P", "⌘"} <= {word.strip("()") for text in texts for word in text.split()}
