"""The control of a node's parameter in the inspector: a picture where there is one for its values."""

from underfoot.parameters import Numbers, Parameter, Rows
from underfoot.widgets.controls.bars_editor import BarsEditor
from underfoot.widgets.controls.curve_editor import CurveEditor, is_curve
from underfoot.widgets.controls.fields import ParameterEditor
from underfoot.widgets.controls.modes_editor import ModesEditor, is_modes
from underfoot.widgets.controls.parameter_editor import editor_for
from underfoot.widgets.design.rhythm_editor import RhythmEditor, is_rhythm


def pictured_editor_for(parameter: Parameter) -> ParameterEditor:
    """Return the control of a parameter: a picture if there is one for its values."""
    if isinstance(parameter, Numbers):
        return BarsEditor(parameter)
    if isinstance(parameter, Rows):
        for fits, editor in ((is_rhythm, RhythmEditor), (is_modes, ModesEditor), (is_curve, CurveEditor)):
            if fits(parameter):
                return editor(parameter)
    return editor_for(parameter)
