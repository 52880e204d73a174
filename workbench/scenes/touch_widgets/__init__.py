"""Touch widgets (thesis 5.6): button, toggle and slider for the feet, with felt clicks and friction."""

from collections.abc import Iterable, Mapping
from typing import Any

from underfoot.floor.layout import Floor
from underfoot.parameters import Number
from underfoot.quantities import counted
from underfoot.scenes.cues import Cue
from underfoot.scenes.moments import Moment
from underfoot.scenes.scene import Scene
from underfoot.scenes.shapes import Disc, Shape
from underfoot.scenes.touch_widgets.controls import Button, Control, Feel, Slider, Toggle


class TouchWidgets(Scene):
    """Controls in the middle of the floor, independent of tile edges."""

    title = "Touch widgets"
    doc = (
        "A button, a toggle and a slider to be pressed and dragged with a foot. A press clicks under the foot, and "
        "clicks again, softer, as it is let go; a slider is felt as it slips along."
    )
    engage_n = Number(
        35.0, 5.0, 500.0, unit="N", scale="log", label="Force", doc="a press has this force; it ends below half of it"
    )
    grain_m = Number(
        0.004, 0.001, 0.05, unit="m", scale="log", label="Grain", doc="a slider's way from slip to slip, in the mean"
    )
    size_m = Number(0.165, 0.05, 0.5, unit="m", label="Size", doc="diameter of the button; from the next start on")

    def __init__(self, floor: Floor, given: Mapping[str, Any] | None = None, seed: int = 1) -> None:
        super().__init__(floor, given, seed)
        low, high = floor.bounds_m()
        x, y = (0.5 * (low + high)).tolist()
        size = self.given["size_m"]
        self.button = Button("Button", x - 0.85 * size, y + 0.65 * size, size, size)
        self.toggle = Toggle("Toggle", x + 0.85 * size, y + 0.65 * size, size, 0.5 * size)
        self.slider = Slider("Slider", x, y - 0.75 * size, 2.7 * size, 0.5 * size)
        self.controls: tuple[Control, ...] = (self.button, self.toggle, self.slider)
        self._moment = Moment(0.0)

    def step(self, moment: Moment) -> Iterable[Cue]:
        self._moment = moment
        feel = Feel(self.given["engage_n"], self.given["grain_m"])
        free = {contact.id for contact in moment.contacts} - {control.held_by for control in self.controls}
        for control in self.controls:
            yield from control.step(moment, free, feel, self.draws)

    def shapes(self) -> Iterable[Shape]:
        for control in self.controls:
            yield from control.shapes()
        for contact in self._moment.contacts:
            yield Disc(contact.x_m, contact.y_m, 0.018, "#7ed491", rim_m=0.004)

    def places_m(self) -> list[tuple[float, float]]:
        """Return the middles of the controls; for the slider, that of its knob."""
        return [control.place_m for control in self.controls]

    @property
    def state(self) -> str:
        toggle = "on" if self.toggle.is_on else "off"
        presses = counted(self.button.presses, "time")
        return f"button pressed {presses}, toggle {toggle}, slider {100.0 * self.slider.value:.0f} %"
