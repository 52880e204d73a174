"""A single strike as the Impact node runs it, to measure its cost and accuracy."""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from underfoot.clock import RATE_HZ
from underfoot.models.modal import contact_motion, hammer, phasors
from underfoot.models.signals.events import event_list

_SECONDS = 0.1
_TIGHT = 1e-10


def timed_work(values: Mapping[str, Any], *, shows: bool = False) -> Callable[[], hammer.Response]:
    """Prepare a strike with the values of an Impact node; return a function that strikes once and lets it ring.

    With `shows` the displacement is computed too, which costs more.

    >>> modes = [(200.0, 30.0, 1.0, 1.0)]
    >>> numbers = {"velocity": 0.5, "mass": 0.05, "stiffness": 1e5, "exponent": 1.5, "damping": 0.3, "error": 1e-3}
    >>> struck = timed_work({"modes": modes, "pitch": 1.0, "decay": 1.0, **numbers})()
    >>> struck.acceleration.size
    4800
    """
    modes = np.array(sorted(values["modes"], key=lambda mode: mode[1]), np.float64).reshape(-1, 4).T
    sizes = phasors.sizes(modes.shape[1])
    known, state = contact_motion.OBJECT.zeros(**sizes), contact_motion.STATE.zeros(row=sizes["row"])
    hammer.design(
        np.ascontiguousarray(modes), values["pitch"], values["decay"], float(RATE_HZ), hammer.FLOOR_M_S2, known
    )
    thrown = hammer.HAMMER.zeros()
    for name in ("mass", "stiffness", "exponent", "damping", "error"):
        setattr(thrown, name, values[name])
    frames = round(_SECONDS * RATE_HZ)
    out = hammer.Response(np.empty(frames), np.empty(frames), np.empty(frames if shows else 0))
    strike = event_list((0.0, values["velocity"]))

    def once() -> hammer.Response:
        state.values[:] = 0.0
        hammer.ring(strike, thrown, 0, known, state, out)
        return out

    return once


def measured_error(values: Mapping[str, Any]) -> float:
    """Return the relative L2 error of a strike's displacement, against one with very small sub-steps.

    `values` are the parameters of the node "impact"; one of them is the `error` that is asked for.

    >>> from underfoot.nodes import REGISTRY
    >>> node = {name: one.default for name, one in REGISTRY["impact"].parameters.items()}
    >>> measured_error({**node, "error": "1e-3"}) < 1e-3
    True
    """
    found, truth = (timed_work({**values, "error": error}, shows=True)() for error in (values["error"], _TIGHT))
    size = float(np.linalg.norm(truth.displacement))
    return float(np.linalg.norm(found.displacement - truth.displacement)) / size if size > 0.0 else 0.0
