"""Packages of other people bring nodes, transports and scenes; one that cannot be loaded is left out."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from command_line import CommandResult
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


def python_in(folder, *arguments):
    """Run Python in a folder, where packages of its `site` are installed, too."""
    path = os.pathsep.join([str(folder / "site"), os.environ.get("PYTHONPATH", "")])
    return subprocess.run(
        [sys.executable, *map(str, arguments)],
        env={**os.environ, "PYTHONPATH": path}, cwd=folder, capture_output=True, text=True,
    )  # fmt: skip


def test_the_template_installs_and_its_tests_pass(tmp_path, monkeypatch):
    monkeypatch.setenv("PYTEST_DISABLE_PLUGIN_AUTOLOAD", "1")  # as ours would take longer to load than its tests
    site, copied = tmp_path / "site", tmp_path / "squeak"
    site.mkdir()
    for path in TEMPLATE.rglob("*"):
        if path.is_file() and path.suffix in (".py", ".toml", ".md"):
            there = copied / path.relative_to(TEMPLATE)
            there.parent.mkdir(parents=True, exist_ok=True)
            there.write_bytes(path.read_bytes())
    offline = ["--no-deps", "--no-build-isolation", "--no-index", "--quiet", "--disable-pip-version-check"]
    done = subprocess.run(
        [sys.executable, "-m", "pip", "install", *offline, "--target", str(site), str(copied)],
        capture_output=True,
        text=True,
    )
    if done.returncode != 0:  # no pip, or setuptools too old to build: as it would have installed it
        sources = {
            f"underfoot_squeak/{path.name}": path.read_text()
            for path in (TEMPLATE / "src" / "underfoot_squeak").glob("*.py")
        }
        install(site, "underfoot_squeak", "underfoot.nodes", "underfoot_squeak.nodes", sources)
    tried = python_in(tmp_path, "-m", "pytest", "-q", "-p", "no:cacheprovider", copied / "tests")
    assert tried.returncode == 0, tried.stdout + tried.stderr
    told = python_in(tmp_path, "-m", "underfoot", "nodes", "squeak")
    assert (told.returncode, told.stderr) == (0, "")
    assert told.stdout.startswith("squeak  (Tones: Squeak)")


# --- packages that are installed beside one another ---

FAULTS = {"open": ("open",), "read": ("read",), "both": ("open", "close")}
"""What fails in a transport of a plug-in, by the end of its scheme."""


def failing(names, error="KeyError('antenna')"):
    return "".join(f"    def {name}(self, *_):\n        raise {error}\n" for name in names)


def transport(scheme, body="", sender=""):
    """The code of a transport that is UDP under another name, whose sender may have a code of its own."""
    ends = f"class {scheme.title()}Sender(UdpSender):\n    option = '{scheme}-link'\n{sender}" if sender else ""
    body += f"    sender = {scheme.title()}Sender\n" if sender else ""
    return (
        "from underfoot.devices.transports.udp import UdpSender, UdpTransport\n"
        f"{ends}class {scheme.title()}(UdpTransport):\n    scheme = '{scheme}'\n    help = 'tiles by radio'\n{body}"
    )


def scene(name, body=""):
    return (
        "from underfoot.scenes.scene import Scene\n"
        f"class {name}(Scene):\n    'Water.'\n    title, doc = '{name}', 'Water on the floor.'\n"
        "    def step(self, moment):\n        return ()\n    def shapes(self):\n        return ()\n"
        f"{body}"
    )


def packages():
    """The name, group, place and code of each package."""
    yield "broken", "nodes", "broken", "1 / 0"
    yield "ends", "nodes", "ends", "import sys\nsys.exit(2)"  # as a program that is one as soon as it is imported
    twice = (
        "from underfoot.patch.node import node, Output\n"
        "@node('gain', 'Mine')\nclass Gain:\n  'Mine.'\n  out = Output()\n  def run(out):\n    out[:] = 0.0\n"
    )
    yield "twice", "nodes", "twice", twice
    yield "hollow", "nodes", "hollow", "from math import pi\n"
    poor = "from underfoot.devices.transport import Transport\nclass Poor(Transport):\n"
    poor += "".join(f"  def {name}(*_): ...\n" for name in ("of", "suggestions", "open", "read", "close"))
    yield "poor", "transports", "poor:Poor", poor
    for scheme in ("simulator", "replay"):
        yield f"my{scheme}", "transports", f"my{scheme}:{scheme.title()}", transport(scheme)
    for scheme in ("floor", "simulation", "recording"):
        titled = transport(scheme, f"    title = 'Radio {scheme}'\n")
        yield f"my{scheme}", "transports", f"my{scheme}:{scheme.title()}", titled
    for end, names in FAULTS.items():
        yield f"radio{end}", "transports", f"radio{end}:Radio{end}", transport(f"radio{end}", failing(names))
    yield (
        "far",
        "transports",
        "far:Far",
        transport("far", "    of = staticmethod(int)\n", "    of = staticmethod(int)\n"),
    )
    for fails in ("send", "unplug", "plug", "close"):
        yield fails, "transports", f"my{fails}:{fails.title()}", transport(fails, sender=failing([fails]))
    yield "shares", "transports", "shares:Shares", transport("shares", "    sender = UdpSender\n")
    yield "radio", "transports", "radio:Radio", transport("radio", sender="    pass\n")
    for option in ("udp", "rate"):
        code = transport(f"my{option}", sender=f"    option = '{option}'\n")
        yield f"my{option}", "transports", f"my{option}:My{option}", code
    yield "puddle", "scenes", "puddle", scene("Puddle")
    for fails in ("__init__", "step", "shapes"):
        name = f"dry{fails.strip('_')}"
        yield name, "scenes", name, scene(name.title(), failing([fails], "KeyError('depth')"))
    deep = "from underfoot.scenes.frozen_pond import FrozenPond\nclass Deep(FrozenPond):\n    title = 'Deep pond'\n"
    yield "deep", "scenes", "deep", deep
    bare = "from underfoot.scenes.scene import Scene\nclass Bare(Scene):\n    doc = 'Bare.'\n"
    yield "bare", "scenes", "bare", bare + scene("Bare").partition("floor.'\n")[2]


COMMANDS = """
import json, os, sys, traceback

statuses = []
for k, words in enumerate(json.loads(sys.argv[1])):
    for stream, end in ((1, "out"), (2, "error")):
        os.dup2(os.open(f"{k}.{end}", os.O_CREAT | os.O_WRONLY), stream)
    sys.argv = ["underfoot", *words]
    try:
        from underfoot.__main__ import main

        main()
    except SystemExit as end:
        statuses.append(end.code)
    except BaseException:
        traceback.print_exc()
        statuses.append(1)
    sys.stdout.flush()
with open("statuses", "w") as file:
    json.dump(statuses, file)
"""
"""Runs command lines one after another: each process of its own would take half a second to begin."""


@pytest.fixture(scope="module")
def installed(tmp_path_factory):
    """A folder in whose `site` all packages are installed."""
    folder = tmp_path_factory.mktemp("installed")
    for name, group, value, code in packages():
        path = value.partition(":")[0]
        modules = {f"{path}.py" if group == "transports" else f"{path}/__init__.py": code}
        install(folder / "site", name, f"underfoot.{group}", value, modules)
    return folder


@pytest.fixture(scope="module")
def told(installed):
    """What each command line tells in a process where they are installed."""
    lines = ["nodes gain", "monitor --help", "monitor far:away", "emulate --far-link away", "scene"]
    lines += [f"monitor radio{end}:127.0.0.1:{free_port()} --seconds 1" for end in FAULTS]
    unplugged = "--unplug 0.01:0.01 --seconds 0.05"
    lines += [f"emulate --{fails}-link 9 {unplugged}" for fails in ("send", "unplug", "plug", "close")]
    lines += [f"emulate --{option} 9 --rate 500 --seconds 0.01" for option in ("udp", "radio-link")]
    lines += [f"scene dry{fails} --seconds 0.3 --film {fails}.gif" for fails in ("init", "step", "shapes")]
    done = python_in(installed, "-c", COMMANDS, json.dumps([line.split() for line in lines]))
    assert done.returncode == 0, done.stderr
    said = zip(json.loads((installed / "statuses").read_text()), *(
        [(installed / f"{k}.{end}").read_text() for k in range(len(lines))] for end in ("out", "error")
    ), strict=True)  # fmt: skip
    return {line.partition(":127")[0]: CommandResult(*result) for line, result in zip(lines, said, strict=True)}


def test_what_cannot_be_loaded_is_left_out_and_takes_no_place(told):
    """A misspelt place was left out in silence; a scene without a title ended the list of all with a traceback.

    Transports took the targets of Underfoot, and options of its emulator: no floor was simulated.
    """
    assert told["nodes gain"].status == 0
    assert told["nodes gain"].out.startswith("gain  (Shapes: Gain)")
    lines = [line for result in told.values() for line in result.error.splitlines() if "plug-in" in line]
    assert sorted(line.removeprefix("underfoot: plug-in ") for line in lines) == [
        "MyrateSender is left out: emulate has an option --rate already",
        "MyudpSender is left out: emulate has an option --udp already",
        "bare is left out: Bare does not declare title",
        "broken is left out: ZeroDivisionError: division by zero",
        "ends is left out: SystemExit: 2",
        "hollow is left out: no complete node is in hollow",
        "myreplay is left out: there is a target replay already",
        "mysimulator is left out: there is a target simulator already",
        "poor is left out: Poor does not declare scheme, address_form, help, label, title, dialog_help, sender",
        "twice is left out: there is a node gain already",
    ]


def test_a_transport_is_a_target(told):
    assert (told["monitor --help"].status, told["monitor --help"].error) == (0, "")
    assert "radio:" in told["monitor --help"].out


@pytest.mark.parametrize("end", FAULTS)
def test_a_transport_that_fails_is_named_in_a_line(told, end):
    """Its thread ended with a traceback, and nobody was told that the floor would stay silent."""
    said = told[f"monitor radio{end}"].error
    assert "Traceback" not in said
    assert said.count(": KeyError: 'antenna'") == 1
    assert "is back" not in said


@pytest.mark.parametrize("line", ["monitor far:away", "emulate --far-link away"])
def test_an_address_that_a_transport_cannot_read_is_named_in_a_line(told, line):
    """Its own error was a traceback."""
    assert told[line].status == 1
    assert "Traceback" not in told[line].error
    assert " is 'away': ValueError: invalid literal for int()" in told[line].error


@pytest.mark.parametrize("fails", ["send", "unplug", "plug", "close"])
def test_an_emulators_end_that_fails_ends_the_command_in_a_line(told, fails):
    """It was a traceback, and the exit status that of a success."""
    said = told[f"emulate --{fails}-link 9 --unplug 0.01:0.01 --seconds 0.05"]
    assert (said.status, "Traceback" in said.error) == (1, False)
    assert said.error.splitlines()[-1].endswith(": KeyError: 'antenna'")


@pytest.mark.parametrize("option", ["udp", "radio-link"])
def test_the_emulator_sends_beside_a_transport(told, option):
    """One that shares the end of another, or whose option has a hyphen, ended every `emulate` with a traceback."""
    said = told[f"emulate --{option} 9 --rate 500 --seconds 0.01"]
    assert (said.status, "Traceback" in said.error) == (0, False), said.error


def test_scenes_are_listed_and_may_be_made_of_others(told):
    """One that is was said to bring the pond again."""
    assert told["scene"].status == 0
    names = [line.split()[0] for line in told["scene"].out.splitlines() if line[:1].isalpha()]
    ours = names[names.index("touch-widgets") + 1 :]
    assert ours == ["deep", "dryinit", "dryshapes", "drystep", "puddle"]


@pytest.mark.parametrize("fails", ["init", "step", "shapes"])
def test_a_scene_that_fails_ends_its_command_in_a_line(told, fails):
    """As the window says it; it was a traceback."""
    said = told[f"scene dry{fails} --seconds 0.3 --film {fails}.gif"]
    assert said.status == 1
    assert said.error.splitlines()[-1] == "underfoot: The scene was stopped: KeyError: 'depth'"
    assert "Traceback" not in said.error


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
for scheme in ("floor", "simulation", "recording"):
    window = QWidget()
    (key,) = (key for key, text in choices() if text == f"Radio {scheme}…")
    TargetChooser(window, controller, None, FileChooser(window, str, print), print, print).choose(key)
    print(window.findChild(TransportDialog).windowTitle())
"""


def test_a_transport_is_chosen_in_the_window_whatever_its_name(installed):
    """Another entry of the target menu answered for it."""
    chosen = python_in(installed, "-c", CHOSEN)
    assert chosen.stdout == "Radio floor\nRadio simulation\nRadio recording\n", chosen.stderr
