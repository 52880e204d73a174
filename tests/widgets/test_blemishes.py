"""What once looked wrong in the window: the toolbar, its first size, the hint, the inspector, the list of keys."""

from itertools import combinations

import pytest
from design_samples import REGISTRY, sample
from msgspec.structs import replace
from on_screen import show
from PySide6.QtCore import QPoint, QPointF, QRect, Qt
from PySide6.QtGui import QAccessible
from PySide6.QtTest import QTest
from PySide6.QtWidgets import (
    QAbstractButton,
    QApplication,
    QButtonGroup,
    QComboBox,
    QLabel,
    QLineEdit,
    QMenu,
    QScrollArea,
    QStyle,
    QTableWidget,
    QTableWidgetItem,
    QToolButton,
    QToolTip,
    QWidget,
)
from windows import end_window, quiet_window, wait_until_kept

from underfoot.engine.target import Target
from underfoot.floor.layout import default_floor
from underfoot.network.server import Counts
from underfoot.nodes import REGISTRY as NODES
from underfoot.patch.groups import Note
from underfoot.patch.patch import Patch
from underfoot.widgets import theme
from underfoot.widgets.controls.file_dialog import file_dialog
from underfoot.widgets.controls.tables import make_read_only
from underfoot.widgets.design.node_list import NodeList
from underfoot.widgets.design.patch_view import MIN_FIT_ZOOM
from underfoot.widgets.design.preset_browsing import PresetDialog
from underfoot.widgets.design.preview_plots import LEAST_SIDE_PX
from underfoot.widgets.dialogs.audio_dialog import AudioDialog
from underfoot.widgets.dialogs.network_dialog import NetworkDialog
from underfoot.widgets.dialogs.shortcuts import ShortcutsDialog
from underfoot.widgets.main_bar import MainBar
from underfoot.widgets.session.settings import DEFAULT_ADDRESSES
from underfoot.widgets.window import MainWindow


@pytest.fixture(scope="module")
def whole_window(qapp, tmp_path_factory):
    """A window with all workspaces, without a session."""
    folder = tmp_path_factory.mktemp("kept")
    made = MainWindow(folder, Target(default_floor()))
    made.settings.first_steps_done = True
    made.show()
    made.workspaces.create_all()
    made.open_patch.write_autosave()
    wait_until_kept(made, folder)
    yield made
    end_window(made)


@pytest.fixture
def whole(whole_window, qtbot):
    """The same window with the focus."""
    show(qtbot, whole_window)
    return whole_window


@pytest.mark.parametrize("width", [1024, 1100, 1280, 1600])
@pytest.mark.parametrize("tabs", [4, 5])
def test_nothing_in_the_toolbar_overlaps_at_any_width(qtbot, width, tabs):
    bar = MainBar(QMenu())
    qtbot.addWidget(bar)
    for name in ("Design", "Monitor", "Calibrate", "Experiment", "Recordings")[:tabs]:
        bar.add_workspace(name, "", "list")
    bar.set_warnings("Calibrate", ["t1 is old"])
    bar.resize(width, 48)
    show(qtbot, bar)
    shown = [child for child in bar.findChildren(QWidget) if child.isVisible() and child.parent() is bar]
    boxes = [child.geometry() for child in shown]
    assert not [pair for pair in combinations(boxes, 2) if pair[0].intersects(pair[1])]
    assert max(box.right() for box in boxes) < width
    assert bar.panic.isVisible()
    assert bar.latency.isVisible() or width < 1600


def test_the_first_window_is_no_larger_than_its_screen(qtbot, tmp_path):
    window = quiet_window(qtbot, tmp_path)
    room = window.screen().availableSize()
    for size in (window.size(), window.minimumSize()):
        assert size.width() <= room.width()
        assert size.height() <= room.height()


def test_what_shows_a_sign_or_a_choice_alone_has_words_for_screen_readers(whole):
    signs = [button for button in whole.findChildren(QAbstractButton) if button.text() and not has_word(button.text())]
    assert {"★", "−", "+"} <= {button.text() for button in signs}
    assert not [(button.text(), button.toolTip()) for button in signs if not has_word(button.accessibleName())]
    said = {
        box.accessibleName(): QAccessible.queryAccessibleInterface(box).text(QAccessible.Text.Description)
        for box in whole.workspaces.findChildren(QComboBox)
    }
    assert said["Ground"].startswith("Ground: ")
    assert not [name for name, description in said.items() if not description]
    tabs = [tab for group in whole.findChildren(QButtonGroup) for tab in group.buttons()]
    tabs += whole.workspaces["Monitor"].force.span_buttons.values()
    roles = {QAccessible.queryAccessibleInterface(tab).role() for tab in tabs}
    assert roles == {QAccessible.Role.RadioButton}  # they were check boxes, of which any number can be on
    whole.show_message("A line that is longer than the window is wide. " * 8)
    lines = [QAccessible.queryAccessibleInterface(label) for label in whole.status.findChildren(QLabel)]
    assert whole.status.message in {line.text(QAccessible.Text.Name) for line in lines}  # it was "Message"


def test_what_cannot_be_used_has_a_tooltip(whole):
    used = [part for kind in (QAbstractButton, QComboBox, QLineEdit) for part in whole.findChildren(kind)]
    refused = [part for part in used if not part.isEnabledTo(part.parentWidget())]
    assert len(refused) > 10
    assert not [part.accessibleName() or part.text() for part in refused if not part.toolTip()]


@pytest.mark.parametrize(
    "make",
    [
        lambda: AudioDialog(list, lambda: None, default_floor()),
        lambda: NetworkDialog(lambda *_: None, Counts, str, DEFAULT_ADDRESSES, []),
        lambda: PresetDialog(Patch()),
    ],
    ids=["audio", "network", "preset"],
)
def test_the_buttons_of_a_dialog_keep_their_keys_on_desktops_that_underline_them(qtbot, make):
    """GNOME and KDE write "&Close": with the key of a field, too, Alt+C would close nothing."""
    dialog = make()
    qtbot.addWidget(dialog)
    dialog.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose, False)
    for button in dialog.buttons.buttons():
        button.setText(f"&{button.text().removeprefix('&')}")
    show(qtbot, dialog)
    with qtbot.waitSignal(dialog.rejected):
        qtbot.keyClick(dialog, Qt.Key.Key_C, Qt.KeyboardModifier.AltModifier)


def has_word(text):
    return any(map(str.isalnum, text))


def test_the_hint_goes_with_the_first_node_and_comes_back(workspace):
    hint = workspace.canvas.hint
    assert not hint.isVisible()
    workspace.canvas.select_all()
    QTest.keyClick(workspace.canvas, Qt.Key.Key_Delete)
    assert hint.isVisible()
    workspace.node_palette.chosen.emit("hum")
    assert not hint.isVisible()
    workspace.undo_action.trigger()
    assert hint.isVisible()


def test_a_wide_patch_is_opened_at_its_left_end_and_can_be_read(workspace):
    wide = sample().add("hum", REGISTRY, (6000.0, 0.0))
    workspace.set_patch(wide)
    canvas = workspace.canvas
    assert canvas.transform().m11() == pytest.approx(MIN_FIT_ZOOM)
    assert theme.TEXT_PX * MIN_FIT_ZOOM > 9.0
    seen = canvas.mapToScene(canvas.viewport().rect()).boundingRect()
    assert seen.left() < 0.0 < seen.right()
    QTest.keyClick(canvas, Qt.Key.Key_Home)
    assert canvas.mapToScene(canvas.viewport().rect()).boundingRect().right() > 6000.0


def test_what_is_selected_is_seen_when_zoomed_out(workspace):
    """Its border is less than a pixel wide there."""
    canvas = workspace.canvas
    workspace.set_patch(replace(workspace.patch(), notes=(Note("note", "Walk", (240.0, 320.0)),)))
    canvas.zoom_to(0.25)

    def ground(id):
        """The colour of a node or note in its lower left corner, beside its words."""
        item = canvas.patch_scene.movable()[id]
        place = canvas.mapFromScene(item.pos() + QPointF(16.0, item.size[1] - 12.0))
        return canvas.viewport().grab().toImage().pixelColor(place).name()

    assert ground("hum") == theme.RAISED
    canvas.patch_scene.select(["hum", "note"])
    selected = theme.PALETTE["selected"]
    assert (ground("hum"), ground("note"), ground("push")) == (selected, selected, theme.RAISED)


def test_the_map_of_a_wide_patch_shows_its_nodes_and_the_part_that_is_seen(workspace):
    """Each is less than a pixel on it."""
    canvas = workspace.canvas
    workspace.document.edit(workspace.patch().move({"push": (-20_000.0, 0.0), "hum": (20_000.0, 0.0)}), "Move")
    canvas.ensure_visible(["hum"])
    picture = canvas.map.grab().toImage()
    shown = {picture.pixelColor(x, y).name() for x in range(picture.width()) for y in range(picture.height())}
    amber = canvas.patch_scene.nodes["push"].description.colour
    assert {theme.MUTED, theme.mixed(amber, theme.PANEL, 0.45)} <= shown


def test_every_page_of_the_inspector_is_equally_wide(workspace):
    workspace.document.edit(workspace.patch().add("beat", REGISTRY, (0.0, 400.0)), "Add")
    widths = set()
    for ids in ([], ["hum"], ["shaker"], ["beat"], ["hum", "shaker"]):
        workspace.canvas.patch_scene.select(ids)
        QApplication.processEvents()
        widths.add((workspace.inspector.width(), workspace.inspector.widget().width()))
    assert len(widths) == 1


def test_the_list_of_keys_is_not_cut_at_its_side(qtbot):
    keys = [("Redo what was undone", "Ctrl+Shift+Z, Ctrl+Shift+Alt+Backspace"), *[("Cut", "Ctrl+X")] * 60]
    dialog = ShortcutsDialog([("EVERYWHERE", keys)])
    qtbot.addWidget(dialog)
    show(qtbot, dialog)
    area = dialog.findChild(QScrollArea)
    assert area.widget().minimumSizeHint().width() <= area.viewport().width()


def test_the_title_of_a_file_is_no_markup_in_a_tooltip(qapp):
    QToolTip.showText(QPoint(), "Ice <b>thin</b> <img src='/dev/null'>")
    shown = [one for one in qapp.topLevelWidgets() if isinstance(one, QLabel) and one.text().startswith("Ice <b>")]
    assert [one.textFormat() for one in shown] == [Qt.TextFormat.PlainText]
    shown[0].deleteLater()  # hidden by the system, it would stay for a while


def test_buttons_of_dialogs_have_no_pictures(qapp):
    assert not qapp.style().styleHint(QStyle.StyleHint.SH_DialogButtonBox_ButtonsHaveIcons)


def test_buttons_of_a_file_dialog_have_pictures_of_ours(qtbot, tmp_path):
    window = QWidget()
    qtbot.addWidget(window)
    dialog = file_dialog(window, "Open", str(tmp_path))
    for name, picture in (("backButton", "arrow-left"), ("newFolderButton", "folder-new")):
        icon = dialog.findChild(QToolButton, name).icon()
        assert icon.pixmap(32).toImage() == theme.icon(picture, theme.TEXT).pixmap(32).toImage()


def test_the_monitor_is_usable_before_its_session_is_open(whole):
    whole.workspaces.choose("Monitor")
    monitor = whole.workspaces["Monitor"]
    for plot in (monitor.force.plot, monitor.vibration.spectrogram):
        QTest.mouseMove(plot, plot.rect().center())
        plot.wheeled.emit(120.0)
    QTest.mouseClick(monitor.map, Qt.MouseButton.LeftButton, pos=monitor.map.rect().center())
    monitor.draw()
    assert {label.text() for label in monitor.force.readouts} == {"– N"}


def test_large_text_on_a_small_screen_cuts_neither_words_nor_plots(qtbot, tmp_path):
    window = quiet_window(qtbot, tmp_path)
    window.setMinimumSize(800, 533)
    window.resize(800, 533)  # text at 150 % on 1280 x 800 is a little wider
    window.workspaces.create_all()

    def shown(name):
        window.workspaces.choose(name)
        QApplication.processEvents()
        return window.workspaces[name]

    press = shown("Monitor").floor.press_n
    assert press.width() >= press.sizeHint().width()
    assert shown("Recordings").steps.plot.width() >= 20 * theme.GRID
    about = shown("Scenes").panel.about
    assert about.height() >= about.heightForWidth(about.width())
    preview = shown("Design").preview
    assert preview.plots.waveform.width() > 1.5 * preview.plots.spectrum.width()
    assert preview.plots.spectrum.width() >= LEAST_SIDE_PX


def test_a_node_and_its_family_do_not_lie_on_one_another_in_a_list(qtbot):
    def with_and_without_family(width):
        listed = NodeList(NODES)
        qtbot.addWidget(listed)
        listed.resize(width, 40)
        show(qtbot, listed)
        listed.filter_by("breakpoint envelope")
        there = listed.grab().toImage()
        for role in range(Qt.ItemDataRole.UserRole, Qt.ItemDataRole.UserRole + 8):
            if listed.item(0).data(role) == NODES["breakpoints"].family:
                listed.item(0).setData(role, "")
        return there, listed.grab().toImage()

    wide, narrow = with_and_without_family(360), with_and_without_family(176)
    assert wide[0] != wide[1]
    assert narrow[0] == narrow[1]


def test_tab_comes_to_every_control_and_back(whole):
    names, takes_tab = whole.workspaces.names, Qt.FocusPolicy.TabFocus
    assert {"Design", "Monitor", "Calibrate", "Experiment", "Recordings", "Scenes"} <= set(names)
    for name in names:
        whole.workspaces.choose(name)
        QApplication.processEvents()
        start, passed = whole.main_bar.menu, []
        start.setFocus()
        while not passed or QApplication.focusWidget() not in passed:
            passed.append(QApplication.focusWidget())
            QTest.keyClick(passed[-1], Qt.Key.Key_Tab)
        assert QApplication.focusWidget() is start, name
        there = [part for part in whole.workspaces[name].findChildren(QWidget) if part.focusPolicy() & takes_tab]
        there = [part for part in there if part.isVisible() and part.isEnabled() and part.focusProxy() is None]
        assert not [part for part in there if part not in passed and not part.visibleRegion().isEmpty()], name
        tabs = whole.main_bar.tabs.values()  # of which arrows go to the others
        assert [tab.accessibleName() for tab in passed if tab in tabs] == [name]


def test_the_key_of_the_menu_is_no_button_s(whole):
    """Of two with the same key, neither would be used."""
    keys = [button.shortcut() for button in whole.findChildren(QAbstractButton) if not button.shortcut().isEmpty()]
    assert keys.count(whole.main_bar.menu.shortcut()) == 1


def test_headings_of_a_table_end_where_their_figures_do(qtbot):
    table = QTableWidget(2, 1)
    qtbot.addWidget(table)
    make_read_only(table)
    table.setHorizontalHeaderLabels(["8"])
    table.setItem(1, 0, QTableWidgetItem("8"))  # not in the first row, which has the focus
    for item in (table.horizontalHeaderItem(0), table.item(1, 0)):
        item.setTextAlignment(Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter)
    show(qtbot, table)
    ends = []
    for part, top in ((table.horizontalHeader().viewport(), 0), (table.viewport(), table.rowViewportPosition(1) + 2)):
        image = part.grab(QRect(0, top, table.columnWidth(0), 20)).toImage()
        ground = image.pixel(1, 1)
        ends.append(max(x for x in range(image.width()) for y in range(20) if image.pixel(x, y) != ground))
    assert ends[0] == ends[1]


def test_facts_of_the_inspector_end_where_the_numbers_above_them_do(whole):
    whole.workspaces.choose("Design")
    inspector = whole.workspaces["Design"].inspector
    image, scale = inspector.grab().toImage(), inspector.devicePixelRatioF()

    def ends_at(widget):
        """The column of the last pixel of its words."""
        place, size = scale * widget.mapTo(inspector, QPoint()), scale * widget.size()
        ground = image.pixelColor(place + QPoint(2, 2))
        columns = range(place.x() + 3, place.x() + size.width() - 2)
        rows = range(place.y() + 3, place.y() + size.height() - 2)
        return max(x for x in columns if any(image.pixelColor(x, y) != ground for y in rows))

    field = inspector.editors["seed"].field
    nodes = next(label for label in inspector.findChildren(QLabel) if label.text().isdigit())
    assert abs(ends_at(field) - ends_at(nodes)) <= 1
