"""TCP: a stream from a hub that listens, over real sockets of this machine."""

import socket
from types import SimpleNamespace

import pytest
from free_ports import free_port
from made_frames import rows

from underfoot.devices import transport_reader
from underfoot.devices.framing.wire_format import encode
from underfoot.devices.recurrence import LAST, OFTEN
from underfoot.devices.transport_reader import TransportReader
from underfoot.devices.transports import transport_of
from underfoot.devices.transports.tcp import SEND_TIMEOUT_S, TcpSender, TcpTransport
from underfoot.errors import BadValue, DeviceError

HOST = "127.0.0.1"


@pytest.fixture
def sender():
    opened = TcpSender("", free_port())
    yield opened
    opened.close()


@pytest.fixture
def connect(sender):
    """`connect()`: one more connection to the sender."""
    opened = []

    def another():
        transport = TcpTransport.of(sender.name)
        transport.open()
        opened.append(transport)
        return transport

    yield another
    for transport in opened:
        transport.close()


def read(transport, size):
    """So many bytes, at least."""
    data = b""
    while len(data) < size:
        data += bytes(transport.read())
    return data


class CountingTransport(TcpTransport):
    """A connection that knows how many times it was opened, and how many bytes were read of it since."""

    opened = count = 0

    def open(self):
        super().open()
        self.opened, self.count = self.opened + 1, 0

    def read(self):
        data = super().read()
        self.count += len(data)
        return data


def test_a_frame_that_comes_in_pieces_is_one_frame(until):
    data = encode(rows(3))
    heard = []
    with socket.create_server((HOST, 0)) as hub:
        transport = CountingTransport(HOST, hub.getsockname()[1])
        reader = TransportReader(transport, lambda samples, when: heard.extend(samples["sequence"].tolist()))
        reader.start()
        try:
            tile, _ = hub.accept()
            with tile:
                for end in [*range(7, len(data), 7), len(data)]:
                    tile.sendall(data[transport.count : end])
                    until(lambda end=end: transport.count == end, "the piece is read by itself")
                until(lambda: heard == [0, 1, 2], "all are read")
                assert reader.parser.counts.corrupted == 0
        finally:
            reader.close()


def test_a_hub_that_is_not_there_is_waited_for(until):
    port = free_port()
    heard = []
    reader = TransportReader(TcpTransport(HOST, port), lambda samples, when: heard.append(len(samples)))
    reader.start()
    try:
        until(lambda: reader.notices, "it says so")
        assert reader.take_notices() == [
            f"tcp:{HOST}:{port} cannot be connected to: connection refused; waiting for it"
        ]
        sender = TcpSender(HOST, port)
        try:
            until(lambda: reader.is_open, "it is connected")
            assert sender.send(encode(rows(5)), [])
            until(lambda: sum(heard) == 5, "it is read")
            assert reader.take_notices() == [f"tcp:{HOST}:{port} is back"]
        finally:
            sender.close()
    finally:
        reader.close()


def test_a_connection_that_the_hub_ends_has_gone_away(sender, connect):
    transport = connect()
    assert sender.send(b"last", [4])
    sender.unplug()
    assert read(transport, 4) == b"last"
    with pytest.raises(DeviceError, match=f"tcp:{sender.name} went away: the connection was closed"):
        transport.read()
    transport.close()
    with pytest.raises(DeviceError, match="cannot be connected to: connection refused"):
        transport.open()
    sender.plug()
    transport.open()
    assert sender.send(b"next", [4])
    assert read(transport, 4) == b"next"


@pytest.mark.parametrize("idle", ["TCP_KEEPIDLE", "TCP_KEEPALIVE"])
def test_the_system_asks_now_and_then_whether_the_hub_is_alive(sender, monkeypatch, idle):
    """A hub that loses its power says nothing: without it, its end would never be noticed. macOS has another name."""
    number = getattr(socket, "TCP_KEEPIDLE", None) or getattr(socket, "TCP_KEEPALIVE", None)
    for name in ("TCP_KEEPIDLE", "TCP_KEEPALIVE"):
        monkeypatch.delattr(socket, name, raising=False)
    monkeypatch.setattr(socket, idle, number, raising=False)
    opened = []
    create = socket.create_connection
    monkeypatch.setattr(socket, "create_connection", lambda *given: opened.append(create(*given)) or opened[-1])
    transport = TcpTransport.of(sender.name)
    transport.open()
    try:
        (connection,) = opened
        assert connection.getsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE)
        asked = (number, socket.TCP_KEEPINTVL, socket.TCP_KEEPCNT)
        idle_s, every_s, probes = (connection.getsockopt(socket.IPPROTO_TCP, name) for name in asked)
        assert idle_s + every_s * probes <= 5
    finally:
        transport.close()


def test_the_emulator_sends_to_whoever_connected_last(sender, connect):
    assert not sender.send(b"nobody", [6])
    first = connect()
    assert sender.send(b"one", [3])
    assert read(first, 3) == b"one"
    second = connect()
    assert sender.send(b"two", [3])
    assert read(second, 3) == b"two"
    with pytest.raises(DeviceError, match="went away"):
        first.read()


def test_who_takes_a_hub_that_another_program_has_waits_ever_longer(sender, connect, until, monkeypatch):
    """Two programs took it from each other ten times a second, and said so each time; later once a second, for ever."""
    waits = []
    monkeypatch.setattr(transport_reader, "retry_s", lambda *failed, **how: waits.append((*failed, how)) or 0.001)
    monkeypatch.setattr(transport_reader, "MOST_RETRY_S", 600.0)  # no connection lasts longer here
    transport = CountingTransport.of(sender.name)
    reader = TransportReader(transport, lambda samples, when: None)
    reader.start()
    try:
        until(lambda: sender.send(b"x", [1]) and transport.count, "it is read")
        for time in range(OFTEN + 3):
            if time == OFTEN + 2:
                lines = reader.take_notices()
                for name in ("MOST_RETRY_S", "HELD_S"):
                    monkeypatch.setattr(transport_reader, name, 0.0)  # this one lasted
            opened = transport.opened
            connect()  # the other program
            until(lambda opened=opened: sender.send(b"x", [1]) and transport.opened > opened and transport.count)
    finally:
        reader.close()
    gone = f"tcp:{sender.name} went away: the connection was closed, perhaps for another program; "
    back, again = f"tcp:{sender.name} is back", f"{gone}it is tried ever more rarely, down to every 30 s: "
    again += "end the other program, or this one"
    assert lines == [f"{gone}waiting for it", back, *[again, back] * (OFTEN - 2), f"{again}; {LAST}", back]
    second, first = {"is_second": True}, {"is_second": False}
    assert waits[: OFTEN + 3] == [*((failed, second) for failed in range(1, OFTEN + 3)), (1, first)]


def test_a_hub_that_ends_each_connection_after_a_while_is_not_taken_for_another_program(until, monkeypatch):
    """It was tried ever more rarely, down to every 30 s, so that of its samples ever fewer came."""
    now, waits = [100.0], []
    monkeypatch.setattr(transport_reader, "time", SimpleNamespace(perf_counter=lambda: now[0]))
    monkeypatch.setattr(transport_reader, "retry_s", lambda *failed, **how: waits.append((*failed, how)) or 0.001)
    with socket.create_server((HOST, 0)) as hub:
        transport = CountingTransport(HOST, hub.getsockname()[1])
        reader = TransportReader(transport, lambda samples, when: None)
        reader.start()
        try:
            for number, life_s in enumerate((3.0, 3.0, 3.1, 3.0), 1):
                tile, _ = hub.accept()
                with tile:
                    data = encode(rows(number))
                    tile.sendall(data)
                    until(lambda data=data: transport.count == len(data), "it is read")
                    now[0] += life_s
                    waiting = len(waits)
                until(lambda waiting=waiting: len(waits) > waiting, "its end is noticed")
            lines = reader.take_notices()
        finally:
            reader.close()
    second, hubs = {"is_second": True}, {"is_second": False}
    assert waits[:4] == [(1, second), (2, second), (1, hubs), (1, hubs)]
    closed = f"tcp:{HOST}:{transport.port} went away: the connection was closed, perhaps for another program"
    assert f"{closed}, or each is after 3.0 s; waiting for it" in lines


def test_the_emulator_lets_go_of_a_reader_that_takes_nothing(sender, connect):
    connect()
    data = bytes(1 << 20)
    assert not all(sender.send(data, [len(data)]) for _ in range(100)), "the system's buffers are full before"
    assert not sender.send(b"more", [4])
    other = connect()
    assert sender.send(b"more", [4])
    assert read(other, 4) == b"more"
    assert SEND_TIMEOUT_S < 1.0  # the emulator stands still meanwhile


def test_by_default_the_emulator_is_for_this_machine_alone(sender):
    assert sender.name.startswith(f"{HOST}:")
    with pytest.raises(DeviceError, match=rf"tcp:{sender.name} cannot be listened at: .*; choose another port"):
        TcpSender.of(sender.name)


@pytest.mark.parametrize("address", [HOST, f"{HOST}:99999", f"{HOST}:0", ":port", "::1:9000", "[::1:9000", ":٣"])
def test_addresses_that_cannot_be_are_refused(address):
    with pytest.raises(BadValue, match="allowed: HOST:PORT with a port of 1 to 65535"):
        transport_of("tcp", address)


def test_a_name_that_no_host_can_have_is_refused():
    with pytest.raises(DeviceError, match=r"tcp:a\.\.b:9000 cannot be connected to: there can be no host of this name"):
        TcpTransport("a..b", 9000).open()
    with pytest.raises(DeviceError, match=r"tcp:a\.\.b:9000 cannot be listened at: "):
        TcpSender("a..b", 9000)
