"""The floor from above: choosing a tile, pressing on it, and what is drawn on it."""

import numpy as np
import pytest
from on_screen import place_on, show
from PySide6.QtCore import QPoint, QPointF, QRectF, Qt
from PySide6.QtGui import QColor

from underfoot.floor.contacts import OngoingContact
from underfoot.floor.layout import Floor, Tile, default_floor
from underfoot.widgets import theme
from underfoot.widgets.floor_map import FloorMap, label_places


@pytest.fixture
def turned():
    """Three tiles, one of them turned by 30 degrees."""
    pads = ((0.1, 0.1), (-0.1, 0.1), (-0.1, -0.1), (0.1, -0.1))
    return Floor(
        (
            Tile("a", (0.3, 0.3), (0.0, 0.0), 0.0, pads),
            Tile("b", (0.3, 0.3), (0.5, 0.0), 30.0, pads[1:] + pads[:1]),
            Tile("c", (0.3, 0.3), (0.0, 0.5), 0.0, pads),
        )
    )


@pytest.fixture
def floor_map(qtbot, turned):
    made = FloorMap()
    qtbot.addWidget(made)
    made.resize(400, 400)
    made.set_floor(turned)
    show(qtbot, made)
    return made


def test_a_map_without_a_floor_says_so(qtbot):
    """As that of Recordings, below its heading, while no recording is open."""
    made = FloorMap()
    qtbot.addWidget(made)
    made.resize(200, 100)
    image = made.grab().toImage()
    seen = {image.pixelColor(x, y).name() for x in range(200) for y in range(100)}
    assert QColor(theme.MUTED).name() in seen
    assert made.accessibleDescription() == "no floor"
    show(qtbot, made)
    qtbot.mouseMove(made, QPoint(60, 50))  # which raised an error, as the map looked for another tile


def test_a_click_chooses_the_tile_under_it(floor_map, qtbot, turned):
    for tile in (turned.tiles[2], turned.tiles[1], turned.tiles[0]):
        with qtbot.waitSignal(floor_map.tile_chosen) as chosen:
            qtbot.mouseClick(floor_map, Qt.MouseButton.LeftButton, pos=place_on(floor_map, tile, 0.14, 0.14))
        assert chosen.args == [tile.id]
    assert floor_map.tile_at(QPointF(2, 2)) == ""


def test_arrows_go_to_the_next_tile_that_way(floor_map, qtbot):
    for key, tile in ((Qt.Key.Key_Right, "b"), (Qt.Key.Key_Left, "a"), (Qt.Key.Key_Up, "c"), (Qt.Key.Key_Down, "a")):
        qtbot.keyClick(floor_map, key)
        assert floor_map.chosen_tile() == tile
        assert floor_map.accessibleDescription().startswith(f"Tile {tile} is selected.")
    qtbot.keyClick(floor_map, Qt.Key.Key_Down)
    assert floor_map.chosen_tile() == "a"


def test_a_loaded_tile_that_is_off_its_command_says_so_where_it_can_be_read(floor_map, turned):
    """Red on amber has a contrast below 2: the words have the ground behind them, which palettes are tested for."""

    def grounds():
        image = floor_map.grab().toImage()
        corners = (place_on(floor_map, turned.tiles[0], -0.14, 0.0), place_on(floor_map, turned.tiles[0], 0.14, -0.14))
        (left, top), (right, bottom) = ((corner.x(), corner.y()) for corner in corners)
        inside = [image.pixelColor(x, y).name() for x in range(left, right) for y in range(top, bottom)]
        return inside.count(theme.GROUND), inside.count(theme.ALARM)

    floor_map.set_loads([800.0, 0.0, 0.0], [False] * 3)
    image, corner = floor_map.grab().toImage(), place_on(floor_map, turned.tiles[0], -0.15, 0.15)
    name = [image.pixelColor(corner.x() + x, corner.y() + y).lightness() for x in range(4, 24) for y in range(4, 18)]
    assert max(name) > QColor(theme.MUTED).lightness()
    assert grounds() == (0, 0)
    floor_map.set_deviating([True, False, False])
    ground, alarm = grounds()
    assert ground > alarm > 0


def test_who_stands_on_a_loaded_tile_can_be_read(floor_map, turned):
    """Green on amber has a contrast below 3: a name has the ground behind it."""
    floor_map.set_loads([0.0, 0.0, 800.0], [False] * 3)
    contacts = [OngoingContact(1, 0.0, 0.5, 800.0, (2,), person=person) for person in (0, 3)]

    def ground(contact):
        floor_map.set_contacts([contact], 1.0)
        image, middle = floor_map.grab().toImage(), place_on(floor_map, turned.tiles[2])
        names = [image.pixelColor(middle.x() + x, middle.y() + y).name() for x in range(60) for y in range(-8, 9)]
        return names.count(theme.GROUND)

    assert ground(contacts[0]) == 0
    assert ground(contacts[1]) > 60


@pytest.mark.parametrize("x_m", [-0.1, 0.0, 0.1])
@pytest.mark.parametrize("y_m", [-0.1, 0.0, 0.1])
def test_the_name_of_who_stands_there_does_not_cover_the_newtons_of_a_small_floor(floor_map, turned, x_m, y_m):
    floor_map.resize(240, 240)
    at = turned.tiles[2].to_floor((x_m, y_m))

    def picture(load_n, person):
        floor_map.set_loads([0.0, 0.0, load_n], [False] * 3)
        floor_map.set_contacts([OngoingContact(1, *at, 800.0, (2,), person=person)], 1.0)
        return floor_map.grab().toImage()

    alone, other = picture(800.0, 0), picture(801.0, 0)
    spots = [(x, y) for x in range(240) for y in range(240) if alone.pixel(x, y) != other.pixel(x, y)]
    assert 5 < len(spots) < 100  # of the last digit
    named = picture(800.0, 3)
    assert named != alone
    assert all(named.pixel(x, y) == alone.pixel(x, y) for x, y in spots)


@pytest.mark.parametrize(("side_px", "at_m"), [(520, (0.08, 0.1)), (400, (0.0, 0.0))])
def test_a_foot_does_not_cover_the_newtons_of_its_tile_among_36(qtbot, side_px, at_m):
    """Where no line of the tile is free of its circle, they are written over it."""
    floor = default_floor(6, 6)
    map = FloorMap()
    qtbot.addWidget(map)
    map.resize(side_px, side_px)
    map.set_floor(floor)
    x_m, y_m = floor.tiles[14].to_floor(at_m)

    def changed(other_n, contacts):
        pictures = []
        for load_n in (700.0, other_n):
            map.set_loads([load_n if row == 14 else 0.0 for row in range(36)], [False] * 36)
            map.set_contacts(contacts, 1.0)
            pictures.append(map.grab().toImage())
        one, other = pictures
        return sum(one.pixel(x, y) != other.pixel(x, y) for x in range(side_px) for y in range(side_px))

    assert changed(701.0, [OngoingContact(1, x_m, y_m, 700.0, (14,))]) >= 0.7 * changed(701.0, []) > 5


def test_a_faulty_sensor_is_marked_in_its_corner_and_named_under_the_mouse(floor_map, qtbot, turned):
    """It was told once, in a line that is gone after some seconds: a technician looks at the floor."""
    before = floor_map.grab().toImage()
    floor_map.set_faults({("b", 2): "sensor 2 is dead (reads 0)"})
    after = floor_map.grab().toImage()
    changed = [QPointF(x, y) for x in range(400) for y in range(400) if before.pixel(x, y) != after.pixel(x, y)]
    corner = turned.tiles[1].to_floor((-0.15, -0.15))  # sensor 2 is at -0.1, -0.1, of a tile that is turned
    place = floor_map.to_screen().map(QPointF(*corner))
    assert 50 < len(changed) < 150
    assert max((spot - place).manhattanLength() for spot in changed) < 21
    for tile, said in ((1, True), (2, False)):
        qtbot.mouseMove(floor_map, place_on(floor_map, turned.tiles[tile]))
        assert floor_map.toolTip().startswith("b: sensor 2 is dead (reads 0).") == said
    assert "dead" not in floor_map.accessibleDescription()  # of the chosen tile
    floor_map.choose_tile("b")
    floor_map.set_loads([0.0] * 3, [False, True, False])
    assert "sensor 2 is dead (reads 0).\nb: untared, as" in floor_map.accessibleDescription()
    floor_map.set_faults({})
    floor_map.set_loads([0.0] * 3, [False] * 3)
    floor_map.choose_tile("a")
    assert floor_map.grab().toImage() == before
    floor_map.set_faults({("b", 2): "sensor 2 is dead (reads 0)"})
    floor_map.set_floor(turned)  # of another session
    assert floor_map.grab().toImage() == before


def test_the_mouse_presses_in_the_tiles_own_frame_and_lets_go(floor_map, qtbot, turned):
    floor_map.can_press = True
    floor_map.set_press(200.0)
    said = []
    floor_map.pressed.connect(lambda *press: said.append(press))
    tile = turned.tiles[1]
    qtbot.mousePress(floor_map, Qt.MouseButton.LeftButton, pos=place_on(floor_map, tile, 0.1, -0.05))
    qtbot.mouseMove(floor_map, place_on(floor_map, tile, 0.0, 0.1))
    qtbot.mouseMove(floor_map, QPoint(1, 1))
    qtbot.mouseRelease(floor_map, Qt.MouseButton.LeftButton, pos=QPoint(1, 1))
    assert said[0] == ("b", pytest.approx(0.1, abs=2e-3), pytest.approx(-0.05, abs=2e-3), 200.0)
    assert said[1] == ("b", pytest.approx(0.0, abs=2e-3), pytest.approx(0.1, abs=2e-3), 200.0)
    assert said[2:] == [("b", 0.0, 0.0, 0.0)]


def test_a_press_ends_when_the_floor_is_hidden(floor_map, qtbot, turned):
    floor_map.can_press = True
    qtbot.mousePress(floor_map, Qt.MouseButton.LeftButton, pos=place_on(floor_map, turned.tiles[0]))
    with qtbot.waitSignal(floor_map.pressed) as let_go:
        floor_map.hide()
    assert let_go.args[3] == 0.0


def test_nobody_presses_on_a_real_floor(floor_map, qtbot, turned):
    with qtbot.assertNotEmitted(floor_map.pressed):
        qtbot.mouseClick(floor_map, Qt.MouseButton.LeftButton, pos=place_on(floor_map, turned.tiles[2]))


def test_a_loaded_tile_is_amber_and_a_foot_is_green(floor_map, turned):
    def colour(tile, x_m, y_m):
        at = place_on(floor_map, tile, x_m, y_m)
        return floor_map.grab().toImage().pixelColor(at)

    empty = colour(turned.tiles[2], 0.0, 0.0)
    floor_map.set_loads(np.array([0.0, 0.0, 800.0]), np.array([False, True, False]))
    floor_map.set_contacts([OngoingContact(1, 0.0, 0.5, 800.0, (2,))], 1.0)
    loaded, foot = colour(turned.tiles[2], 0.0, -0.12), colour(turned.tiles[2], 0.0, 0.0)
    assert loaded.red() > empty.red() + 40
    assert foot.green() > foot.red()


def test_a_step_of_a_preview_is_shown_for_a_while(floor_map, qtbot):
    before = floor_map.grab().toImage()
    floor_map.show_step("b")
    assert floor_map.grab().toImage() != before
    qtbot.waitUntil(lambda: floor_map.grab().toImage() == before)


@pytest.mark.parametrize("apart", [(30.0, 0.0), (0.0, 20.0), (12.0, 12.0), (0.0, 0.0)])
@pytest.mark.parametrize("corner", [(40.0, 40.0), (200.0, 150.0), (390.0, 290.0)])
def test_labels_of_people_side_by_side_cover_neither_each_other_nor_a_foot(apart, corner):
    area = QRectF(0.0, 0.0, 400.0, 300.0)
    feet = [QRectF(corner[0] - 8.0 + k * apart[0], corner[1] - 8.0 + k * apart[1], 16.0, 16.0) for k in (0, -1)]
    labels = label_places(feet, feet, 52.0, area)
    assert not labels[0].intersects(labels[1])
    for label in labels:
        assert area.contains(label)
        assert not any(label.intersects(foot) for foot in feet)
