"""One row of one node alone: its compiled kernels between guard values, or its functions in plain Python.

All memory passed to a kernel lies between guard values; read-only memory is compared.
"""

import ctypes
import inspect

import numpy as np

from underfoot.layouts import Memory
from underfoot.models.signals.events import EVENTS, event_list
from underfoot.parameters import Number

GUARD = 16
CANARY = -1.23456789e300
_PLACES = {name: place for place, name in enumerate(EVENTS.parts)}


class Guarded:
    """float64 values between guards."""

    def __init__(self, name, values):
        self.name, self.size = name, np.size(values)
        self.all = np.full(self.size + 2 * GUARD, CANARY)
        self.values[:] = values

    @property
    def values(self):
        return self.all[GUARD : GUARD + self.size]

    @property
    def address(self):
        return self.all.ctypes.data + 8 * GUARD

    def check(self):
        """Fail, with its name, if something was written before or after the values."""
        outside = np.delete(self.all, np.arange(GUARD, GUARD + self.size))
        assert (outside == CANARY).all(), f"{self.name}: written beyond its own"


class BareRow:
    """A row of the node `type` (a `NodeType`) with these parameters, at `rate` frames a second."""

    def __init__(self, type, rate=48_000.0, key=7, **parameters):
        self.type, self.binding, self.rate, self.key = type, type.binding, rate, np.uint64(key)
        self.values = type.values(parameters)
        names = self.binding.names
        self.controls = Guarded("controls", [self._control(name) for name in names.controls])
        self.state = Guarded("state", np.zeros(self.binding.state_size(self.values, rate)))
        self.coefficients = Guarded("coefficients", np.zeros(self.binding.coefficients_size(self.values, rate)))
        self.data = Guarded("data", self.binding.data(self.values, rate))
        self.outputs, self.events = {}, {}

    def _control(self, name):
        value = self.values[name]
        parameter = self.type.parameters[name]
        return float(parameter.options.index(value) if parameter.kind == "choice" else value)

    def run(self, frame, n, signals=None, events=None):
        """Run `n` frames from `frame` on: `signals` [n] and `events` (lists of tuples) by name, zero if not given.

        A number that is read each frame has its own value if it is not given.
        """
        names = self.binding.names
        inputs = [Guarded(name, self.signal(name, n, signals or {})) for name in names.signals_in]
        outputs = [Guarded(name, np.full(n, np.nan)) for name in names.signals_out]
        taken = [Guarded(name, _list((events or {}).get(name, ()), n)) for name in names.events_in]
        made = [Guarded(name, _list((), n)) for name in names.events_out]
        readonly = [*inputs, self.controls, self.data]
        before = [one.values.copy() for one in readonly]
        pointers = [_addresses(group) for group in (inputs, outputs)]
        lists = [_addresses(group) for group in (taken, made)]
        memories = [_pointer(one) for one in (self.controls, self.state, self.coefficients, self.data)]
        self.binding.run.ctypes(*pointers, *memories, *lists, int(self.key), self.rate, frame, n)
        for one in (*inputs, *outputs, *taken, *made, self.controls, self.state, self.coefficients, self.data):
            one.check()
        for one, old in zip(readonly, before, strict=True):
            assert one.values.tobytes() == old.tobytes(), f"{one.name}: written to, which may only be read"
        self.outputs = {output.name: output.values for output in outputs}
        self.events = {one.name: _events(one.values, n) for one in made}

    def tail(self):
        """Return the bound of the remaining output; 0 for a node without one."""
        if self.binding.tail is None:
            return 0.0
        memories = [_pointer(one) for one in (self.controls, self.state, self.coefficients, self.data)]
        bound = self.binding.tail.ctypes(*memories)
        for one in (self.controls, self.state, self.coefficients, self.data):
            one.check()
        return bound

    def signal(self, name, n, signals):
        if name in signals:
            return np.array(signals[name], np.float64)
        parameter = self.type.parameters.get(name)
        return np.full(n, self.values[name] if isinstance(parameter, Number) else 0.0)


class PlainRow:
    """The same row, its functions called in plain Python with the memories and arrays that they name."""

    def __init__(self, type, rate=48_000.0, key=7, **parameters):
        self.type, self.binding, self.rate, self.key = type, type.binding, rate, np.uint64(key)
        self.values = type.values(parameters)
        self.bare = bare = BareRow(type, rate, key, **parameters)
        sizes = self.binding.sizes(self.values, rate)
        self.known = dict(zip(self.binding.names.controls, bare.controls.values.tolist(), strict=True))
        for name, is_whole in self.binding.names.controls.items():
            self.known[name] = int(self.known[name]) if is_whole else self.known[name]
        self.known["controls"] = Memory(self.binding.controls, bare.controls.values, {})
        for name in ("state", "coefficients"):
            layout = getattr(self.binding, name)
            if layout is not None:
                self.known[name] = layout.zeros(**{symbol: sizes[symbol] for symbol in layout.symbols})
        self.known |= {name: one.table(self.values, rate) for name, one in self.binding.prepared.items()}
        self.known |= {"rate": rate, "key": self.key}
        self._designed = False

    def run(self, frame, n, signals=None, events=None):
        """As `BareRow.run`; return the outputs and the events, by name."""
        names = self.binding.names
        known = self.known | {"frame": frame, "end": frame + n}
        known |= {name: self.bare.signal(name, n, signals or {}) for name in names.signals_in}
        known |= {name: np.full(n, np.nan) for name in names.signals_out}
        known |= {name: event_list(*(events or {}).get(name, ()), room=n) for name in names.events_in}
        known |= {name: event_list(room=n) for name in names.events_out}
        if "design" in self.binding.functions and not self._designed:
            _call(self.binding.functions["design"], known)
            self._designed = True
        _call(self.binding.functions["run"], known)
        made = {name: _events(known[name].values, n) for name in names.events_out}
        return {name: known[name] for name in names.signals_out}, made


def _call(function, known):
    return function(**{name: known[name] for name in inspect.signature(function).parameters})


def _list(events, room):
    return event_list(*events, room=room).values


def _events(values, room):
    found = Memory(EVENTS, values, {"room": room})
    return np.column_stack([found.time, found.strength, found.duration])[: len(found)]


def _pointer(one):
    return ctypes.cast(one.address, ctypes.POINTER(ctypes.c_double))


def _addresses(group):
    made = (ctypes.POINTER(ctypes.c_double) * max(len(group), 1))(*(_pointer(one) for one in group))
    return ctypes.cast(made, ctypes.POINTER(ctypes.POINTER(ctypes.c_double)))
