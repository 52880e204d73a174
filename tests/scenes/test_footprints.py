"""Footprints can be read: the lengths of steps lie over all prints, and not over one another."""

from itertools import combinations

from underfoot.devices.simulated_floor import SimulatedFloor
from underfoot.floor.layout import default_floor
from underfoot.scenes import discover
from underfoot.scenes.footprints import WORDS_M
from underfoot.scenes.rehearsal import rehearse
from underfoot.scenes.shapes import Text


def test_lengths_of_steps_are_read_where_a_walker_treads_again_and_again():
    scene = discover()["footprints"](default_floor())
    rehearse(scene, SimulatedFloor(default_floor()), 12.0)
    shapes = list(scene.shapes())
    words = [shape for shape in shapes if isinstance(shape, Text)]
    assert shapes[-len(words) :] == words
    lengths = [shape for shape in words if shape.text.endswith("cm")]
    assert lengths
    known = [one.step.step_length_mm for one in scene.prints if one.step is not None]
    assert {shape.text for shape in lengths} <= {f"{0.1 * length_mm:.0f} cm" for length_mm in known}
    for one, other in combinations(lengths, 2):
        assert abs(one.x_m - other.x_m) > WORDS_M[0] or abs(one.y_m - other.y_m) > WORDS_M[1]
