"""A transport may be anybody's: whatever its `read` does, the thread that calls it goes on."""

import resource
import sys
from contextlib import closing

import pytest
from bare_transport import BareTransport

from underfoot.devices.transport_reader import TransportReader


class Own(BareTransport):
    """A transport of a plug-in; `answer` is what it reads."""

    times_opened = 0

    def __init__(self, answer):
        self.answer = answer

    def open(self):
        self.times_opened += 1

    def read(self):
        return self.answer(self)


def exits(transport):
    raise SystemExit(3)


def loses(transport):
    transport.lost = None
    return b""


def fails_at_length(transport):
    raise ValueError("the antenna\nis not there")


@pytest.mark.parametrize(
    ("answer", "why"),
    [
        (lambda transport: None, "TypeError: memoryview: a bytes-like object"),  # as a file that does not block
        (exits, "SystemExit: 3"),
        (loses, "TypeError: 'NoneType' object is not iterable"),
        (fails_at_length, "ValueError: the antenna is not there"),
    ],
)
def test_what_is_no_reading_is_told_in_a_line_and_it_is_opened_again(answer, why, until):
    """The thread ended with a traceback, or without a word, and the floor was silent for good."""
    transport = Own(answer)
    with closing(TransportReader(transport, print)) as reader:
        reader.start()
        until(lambda: transport.times_opened > 1, "it is opened again")
    (line,) = reader.take_notices()
    assert line.startswith(f"given: {why}")
    assert line.endswith("; waiting for it")
    assert "\n" not in line


@pytest.mark.skipif(sys.platform != "linux", reason="Linux alone counts how often a thread has slept")
def test_a_read_that_does_not_wait_takes_no_whole_core(until):
    slept = []

    def counts(transport):
        slept.append(resource.getrusage(resource.RUSAGE_THREAD).ru_nvcsw)
        return b""

    with closing(TransportReader(Own(counts), print)) as reader:
        reader.start()
        until(lambda: len(slept) > 100, "it is read a hundred times")
    assert slept[100] - slept[0] >= 90  # by the system's count, in which a wait that was over at once is none
