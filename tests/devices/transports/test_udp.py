"""UDP: datagrams are pieces of their own."""

import socket

import numpy as np
import pytest
from free_ports import free_port

from underfoot.devices import transport_reader
from underfoot.devices.framing.parser import HELD_S, Parser
from underfoot.devices.framing.wire_format import encode
from underfoot.devices.transport_reader import TransportReader
from underfoot.devices.transports import transport_of
from underfoot.devices.transports.udp import DATAGRAM_BYTES, MOST_NAMES, UdpSender, UdpTransport
from underfoot.errors import BadValue, DeviceError


def test_datagrams_end_frames():
    port = UdpTransport("127.0.0.1", free_port())
    port.open()
    try:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
            for part in (b"one", b"two"):
                sender.sendto(part, ("127.0.0.1", port.port))
        data = b""
        while len(data) < 8:
            data += bytes(port.read())
        assert data == b"one\0two\0"
        for host in ("127.0.0.1", "0.0.0.0"):
            with pytest.raises(DeviceError, match=r"cannot be listened at: .* second Underfoot; choose another port"):
                UdpTransport(host, port.port).open()
    finally:
        port.close()


def test_the_newest_addresses_are_known_by_name():
    """As a board has another port each time it is started, those of the last weeks were "another address"."""
    port = UdpTransport("127.0.0.1", free_port())
    port.open()
    try:
        for _ in range(MOST_NAMES + 1):
            with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as board:
                board.sendto(b"0", ("127.0.0.1", port.port))
                name = f"127.0.0.1:{board.getsockname()[1]}"
                assert bytes(port.read()) == b"0\0"
        assert port.sender_name(port.senders[0][1]) == name
    finally:
        port.close()


def test_datagrams_hold_as_many_whole_frames_as_an_ethernet_frame_carries():
    port = UdpTransport("127.0.0.1", free_port())
    sender = UdpSender("127.0.0.1", port.port)
    port.open()
    try:
        assert sender.send(bytes(range(1, 251)) * 12, range(500, 3001, 500))
        data = b""
        while len(data) < 3003:
            data += bytes(port.read())
        assert [len(piece) for piece in data.split(b"\0")] == [1000, 1000, 1000, 0]
        assert DATAGRAM_BYTES == 1400
    finally:
        port.close()
        sender.close()


def test_a_name_that_no_host_can_have_is_refused():
    with pytest.raises(DeviceError, match=r"udp:a\.\.b:9000 cannot be sent to: there can be no host of this name"):
        UdpSender("a..b", 9000)
    with pytest.raises(DeviceError, match=r"udp:a\.\.b:9000 cannot be listened at: "):
        UdpTransport("a..b", 9000).open()


@pytest.mark.parametrize(
    "address", ["127.0.0.1", "127.0.0.1:99999", "127.0.0.1:0", ":port", "1", "a:b:9000", "[]:9000"]
)
def test_addresses_that_cannot_be_are_refused(address):
    """A `1` alone, as of an address that was not typed to its end, was listened at."""
    with pytest.raises(BadValue, match="allowed: HOST:PORT with a port of 1024 to 65535"):
        transport_of("udp", address)


def test_the_address_of_a_tile_is_none_to_listen_at():
    """The system's words for it, 'cannot assign requested address', told nobody what to enter."""
    with pytest.raises(DeviceError, match=r"this computer has no such address; choose one of its own, or 0\.0\.0\.0"):
        UdpTransport("192.0.2.1", 9000).open()


def test_the_address_of_a_group_is_refused():
    """Nothing would come: a group has to be joined."""
    with pytest.raises(BadValue, match=r"of a group; allowed: an address of this computer, as 0\.0\.0\.0:9000"):
        transport_of("udp", "239.1.2.3:9000")


def test_a_tile_belongs_to_the_address_that_sends_it_until_that_is_silent():
    """Frames of the same tile from elsewhere, valid as they are, are left out, counted, and their address is known."""
    port, parser = UdpTransport("127.0.0.1", free_port()), Parser()
    port.open()
    with (
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as own,
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other,
    ):

        def heard(sender, tile, number, now_s):
            sender.sendto(encode([tile, number, 1000 * number, 1, 2, 3, 4]), ("127.0.0.1", port.port))
            return parser.feed(port.read(), port.senders, now_s)["sequence"].tolist()

        try:
            assert heard(own, 0, 1, 0.0) == [1]
            assert heard(other, 0, 2, 0.1) == []
            assert heard(other, 1, 1, 0.1) == [1]  # another tile may come from there
            assert not parser.is_contested(0)  # its own sender may have gone, and come back at another port
            assert heard(own, 0, 2, 0.2) == [2]
            assert parser.is_contested(0)
            assert parser.counts.foreign == 1
            mine, stranger = (port.sender_name(number) for number in parser.senders_of(0))
            assert mine == f"127.0.0.1:{own.getsockname()[1]}"
            assert stranger == f"127.0.0.1:{other.getsockname()[1]}"
            assert heard(other, 0, 3, 0.2 + 1.01 * HELD_S) == [3]
            assert not parser.is_contested(0)
            assert heard(own, 0, 3, 0.3 + 1.01 * HELD_S) == []
            assert not parser.is_contested(0)
            assert heard(other, 0, 4, 0.4 + 1.01 * HELD_S) == [4]
            assert parser.is_contested(0)
            assert not parser.is_contested(1)
        finally:
            port.close()


def test_of_bytes_that_are_no_frames_no_baud_rate_is_asked(until, monkeypatch):
    """There is none over a network."""
    monkeypatch.setattr(transport_reader, "SILENT_S", 0.0)
    port = free_port()
    reader = TransportReader(UdpTransport("127.0.0.1", port), lambda samples, when: None)
    reader.start()
    try:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
            data = np.random.default_rng(1).bytes(1400)
            until(lambda: other.sendto(data, ("127.0.0.1", port)) and "no frame" in reader.trouble, "it is said")
        assert reader.trouble.endswith(f"alone (COBS); {UdpTransport.doubt}")
        assert "baud" not in reader.trouble
    finally:
        reader.close()


def test_a_transport_whose_close_fails_is_read_again(until, monkeypatch):
    """As a plug-in's that closes what it could not open: its error ended the thread that reads.

    What is missing for long was tried ten times a second, for ever.
    """
    failed = []
    monkeypatch.setattr(transport_reader, "retry_s", lambda failures, is_second: failed.append(failures) or 0.001)

    class Loose(UdpTransport):
        is_plugged = False

        def open(self):
            if not self.is_plugged:
                raise DeviceError("it is not plugged in")
            super().open()

        def close(self):
            super().close()
            if not self.is_plugged:
                raise AttributeError("nothing is open")

    port = Loose("127.0.0.1", free_port())
    reader = TransportReader(port, lambda samples, when: None)
    reader.start()
    try:
        until(lambda: len(failed) > 3, "it is tried again")
        assert failed[:4] == [1, 2, 3, 4]
        port.is_plugged = True
        until(lambda: reader.is_open, "it is opened")
        assert reader.take_notices() == ["it is not plugged in; waiting for it", f"{port.name} is back"]
    finally:
        reader.close()
