"""Rings in shared memory: read once and in order, from another process, and beside a busy writer."""

import threading
from contextlib import closing

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from underfoot.engine.rings import Reader, Ring

CAPACITY = 256


@pytest.fixture
def ring():
    ring = Ring.create(2, CAPACITY, "float64")
    yield ring
    ring.close()


def numbered(first, count):
    """Rows that say which they are."""
    return np.repeat(np.arange(first, first + count, dtype=np.float64)[:, None], 2, axis=1)


def test_what_is_written_is_read_once_and_in_order(ring):
    reader = Reader(ring)
    ring.write(numbered(0, 5), 5)
    ring.write(numbered(5, 9), 2)
    first, rows = reader.read()
    assert (first, rows.tolist()) == (0, numbered(0, 7).tolist())
    assert len(reader.read()[1]) == 0
    assert len(reader.read_seen()[1]) == 0, "nobody has looked since"
    ring.write(numbered(7, 3), 3)
    first, rows = reader.read()
    assert (first, rows.tolist()) == (7, numbered(7, 3).tolist())


def test_rows_that_were_seen_are_read_as_soon_after_a_hundred_years(ring):
    """It took a step for each lap of the ring so far: after some hours a recording had gaps. So this test hung."""
    now = 100 * 365 * 86_400 * 48_000
    ring.skip(now)
    reader = Reader(ring)
    ring.write(numbered(now, 5), 5)
    reader.look()
    first, rows = reader.read_seen()
    assert (first, rows.tolist()) == (now, numbered(now, 5).tolist())


def test_a_ring_is_opened_by_its_name(ring):
    other = Ring.open(ring.where)
    ring.write(numbered(0, 3), 3)
    assert Reader(other, start=1).read()[1].tolist() == numbered(1, 2).tolist()
    other.close()


def test_a_new_reader_begins_at_the_present_or_where_it_is_told(ring):
    ring.write(numbered(0, 10), 10)
    assert len(Reader(ring).read()[1]) == 0
    assert Reader(ring, start=4).read()[0] == 4


def test_what_was_overwritten_is_missing_and_the_number_tells(ring):
    reader = Reader(ring)
    for first in range(0, 3 * CAPACITY, 32):
        ring.write(numbered(first, 32), 32)
    first, rows = reader.read()
    assert first > 2 * CAPACITY
    assert rows.tolist() == numbered(first, 3 * CAPACITY - first).tolist()


def test_rows_that_the_writer_may_be_overwriting_are_missing(ring):
    """It writes the rows of the next lap first, and then says so."""
    reader = Reader(ring)
    ring.write(numbered(0, CAPACITY), CAPACITY)
    ring.rows[: CAPACITY // 16] = -1.0
    first, rows = reader.read()
    assert first == reader.lost == CAPACITY // 16
    assert rows.tolist() == numbered(first, CAPACITY - first).tolist()


@pytest.mark.parametrize(("unread", "missing"), [(0, 50), (20, 50), (0, 2 * CAPACITY)])
def test_rows_that_were_never_written_are_a_gap_and_not_lost(ring, unread, missing):
    """Where one engine takes over from another, what is in the ring by chance was never played."""
    for first in range(0, 2 * CAPACITY, 32):
        ring.write(numbered(first, 32), 32)
    end = 2 * CAPACITY
    reader = Reader(ring, start=end - unread)
    other = Ring.open(ring.where)
    other.skip(end + missing)
    other.write(numbered(end + missing, 4), 4)
    reads = [reader.read(), reader.read(), reader.read()]
    got = [(first, rows[:, 0].tolist()) for first, rows in reads if len(rows)]
    before = [(end - unread, list(range(end - unread, end)))] if unread else []
    assert got == [*before, (end + missing, list(range(end + missing, end + missing + 4)))]
    assert reader.lost == 0
    other.close()


@example([("write", 40), ("write", 40), ("skip", 40), ("write_zeros", 40), ("write_zeros", 40)])
@given(st.lists(st.tuples(st.sampled_from(["write", "write_zeros", "skip"]), st.integers(1, 40)), max_size=60))
def test_rows_of_zeros_are_as_if_they_were_written(steps):
    """Whatever was in the ring a lap before: numbers, zeros, a gap, or nothing yet."""
    with closing(Ring.create(2, 64, "float64")) as ring:
        expected = {}
        for what, count in steps:
            at = ring.written
            if what == "skip":
                ring.skip(at + count)
                continue
            rows = numbered(at + 1, count) if what == "write" else np.zeros((count, 2))
            ring.write(rows, count) if what == "write" else ring.write_zeros(count)
            expected |= {at + k: row for k, row in enumerate(rows.tolist())}
        kept = [row for row in range(max(ring.written - 64, 0), ring.written) if row in expected]
        assert ring.rows[np.array(kept, int) % 64].tolist() == [expected[row] for row in kept]


def test_a_ring_does_not_continue_at_an_earlier_row(ring):
    ring.write(numbered(0, 10), 10)
    ring.skip(4)
    assert ring.written == 10


def test_a_reader_beside_a_busy_writer_never_sees_a_torn_row():
    """The writer laps the ring many times while it is read, slowly at times, so that rows are lost: never wrong."""
    ring = Ring.create(8, 1024, "float64")
    total = 400_000
    rows = np.empty((64, 8))
    done = threading.Event()

    def write():
        for first in range(0, total, 64):
            rows[:] = np.arange(first, first + 64)[:, None]
            ring.write(rows, 64)
        done.set()

    reader = Reader(ring)
    writer = threading.Thread(target=write)
    writer.start()
    expected = 0
    seen = 0
    while not done.is_set() or reader.next < ring.written:
        first, got = reader.read()
        assert first >= expected
        assert (got == np.arange(first, first + len(got))[:, None]).all()
        expected, seen = first + len(got), seen + len(got)
    writer.join()
    ring.close()
    assert expected == total
    assert seen > 0
