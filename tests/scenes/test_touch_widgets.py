"""Controls for feet under simulated hands: thresholds, capture, clicks and slips; targets and footprints, too."""

import numpy as np
import pytest
from timed_presses import TimedPress, rehearse_presses

from underfoot.devices.simulated_floor import SimulatedFloor
from underfoot.experiments.methods.target_selection import TargetSelection
from underfoot.floor.layout import default_floor
from underfoot.nodes import REGISTRY
from underfoot.patch import preset_files
from underfoot.patch.patch import Patch
from underfoot.scenes import discover
from underfoot.scenes.cues import Play, nearest_tile
from underfoot.scenes.rehearsal import rehearse
from underfoot.scenes.shapes import Text

FLOOR = default_floor()
KINDS = discover()


def hand(time_s, x_m, y_m, force_n):
    """Return the press of a hand at a place of the floor."""
    tile = FLOOR.tiles[FLOOR.index(nearest_tile(FLOOR, x_m, y_m))]
    return TimedPress(time_s, tile.id, *tile.to_tile((x_m, y_m)).tolist(), force_n)


def test_a_button_clicks_down_and_softer_up():
    scene = KINDS["touch-widgets"](FLOOR)
    at = (scene.button.x_m, scene.button.y_m)
    done = rehearse_presses(scene, [hand(0.3, *at, 200.0), hand(0.7, *at, 0.0)], 1.2)
    assert scene.state.startswith("button pressed 1 time, ")
    assert [(strike.node, strike.strength) for strike in done.strikes] == [("click", 1.0), ("click", 0.6)]
    assert done.said == ["Button down, press 1", "Button up"]
    times = [time_s for time_s, cue in done.cues if cue in done.strikes]
    assert times == pytest.approx([0.31, 0.72], abs=0.03)


def test_a_press_needs_the_force_and_holds_until_half_of_it():
    scene = KINDS["touch-widgets"](FLOOR)
    at = (scene.button.x_m, scene.button.y_m)
    forces = (30.0, 40.0, 20.0, 30.0, 40.0, 12.0, 30.0)  # on at 35, off below 17.5
    done = rehearse_presses(scene, [hand(0.3 + 0.3 * k, *at, force) for k, force in enumerate(forces)], 2.6)
    assert done.said == ["Button down, press 1", "Button up"]


def test_a_toggle_changes_as_it_is_pressed_and_not_as_it_is_let_go():
    scene = KINDS["touch-widgets"](FLOOR)
    at = (scene.toggle.x_m, scene.toggle.y_m)
    done = rehearse_presses(scene, [hand(0.3 + 0.3 * k, *at, 200.0 * (k % 2 == 0)) for k in range(4)], 1.6)
    assert done.said == ["Toggle on", "Toggle off"]


def test_each_control_clicks_under_whoever_presses_where_it_says():
    scene = KINDS["touch-widgets"](FLOOR)
    assert len(scene.places_m()) == 3
    for aside_m in (-0.03, 0.03):  # a slider lies on several tiles: it clicks on that of the foot
        for x_m, y_m in scene.places_m():
            done = rehearse_presses(
                scene, [hand(0.3, x_m + aside_m, y_m, 200.0), hand(0.7, x_m + aside_m, y_m, 0.0)], 1.2
            )
            clicks = [strike for strike in done.strikes if strike.node == "click"]
            tile = nearest_tile(FLOOR, x_m + aside_m, y_m)
            assert [nearest_tile(FLOOR, click.x_m, click.y_m) for click in clicks] == [tile, tile]


def test_a_slider_follows_over_a_tile_edge_and_slips_about_once_a_grain():
    scene = KINDS["touch-widgets"](FLOOR)
    slider = scene.slider
    begin, way = slider.x_m + 0.01, 0.1  # the middle is between two tiles
    hands = [hand(0.3 + 0.01 * k, begin + way * k / 60, slider.y_m, 200.0) for k in range(61)]
    done = rehearse_presses(scene, [*hands, hand(1.2, begin + way, slider.y_m, 0.0)], 1.6)
    slips = [strike for strike in done.strikes if strike.node == "slip"]
    assert slider.value == pytest.approx(0.5 + way / (slider.width_m - slider.height_m), abs=0.02)
    assert len(slips) == pytest.approx(way / 0.004, rel=0.25)
    assert [slip.at_s for slip in slips] == sorted(slip.at_s for slip in slips)
    assert done.said[-1] == f"Slider at {100 * slider.value:.0f} %"


def test_a_foot_beside_all_controls_does_nothing():
    scene = KINDS["touch-widgets"](FLOOR)
    done = rehearse_presses(scene, [hand(0.3, -0.29, -0.29, 500.0), hand(0.8, -0.29, -0.29, 0.0)], 1.2)
    assert not done.cues


def test_targets_are_those_of_the_study_hit_or_missed():
    scene = KINDS["target-selection"](FLOOR, {"visible_s": 0.5, "pause_s": 0.2, "widths_m": [0.165]})
    of_method = {name: value for name, value in scene.given.items() if name in TargetSelection.parameters}
    assert TargetSelection.checked(of_method, {})["widths_m"] == (0.165,)
    first, second = list(scene.left)[:2]
    x, y = scene.origin_m[0] + first.facts["x_m"], scene.origin_m[1] + first.facts["y_m"]
    done = rehearse_presses(scene, [hand(0.35, x, y, 200.0), hand(0.5, x, y, 0.0)], 1.5)
    assert [line.split()[0].strip(",") for line in done.said if "left out" not in line] == ["hit", "missed"]
    assert scene.times_s == pytest.approx([0.14], abs=0.03)
    assert len(done.strikes) == 1
    assert second not in scene.left


def test_after_the_last_target_the_floor_says_done_also_where_it_was_hit():
    scene = KINDS["target-selection"](FLOOR, {"pause_s": 0.2, "widths_m": [0.165]})
    while len(scene.left) > 1:
        scene.left.pop()
    x, y = (scene.origin_m[k] + scene.left[0].facts[name] for k, name in enumerate(("x_m", "y_m")))
    rehearse_presses(scene, [hand(0.35, x, y, 200.0), hand(0.5, x, y, 0.0)], 1.0)
    assert len(scene.times_s) == 1
    assert [shape.text for shape in scene.shapes() if isinstance(shape, Text)] == ["Done"]


def test_steps_are_counted_as_the_floor_knows_them():
    scene = KINDS["footprints"](FLOOR)
    source = SimulatedFloor(FLOOR)
    done = rehearse(scene, source, 10.0)
    assert scene.steps == sum(len(moment.steps) for moment in done.moments) > 10
    known = [one for one in scene.prints if one.step is not None]
    assert known
    for one in known:  # the print lies where the walker's foot was
        steps = source.footfalls[np.abs(source.footfalls["start_s"] - one.contact.start_s) < 0.1]
        middle = 0.5 * steps["length_m"]
        x = steps["heel_x_m"] + middle * steps["cos_heading"]
        y = steps["heel_y_m"] + middle * steps["sin_heading"]
        assert np.hypot(x - one.at_m[0], y - one.at_m[1]).min() < 0.06


def test_a_ground_is_played_beside_nothing_at_its_gain():
    scene = KINDS["footprints"](FLOOR, {"ground": "gravel", "gain": 0.5})
    done = rehearse(scene, SimulatedFloor(FLOOR, walking=False), 0.1)
    plays = [cue for _, cue in done.cues if isinstance(cue, Play)]
    assert len(plays) == 1
    gravel = Patch.load(preset_files.patches()["gravel"], REGISTRY)
    played = plays[0].beside(Patch(), FLOOR, REGISTRY)
    limited = Play(gravel, "t2", 0.5).beside(Patch(), FLOOR, REGISTRY)
    for node in gravel.nodes:
        if REGISTRY[node.type].is_sink:
            level = REGISTRY[node.type].values(node.parameters)["level"]
            assert played.node(node.id).parameters["level"] == 0.5 * level
            assert limited.node(node.id).parameters["tiles"] == "t2"
