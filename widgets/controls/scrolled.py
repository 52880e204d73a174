"""Parts of a window that scroll where there is no room for all of them."""

from PySide6.QtCore import QEvent, QObject, QPoint, QSize, Qt
from PySide6.QtGui import QKeyEvent, QResizeEvent, QWheelEvent
from PySide6.QtWidgets import QScrollArea, QSizePolicy, QStackedWidget, QVBoxLayout, QWidget

from underfoot.widgets import theme


class Scrolled(QScrollArea):
    """As high as what it holds, or as there is room for: in a low window it scrolls, by the wheel and by keys.

    It takes no focus: keys come from what it holds, or by `scroll_by`.
    """

    def __init__(self, held: QWidget) -> None:
        super().__init__()
        self._held = held
        self.setWidget(held)
        held.setAutoFillBackground(False)  # which `setWidget` turns on; what is behind shows the ground
        self.setSizePolicy(QSizePolicy.Policy.Preferred, QSizePolicy.Policy.Maximum)
        self.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self.setFocusPolicy(Qt.FocusPolicy.NoFocus)

    def scroll_by(self, event: QKeyEvent | QWheelEvent) -> bool:
        """Scroll by a key or the wheel that came elsewhere; return whether it was of use."""
        self.verticalScrollBar().event(event)  # not sent: what it does not use would come back here
        return event.isAccepted()

    def show_whole(self, part: QWidget) -> None:
        """Scroll to a part; Qt's own scrolls to the cursor of a field, which may be all that is then seen of it."""
        half = part.height() // 2
        self.ensureVisible(0, part.mapTo(self._held, QPoint(0, half)).y(), 0, half + theme.GRID)

    def focusNextPrevChild(self, next: bool) -> bool:
        has_moved = super().focusNextPrevChild(next)
        part = self._held.focusWidget()
        if has_moved and part is not None and part.hasFocus():
            self.show_whole(part)
        return has_moved

    def sizeHint(self) -> QSize:
        return QSize(self._held.sizeHint().width(), self._height())

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        if event.type() == QEvent.Type.LayoutRequest:
            self._grow()
            self._fit()
        return super().eventFilter(watched, event)

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self._fit()

    def _height(self) -> int:
        """Return the height of what is held in the present width; Qt's own would be that in the least width."""
        held = self._held
        return held.heightForWidth(self.viewport().width()) if held.hasHeightForWidth() else held.sizeHint().height()

    def _grow(self) -> None:
        """Take the room for what is held before that has its new height: for one picture a bar would be seen."""
        self.updateGeometry()
        around = self.parentWidget()
        layout = around.layout() if around is not None else None
        if layout is not None:
            layout.activate()

    def _fit(self) -> None:
        self._held.resize(self.viewport().width(), max(self._height(), self.viewport().height()))
        self.updateGeometry()


class Pages(QScrollArea):
    """Shows one page at a time, made within `inside`, and scrolls it.

    What gets another parent, or none, is styled again with all that it has: half of what a page with twenty fields
    takes. So a page is not taken out, but hidden, until it is deleted.
    """

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setWidgetResizable(True)
        self.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self.inside = QWidget()
        self.setWidget(self.inside)
        self.page = QWidget(self.inside)
        self._column = QVBoxLayout(self.inside)
        self._column.setContentsMargins(0, 0, 0, 0)
        self._column.addWidget(self.page)

    def show_page(self, page: QWidget) -> None:
        """Show this page in place of the present one, which is deleted later: it may be handling a key just now."""
        focused = self.window().focusWidget()
        if focused is not None and self.page.isAncestorOf(focused):
            focused.clearFocus()  # or Qt gives it to a neighbour
        self.page.hide()
        self.page.deleteLater()
        self._column.addWidget(page)
        self.page = page
        page.show()


def scroll_area() -> QScrollArea:
    """Return an area that is filled by what it will hold, and that Tab passes by."""
    area = QScrollArea()
    area.setWidgetResizable(True)
    area.setFocusPolicy(Qt.FocusPolicy.NoFocus)
    return area


def scrolling(held: QWidget) -> QScrollArea:
    """Return what is held so that it scrolls on a screen that is too small for it, instead of overlapping."""
    theme.fill(held, "ground")
    area = scroll_area()
    area.setWidget(held)
    return area


def scroll_in(page: QWidget, held: QWidget) -> QScrollArea:
    """Fill a page without a layout with what is held, so that it scrolls; what its layout gets later stays in sight."""
    area = scrolling(held)
    layout = QVBoxLayout(page)
    layout.setContentsMargins(0, 0, 0, 0)
    layout.setSpacing(0)
    layout.addWidget(area, 1)
    return area


def scrolling_pages(pages: QStackedWidget) -> QScrollArea:
    """Return the pages so that they scroll; another page begins at its corner."""
    area = scrolling(pages)
    for bar in (area.horizontalScrollBar(), area.verticalScrollBar()):
        pages.currentChanged.connect(lambda _, bar=bar: bar.setValue(0))
    return area
