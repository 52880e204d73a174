"""Distributions of a fibre bundle as pictures: load over strain, event sizes, intervals between events (7.2.3)."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from underfoot.drawing import Drawing, Series
from underfoot.models.fibre_bundle.bundle import FibreBundle

_RATE, _RISE_S, _HOLD_S = 48_000.0, 0.8, 0.2
_BUNDLES = 8
_BEYOND = 1.05
"""Final load, relative to the critical load: every bundle breaks before it."""


def bundle_of(values: Mapping[str, Any]) -> FibreBundle:
    """Return the bundle of a node with these `values`."""
    return FibreBundle(**{name: values[name] for name in FibreBundle.__struct_fields__ if name in values})


def bundle_drawings(values: Mapping[str, Any], title: str = "Load over strain") -> tuple[Drawing, ...]:
    """Return drawings of a node's bundle under a load that rises in 0.8 s: newtons over strain, event sizes, intervals.

    The first shows one bundle beside the quasi-static limit of an infinite one, N (1 - P(x)) k_F x; the others, eight.
    `title` is that of the first one; `values` are those of the node "fibre-bundle".

    >>> from underfoot.nodes import REGISTRY
    >>> node = {name: one.initial for name, one in REGISTRY["fibre-bundle"].parameters.items()}
    >>> bundle_drawings(node)[0].y
    'load, N'
    """
    bundle = bundle_of(values)
    newton = values["strength"] / bundle.critical_stress
    rise = np.minimum(np.arange(round((_RISE_S + _HOLD_S) * _RATE)) / (_RISE_S * _RATE), 1.0)
    load = _BEYOND * bundle.critical_stress * rise
    found = [bundle.response(load, _RATE, seed) for seed in range(_BUNDLES)]
    top = float(np.max(np.where(load < bundle.critical_stress, found[0].strain, 0.0)))
    strain = np.linspace(0.0, 1.5 * max(top, 1e-9), 120)
    one = found[0].strain <= strain[-1]
    this = Series("this bundle", found[0].strain[one][::40], newton * load[one][::40])
    slow = Series("slowly loaded", strain, newton * _borne(bundle, strain), "dashed", "force")
    sizes = np.concatenate([one.energy[one.failures > 0] for one in found])
    gaps = np.concatenate([np.diff(one.event_s) for one in found])
    return (
        Drawing(title, "strain", "load, N", (this,) if bundle.model == "inverse" else (this, slow)),
        _spectrum("Energy of an event", "energy, of the bundle's units", sizes),
        _spectrum("Time between events", "interval, ms", 1e3 * gaps, ", 1/ms"),
    )


def _borne(bundle: FibreBundle, strain: np.ndarray) -> np.ndarray:
    """Return the load of an infinite bundle at each strain, N (1 - P(x)) k_F x. Inverse chains do not break."""
    if bundle.thresholds == "weibull":
        left = np.exp(-((strain / bundle.scale) ** bundle.shape))
    else:
        left = np.clip(1.0 - strain / bundle.scale, 0.0, 1.0)
    return np.asarray(bundle.fibres * left * bundle.stiffness * strain)


def _spectrum(title: str, label: str, values: np.ndarray, unit: str = "") -> Drawing:
    """Return the density of positive values, in this unit, on logarithmic axes."""
    found = values[values > 0.0]
    if found.size < 2 or found.min() == found.max():
        return Drawing(title, label, "density", note="fewer than two events")
    edges = np.geomspace(found.min(), found.max() * 1.001, 24)
    held = np.histogram(found, edges)[0]
    middles = np.sqrt(edges[1:] * edges[:-1])
    dense = held / np.diff(edges) / found.size
    some = held > 0
    line = Series(f"{_BUNDLES} bundles", middles[some], dense[some], "dots")
    return Drawing(title, label, f"density{unit}", (line,), x_log=True, y_log=True)
