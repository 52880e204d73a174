"""The look of the window: colours, fonts, the 8-pixel grid, and one accent per kind of signal."""

import math
from functools import cache, lru_cache
from importlib.resources import files
from pathlib import Path

from PySide6.QtCore import QMargins, QRect, QRectF, QSize, Qt
from PySide6.QtGui import QColor, QFont, QFontDatabase, QIcon, QIconEngine, QPainter, QPalette, QPixmap
from PySide6.QtSvg import QSvgRenderer
from PySide6.QtWidgets import QApplication, QLabel, QSizePolicy, QStyleFactory, QWidget

from underfoot.drawing import look

GRID = 8
"""Pixels. Sizes, margins and gaps are multiples of this or of its half."""
HIT_PX = 3 * GRID
"""Least height of what is clicked (WCAG 2.5.8)."""
MARGINS = QMargins(2 * GRID, 2 * GRID, 2 * GRID, 2 * GRID)
"""Of a dialog, and of a page of its own."""

_WINDOW_COLOURS = {
    "panel": ("#191e25", "#f4f6f8"),
    "raised": ("#222933", "#e6eaee"),
    "hover": ("#2a323e", "#d9dfe5"),
}
"""Colours that only the window has, beside those of `look.PALETTES`: panels, controls, and controls under the mouse."""

TITLE_SHARE = 0.34
"""Share of a node's colour in the strip of its title."""
_TITLED = ("force", "vibration", "events", "contact", "alarm", "muted")
"""Colours of nodes, and of groups that are drawn as one."""

_MIXTURES = {
    "selected": ("vibration", "raised", 0.45),
    "checked": ("vibration", "raised", 0.3),
    "primary": ("vibration", "raised", 0.35),
    "alarming": ("alarm", "panel", 0.22),
    "alarming hover": ("alarm", "panel", 0.36),
    "alarming text": ("alarm", "text", 0.4),
    "assuring": ("contact", "panel", 0.22),
    "quiet": ("muted", "raised", 0.92),
    "loaded": ("force", "raised", 0.45),
    "left foot": ("contact", "panel", 0.7),
    "right foot": ("contact", "panel", 0.4),
    "a foot": ("contact", "panel", 0.6),
    "no step": ("contact", "panel", 0.15),
    **{f"{name} title": (name, "panel", TITLE_SHARE) for name in _TITLED},
}
"""Mixed colours of every palette: a colour, the one that it is mixed with, and its share."""

NAME = ""
"""The present palette: "dark" or "light"."""
PALETTE: dict[str, str] = {}
"""Its colours by their names, for drawings."""
FORCE = VIBRATION = EVENTS = CONTACT = ALARM = ""
GROUND = PANEL = RAISED = HOVER = LINE = ""
TEXT = MUTED = ""
FAINT = ""
"""For lines and disabled controls, not for text."""
_CONSTANTS = (
    "force", "vibration", "events", "contact", "alarm",
    "ground", "panel", "raised", "hover", "line", "text", "muted", "faint",
)  # fmt: skip
"""Colours that have a constant above, which `choose_palette` sets."""

TEXT_PX, SMALL_PX, TITLE_PX = 13, look.SMALL_PX, look.TITLE_PX
_ICON_FOLDER = Path(str(files("underfoot.assets"))).joinpath("icons").as_posix()
_ICONS: dict[int, tuple[str, str]] = {}
"""Name and colour of each icon made, by its key in Qt's cache."""
_CLONES: list[QIconEngine] = []
"""What draws the icons that Qt has copied in order to change them."""
_FAMILIES = ("Inter", "Segoe UI", "SF Pro Text", "Noto Sans", "Cantarell", "DejaVu Sans")


def choose_palette(name: str) -> None:
    """Use the colours of a palette, "dark" or "light", from now on; existing widgets keep theirs."""
    known = globals()
    known["NAME"], known["PALETTE"] = name, colours(name)
    known.update({colour.upper(): PALETTE[colour] for colour in _CONSTANTS})


@cache
def colours(name: str) -> dict[str, str]:
    """Return all colours of a palette, "dark" or "light", by name."""
    known = {**look.palette(name), **{own: both[look.PALETTES.index(name)] for own, both in _WINDOW_COLOURS.items()}}
    known.update({made: mixed(known[of], known[on], share) for made, (of, on, share) in _MIXTURES.items()})
    return known


@cache
def _names() -> dict[str, str]:
    """Return the names of all colours of all palettes."""
    return {colour: name for palette in look.PALETTES for name, colour in colours(palette).items()}


def current_colour(colour: str) -> str:
    """Return the present palette's colour for a colour of any palette; other colours are returned unchanged.

    >>> current_colour(colours("light")["force"]), current_colour("#123456")
    ('#f0a63c', '#123456')
    """
    return PALETTE.get(_names().get(colour, ""), colour)


def apply(app: QApplication) -> None:
    """Apply the chosen colours to `app`: Fusion style, an explicit palette, one stylesheet, one font."""
    app.setStyle(QStyleFactory.create("Fusion"))
    app.setPalette(_palette())
    app.setFont(font())
    app.setStyleSheet(_style())


FORCE_UNITS = ("N", "N/s", "kN/s")


def signal_colour(kind: str, unit: str = "") -> str:
    """Return the accent of a port or curve: violet for events, amber for forces, teal for all other signals.

    >>> signal_colour("event"), signal_colour("signal", "N"), signal_colour("signal", "m/s^2")
    ('#b693f2', '#f0a63c', '#3fc1c9')
    """
    if kind == "event":
        return EVENTS
    return FORCE if unit in FORCE_UNITS else VIBRATION


@lru_cache(maxsize=1024)
def mixed(colour: str, ground: str, share: float) -> str:
    """Return `share` of `colour` mixed with `ground`, as an opaque colour.

    >>> mixed("#ffffff", "#000000", 0.5)
    '#808080'
    """
    return "#" + "".join(
        f"{round(share * a + (1 - share) * b):02x}" for a, b in zip(look.rgb(colour), look.rgb(ground), strict=True)
    )


@lru_cache(maxsize=32)
def font(size_px: int = TEXT_PX, bold: bool = False) -> QFont:
    """Return the application's font, sized in pixels so that the grid is the same on every screen."""
    made = QFont(_family())
    made.setPixelSize(size_px)
    made.setBold(bold)
    made.setHintingPreference(QFont.HintingPreference.PreferVerticalHinting)
    return made


@cache
def _family() -> str:
    known = set(QFontDatabase.families())
    return next((name for name in _FAMILIES if name in known), QFont().defaultFamily())


def label(text: str = "", role: str = "") -> QLabel:
    """Return a label with a role of the stylesheet: title, heading, muted, small, value, alarm, good, code."""
    made = QLabel(text)
    made.setTextFormat(Qt.TextFormat.PlainText)  # names may have signs that would be markup
    if role:
        made.setProperty("role", role)
    return made


def paragraph(text: str = "", role: str = "") -> QLabel:
    """Return such a label whose lines break where its width ends."""
    made = label(text, role)
    made.setWordWrap(True)
    return made


def wrap(*labels: QLabel) -> None:
    """Break the labels' lines at any width, so that their words make no window wider."""
    for one in labels:
        one.setWordWrap(True)
        one.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Minimum)


def fill(widget: QWidget, role: str) -> None:
    """Give a plain widget the background of its role, "ground" or "panel"."""
    widget.setProperty("role", role)
    widget.setAttribute(Qt.WidgetAttribute.WA_StyledBackground)


def text_on(colour: str) -> str:
    """Return the colour of text on a colour: that of text, or of the ground, whichever stands out more (WCAG 2.1)."""
    return max((TEXT, GROUND), key=lambda text: abs(math.log((_luminance(text) + 0.05) / (_luminance(colour) + 0.05))))


def _luminance(colour: str) -> float:
    """Return the relative luminance of a colour, 0 to 1."""
    parts = [part / 255 for part in look.rgb(colour)]
    red, green, blue = (part / 12.92 if part <= 0.04045 else ((part + 0.055) / 1.055) ** 2.4 for part in parts)
    return 0.2126 * red + 0.7152 * green + 0.0722 * blue


def set_role(widget: QWidget, role: str) -> None:
    """Set a widget's role, and apply the stylesheet again."""
    if widget.property("role") != role:
        widget.setProperty("role", role)
        widget.style().unpolish(widget)
        widget.style().polish(widget)


def icon(name: str, colour: str = "") -> QIcon:
    """Return the icon `assets/icons/<name>.svg` in a colour, by default that of text; faint if disabled."""
    made = _icon(name, colour or TEXT, FAINT)
    _ICONS[made.cacheKey()] = name, colour or TEXT
    return made


def recoloured_icon(made: QIcon) -> QIcon:
    """Return an icon made by `icon` in the present colours; other icons are returned unchanged."""
    name, colour = _ICONS.get(made.cacheKey(), ("", ""))
    return icon(name, current_colour(colour)) if name else made


@lru_cache(maxsize=128)
def _icon(name: str, colour: str, disabled: str) -> QIcon:
    return QIcon(_IconEngine(name, colour, disabled))


class _IconEngine(QIconEngine):
    """Draws an icon in the sizes and modes that are asked for, when they are: most are never seen."""

    def __init__(self, name: str, colour: str, disabled: str) -> None:
        super().__init__()
        self._drawn = name, colour, disabled

    def pixmap(self, size: QSize, mode: QIcon.Mode, state: QIcon.State) -> QPixmap:
        name, colour, disabled = self._drawn
        stroke = disabled if mode == QIcon.Mode.Disabled else colour
        return _icon_picture(name, stroke, size.width(), size.height())

    def paint(self, painter: QPainter, rect: QRect, mode: QIcon.Mode, state: QIcon.State) -> None:
        ratio = painter.device().devicePixelRatioF()
        painter.drawPixmap(rect, self.pixmap(rect.size() * ratio, mode, state))

    def clone(self) -> QIconEngine:
        _CLONES.append(_IconEngine(*self._drawn))  # or Python deletes what Qt has got
        return _CLONES[-1]


@lru_cache(maxsize=256)
def _icon_picture(name: str, stroke: str, width: int, height: int) -> QPixmap:
    drawing = files("underfoot.assets").joinpath("icons", f"{name}.svg").read_text()
    renderer = QSvgRenderer(drawing.replace("currentColor", stroke).encode())
    edge = min(width, height)
    picture = QPixmap(width, height)
    picture.fill(Qt.GlobalColor.transparent)
    painter = QPainter(picture)
    renderer.render(painter, QRectF((width - edge) / 2, (height - edge) / 2, edge, edge))
    painter.end()
    return picture


def _palette() -> QPalette:
    role = QPalette.ColorRole
    palette = QPalette()
    for which, colour in {
        role.Window: PANEL,
        role.WindowText: TEXT,
        role.Base: RAISED,
        role.AlternateBase: PANEL,
        role.Text: TEXT,
        role.PlaceholderText: MUTED,
        role.Button: RAISED,
        role.ButtonText: TEXT,
        role.BrightText: ALARM,
        role.Highlight: PALETTE["selected"],
        role.HighlightedText: TEXT,
        role.ToolTipBase: RAISED,
        role.ToolTipText: TEXT,
        role.Link: VIBRATION,
        role.Light: LINE,
        role.Midlight: LINE,
        role.Mid: LINE,
        role.Dark: GROUND,
        role.Shadow: GROUND,
        role.Accent: VIBRATION,
    }.items():
        palette.setColor(which, QColor(colour))
    for which in (role.WindowText, role.Text, role.ButtonText):
        palette.setColor(QPalette.ColorGroup.Disabled, which, QColor(FAINT))
    return palette


def _style() -> str:
    return _style_of_text() + _style_of_buttons() + _style_of_fields() + _style_of_views()


def _style_of_text() -> str:
    return f"""
QWidget {{ color: {TEXT}; }}
QMainWindow, QDialog {{ background: {PANEL}; }}
QWidget[role="panel"] {{ background: {PANEL}; }}
QWidget[role="ground"] {{ background: {GROUND}; }}
QDialogButtonBox, QMessageBox {{ dialogbuttonbox-buttons-have-icons: 0; }}
QLabel {{ background: transparent; }}
QLabel[role="title"] {{ font-size: {TITLE_PX}px; font-weight: bold; }}
QLabel[role="heading"] {{ font-size: {SMALL_PX}px; font-weight: bold; color: {MUTED}; }}
QLabel[role="muted"] {{ color: {MUTED}; }}
QLabel[role="small"] {{ color: {MUTED}; font-size: {SMALL_PX}px; }}
QLabel[role="alarm"] {{ color: {ALARM}; }}
QLabel[role="good"] {{ color: {CONTACT}; }}
QLabel[role="force"] {{ color: {FORCE}; }}
QLabel[role="code"] {{ background: {GROUND}; border: 1px solid {LINE}; border-radius: 4px; padding: 6px; }}
QToolTip {{ background: {RAISED}; color: {TEXT}; border: 1px solid {LINE}; padding: 4px 6px;
    qproperty-textFormat: PlainText; }} /* of a file's title, markup would be drawn, and its pictures loaded */
"""


def _style_of_buttons() -> str:
    return f"""
QPushButton, QToolButton, QComboBox {{
    background: {RAISED}; border: 1px solid {RAISED}; border-radius: 4px; padding: 4px 8px; min-height: 18px; }}
QPushButton:hover, QToolButton:hover, QComboBox:hover {{ background: {HOVER}; }}
QPushButton:pressed, QToolButton:pressed {{ background: {LINE}; }}
QPushButton:checked, QToolButton:checked {{ background: {PALETTE["checked"]}; }}
QPushButton:focus, QToolButton:focus, QComboBox:focus, QLineEdit:focus, QPlainTextEdit:focus {{
    border: 1px solid {VIBRATION}; }}
QPushButton:disabled, QToolButton:disabled, QComboBox:disabled {{ color: {FAINT}; }}
QComboBox {{ placeholder-text-color: {MUTED}; }}
QPushButton[role="alarm"] {{
    background: {PALETTE["alarming"]}; border: 1px solid {ALARM}; font-weight: bold;
    color: {PALETTE["alarming text"]}; }}
QPushButton[role="alarm"]:hover {{ background: {PALETTE["alarming hover"]}; }}
QPushButton[role="alarm"]:focus {{ border: 1px solid {TEXT}; }}
QPushButton[role="primary"]:enabled {{ background: {PALETTE["primary"]}; }}
QPushButton[role="tab"], QToolButton[role="tab"] {{
    background: transparent; border-color: transparent; color: {MUTED}; }}
QPushButton[role="tab"]:hover, QToolButton[role="tab"]:hover {{ color: {TEXT}; }}
QPushButton[role="tab"]:disabled, QToolButton[role="tab"]:disabled {{ color: {FAINT}; }}
QToolButton[role="chip"], QPushButton[role="chip"] {{
    background: transparent; border-color: transparent; color: {MUTED}; padding: 1px 2px; font-size: {SMALL_PX}px; }}
QToolButton[role="chip"], QPushButton[role="chip"], QComboBox[role="chip"] {{ min-height: {HIT_PX - 4}px; }}
QPushButton[role="chip"] {{ padding: 1px 6px; min-width: {HIT_PX - 14}px; }}
QToolButton[role="chip"]:hover, QPushButton[role="chip"]:hover {{ color: {TEXT}; }}
QToolButton[role="chip"]:checked, QPushButton[role="chip"]:checked {{ background: {RAISED}; color: {TEXT}; }}
QToolButton[role="chip"]:disabled, QPushButton[role="chip"]:disabled {{ color: {FAINT}; }}
QToolButton[role="chip"]:focus, QPushButton[role="chip"]:focus {{ border: 1px solid {VIBRATION}; }}
QComboBox[role="chip"] {{ padding: 1px 6px; font-size: {SMALL_PX}px; }}
QPushButton[role="tab"]:checked, QToolButton[role="tab"]:checked {{ background: {RAISED}; color: {TEXT}; }}
QPushButton[role="tab"]:focus, QToolButton[role="tab"]:focus {{ border: 1px solid {VIBRATION}; }}
QToolButton[role="flat"], QPushButton[role="flat"] {{
    background: transparent; border-color: transparent; padding: 2px; }}
QToolButton[role="flat"]::menu-indicator {{ image: none; }}
QToolButton[role="flat"]:hover, QPushButton[role="flat"]:hover {{ background: {HOVER}; }}
QToolButton[role="flat"]:focus, QPushButton[role="flat"]:focus {{ border: 1px solid {VIBRATION}; }}
"""


def _style_of_fields() -> str:
    return f"""
QLineEdit, QPlainTextEdit, QAbstractSpinBox {{
    background: {RAISED}; border: 1px solid {RAISED}; border-radius: 4px; padding: 4px 8px;
    selection-background-color: {PALETTE["selected"]}; placeholder-text-color: {MUTED}; }}
QAbstractSpinBox::up-button, QAbstractSpinBox::down-button {{ width: 0; border: none; }}
QLineEdit[role="value"] {{
    background: transparent; border-color: transparent; padding: 1px 3px; min-height: {HIT_PX - 4}px; }}
QLineEdit[role="value"]:hover {{ background: {RAISED}; }}
QLineEdit[role="value"]:focus {{ background: {RAISED}; border: 1px solid {VIBRATION}; }}
QLineEdit[role="bad"] {{ border: 1px solid {ALARM}; padding: 1px 3px; min-height: {HIT_PX - 4}px; }}
QComboBox::drop-down {{ border: none; width: 16px; }}
QComboBox::down-arrow {{
    width: 0; height: 0; margin-right: 6px;
    border-left: 4px solid {RAISED}; border-right: 4px solid {RAISED}; border-top: 5px solid {MUTED}; }}
QComboBox QAbstractItemView {{ background: {RAISED}; border: 1px solid {LINE}; outline: none; }}
"""


def _style_of_views() -> str:
    return f"""
QAbstractItemView {{ outline: none; }}
PatchView {{ border: 1px solid {GROUND}; }}
PatchView:focus {{ border: 1px solid {VIBRATION}; }}
QTreeView, QListView, QTableView {{ background: {PANEL}; border: none; }}
QTreeView::item, QListView::item {{ padding: 1px 3px; border: 1px solid transparent; border-radius: 4px; }}
QTreeView::item:hover, QListView::item:hover {{ background: {RAISED}; }}
QTreeView::item:selected, QListView::item:selected {{ background: {HOVER}; color: {TEXT}; }}
QTreeView::item:focus, QListView::item:focus, QTableView::item:focus {{ border: 1px solid {VIBRATION}; }}
QTableView {{ gridline-color: {LINE}; }}
QAbstractScrollArea::corner {{ background: transparent; border: none; }}
QHeaderView::section {{ background: {PANEL}; color: {MUTED}; border: none; padding: 4px 6px; }}
QTableWidget QHeaderView[role="read"]::section {{ padding: 4px 3px; }}
QHeaderView::up-arrow, QHeaderView::down-arrow {{ subcontrol-position: top center; width: 9px; height: 6px; }}
QScrollArea {{ background: transparent; border: none; }}
QScrollBar:vertical {{ background: transparent; width: 8px; margin: 0; }}
QScrollBar:horizontal {{ background: transparent; height: 8px; margin: 0; }}
QScrollBar::handle {{ background: {LINE}; border-radius: 2px; margin: 2px; min-height: 24px; min-width: 24px; }}
QScrollBar::handle:hover {{ background: {FAINT}; }}
QScrollBar::add-line, QScrollBar::sub-line {{ width: 0; height: 0; }}
QScrollBar::add-page, QScrollBar::sub-page {{ background: transparent; }}
QSplitter::handle {{ background: {LINE}; }}
QMenu {{ background: {RAISED}; border: 1px solid {LINE}; padding: 4px; menu-scrollable: 1; }}
QMenu::item {{ padding: 4px 24px 4px 12px; border-radius: 4px; }}
QMenu::item:selected {{ background: {HOVER}; }}
QMenu::item:disabled {{ color: {FAINT}; background: transparent; }}
QMenu::separator {{ height: 1px; background: {LINE}; margin: 4px 8px; }}
QCheckBox, QRadioButton {{ min-height: {HIT_PX}px; }}
QCheckBox::indicator, QRadioButton::indicator, QAbstractItemView::indicator {{
    width: 13px; height: 13px; border: 1px solid {FAINT}; border-radius: 3px; background: {RAISED}; }}
QRadioButton::indicator {{ border-radius: 7px; }}
QCheckBox::indicator:checked, QAbstractItemView::indicator:checked {{
    background: {VIBRATION}; border-color: {VIBRATION}; image: url({_ICON_FOLDER}/check-{NAME}.svg); }}
QRadioButton::indicator:checked {{ border: 4px solid {VIBRATION}; width: 7px; height: 7px; background: {GROUND}; }}
QCheckBox::indicator:focus, QRadioButton::indicator:focus {{ border-color: {VIBRATION}; }}
QCheckBox::indicator:disabled, QRadioButton::indicator:disabled {{ background: {PANEL}; border-color: {LINE}; }}
QProgressBar {{ background: {RAISED}; border: none; border-radius: 2px; text-align: center; }}
QProgressBar::chunk {{ background: {VIBRATION}; border-radius: 2px; }}
"""


choose_palette("dark")
