"""A node's functions are given what they name: everything there is, and nothing that is not."""

import math
import sys
from types import ModuleType

import numpy as np
import pytest
from bare_row import BareRow

from underfoot.errors import BadFile, BadValue
from underfoot.layouts import Layout
from underfoot.models.signals.events import emit
from underfoot.nodes import REGISTRY
from underfoot.parameters import Choice, Count, Number, Numbers
from underfoot.patch.node import Input, Output, node, prepared, prepared_columns
from underfoot.patch.patch import Patch, PlacedNode
from underfoot.patch.program import Program


@node("everything", "Tests")
class Everything:
    """Takes everything that a function may take."""

    signal = Input()
    hits = Input(kind="event")
    force_n = Input("N", from_engine=True)
    by_hand = Input(kind="event", from_engine=True)
    fast = Number(2.0, 0.0, 10.0, wire="audio")
    slow = Number(3.0, 0.0, 10.0)
    count = Count(4, 0, 9)
    kind = Choice("b", options=("a", "b", "c"))
    weights = Numbers((5.0, 6.0), 0.0, 10.0)
    out = Output()
    told = Output(kind="event")
    state = Layout("everything", "runs", line=("length",))
    coefficients = Layout("everything_coefficients", "designs", "sum", pair=(2, "length"))

    def sizes(values, rate):
        return {"length": len(values["weights"])}

    @prepared
    def line(values, rate):
        return values["weights"]

    @prepared_columns
    def columns(values, rate):
        return [values["weights"], [rate, rate]]

    def design(slow, line, rate, coefficients):
        coefficients.designs += 1.0
        coefficients.sum = slow + line.sum() + rate
        coefficients.pair[1, 1] = 7.0

    def run(
        signal, hits, force_n, by_hand, fast, slow, count, kind, controls, line, columns,
        rate, frame, end, key, state, coefficients, out, told,
    ):  # fmt: skip
        state.runs += 1.0
        state.line[1] = columns[1, 0]
        for i in range(out.size):
            out[i] = signal[i] + force_n[i] + fast[i]
        out[0] = slow
        out[1] = controls.slow + controls.count
        out[2] = 10 * count + kind
        out[3] = line[1]
        out[4] = rate
        out[5] = end - frame
        out[6] = float(key)
        out[7] = coefficients.sum
        out[8] = state.runs
        out[9] = coefficients.designs
        out[10] = state.line[1] + coefficients.pair[1, 1]
        for k in range(len(hits)):
            told.time[k] = hits.time[k]
            told.strength[k] = hits.strength[k] + len(by_hand)
        told.count = len(hits)

    def tail(slow, line, controls, state, coefficients):
        return slow + line[0] + controls.kind + state.runs + coefficients.designs


@node("reversed", "Tests")
class Reversed:
    """Writes its input backwards, as somebody would who thinks in arrays."""

    signal = Input()
    out = Output()

    def run(signal, out):
        backwards = np.zeros(signal.size)
        backwards[:] = signal[::-1]
        out[:] = backwards


def test_a_node_s_functions_may_make_and_copy_arrays():
    row = BareRow(Reversed)
    row.run(0, 5, {"signal": np.arange(5.0)})
    assert row.outputs["out"].tolist() == [4.0, 3.0, 2.0, 1.0, 0.0]


CELL = """
from underfoot.patch.node import Input, Output, node

@node("halved", "Tests")
class Halved:
    \"\"\"Half of a signal.\"\"\"

    signal = Input()
    out = Output()

    def run(signal, out):
        for i in range(out.size):
            out[i] = 0.5 * signal[i]
"""


def test_a_node_of_a_notebook_which_has_no_file_runs_and_its_mistakes_are_one_line(monkeypatch):
    monkeypatch.setitem(sys.modules, "notebook_cell", ModuleType("notebook_cell"))
    cell = {"__name__": "notebook_cell"}
    exec(CELL, cell)
    row = BareRow(cell["Halved"])
    row.run(0, 2, {"signal": np.array([1.0, 2.0])})
    assert row.outputs["out"].tolist() == [0.5, 1.0]
    exec(CELL.replace("0.5 *", "half *"), cell)
    with pytest.raises(BadFile, match=r"^<node>: run of Halved cannot be compiled: NameError: name 'half' is not def"):
        BareRow(cell["Halved"]).run(0, 2, {"signal": np.array([1.0, 2.0])})


def test_functions_are_given_what_they_name():
    row = BareRow(Everything, rate=1000.0, key=42)
    ramp = np.arange(20.0)
    signals, events = {"signal": ramp, "force_n": 100.0 * ramp}, {"hits": [(3.5, 1.0)], "by_hand": [(4.0, 2.0)]}
    for runs in (1.0, 2.0):
        row.run(int(20 * (runs - 1.0)), 20, signals, events)
        out = row.outputs["out"]
        assert out[:11].tolist() == [3.0, 7.0, 41.0, 6.0, 1000.0, 20.0, 42.0, 1014.0, runs, 1.0, 1007.0]
        np.testing.assert_array_equal(out[11:], 101.0 * ramp[11:] + 2.0)
        assert row.events["told"].tolist() == [[3.5, 2.0, 0.0]]
    assert row.tail() == 3.0 + 5.0 + 1.0 + 2.0 + 1.0


def test_coefficients_are_designed_when_a_number_that_design_names_has_moved():
    row = BareRow(Everything)
    row.run(0, 20)
    places = list(Everything.binding.names.controls)
    row.controls.values[places.index("count")] = 5.0
    row.run(20, 20)
    assert row.outputs["out"][9] == 1.0
    row.controls.values[places.index("slow")] = 4.0
    row.run(40, 20)
    assert row.outputs["out"][9] == 2.0


def test_numbers_that_are_all_zero_are_designed_for_as_well():
    row = BareRow(Everything, slow=0.0)
    row.run(0, 20)
    assert row.outputs["out"][9] == 1.0


@pytest.mark.parametrize(
    ("function", "allowed"),
    [
        ("def run(sginal, out): pass", "signal"),
        ("def run(signal, out, n): pass", "frame"),
        ("def run(signal, out, state): pass", "coefficients"),
        ("def run(signal, out): pass\ndef design(out, coefficients): pass", "gain"),
        ("def run(signal, out): pass\ndef tail(signal): pass", "gain"),
        ("def run(signal, out): pass\ndef tail(rate): pass", "coefficients"),
    ],
)
def test_a_name_that_is_not_there_is_refused_as_the_class_is_declared(function, allowed):
    body = {"__doc__": "Bad.", "signal": Input(), "gain": Number(1.0, 0.0, 2.0), "out": Output()}
    body["coefficients"] = Layout("bad", "a")
    exec(function, {}, body)
    for name, value in body.items():
        if hasattr(value, "__set_name__"):
            value.__set_name__(None, name)
    with pytest.raises(BadValue, match=rf"(run|design|tail) of Bad takes '\w+'; allowed: .*{allowed}"):
        node("bad", "Tests")(type("Bad", (), body))


def fill(out):
    out[:] = 0.0


@pytest.mark.parametrize(
    ("body", "says"),
    [
        ({"run": fill}, "docstring of node bad is None; allowed: what the node does, for its help"),
        (
            {"run": fill, "__doc__": "Bad.", "also_called": 5},
            'also_called of node bad is 5; allowed: words in one text, as "VCA, amplifier"',
        ),
        ({"__doc__": "Bad."}, "Bad has no function run, which computes its outputs"),
        (
            {"run": fill, "__doc__": "Bad.", "desing": fill},
            "name in node bad is 'desing'; allowed: .*, run, design, .*",
        ),
        (
            {"run": fill, "__doc__": "Bad.", "onset": Output(kind="event")},
            "run of Bad does not take its output 'onset', which it must write",
        ),
        (
            {"run": fill, "__doc__": "Bad.", "force": Input("N", from_engine=True)},
            "input of node bad with from_engine=True is 'force'; allowed: force_n, x_m, y_m, cut",
        ),
        (
            {"run": fill, "__doc__": "Bad.", "x_m": Input("m", of_tile=True)},
            "input of node bad with of_tile=True is 'x_m'; allowed: centre_x_m, centre_y_m",
        ),
    ],
)
def test_a_node_that_says_nothing_of_what_it_does_or_leaves_it_undone_is_refused(body, says):
    with pytest.raises(BadValue, match=f"^{says}$"):
        node("bad", "Tests")(type("Bad", (), {"out": Output(), **body}))


def test_a_type_that_could_not_be_the_id_of_a_node_is_refused():
    with pytest.raises(BadValue, match=r"^type of node Bad is 'Bad Name'; allowed: letters, digits, - and _$"):
        node("Bad Name", "Tests")(type("Bad", (), {"__doc__": "Bad.", "out": Output(), "run": fill}))


def test_a_name_that_means_two_things_is_refused():
    with pytest.raises(BadValue, match=r"port or parameter of Bad is 'rate'; allowed: any name but controls, .*, key$"):

        @node("bad", "Tests")
        class Bad:
            """Has a parameter that nobody could name."""

            rate = Number(1.0, 0.0, 2.0)
            out = Output()

            def run(out):
                out[0] = math.nan


@pytest.mark.parametrize("muting", [("sginal",), ("slow",), "signal"])
def test_a_node_muted_by_what_is_no_signal_of_its_own_is_refused(muting):
    with pytest.raises(BadValue, match=r"^muted_by of Bad is .*; allowed: a tuple of signal, gain$"):

        @node("bad", "Tests")
        class Bad:
            """Would not sleep when it could."""

            signal = Input()
            gain = Number(1.0, 0.0, 2.0, wire="audio")
            slow = Number(1.0, 0.0, 2.0)
            out = Output()
            muted_by = muting

            def run(signal, gain, slow, out):
                out[:] = signal * gain * slow


@pytest.mark.parametrize("line", ["raise ValueError('too loud')", "assert signal[0] < 1.0"])
def test_a_function_that_raises_an_error_is_refused(line):
    body = {"__doc__": "Bad.", "signal": Input(), "out": Output()}
    exec(f"def run(signal, out):\n    {line}", {}, body)
    with pytest.raises(BadValue, match=r"^run of Bad raises an error, which nothing could catch while it plays; "):
        node("bad", "Tests")(type("Bad", (), body))


@pytest.mark.parametrize(
    ("parameter", "says"),
    [
        (Number(1.0, 2.0, 3.0, unit="N"), "default of knob is 1.0; allowed: 2 to 3 N"),
        (Choice("fast", options=("slow", "quick")), "default of knob is 'fast'; allowed: slow, quick"),
        (Number(1.0, 0.0, 2.0, wire="frame"), "wire of knob is 'frame'; allowed: '', 'span', 'audio'"),
        (Number(1.0, 0.0, 2.0, scale="cubic"), "scale of knob is 'cubic'; allowed: linear, log, gain, amplitude"),
        (Number(1.0, 0.0, 2.0, scale="log"), "low of knob is 0.0; allowed: above 0 with log"),
    ],
)
def test_a_parameter_that_contradicts_itself_is_refused(parameter, says):
    """It would begin with a value that no file may have, divide by zero in its control, or be driven by nothing."""
    with pytest.raises(BadValue, match=f"^{says}$"):

        @node("bad", "Tests")
        class Bad:
            """Has a knob."""

            knob = parameter
            out = Output()

            def run(knob, out):
                out[:] = knob


@node("steps", "Tests")
class Steps:
    """Events of left and right feet."""

    left = Output(kind="event")
    right = Output(kind="event")
    tail = math.inf

    def run(frame, end, left, right):
        for at in range(frame, end):
            if at % 100 == 0:
                emit(left, at, 1.0)
            if at % 100 == 50:
                emit(right, at, 2.0)


def test_each_of_several_event_outputs_and_inputs_has_its_own_events():
    """No node that comes with the program has two outputs: those of a node of one's own would have been mixed up."""
    types, ends = {**REGISTRY, "steps": Steps}, ("steps.left", "steps.right", "join.out")
    wires = (("steps.left", "join.a"), ("steps.right", "join.b"))
    patch = Patch(nodes=(PlacedNode("steps", "steps"), PlacedNode("join", "join")), wires=wires).check(types)
    program = Program(patch, types, ("t1",), rate=48_000, block=256, scopes=ends)
    program.run(0, 256)
    left, right, both = (program.events(end)[:, :2].tolist() for end in ends)
    assert (left, right) == ([[0.0, 1.0], [100.0, 1.0], [200.0, 1.0]], [[50.0, 2.0], [150.0, 2.0], [250.0, 2.0]])
    assert both == sorted(left + right)
