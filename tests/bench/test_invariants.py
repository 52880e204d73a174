"""Invariants that honest nodes keep and made-up breakers break."""

import numpy as np
import pytest

from underfoot.bench.invariants import NodeSignals, broken_invariant

RATE = 48_000.0
QUIET, LOUD = np.full(100, 0.1), np.ones(100)


def seen(values=(), inputs=(), outputs=(), events_in=(), events_out=()):
    events_in, events_out = (
        {k: np.array(v, float).reshape(-1, 3) for k, v in dict(e).items()} for e in (events_in, events_out)
    )
    return NodeSignals(RATE, dict(values), dict(inputs), dict(outputs), events_in, events_out)


@pytest.mark.parametrize(
    ("type", "case"),
    [
        ("low-pass", {"values": {"q": 0.7, "cutoff": 100.0}, "inputs": {"signal": QUIET}, "outputs": {"out": LOUD}}),
        ("high-pass", {"values": {"q": 2.0, "cutoff": 9.0}, "inputs": {"signal": QUIET}, "outputs": {"out": LOUD}}),
        ("band-pass", {"values": {"centre": 1.0, "width": 1.0}, "inputs": {"signal": QUIET}, "outputs": {"out": LOUD}}),
        (
            "strain-rate-envelope",
            {
                "values": {"frequency": 10.0, "damping": 1.0, "mass": 1.0},
                "inputs": {"force": LOUD},
                "outputs": {"out": QUIET},  # the gain is 1 / (2 w0 M) = 0.008
            },
        ),
        ("contact-envelope", {"outputs": {"out": 1.1 * LOUD}}),
        ("roughness", {"values": {"depth": 0.5}, "inputs": {"signal": LOUD}, "outputs": {"out": 1.6 * LOUD}}),
        ("tone", {"values": {"amplitude": 0.5}, "outputs": {"out": -LOUD}}),
        (
            "scale",
            {"values": {"out_low": 2.0, "out_high": 3.0}, "inputs": {"signal": LOUD}, "outputs": {"out": 4.0 * LOUD}},
        ),
        (
            "modal-bank",
            {
                "values": {"level": 1.0, "modes": [(100.0, 1.0, 0.5)]},
                "outputs": {"out": LOUD},
                "events_in": {"strike": [5.0, 1.0, 0.0]},
            },
        ),
        (
            "slip",
            {
                "values": {"most": 1.0, "least": 0.1},
                "inputs": {"force": LOUD},
                "outputs": {"displacement": QUIET},
                "events_out": {"events": [9.5, 0.5, 0.0]},  # 0.25 J from 1 N that came 0.1 m far
            },
        ),
        (
            "fibre-bundle",
            {
                "values": {
                    "model": "exact", "thresholds": "uniform", "fibres": 100, "shape": 1.0, "scale": 1.0,
                    "stiffness": 1.0, "strength": 25.0, "softness": 0.5, "loudness": 1.0,
                },
                "inputs": {"force": LOUD},
                "outputs": {"strain": QUIET},
                "events_out": {"events": [9.5, 0.5, 0.0]},  # 0.125 from a stress of 1 at a strain of 0.1
            },
        ),
    ],
)  # fmt: skip
def test_a_breaker_is_told_and_a_tenth_of_it_is_not(type, case):
    assert broken_invariant(type, seen(**case)).startswith(("puts out", "gives", "has set free"))
    tamed = dict(case)
    if "events_out" in case:
        tamed["events_out"] = {"events": [9.5, 0.05, 0.0]}
    elif type == "scale":
        tamed["outputs"] = {"out": 2.5 * LOUD}
    else:
        tamed["outputs"] = {name: 0.01 * signal for name, signal in case["outputs"].items()}
    assert broken_invariant(type, seen(**tamed)) == ""


def test_a_drawn_bank_rings_no_louder_than_all_its_modes_together():
    values, strike = {"level": 2.0, "modes": 9}, {"strike": [5.0, 0.1, 0.0]}
    assert broken_invariant("drawn-bank", seen(values, outputs={"out": 0.6 * LOUD}, events_in=strike)) == ""
    assert "outside" in broken_invariant("drawn-bank", seen(values, outputs={"out": 0.7 * LOUD}, events_in=strike))


def test_a_block_that_is_not_pressed_lies_still():
    values, force = {"frequency": 100.0}, np.repeat([0.0, 700.0], 50)
    moved = {"acceleration": np.repeat([0.0, 3.0], 50)}
    slip = {"events": [60.0, 1.0, 0.01]}
    assert broken_invariant("stick-slip", seen(values, {"force": force}, moved, events_out=slip)) == ""
    assert "frame 0" in broken_invariant("stick-slip", seen(values, {"force": force}, {"acceleration": LOUD}))
    for event in ([60.0, -1.0, 0.01], [60.0, 1.0, 2.0]):
        assert "slip" in broken_invariant(
            "stick-slip", seen(values, {"force": force}, moved, events_out={"events": event})
        )


def test_a_hammer_may_give_twice_its_momentum_and_no_more():
    values, blow = {"mass": 0.1, "velocity": 2.0}, {"strike": [3.0, 1.0, 0.0]}
    force = np.zeros(100)
    force[3] = 0.39 * RATE
    assert broken_invariant("impact", seen(values, outputs={"force": force}, events_in=blow)) == ""
    force[4] = 0.02 * RATE
    assert "impulse" in broken_invariant("impact", seen(values, outputs={"force": force}, events_in=blow))
    force[4] = -1.0
    assert "pulls" in broken_invariant("impact", seen(values, outputs={"force": force}, events_in=blow))


def test_an_invariant_is_silent_where_a_wire_drives_what_it_needs():
    moving = seen({"q": 1.0}, {"signal": QUIET}, {"out": LOUD})
    assert broken_invariant("low-pass", moving) == ""
    assert broken_invariant("no-such-node", moving) == ""
