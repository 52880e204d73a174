"""Serial ports, by the pseudo-terminals that stand for them."""

import os
import sys
from types import SimpleNamespace

import numpy as np
import pytest
import serial
from made_frames import rows
from serial.tools import list_ports

from underfoot.devices import transport_reader
from underfoot.devices.framing.wire_format import csv_lines, encode, rows_of
from underfoot.devices.transport_reader import TransportReader
from underfoot.devices.transports import serial as serial_ports
from underfoot.devices.transports import transport_of
from underfoot.devices.transports.serial import PtySender, SerialTransport
from underfoot.errors import BadValue, DeviceError

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="there are no pseudo-terminals")


def test_a_port_that_is_not_there_is_waited_for(until, tmp_path):
    name = tmp_path / "tile"
    heard = []
    reader = TransportReader(SerialTransport(str(name)), lambda samples, when: heard.append(len(samples)))
    reader.start()
    try:
        until(lambda: reader.notices, "it says so")
        assert reader.notices[0] == f"serial:{name} cannot be opened: there is no such port; waiting for it"
        assert reader.trouble == reader.notices[0]
        sender = PtySender()
        try:
            os.symlink(sender.name, name)
            until(lambda: reader.is_open, "it is opened")
            assert sender.send(encode(rows(5)), [])
            until(lambda: sum(heard) == 5, "it is read")
            assert "no such port" not in reader.trouble
            until(lambda: f"serial:{name} is back" in reader.notices, "it says so")
        finally:
            sender.close()
    finally:
        reader.close()


def test_a_board_that_boots_when_its_port_is_opened_is_no_trouble(until, monkeypatch):
    """Of an Arduino it was said at each start that nothing comes, or no frame, and then that it sends again."""
    monkeypatch.setattr(transport_reader, "SILENT_S", 0.0)
    monkeypatch.setattr(SerialTransport, "boot_s", 1000.0 * SerialTransport.boot_s)
    sender, heard = PtySender(), []
    reader = TransportReader(SerialTransport(sender.name), lambda samples, when: heard.append(len(samples)))
    reader.start()
    try:
        until(lambda: reader.is_open, "it is open")
        assert sender.send(b"\xff" * 600, [])
        until(lambda: reader.parser.bytes == 600, "the bootloader's bytes are read")
        assert sender.send(b"\0" + encode(rows(5)), [])
        until(lambda: sum(heard) == 5, "it is read")
        assert not any(line.endswith("sends again") or "no frame" in line for line in reader.notices)
    finally:
        reader.close()
        sender.close()


def test_a_port_that_goes_away_while_it_is_opened_is_waited_for(until, monkeypatch):
    """As a loose plug does: pyserial passes on an error of `termios`, which ended the thread that reads."""
    sender = PtySender()
    reset = serial.Serial.reset_input_buffer

    def unplug(port):
        sender.unplug()
        reset(port)

    heard = []
    reader = TransportReader(SerialTransport(sender.name), lambda samples, when: heard.append(len(samples)))
    try:
        with monkeypatch.context() as patch:
            patch.setattr(serial.Serial, "reset_input_buffer", unplug)
            reader.start()
            until(lambda: reader.notices, "it says so")
            assert reader.take_notices() == [f"serial:{sender.name} cannot be opened: it was unplugged; waiting for it"]
        sender.plug()
        until(lambda: reader.is_open, "it is opened")
        assert sender.send(encode(rows(5)), [])
        until(lambda: sum(heard) == 5, "it is read")
    finally:
        reader.close()
        sender.close()


def test_a_port_is_offered_by_the_name_that_its_board_keeps(tmp_path, monkeypatch):
    """Plugged in again it may have another number, and was waited for in vain."""
    ports = [SimpleNamespace(device=str(tmp_path / name)) for name in ("ttyACM0", "ttyS0")]
    monkeypatch.setattr(list_ports, "comports", lambda: ports)
    monkeypatch.setattr(serial_ports, "LASTING_NAMES", tmp_path / "by-id")
    assert SerialTransport.suggestions() == [port.device for port in ports]
    (tmp_path / "by-id").mkdir()
    (tmp_path / "by-id/usb-board-if00").symlink_to("../ttyACM0")
    assert SerialTransport.suggestions() == [str(tmp_path / "by-id/usb-board-if00"), ports[1].device]


def test_a_port_belongs_to_one():
    """Beside others it is waited for."""
    ends = PtySender(), PtySender()
    first, second = (SerialTransport(end.name) for end in ends)
    both = SerialTransport(f"{ends[0].name},{ends[1].name}")
    taken = "cannot be opened: another program has it, or Underfoot itself"
    second.open()
    try:
        both.open()
        both.read()
        assert both.lost[0].startswith(f"{second.name} {taken}")
        with pytest.raises(DeviceError, match=taken):
            first.open()
    finally:
        for opened in (first, second, both, *ends):
            opened.close()


def test_what_lay_in_the_buffer_is_dropped():
    sender = PtySender()
    port = SerialTransport(sender.name)
    try:
        assert sender.send(b"old", [])
        port.open()
        assert sender.send(b"new", [])
        assert port.read()[:1] == b"n"
    finally:
        port.close()
        sender.close()


@pytest.mark.parametrize(
    ("address", "message"),
    [
        ("", "port is ''; allowed: a port's name"),
        ("/dev/ttyUSB0@fast", "allowed: PORT or PORT@BAUD"),
        ("/dev/ttyUSB0@1", "baud is 1; allowed: 50 to 20000000"),
        ("/dev/ttyUSB0,", "port is '/dev/ttyUSB0,'; allowed: a port's name"),
        ("COM3,COM3", "port is 'COM3,COM3'; allowed: each port once"),
    ],
)
def test_ports_that_cannot_be_are_refused(address, message):
    with pytest.raises(BadValue, match=message):
        transport_of("serial", address)


def test_what_is_no_port_is_said_to_be_none(tmp_path):
    """Of several, up to five are named: of 36 boards whose hub was not plugged in, it was the first alone, or all."""
    file = tmp_path / "walk.csv"
    file.touch()
    of_folder, of_file = "it is a folder", "it is no serial port"
    both = f"{of_folder}; serial:{file} cannot be opened: {of_file}"
    many = ",".join(f"{tmp_path}/none{k}" for k in range(7))
    for address, why in (
        (tmp_path, of_folder),
        (file, of_file),
        (f"{tmp_path},{file}", both),
        (many, ".*/none4 cannot be opened: there is no such port; and 2 more"),
    ):
        with pytest.raises(DeviceError, match=f"cannot be opened: {why}$"):
            transport_of("serial", str(address)).open()


@pytest.mark.parametrize("form", [encode, csv_lines])
def test_several_ports_are_read_as_one_line_of_which_a_part_may_be_missing(form, until, monkeypatch):
    """Of boards with a port each one alone was read. Their frames come in pieces, now of the one, now of the other."""
    monkeypatch.setattr(serial_ports, "_AGAIN_S", 0.0)
    boards, heard = [PtySender() for _ in range(3)], set()
    line = SerialTransport(",".join(board.name for board in boards))
    reader = TransportReader(line, lambda samples, when: heard.update(map(tuple, rows_of(samples)[:, :2].tolist())))

    def sent(first, tiles):
        """Send 20 frames of each of these tiles; return the last ones."""
        data = {tile: form(rows(20, 1, first) + np.array([tile, 0, 0, 0, 0, 0, 0])) for tile in tiles}
        for at in range(0, max(map(len, data.values())), 17):
            for tile in tiles:
                boards[tile].send(data[tile][at : at + 17], [])
        return {(tile, first + 19) for tile in tiles}

    boards[1].unplug()
    reader.start()
    try:
        until(lambda: reader.is_open, "those that are there are open")
        last = sent(0, (0, 2))
        until(lambda: last <= heard, "these come")
        boards[1].plug()
        until(lambda: sent(20, (1,)) and heard & {(1, 39)}, "it is there")
        boards[1].unplug()
        last = sent(40, (0, 2))
        until(lambda: last <= heard, "the others come")
        boards[1].plug()
        until(lambda: sent(60, (1,)) and heard & {(1, 79)}, "it is back")
        assert reader.parser.counts.corrupted == 0
        assert line.sender_name(reader.parser.senders_of(2)[0]) == f"serial:{boards[2].name}"
        missing, lost = reader.take_notices()
        assert missing == f"serial:{boards[1].name} cannot be opened: there is no such port; waiting for it"
        assert lost.startswith(f"serial:{boards[1].name} went away: ")
        assert lost.endswith("; waiting for it")
        for board in boards:
            board.unplug()
        until(lambda: reader.trouble.endswith("; waiting for it"), "all are gone", seen=lambda: reader.trouble)
        boards[2].plug()
        until(lambda: sent(80, (2,)) and heard & {(2, 99)}, "one of them is enough")
    finally:
        reader.close()
        for board in boards:
            board.close()
