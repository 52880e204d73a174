"""The audio dialog: what it offers, what it gives back, and what it says where there is no card."""

import threading

from on_screen import show
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QDialogButtonBox, QLabel, QPushButton

from underfoot.devices.sound import Card
from underfoot.floor.layout import default_floor
from underfoot.widgets.dialogs.audio_dialog import AudioDialog

CARDS = [Card("Eight out", 8, 48_000.0), Card("Headphones", 2, 44_100.0)]


def opened(qtbot, cards, device="", rate=48_000, block=128, floor=None):
    let_go = threading.Event()
    dialog = AudioDialog(lambda: let_go.wait(300) and cards, let_go.set, floor or default_floor())
    qtbot.addWidget(dialog)
    dialog.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose, False)
    dialog.set_values(device, rate, block)
    show(qtbot, dialog)
    assert dialog.note.text() == "Looking for sound devices…"
    with qtbot.waitSignal(dialog.search.found):
        let_go.set()
    return dialog


def test_what_is_in_use_is_what_is_shown(qtbot):
    dialog = opened(qtbot, CARDS, "Headphones", 44_100, 256)
    assert dialog.values() == ("Headphones", 44_100, 256, "")
    assert "2 channels" in dialog.cards.rows[0].device_box.currentText()
    assert dialog.length.text().startswith("A block lasts 5.80 ms")
    dialog.set_values("Headphones", 192_000, 16)  # which a settings file may have
    assert dialog.values() == ("Headphones", 192_000, 16, "")
    assert (dialog.rate.currentText(), dialog.block.currentText()) == ("192 kHz", "16 frames")


def test_opening_it_prints_no_warning_of_qt(qtbot, qtlog):
    opened(qtbot, CARDS)
    assert not [record.message for record in qtlog.records if "propagateSizeHints" not in record.message]


def test_the_focus_begins_at_the_first_card_and_goes_through_all_before_the_buttons(qtbot):
    dialog = opened(qtbot, CARDS)
    cards = dialog.cards
    assert dialog.focusWidget() is cards.rows[0].device_box
    qtbot.mouseClick(cards.add_button, Qt.MouseButton.LeftButton)
    qtbot.waitUntil(cards.rows[1].isVisible)
    cards.rows[0].device_box.setFocus()
    passed = []
    for _ in range(6):
        qtbot.keyClick(dialog.focusWidget(), Qt.Key.Key_Tab)
        passed.append(dialog.focusWidget())
    first, second = cards.rows
    last = (second.device_box, second.channels, second.remove_button, cards.add_button, cards.search_again)
    assert passed == [first.channels, *last]


def test_no_control_is_cut(qtbot):
    dialog = opened(qtbot, [])
    card = dialog.cards.rows[0]
    for control in (card.device_box, card.channels, dialog.cards.add_button, dialog.cards.search_again, dialog.rate):
        assert control.height() >= control.sizeHint().height()


def test_apply_gives_device_rate_and_block(qtbot):
    dialog = opened(qtbot, CARDS)
    dialog.cards.rows[0].device_box.setCurrentIndex(dialog.cards.rows[0].device_box.findData("Eight out"))
    dialog.rate.setCurrentIndex(dialog.rate.findData(96_000))
    apply = dialog.buttons.button(QDialogButtonBox.StandardButton.Apply)
    with qtbot.waitSignal(dialog.applied) as applied:
        qtbot.mouseClick(apply, Qt.MouseButton.LeftButton)
    assert applied.args == ["Eight out", 96_000, 128, ""]


def test_no_card_is_said_calmly_and_no_sound_can_be_chosen(qtbot):
    dialog = opened(qtbot, [], None)
    assert dialog.values()[0] is None
    assert dialog.cards.rows[0].device_box.currentText().startswith("No sound")
    assert "No sound device" in dialog.note.text()
    assert dialog.note.isVisible()


def test_the_default_device_stays_chosen_where_there_is_no_card(qtbot):
    dialog = opened(qtbot, [], "")
    assert dialog.values()[0] == ""
    assert dialog.cards.rows[0].device_box.currentText() == "Default device of this computer"


def test_a_device_that_went_away_stays_chosen_and_is_marked(qtbot):
    dialog = opened(qtbot, CARDS, "Gone")
    assert dialog.values()[0] == "Gone"
    assert "not connected" in dialog.cards.rows[0].device_box.currentText()


def test_every_tile_can_be_pulsed(qtbot):
    dialog = opened(qtbot, CARDS, floor=default_floor(2, 3))
    buttons = {b.text(): b for b in dialog.findChildren(QPushButton) if b.toolTip().startswith("Pulse")}
    assert list(buttons) == ["t1", "t2", "t3", "t4", "t5", "t6"]
    with qtbot.waitSignal(dialog.pulse_requested) as asked:
        qtbot.mouseClick(buttons["t5"], Qt.MouseButton.LeftButton)
    assert asked.args == ["t5"]
    assert "channel 5" in buttons["t5"].toolTip()


def test_escape_closes(qtbot):
    dialog = opened(qtbot, CARDS)
    qtbot.keyClick(dialog, Qt.Key.Key_Escape)
    assert not dialog.isVisible()


def test_a_card_that_was_plugged_in_since_is_found_by_looking_again(qtbot):
    cards = list(CARDS)
    dialog = opened(qtbot, cards, "Headphones")
    cards.append(Card("New card", 18, 48_000.0))
    with qtbot.waitSignal(dialog.search.found):
        qtbot.mouseClick(dialog.cards.search_again, Qt.MouseButton.LeftButton)
    assert dialog.cards.rows[0].device_box.findData("New card") > 0
    assert dialog.values()[0] == "Headphones"


def test_closing_waits_for_the_search_and_nothing_is_left_of_it(qtbot):
    """Here the search ends only after the dialog was asked to close, as on a slow machine."""
    searching, found = threading.Event(), threading.Event()

    def find():
        searching.set()
        assert found.wait(300)
        return CARDS

    dialog = AudioDialog(find, lambda: None, default_floor())
    qtbot.addWidget(dialog)
    show(qtbot, dialog)
    assert searching.wait(300)
    timer = threading.Timer(0.05, found.set)
    timer.start()
    dialog.reject()
    assert not dialog.isVisible()
    assert found.is_set()
    timer.join()
    assert not any(thread.name == "look for sound devices" for thread in threading.enumerate())


def test_accelerometers_are_given_as_they_are_written_and_refused_with_a_reason(qtbot):
    dialog = opened(qtbot, CARDS)
    apply = dialog.buttons.button(QDialogButtonBox.StandardButton.Apply)
    qtbot.keyClicks(dialog.accelerometers, "t9:0:98")
    with qtbot.assertNotEmitted(dialog.applied):
        qtbot.mouseClick(apply, Qt.MouseButton.LeftButton)
    assert "t9" in dialog.note.text()
    assert "allowed: t1, t2, t3, t4" in dialog.note.text()
    dialog.accelerometers.clear()
    qtbot.keyClicks(dialog.accelerometers, "t1:0:98.1  t2:1:98.1")
    with qtbot.waitSignal(dialog.applied) as applied:
        qtbot.mouseClick(apply, Qt.MouseButton.LeftButton)
    assert applied.args[3] == "t1:0:98.1 t2:1:98.1"


def test_a_floor_of_thirty_six_tiles_is_laid_on_two_cards(qtbot):
    cards = [Card("Left", 18, 48_000.0), Card("Right", 18, 48_000.0)]
    dialog = opened(qtbot, cards, "Left", floor=default_floor(6, 6))
    assert "silent" in " ".join(label.text() for label in dialog.map.findChildren(QLabel))
    qtbot.mouseClick(dialog.cards.add_button, Qt.MouseButton.LeftButton)
    assert dialog.values()[0] == "Left; Right"
    dialog.cards.rows[0].channels.selectAll()
    qtbot.keyClicks(dialog.cards.rows[0].channels, "12")
    qtbot.keyClick(dialog.cards.rows[0].channels, Qt.Key.Key_Tab)
    assert dialog.values()[0] == "Left=12; Right"
    tips = {b.text(): b.toolTip() for b in dialog.map.findChildren(QPushButton)}
    assert "channel 12" in tips["t12"]
    assert "channel 1" in tips["t13"]
    qtbot.mouseClick(dialog.cards.rows[1].remove_button, Qt.MouseButton.LeftButton)
    assert dialog.values()[0] == "Left=12"
