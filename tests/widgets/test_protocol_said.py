"""What a screen reader says of the form of a study."""

from PySide6.QtGui import QAccessible
from PySide6.QtWidgets import QComboBox
from study_hand import Hand


def test_a_screen_reader_says_what_each_box_of_the_form_chooses(qtbot, tmp_path):
    """On Linux the name of a box is its choice: a stage was called trials, and a patch after its file."""
    made = Hand(qtbot, tmp_path)
    made.click(made.workspace.study_list.new)
    made.page(1)
    made.click(made.protocol_editor.questions.add)
    for place in (2, 3):
        made.page(place)
    said = {
        box.accessibleName(): QAccessible.queryAccessibleInterface(box).text(QAccessible.Text.Description)
        for box in made.protocol_editor.findChildren(QComboBox)
    }
    assert {"Kind", "Method", "Patch", "Scaled by"} <= set(said)
    assert not [name for name, words in said.items() if not words.startswith(name)]
