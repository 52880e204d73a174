"""A sensor's curve that is a straight line."""

from underfoot.floor.curves import Curve


def line(slope=0.01, rest=1000.0, full=500.0, **more):
    """From a reading of `rest` without load to `full` newtons, `slope` newtons a count."""
    return Curve(
        family="power",
        unloaded_reading=rest,
        full_scale_n=full,
        readings=(rest, rest + full / slope),
        forces_n=(0.0, full),
        slopes=(slope,) * 2,
        **more,
    )
