"""Lock-free rings in shared memory, with one writer and any number of readers; no reader can block the writer.

The supervisor creates and unlinks them. The writer copies its rows and then publishes the number ever written, with
release order. A reader loads that number with acquire order, copies, and loads it again: rows overwritten in between
are dropped, and reported. A writer that replaces a dead one continues at a later row; the rows of this gap were never
written, and readers skip them.
"""

from collections.abc import Callable
from functools import cached_property
from multiprocessing.shared_memory import SharedMemory
from typing import TYPE_CHECKING, Any

import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

from underfoot.engine.shared_blocks import new_block
from underfoot.errors import DeviceError
from underfoot.kernels import Intrinsic, block_kernel, kernel

if TYPE_CHECKING:
    from llvmlite import ir
    from numba import types

    from underfoot.emission import Arguments, BaseContext, Emission, Signature, TypingContext

CLOSED = "the session is closed; start another one"
HEADER = np.dtype(
    [
        ("written", np.int64),
        ("gap", np.int64),
        ("gap_end", np.int64),
        ("kept", np.int64),
        ("zero_from", np.int64),
    ],
    align=True,
)
"""Number of rows ever written; the rows from `gap` to before `gap_end`, which never were; the row up to which the
recorder, the only writer of this field, has everything on disk; and, in a ring that `write_zeros` is used on, the row
from which on all are zero.
"""

_HEADER_BYTES = 64  # a cache line of its own


@Intrinsic
def publish(context: "TypingContext", header: "types.Array", count: "types.Type") -> "Emission":
    """Publish to readers that `count` rows were written."""
    from numba import types

    def code(context: "BaseContext", builder: "ir.IRBuilder", signature: "Signature", args: "Arguments") -> "ir.Value":
        builder.store_atomic(args[1], _written_pointer(context, builder, signature, args), "release", 8)
        return context.get_dummy_value()

    return types.void(header, types.int64), code


@Intrinsic
def _written(context: "TypingContext", header: "types.Array") -> "Emission":
    from numba import types

    def code(context: "BaseContext", builder: "ir.IRBuilder", signature: "Signature", args: "Arguments") -> "ir.Value":
        return builder.load_atomic(_written_pointer(context, builder, signature, args), "acquire", 8)

    return types.int64(header), code


def _written_pointer(
    context: "BaseContext", builder: "ir.IRBuilder", signature: "Signature", args: "Arguments"
) -> "ir.Value":
    """Return a pointer to the header's first field, `written`."""
    from llvmlite import ir

    array = context.make_array(signature.args[0])(context, builder, args[0])
    return builder.bitcast(array.data, ir.IntType(64).as_pointer())


@block_kernel
def write_rows(header: NDArray[np.void], rows: NDArray[Any], new: NDArray[Any], n: int) -> None:
    """Append the first `n` rows of `new` to the ring and publish them."""
    at = header[0].written
    header[0].zero_from = at + n
    place = at % rows.shape[0]
    for i in range(n):
        for j in range(rows.shape[1]):
            rows[place, j] = new[i, j]
        place = place + 1 if place + 1 < rows.shape[0] else 0
    publish(header, at + n)


@block_kernel
def write_zeros(header: NDArray[np.void], rows: NDArray[Any], n: int) -> None:
    """Append `n` rows of zeros to the ring and publish them.

    Where memory has never been written, or holds a row of zeros, it is left alone: this would be a third of an empty
    floor's cost.
    """
    at, capacity = header[0].written, rows.shape[0]
    for row in range(max(at, capacity), min(at + n, header[0].zero_from + capacity)):
        for j in range(rows.shape[1]):
            rows[row % capacity, j] = 0
    publish(header, at + n)


@kernel
def copy_rows(header: NDArray[np.void], rows: NDArray[Any], first: int, out: NDArray[Any]) -> int:
    """Copy rows from `first` on into `out`; return the number of rows ever written after the copy."""
    _written(header)  # acquire: rows counted before are visible from here on
    place = first % rows.shape[0]
    for i in range(out.shape[0]):
        for j in range(rows.shape[1]):
            out[i, j] = rows[place, j]
        place = place + 1 if place + 1 < rows.shape[0] else 0
    return _written(header)


def _copy_seen(header: NDArray[np.void], rows: NDArray[Any], first: int, out: NDArray[Any]) -> int:
    """Do as `copy_rows`, for rows that were written a while ago."""
    at = np.arange(first, first + len(out)) % len(rows)  # not by `mode="wrap"`: it takes a step for each lap so far
    np.take(rows, at, axis=0, out=out, mode="clip")
    return int(header["written"][0])


def load_reading() -> None:
    """Load the readers' kernels, before reads that must not wait."""
    for dtype in (np.float32, np.float64):
        rows = np.zeros((1, 1), dtype)
        copy_rows(np.zeros(1, HEADER), rows, 0, rows)


@kernel
def _skip(header: NDArray[np.void], count: int) -> None:
    header[0].gap, header[0].gap_end = header[0].written, count
    header[0].zero_from = count
    publish(header, count)


class RingName(Struct, frozen=True):
    """The data another process needs to open a ring."""

    name: str
    dtype: str
    width: int
    capacity: int


class Ring:
    """A ring of `capacity` rows of `width` numbers. `create` in the supervisor, `open` elsewhere."""

    def __init__(self, memory: SharedMemory, where: RingName, owned: bool) -> None:
        self._memory, self.where, self._owned, self._is_closed = memory, where, owned, False
        buffer = memory.buf
        self.header = np.ndarray((1,), HEADER, buffer)
        self.rows = np.ndarray((where.capacity, where.width), where.dtype, buffer, offset=_HEADER_BYTES)

    @staticmethod
    def create(width: int, capacity: int, dtype: str = "float32") -> "Ring":
        """Create an empty ring."""
        size = _HEADER_BYTES + capacity * width * np.dtype(dtype).itemsize
        memory = new_block(size)
        return Ring(memory, RingName(memory.name, dtype, width, capacity), owned=True)

    @staticmethod
    def open(where: RingName) -> "Ring":
        """Open a ring that another process created."""
        return Ring(SharedMemory(where.name), where, owned=False)

    def write(self, new: NDArray[Any], n: int) -> None:
        """Append the first `n` rows of `new`, which has the ring's type and width. Allocates nothing."""
        self._write_rows(self.header, self.rows, new, n)

    def write_zeros(self, n: int) -> None:
        """Append `n` rows of zeros. Allocates nothing."""
        self._write_zeros(self.header, self.rows, n)

    @cached_property
    def _write_rows(self) -> Callable[..., None]:
        return write_rows.specialised(self.header, self.rows, self.rows, 0)

    @cached_property
    def _write_zeros(self) -> Callable[..., None]:
        return write_zeros.specialised(self.header, self.rows, 0)

    def skip(self, count: int) -> None:
        """Continue at row `count`, at least the present one; the rows in between are a gap."""
        if count > self.written:
            _skip(self.header, count)

    @property
    def written(self) -> int:
        """Number of rows ever written. Reading them requires `copy_rows`. `DeviceError` once it is closed."""
        if self._is_closed:
            raise DeviceError(CLOSED)
        return int(self.header["written"][0])

    @property
    def kept(self) -> int:
        """The row up to which a recorder has everything on disk."""
        return int(self.header["kept"][0])

    def keep(self, count: int) -> None:
        """Set `kept`; for a recorder, or at the beginning of a recording."""
        self.header["kept"] = count

    def close(self) -> None:
        """Release the memory; its creator also removes it."""
        self._is_closed = True
        del self.header, self.rows
        self._memory.close()
        if self._owned:
            self._memory.unlink()


class Reader:
    """Reads a ring from `start` on (by default its present end), and keeps its own position."""

    def __init__(self, ring: Ring, start: int | None = None) -> None:
        self.ring = ring
        self._seen = ring.written
        self.next = self._seen if start is None else start
        self.lost = 0
        """Number of rows that were overwritten before they were read."""

    def read(self) -> tuple[int, NDArray[Any]]:
        """Return the number of the first row, and the rows new since the last read.

        Rows overwritten before they could be read, or never written, are missing, which shows in the first row's
        number. Rows before and after such a gap are returned by two reads.
        """
        return self._read(self.ring.written, copy_rows)

    def look(self) -> None:
        """Note the present end of the ring, for `read_seen`."""
        self._seen = self.ring.written

    def read_seen(self) -> tuple[int, NDArray[Any]]:
        """Do as `read`, for the rows present at the last `look`. Between the two calls this process must have waited.

        By then these rows are visible to every processor without an acquire load, and so without loading Numba, which
        takes a second, and many on a busy machine.
        """
        return self._read(max(self._seen, self.next), _copy_seen)

    def _read(self, end: int, copy: Callable[..., int]) -> tuple[int, NDArray[Any]]:
        ring = self.ring
        capacity = ring.where.capacity
        gap, gap_end = int(ring.header["gap"][0]), int(ring.header["gap_end"][0])
        first = max(self.next, ring.written - capacity)
        self.lost += first - self.next - max(min(first, gap_end) - max(self.next, gap), 0)
        if gap <= first < gap_end:
            first = gap_end
        elif first < gap < end:
            end = gap
        out = np.empty((max(end - first, 0), ring.where.width), ring.where.dtype)
        if not len(out):  # nothing new: a window that waits for the engine need not load Numba
            self.next = end
            return first, out
        now = copy(ring.header, ring.rows, first, out)
        # The writer may be overwriting the rows after the oldest, so these are dropped, too.
        spoilt = min(max(now - capacity + capacity // 16 - first, 0), len(out))
        self.next = end
        self.lost += spoilt
        return first + spoilt, out[spoilt:]
