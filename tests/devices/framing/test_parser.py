"""The parser: any bytes in any pieces; what was damaged is never taken for a sample, and losses are counted exactly."""

import tracemalloc
import zlib
from itertools import product

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from made_frames import frames_of, packed, rows, stuffed

from underfoot.devices.framing.parser import WINDOW, FrameCounts, Parser
from underfoot.devices.framing.wire_format import FRAME_BYTES, csv_lines, encode, rows_of


def parsed(*pieces):
    parser = Parser()
    got = [parser.feed(piece).copy() for piece in pieces]
    return parser, np.concatenate(got)


# --- whole streams ---


@pytest.mark.parametrize("write", [encode, csv_lines])
@given(st.lists(st.integers(1, 60), min_size=1, max_size=12))
def test_any_pieces_give_the_same_frames(write, lengths):
    sent = rows(8, tiles=3)
    data = write(sent)
    cuts = np.cumsum(lengths)
    pieces = [data[a:b] for a, b in zip([0, *cuts], [*cuts, len(data)], strict=True)]
    parser, got = parsed(*pieces)
    np.testing.assert_array_equal(rows_of(got), sent)
    assert parser.counts == FrameCounts(accepted=len(sent))
    assert parser.bytes == len(data)


def test_each_of_several_senders_has_its_own_form():
    """Of boards that write frames and lines, all but those of the first form were silent, and counted as damaged."""
    parser, first, second = Parser(), rows(300), np.add(rows(300), [1, 0, 0, 0, 0, 0, 0])
    got = []
    for one, other in zip(first, second, strict=True):
        frame, line = encode(one), csv_lines([other])
        got += rows_of(parser.feed(frame + line, [(len(frame), 7), (len(frame) + len(line), -8)])).tolist()
    np.testing.assert_array_equal(got, np.stack([first, second], axis=1).reshape(600, -1))
    assert parser.counts == FrameCounts(accepted=600)


def test_the_sequence_goes_round_and_time_is_unwrapped():
    sent = rows(3000, tiles=2, first=65_000, start_us=(1 << 32) - 65_500_000)
    parser, got = parsed(encode(sent))
    assert parser.counts == FrameCounts(accepted=6000)
    time_us = got["microseconds"][got["tile"] == 1]
    assert (np.diff(time_us) == 1000).all()
    assert time_us[-1] > 1 << 32


def test_a_stream_that_is_joined_in_the_middle_of_a_frame_counts_nothing_as_wrong():
    for data in (encode(rows(5))[10:], csv_lines(rows(5))[1:]):
        parser = Parser()
        parser.resync()
        assert parser.feed(data)["sequence"].tolist() == [1, 2, 3, 4]
        assert parser.counts == FrameCounts(accepted=4)


def test_a_line_whose_first_digit_was_missed_is_no_line_of_another_tile():
    parser = Parser()
    parser.resync()
    assert parser.feed(b"2,5,5000,1,2,3,4\n12,6,6000,1,2,3,4\n")["tile"].tolist() == [12]


def test_lines_may_end_as_windows_ends_them_and_hold_spaces():
    _, got = parsed(b"2, 41, 41000, 1, 2, 3, 4\r\n2,42,42000,5,6,7,8\r\n")
    assert rows_of(got).tolist() == [[2, 41, 41000, 1, 2, 3, 4], [2, 42, 42000, 5, 6, 7, 8]]


def test_a_long_counter_in_a_line_goes_round_like_a_short_one():
    parser, got = parsed(*[b"0,%d,%d,1,2,3,4\n" % (i, 1000 * i) for i in range(65_530, 65_545)])
    assert parser.counts == FrameCounts(accepted=15)
    assert got["sequence"][-1] == 65_544 - 65_536


def test_a_boot_message_and_new_firmware_do_not_confuse_it():
    sent = rows(600)
    first, second, third = sent[:200], sent[200:400], sent[400:]
    noise = b"Tile 4 booting, firmware 1.2\r\nADC ok\r\n"
    _, got = parsed(noise + encode(first), b"?" * 5000 + b"\n" + csv_lines(second), b"\n" * 5000 + encode(third))
    np.testing.assert_array_equal(rows_of(got), sent)


# --- damage ---


@pytest.mark.parametrize("write", [encode, csv_lines])
def test_a_million_random_bytes_are_no_frame(write):
    data = np.random.default_rng(3).integers(0, 256, 1_000_000).astype(np.uint8)
    parser, got = parsed(write(rows(1)), *np.array_split(data, 77))
    assert len(got) == parser.counts.accepted == 1
    assert parser.counts.lost == 0
    assert len(parser.feed(b"\0\n" + write(rows(2)[1:]))) == 1


@pytest.mark.parametrize("change", [0x01, 0x80, 0xFF, None])
def test_one_wrong_byte_costs_its_frame_and_no_other(change):
    sent = rows(5)
    frames = frames_of(encode(sent))
    for byte in range(FRAME_BYTES):
        spoilt = bytearray(frames[2])
        if change is None:
            spoilt[byte] = 7 if byte == FRAME_BYTES - 1 else 0
            if spoilt == frames[2]:
                spoilt[byte] ^= 2
        else:
            spoilt[byte] ^= change
        parser, got = parsed(b"".join([*frames[:2], bytes(spoilt), *frames[3:]]))
        np.testing.assert_array_equal(rows_of(got), sent[[0, 1, 3, 4]], f"byte {byte}")
        assert parser.counts.lost == 1, byte
        assert 1 <= parser.counts.corrupted <= 2, byte


def test_a_frame_that_broke_off_costs_no_other():
    frames = frames_of(encode(rows(5)))
    for kept in range(1, FRAME_BYTES):
        parser, got = parsed(b"".join([*frames[:2], frames[2][:kept], *frames[3:]]))
        assert got["sequence"].tolist() == [0, 1, 3, 4], kept
        assert parser.counts.lost == 1, kept


def test_another_version_another_length_and_a_wrong_checksum_are_refused():
    row = rows(1)[0].tolist()
    good = packed(row)
    body = good[:17]

    def sealed(text):
        return stuffed(text + zlib.crc32(text).to_bytes(4, "little")) + b"\0"

    bad = [sealed(b"\3" + body[1:]), sealed(body + b"\0"), sealed(body[:-1]), stuffed(body + b"abcd") + b"\0"]
    for each in (*bad, b"\0\0\0", b"\x16" + good.replace(b"\0", b"\1") + b"\0"):
        assert len(parsed(each)[1]) == 0
    assert len(parsed(sealed(body))[1]) == 1


@pytest.mark.parametrize(
    "line",
    [
        b"1,2,3,4,5,6",
        b"1,2,3,4,5,6,7,8",
        b"1,2,3,4,5,6,",
        b",2,3,4,5,6,7",
        b"1,2,3,4,5,6,-7",
        b"1,2,3,4,5,6,7.5",
        b"65536,2,3,4,5,6,7",
        b"1,2,3,4,5,6,65536",
        b"1,2,4294967296,4,5,6,7",
        b"tile,sequence,microseconds,r1,r2,r3,r4",
        b"1,2,3,4,5,6,7" + b"0" * 500,
    ],
)
def test_a_line_that_is_none_is_counted_and_left_out(line):
    sent = rows(4)
    parser, got = parsed(csv_lines(sent[:2]), line + b"\n", csv_lines(sent[2:]))
    np.testing.assert_array_equal(rows_of(got), sent)
    assert parser.counts == FrameCounts(accepted=4, corrupted=1)


# --- order ---


def told(order, count=40):
    frames = frames_of(encode(rows(count)))
    parser, got = parsed(b"".join(frames[i] for i in order))
    return parser.counts, got["sequence"].tolist()


def test_what_is_missing_is_counted():
    assert told([0, 1, 5, 6, 9]) == (FrameCounts(accepted=5, lost=5), [0, 1, 5, 6, 9])


def test_what_comes_twice_is_handed_over_once():
    assert told([0, 1, 1, 2, 1, 3, 0]) == (FrameCounts(accepted=4, doubled=3), [0, 1, 2, 3])


def test_what_comes_late_is_handed_over_and_no_longer_missing():
    assert told([0, 2, 1, 3, 5, 6, 4]) == (FrameCounts(accepted=7, reordered=2), [0, 2, 1, 3, 5, 6, 4])


def test_what_comes_behind_the_very_first_was_never_missing():
    assert told([3, 1, 2, 4]) == (FrameCounts(accepted=4, reordered=2), [3, 1, 2, 4])
    assert told([3, 1, 4]) == (FrameCounts(accepted=3, reordered=1, lost=1), [3, 1, 4])


def test_a_frame_from_long_ago_is_left_out():
    frames = frames_of(encode(rows(200)))
    parser, got = parsed(b"".join([*frames[:100], frames[3], *frames[100:150], frames[20], *frames[150:]]))
    assert got["sequence"].tolist() == list(range(200))
    assert parser.counts == FrameCounts(accepted=200, stale=2)


@pytest.mark.parametrize("before", [900, 20_000, 40_000, 70_000])
def test_a_tile_that_begins_anew_is_recognised_and_nothing_counts_as_lost(before):
    old = rows(100, first=before - 100)
    parser, got = parsed(encode(old), encode(rows(100)))
    assert parser.counts.restarts == 1
    assert parser.counts.lost == 0
    epochs = got["epoch"]
    assert epochs[0] == 0
    assert epochs[-1] == 1
    assert got["sequence"][epochs == 1].tolist() == list(range(1, 100))  # the first one could have been an old one


def test_frames_that_were_held_up_together_are_no_new_beginning():
    """Of a board that sends ten in a datagram, one that others overtook began it anew: its clock was fitted anew."""
    sent = rows(600)
    parser, got = parsed(encode(np.concatenate([sent[:200], sent[210:400], sent[200:210], sent[400:]])))
    assert parser.counts == FrameCounts(accepted=590, lost=10, stale=10)
    assert not got["epoch"].any()
    assert parsed(encode(sent[200:300]), encode(rows(100)))[0].counts.restarts == 1  # it is one, where more follow


@pytest.mark.parametrize("bundle", [1, 2, 30])
def test_of_two_boards_with_one_number_one_has_the_tile_until_it_sends_no_more(bundle):
    """Behind one hub, which two were flashed alike. The force was now of the one, now of the other.

    Frames come in bundles, a few too late, and one in twenty is lost.
    """
    random = np.random.default_rng(2)
    boards = rows(3000, first=9_000), rows(2000, start_us=4_000_000_000)
    sent = np.concatenate([board[i : i + bundle] for i in range(0, 2000, bundle) for board in boards])
    late = np.argsort(np.arange(len(sent)) + random.integers(0, 3, len(sent)), kind="stable")
    both = sent[late][random.random(len(sent)) > 0.05]
    _, got = parsed(encode(np.concatenate([rows(100, first=8_900), both, boards[0][2000:]])))
    is_second = got["sequence"] < 8_000
    changes = np.flatnonzero(np.diff(is_second))
    assert got["epoch"].tolist() == np.searchsorted(changes, np.arange(len(got))).tolist()
    assert len(changes) <= 2
    assert got["sequence"][-930:].tolist() == list(range(11_070, 12_000))


def test_a_long_silence_is_no_new_beginning():
    sent = np.concatenate([rows(100), rows(100, first=20_100)])
    parser, got = parsed(encode(sent))
    assert parser.counts == FrameCounts(accepted=200, lost=20_000)
    assert not got["epoch"].any()


@pytest.mark.parametrize("first", [40_100, 600_100])
def test_a_silence_in_which_numbers_may_have_gone_round_is_no_restart(first):
    """It was asked whether the power is steady of tiles whose line had been away, or whose computer had slept."""
    parser, got = parsed(encode(np.concatenate([rows(100), rows(100, first=first)])))
    assert parser.counts == FrameCounts(accepted=199, stale=1)
    assert got["epoch"].tolist() == [0] * 100 + [1] * 99


def test_a_board_that_sleeps_and_then_goes_on_in_its_numbers_has_not_begun_anew():
    """It was asked whether its power is steady, each hour."""
    parser, got = parsed(encode(np.concatenate([rows(100), rows(100, first=100, start_us=10_000_000)])))
    assert parser.counts == FrameCounts(accepted=199, stale=1)
    assert got["epoch"].tolist() == [0] * 100 + [1] * 99


@given(st.data())
def test_counts_are_those_of_a_list_and_a_set(data):
    """An order of frames of which none is older than 60, with losses and doubles, of two tiles."""
    random = np.random.default_rng(data.draw(st.integers(0, 1 << 32)))
    order, count = [], 300
    keys = np.arange(count) + random.integers(0, data.draw(st.integers(1, 55)), count)
    for i in np.argsort(keys, kind="stable").tolist():
        order += [i] * int(random.choice([0, 1, 2], p=[0.1, 0.8, 0.1]))
    frames = frames_of(encode(rows(count // 2, tiles=2)))
    parser, got = parsed(b"".join(frames[i] for i in order))
    expected = dict.fromkeys(("accepted", "lost", "doubled", "reordered"), 0)
    for tile in (0, 1):
        seen, newest = set(), -1
        for i in (i // 2 for i in order if i % 2 == tile):
            if i in seen:
                expected["doubled"] += 1
                continue
            expected["accepted"] += 1
            expected["reordered"] += i < newest
            seen.add(i)
            newest = max(newest, i)
        expected["lost"] += newest - min(seen) + 1 - len(seen)
        assert (got["tile"] == tile).sum() == len(seen)
    assert parser.counts == FrameCounts(**expected)
    assert len(got) == expected["accepted"]


def test_the_period_of_a_tile_is_told_by_its_own_clock():
    parser, _ = parsed(encode(rows(200, tiles=2, period_us=5000)))
    assert parser.period_us(1) == 5000
    assert parser.period_us(7) == 0


def test_ten_thousand_chunks_leave_nothing_behind():
    parser = Parser()
    data = np.frombuffer(encode(rows(2000)), np.uint8)
    chunks = [data[i : i + 200] for i in range(0, len(data), 200)]
    for chunk in chunks:
        parser.feed(chunk)
    tracemalloc.start()
    try:
        before, _ = tracemalloc.get_traced_memory()
        for _ in range(50):
            for chunk in chunks:
                parser.feed(chunk)
        after, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert after - before < 256
    assert peak - before < 2048


def test_no_damaged_character_of_a_line_with_a_checksum_is_another_sample():
    """A damaged digit was a wrong force. The asterisk may be the one: the line then ends in more digits."""
    parser = Parser()
    parser.feed(csv_lines([0, 0, 0, 300, 301, 302, 4]))
    for number, (at, damage) in enumerate(product(range(28), b"0195,*x\n"), start=1):
        rows = [[0, count, 1000 * count, 300, 301, 302, 4] for count in (2 * number, 2 * number + 1)]
        sent = bytearray(csv_lines(rows))
        sent[at] = damage
        assert all(row in rows for row in rows_of(parser.feed(sent)).tolist()), bytes(sent)


def test_a_tile_that_sends_no_checksums_any_more_is_read_again():
    """As with another sketch on the same board. Other tiles of the line need none meanwhile."""
    with_none = [b"%d,%d,%d,1,2,3,4\n" % (tile, number, 1000 * number) for number in range(3, 80) for tile in (0, 1)]
    parser, _ = parsed(csv_lines(rows(3)), *with_none)
    assert parser.counts.corrupted == WINDOW
    assert parser.tile_counts(2)[:, 0].tolist() == [3 + 77 - WINDOW, 77]
