"""Packages of other people bring nodes, transports and scenes; one that cannot be loaded is left out."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from free_ports import free_port

TEMPLATE = Path(__file__).resolve().parents[1] / "docs" / "plugin-template"


def install(folder, name, group, value, modules):
    """A package as an installer leaves it: its modules, and what they are declared as."""
    for path, text in modules.items():
        (folder / path).parent.mkdir(parents=True, exist_ok=True)
        (folder / path).write_text(text)
    about = folder / f"{name}-1.0.dist-info"
    about.mkdir()
    (about / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.0\n")
    (about / "entry_points.txt").write_text(f"[{group}]\n{name} = {value}\n")


@pytest.fixture
def python(tmp_path):
    """Runs Python where packages of a folder are installed, too."""
    site = tmp_path / "site"
    site.mkdir()

    def run(*arguments):
        path = os.pathsep.join([str(site), os.environ.get("PYTHONPATH", "")])
        environment = {**os.environ, "PYTHONPATH": path}
        return subprocess.run(
            [sys.executable, *map(str, arguments)], env=environment, cwd=tmp_path, capture_output=True, text=True
        )

    run.site = site
    return run


def test_the_template_installs_and_its_tests_pass(python, tmp_path):
    copied = tmp_path / "squeak"
    for path in TEMPLATE.rglob("*"):
        if path.is_file() and path.suffix in (".py", ".toml", ".md"):
            there = copied / path.relative_to(TEMPLATE)
            there.parent.mkdir(parents=True, exist_ok=True)
            there.write_bytes(path.read_bytes())
    offline = ["--no-deps", "--no-build-isolation", "--no-index", "--quiet", "--disable-pip-version-check"]
    done = subprocess.run(
        [sys.executable, "-m", "pip", "install", *offline, "--target", str(python.site), str(copied)],
        capture_output=True,
        text=True,
    )
    if done.returncode != 0:  # no pip, or setuptools too old to build: as it would have installed it
        sources = {
            f"underfoot_squeak/{path.name}": path.read_text()
            for path in (TEMPLATE / "src" / "underfoot_squeak").glob("*.py")
        }
        install(python.site, "underfoot_squeak", "underfoot.nodes", "underfoot_squeak.nodes", sources)
    tried = python("-m", "pytest", "-q", "-p", "no:cacheprovider", copied / "tests")
    assert tried.returncode == 0, tried.stdout + tried.stderr
    told = python("-m", "underfoot", "nodes", "squeak")
    assert (told.returncode, told.stderr) == (0, "")
    assert told.stdout.startswith("squeak  (Tones: Squeak)")


def test_what_cannot_be_loaded_is_left_out_and_takes_no_place(python):
    install(python.site, "broken", "underfoot.nodes", "broken", {"broken.py": "1 / 0"})
    again = (
        "from underfoot.patch.node import node, Output\n"
        "@node('gain', 'Mine')\nclass Gain:\n  'Mine.'\n  out = Output()\n  def run(out):\n    out[:] = 0.0\n"
    )
    install(python.site, "twice", "underfoot.nodes", "twice", {"twice.py": again})
    poor = "from underfoot.devices.transport import Transport\nclass Poor(Transport):\n"
    poor += "".join(f"  def {name}(*_): ...\n" for name in ("of", "suggestions", "open", "read", "close"))
    install(python.site, "poor", "underfoot.transports", "poor:Poor", {"poor.py": poor})
    told = python("-m", "underfoot", "nodes", "gain")
    assert told.returncode == 0
    assert told.stdout.startswith("gain  (Shapes: Gain)")
    told = [line for line in told.stderr.splitlines() if "plug-in" in line]
    assert told == [
        "underfoot: plug-in poor is left out: Poor does not declare scheme, address_form, help, label, title, "
        "dialog_help, sender",
        "underfoot: plug-in broken is left out: ZeroDivisionError: division by zero",
        "underfoot: plug-in twice is left out: there is a node gain already",
    ]


def test_a_plug_in_that_brings_nothing_says_so(python):
    """A misspelt place was left out in silence."""
    install(python.site, "hollow", "underfoot.nodes", "hollow", {"hollow/__init__.py": "from math import pi\n"})
    told = python("-m", "underfoot", "nodes", "gain")
    assert told.returncode == 0
    assert told.stderr == "underfoot: plug-in hollow is left out: no complete node is in hollow\n"


def test_a_transport_of_a_plug_in_is_a_target(python):
    code = (
        "from underfoot.devices.transports.udp import UdpTransport\n"
        "class Radio(UdpTransport):\n    scheme = 'radio'\n    help = 'tiles by radio'\n"
    )
    install(python.site, "radio", "underfoot.transports", "radio:Radio", {"radio.py": code})
    told = python("-m", "underfoot", "monitor", "--help")
    assert (told.returncode, told.stderr) == (0, "")
    assert "radio:" in told.stdout


@pytest.mark.parametrize("scheme", ["simulator", "replay"])
def test_a_transport_of_a_plug_in_takes_no_target_of_underfoot(python, scheme):
    """Every command and the window listened at it instead of simulating a floor."""
    code = (
        "from underfoot.devices.transports.udp import UdpTransport\n"
        f"class Radio(UdpTransport):\n    scheme = '{scheme}'\n"
    )
    install(python.site, "radio", "underfoot.transports", "radio:Radio", {"radio.py": code})
    told = python("-m", "underfoot", "monitor", "--help")
    assert told.stderr == f"underfoot: plug-in radio is left out: there is a target {scheme} already\n"


@pytest.mark.parametrize("fails", [("open",), ("read",), ("open", "close")])
def test_a_transport_of_a_plug_in_that_fails_is_named_in_a_line(python, fails):
    """Its thread ended with a traceback, and nobody was told that the floor would stay silent."""
    code = (
        "from underfoot.devices.transports.udp import UdpTransport\n"
        "class Radio(UdpTransport):\n    scheme = 'radio'\n    help = 'tiles by radio'\n"
        + "".join(f"    def {name}(self):\n        raise KeyError('antenna')\n" for name in fails)
    )
    install(python.site, "radio", "underfoot.transports", "radio:Radio", {"radio.py": code})
    told = python("-m", "underfoot", "monitor", f"radio:127.0.0.1:{free_port()}", "--seconds", "1")
    assert "Traceback" not in told.stderr
    assert told.stderr.count(": KeyError: 'antenna'") == 1
    assert "is back" not in told.stderr


@pytest.mark.parametrize("command", [["monitor", "radio:far"], ["emulate", "--radio", "far"]])
def test_an_address_that_a_plug_in_cannot_read_is_named_in_a_line(python, command):
    """Its own error was a traceback."""
    code = (
        "from underfoot.devices.transports.udp import UdpSender, UdpTransport\n"
        "class RadioSender(UdpSender):\n    option = 'radio'\n    of = staticmethod(int)\n"
        "class Radio(UdpTransport):\n    scheme = 'radio'\n    sender = RadioSender\n    of = staticmethod(int)\n"
    )
    install(python.site, "radio", "underfoot.transports", "radio:Radio", {"radio.py": code})
    told = python("-m", "underfoot", *command)
    assert told.returncode != 0
    assert "Traceback" not in told.stderr
    assert "radio is 'far': ValueError: invalid literal for int()" in told.stderr


@pytest.mark.parametrize("fails", ["send", "unplug", "plug", "close"])
def test_an_emulators_end_of_a_plug_in_that_fails_ends_the_command_in_a_line(python, fails):
    """It was a traceback, and the exit status that of a success."""
    code = (
        "from underfoot.devices.transports.udp import UdpSender, UdpTransport\n"
        "class RadioSender(UdpSender):\n    option = 'radio'\n"
        f"    def {fails}(self, *_):\n        raise KeyError('antenna')\n"
        "class Radio(UdpTransport):\n    scheme = 'radio'\n    sender = RadioSender\n"
    )
    install(python.site, "radio", "underfoot.transports", "radio:Radio", {"radio.py": code})
    told = python("-m", "underfoot", "emulate", "--radio", "9", "--unplug", "0.01:0.01", "--seconds", "0.05")
    assert (told.returncode, "Traceback" in told.stderr) == (1, False)
    assert told.stderr.splitlines()[-1].endswith(": KeyError: 'antenna'")


CHOSEN = """
from types import SimpleNamespace
from PySide6.QtWidgets import QApplication, QWidget
from underfoot.engine.target import Target
from underfoot.floor.layout import default_floor
from underfoot.widgets.dialogs.file_chooser import FileChooser
from underfoot.widgets.dialogs.transport_dialog import TransportDialog
from underfoot.widgets.session.target_chooser import TargetChooser
from underfoot.widgets.session.targets import choices

application, controller = QApplication([]), SimpleNamespace(target=Target(default_floor()))
window = QWidget()
(key,) = (key for key, text in choices() if text == "Radio…")
TargetChooser(window, controller, None, FileChooser(window, str, print), print, print).choose(key)
print(window.findChild(TransportDialog).windowTitle())
"""


@pytest.mark.parametrize("scheme", ["floor", "simulation", "recording"])
def test_a_transport_of_a_plug_in_is_chosen_in_the_window_whatever_its_name(python, scheme):
    """Another entry of the target menu answered for it."""
    code = (
        "from underfoot.devices.transports.udp import UdpTransport\n"
        f"class Radio(UdpTransport):\n    scheme, title = '{scheme}', 'Radio'\n"
    )
    install(python.site, "radio", "underfoot.transports", "radio:Radio", {"radio.py": code})
    told = python("-c", CHOSEN)
    assert told.stdout == "Radio\n", told.stderr


@pytest.mark.parametrize(("end", "option"), [("UdpSender", "--udp"), ("RadioSender", "--radio-link")])
def test_the_emulator_sends_beside_a_transport_of_a_plug_in(python, end, option):
    """One that shares the end of another, or whose option has a hyphen, ended every `emulate` with a traceback."""
    code = (
        "from underfoot.devices.transports.udp import UdpSender, UdpTransport\n"
        "class RadioSender(UdpSender):\n    option = 'radio-link'\n"
        f"class Radio(UdpTransport):\n    scheme = 'radio'\n    help = 'tiles by radio'\n    sender = {end}\n"
    )
    install(python.site, "radio", "underfoot.transports", "radio:Radio", {"radio.py": code})
    for each in ("--udp", option):
        told = python("-m", "underfoot", "emulate", each, "9", "--seconds", "0.01")
        assert (told.returncode, "Traceback" in told.stderr) == (0, False), told.stderr


@pytest.mark.parametrize("option", ["udp", "rate"])
def test_the_emulators_end_of_a_plug_in_takes_no_option_that_is_there(python, option):
    """One was left out in silence, the other took the place of the emulator's own option."""
    code = (
        "from underfoot.devices.transports.udp import UdpSender, UdpTransport\n"
        f"class RadioSender(UdpSender):\n    option = '{option}'\n"
        "class Radio(UdpTransport):\n    scheme = 'radio'\n    sender = RadioSender\n"
    )
    install(python.site, "radio", "underfoot.transports", "radio:Radio", {"radio.py": code})
    told = python("-m", "underfoot", "emulate", "--udp", "9", "--rate", "500", "--seconds", "0.01")
    assert told.returncode == 0
    assert f"underfoot: plug-in RadioSender is left out: emulate has an option --{option} already\n" in told.stderr


def test_a_scene_of_a_plug_in_is_run_by_the_command(python):
    code = (
        "from underfoot.scenes.scene import Scene\n"
        "class Puddle(Scene):\n    'Water.'\n    title, doc = 'Puddle', 'Water on the floor.'\n"
        "    def step(self, moment):\n        return ()\n    def shapes(self):\n        return ()\n"
    )
    install(python.site, "puddle", "underfoot.scenes", "puddle", {"puddle/__init__.py": code})
    told = python("-m", "underfoot", "scene")
    assert (told.returncode, told.stderr) == (0, "")
    assert "puddle" in told.stdout


def test_a_scene_of_a_plug_in_may_be_made_of_another_and_one_without_a_title_is_left_out(python):
    """The first was said to bring the pond again; the second ended the list of all scenes with a traceback."""
    deep = "from underfoot.scenes.frozen_pond import FrozenPond\nclass Deep(FrozenPond):\n    title = 'Deep pond'\n"
    install(python.site, "deep", "underfoot.scenes", "deep", {"deep/__init__.py": deep})
    bare = "from underfoot.scenes.scene import Scene\nclass Bare(Scene):\n    doc = 'Bare.'\n"
    bare += "    def step(self, moment):\n        return ()\n    def shapes(self):\n        return ()\n"
    install(python.site, "bare", "underfoot.scenes", "bare", {"bare/__init__.py": bare})
    told = python("-m", "underfoot", "scene")
    assert told.returncode == 0
    assert told.stderr == "underfoot: plug-in bare is left out: Bare does not declare title\n"
    assert [line.split()[0] for line in told.stdout.splitlines() if line[:1].isalpha()][-2:] == [
        "touch-widgets",
        "deep",
    ]


@pytest.mark.parametrize("fails", ["__init__", "step", "shapes"])
def test_a_scene_of_a_plug_in_that_fails_ends_its_command_in_a_line(python, fails):
    """As the window says it; it was a traceback."""
    code = (
        "from underfoot.scenes.scene import Scene\n"
        "class Puddle(Scene):\n    'Water.'\n    title, doc = 'Puddle', 'Water on the floor.'\n"
        "    def step(self, moment):\n        return ()\n    def shapes(self):\n        return ()\n"
        f"    def {fails}(self, *_):\n        raise KeyError('depth')\n"
    )
    install(python.site, "puddle", "underfoot.scenes", "puddle", {"puddle/__init__.py": code})
    told = python("-m", "underfoot", "scene", "puddle", "--seconds", "0.3", "--film", "a.gif")
    assert told.returncode == 1
    assert told.stderr.splitlines()[-1] == "underfoot: The scene was stopped: KeyError: 'depth'"
    assert "Traceback" not in told.stderr
