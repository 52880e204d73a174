"""Footprints can be read: the lengths of steps lie over all prints, and not over one another."""

from itertools import combinations

import numpy as np

from underfoot.devices.simulated_floor import SimulatedFloor
from underfoot.floor.contacts import OngoingContact
from underfoot.floor.footsteps import Step
from underfoot.floor.layout import default_floor
from underfoot.scenes import discover
from underfoot.scenes.footprints import WORDS_M
from underfoot.scenes.moments import Moment
from underfoot.scenes.rehearsal import rehearse
from underfoot.scenes.shapes import Polygon, Text


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


def test_of_feet_that_land_together_each_has_its_own_step():
    """Of four people two in five prints had the side and the length of another one's step."""
    scene = discover()["footprints"](default_floor())
    rolls = ((0,), (0, 2), (0,)), ((3,), (3,), (3,))
    for k in range(3):
        feet = (OngoingContact(n + 1, 0.1, 0.1, 300.0, tiles[k], 1.0 + 0.02 * n) for n, tiles in enumerate(rolls))
        list(scene.step(Moment(1.03 + 0.01 * k, tuple(feet))))
    of_second, of_first = Step(1, "t4", "left", 1.0, *[1.0] * 8), Step(2, "t3", "right", 0.9, *[1.0] * 8)
    list(scene.step(Moment(2.5, steps=(of_second, of_first))))
    assert [one.step for one in scene.prints] == [of_first, of_second]


def test_a_left_sole_is_the_mirror_image_of_a_right_one_with_the_toes_ahead_and_inwards():
    def sole(side):
        scene, foot = discover()["footprints"](default_floor()), OngoingContact(1, 0.3, 0.2, 300.0, (0,), 1.0)
        list(scene.step(Moment(1.01, (foot,))))
        known = Step(1, "t1", side, 1.0, *[1.0] * 8, heading_deg=90.0)
        list(scene.step(Moment(2.5, (foot,), steps=(known,))))
        return np.concatenate([shape.points_m for shape in scene.shapes() if isinstance(shape, Polygon)])

    left, right = sole("left") - (0.3, 0.2), sole("right") - (0.3, 0.2)
    np.testing.assert_allclose(left, right * (-1.0, 1.0), atol=1e-12)
    np.testing.assert_allclose(np.ptp(left, axis=0), (0.1, 0.28), atol=0.005)
    toe, heel = left[np.argmax(left[:, 1])], left[np.argmin(left[:, 1])]
    assert toe[1] > 0.13 > -0.13 > heel[1]
    assert toe[0] > 0.0 > heel[0]


def test_a_print_and_its_length_fade_together_from_when_the_foot_has_gone():
    scene, foot = discover()["footprints"](default_floor()), OngoingContact(1, 0.3, 0.2, 300.0, (0,), 1.0)
    list(scene.step(Moment(1.01, (foot,))))
    step = Step(1, "t1", "left", 1.0, *[1.0] * 8, heading_deg=90.0, step_length_mm=600.0)
    list(scene.step(Moment(5.0, (foot,), steps=(step,))))

    def opacities():
        *soles, length, _ = (shape.opacity for shape in scene.shapes())
        return {round(opacity / 0.85, 9) for opacity in soles}, length

    assert opacities() == ({1.0}, 1.0)
    list(scene.step(Moment(6.0, up=(foot,))))
    list(scene.step(Moment(10.0)))
    assert opacities() == ({0.25}, 0.25)
