"""A transport is one file: found by itself, refused where it is not whole, and named wherever targets are."""

from pathlib import Path

import pytest
from click.testing import CliRunner

from underfoot.__main__ import cli
from underfoot.devices import transports
from underfoot.devices.transports import TRANSPORTS, split_target, target_forms, transport_of
from underfoot.errors import BadValue

ROOT = Path(__file__).resolve().parents[3]

FILE = """
from underfoot.devices.transport import Sender, Transport

class LoopbackSender(Sender):
    option, option_value, help, powers_tiles = "loopback", "", "To itself.", False
    of = send = unplug = plug = close = None

class LoopbackTransport(Transport):
    scheme, address_form, help = "loopback", "NAME", "nothing but itself"
    label, title, dialog_help, sender = "Loopback", "Tiles of nobody", "Any name.", LoopbackSender
    of = suggestions = open = read = close = None
"""


@pytest.fixture
def found(tmp_path, monkeypatch):
    """`found(name, text)`: what is found when there is a file more."""

    def discover(name, text):
        (tmp_path / f"{name}.py").write_text(text)
        monkeypatch.setattr(transports, "__path__", [*transports.__path__, str(tmp_path)])
        return transports.discover()

    return discover


def test_a_new_file_is_a_transport(found):
    more = found("loopback_whole", FILE)
    assert more.keys() - TRANSPORTS.keys() == {"loopback"}
    assert more["loopback"].title == "Tiles of nobody"


@pytest.mark.parametrize(
    ("declared", "message"),
    [("label, title,", "LoopbackTransport does not declare title"), ("option, ", "LoopbackSender does not declare")],
)
def test_one_that_does_not_declare_all_is_refused_by_name(found, declared, message):
    kept = {"label, title,": "label, _title,", "option, ": "_option, "}[declared]
    with pytest.raises(TypeError, match=message):
        found(f"loopback_without_{len(declared)}", FILE.replace(declared, kept))


@pytest.mark.parametrize("command", [["--help"], ["monitor", "--help"], ["calibrate", "fsr", "--help"]])
def test_help_of_commands_has_every_transport(command):
    said = CliRunner().invoke(cli, command, terminal_width=1000)
    for scheme, transport in TRANSPORTS.items():
        assert f"{scheme}:{transport.address_form}" in said.output


def test_the_emulator_has_an_option_for_every_transport():
    said = CliRunner().invoke(cli, ["emulate", "--help"], terminal_width=1000)
    for transport in TRANSPORTS.values():
        assert f"--{transport.sender.option}" in said.output
        assert transport.sender.help in said.output


def test_the_documents_have_every_transport():
    hardware = (ROOT / "docs/hardware.md").read_text()
    for scheme, transport in TRANSPORTS.items():
        assert f"`{scheme}:{transport.address_form.partition('[')[0]}`" in hardware
        assert f"underfoot emulate --{transport.sender.option}" in hardware
    firmware = (ROOT / "assets/firmware/README.md").read_text()
    for scheme in TRANSPORTS:
        assert f"underfoot monitor {scheme}:" in firmware


def test_what_is_no_transport_is_refused():
    with pytest.raises(BadValue, match=f"transport is 'carrier pigeon'; allowed: {', '.join(TRANSPORTS)}"):
        transport_of("carrier pigeon", "coop")
    assert target_forms().count(":") >= len(TRANSPORTS)


@pytest.mark.parametrize(
    ("scheme", "ways", "another"),
    [
        ("serial", ("{}/port", "{}/port@9600", "{}/link", "{}/second,{}/port"), "{}/other"),
        ("tcp", ("9001", ":9001", "localhost:9001", "127.0.0.1:9001"), "hub:9001"),
        ("udp", ("9001", ":9001", "0.0.0.0:9001", "127.0.0.1:9001"), "9002"),
    ],
)
def test_a_device_is_known_however_its_address_is_written(scheme, ways, another, tmp_path):
    (tmp_path / "link").symlink_to(tmp_path / "port")
    sent = (transport_of(scheme, way.replace("{}", str(tmp_path))) for way in (*ways, another))
    devices, *others = (transport.devices for transport in sent)
    assert [devices.isdisjoint(other) for other in others] == [False] * (len(ways) - 1) + [True]


@pytest.mark.parametrize("scheme", ["udp", "tcp"])
def test_the_name_of_an_ipv6_address_is_its_target(scheme):
    """Without its brackets what was said of it, and what `emulate` printed, was no address."""
    assert transport_of(scheme, "[::1]:9001").name == f"{scheme}:[::1]:9001"
    assert split_target(f"{scheme}:[::1]:9001") == (scheme, "[::1]:9001")
