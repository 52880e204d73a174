"""Memory with names: the same numbers, arrays and layouts within, in Python and in compiled code."""

import pickle

import numpy as np
import pytest
from numba import njit

from underfoot.errors import BadValue
from underfoot.layouts import Layout
from underfoot.memory import LINE

PAIR = Layout("pair", re=("row",), im=("row",))
OBJECT = Layout(
    "object",
    "mass",
    "load",
    grid=(2, "row"),
    block=3,
    poles=PAIR,
    line=("length",),
    spare=PAIR,
    last=Layout("one", "x"),
)
SIZES = {"row": 5, "length": 9}
object_at = OBJECT.at


def filled(first=1.0):
    """A memory in which every value is another."""
    memory = OBJECT.zeros(**SIZES)
    memory.values[:] = first + np.arange(memory.values.size)
    return memory


def parts_of(memory):
    """Everything that a memory has, by name."""
    return {
        "mass": memory.mass,
        "load": memory.load,
        "grid": memory.grid,
        "block": memory.block,
        "poles.re": memory.poles.re,
        "poles.im": memory.poles.im,
        "line": memory.line,
        "spare.re": memory.spare.re,
        "spare.im": memory.spare.im,
        "last.x": memory.last.x,
    }


@njit
def read(memory):
    return (
        *(memory.mass, memory.load, memory.grid.copy(), memory.block.copy()),
        *(memory.poles.re.copy(), memory.poles.im.copy(), memory.line.copy()),
        *(memory.spare.re.copy(), memory.spare.im.copy(), memory.last.x),
    )


@njit
def write(memory):
    memory.mass, memory.load = 100.0, 101
    memory.grid[1, memory.row - 1] = 102.0
    memory.block[2] = 103.0
    memory.poles.im[4] = 104.0
    memory.line[memory.length - 1] = 105.0
    memory.spare.re[0] = 106.0
    memory.last.x = 107.0


@njit
def sizes_in(memory):
    return memory.row, memory.length, memory.poles.row, memory.values.size, memory.values.sum()


def test_no_part_lies_on_another_and_arrays_begin_on_cache_lines():
    memory = OBJECT.zeros(**SIZES)
    assert memory.values.ctypes.data % (8 * LINE) == 0
    parts = parts_of(memory)
    arrays = {name: part for name, part in parts.items() if isinstance(part, np.ndarray)}
    for array in arrays.values():
        assert array.ctypes.data % (8 * LINE) == 0
        array += 1.0
    memory.mass = memory.load = memory.last.x = 1.0
    assert memory.values.sum() == 3 + sum(array.size for array in arrays.values())
    assert memory.values.max() == 1.0
    assert memory.grid.shape == (2, 5)
    assert OBJECT.size(SIZES) == memory.values.size
    assert memory.values.size % LINE == 0


def test_compiled_code_finds_what_python_finds():
    memory = filled()
    for (name, ours), theirs in zip(parts_of(memory).items(), read(memory), strict=True):
        np.testing.assert_array_equal(ours, theirs, err_msg=name)
    assert sizes_in(memory) == (5, 9, 5, memory.values.size, memory.values.sum())


def test_compiled_code_writes_there_and_nowhere_else():
    memory, before = filled(1000.0), filled(1000.0)
    write(memory)
    assert (memory.mass, memory.load, memory.last.x) == (100.0, 101.0, 107.0)
    assert (memory.grid[1, 4], memory.block[2], memory.poles.im[4]) == (102.0, 103.0, 104.0)
    assert (memory.line[8], memory.spare.re[0]) == (105.0, 106.0)
    assert np.count_nonzero(memory.values != before.values) == 8


def test_python_writes_what_compiled_code_reads():
    memory = OBJECT.zeros(**SIZES)
    memory.load, memory.last.x = 2.0, 3.0
    memory.poles.im[:] = np.arange(5)
    found = read(memory)
    assert (found[0], found[1], found[-1]) == (0.0, 2.0, 3.0)
    assert found[5].tolist() == [0.0, 1.0, 2.0, 3.0, 4.0]


def test_one_compiled_form_serves_memories_of_all_sizes():
    compiled = len(sizes_in.signatures)
    for row, length in ((1, 0), (8, 64), (0, 1)):
        memory = OBJECT.zeros(row=row, length=length)
        assert sizes_in(memory)[:3] == (row, length, row)
    assert len(sizes_in.signatures) == max(compiled, 1)


def test_a_memory_in_the_middle_of_an_array_is_found_by_its_address():
    @njit
    def load_of(values, row, length):
        return object_at(values, (row, length)).load

    memory = filled()
    space = np.concatenate([np.zeros(16), memory.values])
    assert load_of(space[16:], 5, 9) == memory.load
    assert load_of(space, 5, 9) == 0.0


def test_len_is_the_number_named_count():
    counted = Layout("counted", "count", at=("room",))

    @njit
    def length(memory):
        return len(memory)

    memory = counted.zeros(room=4)
    memory.count = 3
    assert len(memory) == length(memory) == 3


def test_layouts_are_pickled_with_all_they_are_made_of():
    again = pickle.loads(pickle.dumps(OBJECT))
    assert repr(again) == repr(OBJECT)
    assert again.symbols == OBJECT.symbols == ("row", "length")
    assert list(again.places(SIZES)) == list(OBJECT.places(SIZES))


def test_what_is_not_there_is_named():
    memory = OBJECT.zeros(**SIZES)
    with pytest.raises(AttributeError, match="object has no 'weight'; it has mass, load"):
        _ = memory.weight
    with pytest.raises(AttributeError, match="object has no 'weight'"):
        memory.weight = 1.0
    with pytest.raises(AttributeError, match="block is no number"):
        memory.block = 1.0
    with pytest.raises(KeyError, match="length"):
        OBJECT.zeros(row=3)
    with pytest.raises(BadValue, match=r"^size is "):
        Layout("twice", "row", at=("row",))
