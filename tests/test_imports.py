"""Which modules may know which: docs/architecture.md's directions, no cycles, no Qt, and no scipy in the engine.

And how long files and functions may be (CONTRIBUTING.md), as what they import is read by the same parser. Ruff counts
parameters.
"""

import ast
import re
import subprocess
import sys
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
FOLDERS = {"underfoot": "workbench", "underfoot.widgets": "widgets", "underfoot.presets": "presets"}


def modules():
    """Every module by its name, and where it lies."""
    for package, folder in FOLDERS.items():
        for path in sorted((ROOT / folder).rglob("*.py")):
            parts = path.relative_to(ROOT / folder).with_suffix("").parts
            yield ".".join((package, *parts)).removesuffix(".__init__"), path


SOURCES = dict(modules())
LEVELS = (
    {
        "underfoot",
        "presets",
        "arguments",
        "array_cache",
        "array_tables",
        "errors",
        "clock",
        "csv_tables",
        "compilation",
        "documents",
        "drawing",
        "emission",
        "file_places",
        "files",
        "kernels",
        "kernel_cache",
        "lane_lowering",
        "lanes",
        "layouts",
        "memory",
        "memory_lowering",
        "models",
        "number_parsing",
        "options",
        "phrases",
        "plugins",
        "quantities",
        "sqlite_files",
        "version",
    },
    {"parameters"},
    {"floor", "patch"},
    {"nodes", "devices", "calibration", "records", "experiments"},
    {"engine", "exchange", "network"},
    {"studies"},
    {"bench", "scenes"},
    {"commands", "monitoring"},
    {"widgets"},
    {"__main__"},
    {"start"},
)
WORKSPACES = {
    path.parent.name for path in (ROOT / "widgets").glob("*/__init__.py") if "WorkspaceDeclaration(" in path.read_text()
}
WIDGET_LEVELS = (
    {"theme", "escape", "lost_release", "background", "garbage_collection", "pictures", "polled_process"},
    {"plots", "controls", "floor_trails", "pressed_floor"},
    {"floor_map", "level_slider", "menu", "status_line", "main_bar", "dialogs"},
    {"session"},
    {"workspace", "view_menu", "window_state", "recolour", "session_display"},
    {"workspace_stack", "window_dialogs", "projecting_workspace"},
    WORKSPACES,
    {"window", "screenshots"},
    {"application", "under_load"},
)
"""The same within `underfoot.widgets`; a folder that declares a workspace is at its place without being named."""

QT = ("PySide6", "shiboken6", "superqt", "qtpy", "PyQt6", "PyQt5", "underfoot.widgets")
NOT_IN_THE_ENGINE = (*QT, "scipy", "soundfile", "h5py", "click", "pytest", "matplotlib")
WIDGETS = [module for module in SOURCES if module.startswith("underfoot.widgets.")]
WITHOUT_A_SCREEN = [module for module in SOURCES if not module.startswith("underfoot.widgets")]


def part(module):
    """The file or folder that a module belongs to."""
    return module.split(".")[1] if "." in module else module


def level(module):
    return next(i for i, parts in enumerate(LEVELS) if part(module) in parts)


def widget_part(module):
    """The file or folder of `underfoot.widgets` that a module belongs to."""
    return module.split(".")[2]


def widget_level(module):
    return next(i for i, parts in enumerate(WIDGET_LEVELS) if widget_part(module) in parts)


def statements(body):
    """All statements, also within others: no import and no function is in an expression, of which most of a file is."""
    for one in body:
        yield one
        for inside in ("body", "handlers", "cases", "orelse", "finalbody"):
            yield from statements(getattr(one, inside, ()))


@cache
def parsed(path):
    """Every module that a file imports, in its functions and for its annotations, too; and how long its functions are.

    The package's own file only names what scripts use, for type checkers: nothing below it depends on that.
    """
    modules, lines = set(), {}
    tree = ast.parse(path.read_text())
    if path == SOURCES["underfoot"]:
        tree.body = [one for one in tree.body if not ast.unparse(one).startswith("if TYPE_CHECKING")]
    for node in statements(tree.body):
        if isinstance(node, ast.Import):
            modules |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path} has a relative import"
            names = {f"{node.module}.{alias.name}" for alias in node.names}
            modules |= {name if name in SOURCES else node.module for name in names}
        elif isinstance(node, ast.FunctionDef):
            lines[node.name, node.lineno] = node.end_lineno - node.lineno + 1
    return modules, lines


def imported(module):
    return parsed(SOURCES[module])[0]


def python(code):
    return subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True)


def blocked(names):
    """Code after which these modules are not there."""
    return f"""
import sys
class Blocker:
    def find_spec(self, name, path=None, target=None):
        if any(name == blocked or name.startswith(blocked + ".") for blocked in {names!r}):
            raise ModuleNotFoundError(f"{{name}} is blocked")
sys.meta_path.insert(0, Blocker())
"""


def test_the_table_of_the_document_has_every_part():
    table = re.findall(r"^\| \d+ \| (.*?) \|", (ROOT / "docs" / "architecture.md").read_text(), re.MULTILINE)
    named = set(re.findall(r"`(\w+)`", " ".join(table)))
    assert named == set().union(*LEVELS) - {"underfoot", "presets"}


def test_every_part_has_its_level():
    for module in SOURCES:
        assert sum(part(module) in parts for parts in LEVELS) == 1, module


def test_imports_run_down():
    ours = {module: {one for one in imported(module) if one.partition(".")[0] == "underfoot"} for module in SOURCES}
    for module, names in ours.items():
        assert names <= SOURCES.keys(), module
    above = {module: [name for name in names if level(name) > level(module)] for module, names in ours.items()}
    assert not {module: names for module, names in above.items() if names}


def test_only_the_about_dialog_imports_the_package_s_own_file():
    """Which names what scripts use, of all levels; the dialog says where it lies."""
    assert [module for module in SOURCES if "underfoot" in imported(module)] == ["underfoot.widgets.dialogs.about"]


def test_every_part_of_the_widgets_has_its_level():
    assert {"design", "monitor", "calibrate"} <= WORKSPACES
    for module in WIDGETS:
        assert sum(widget_part(module) in parts for parts in WIDGET_LEVELS) == 1, module


def test_imports_of_widgets_run_down_and_no_workspace_knows_another():
    def is_wrong(module, name):
        others = WORKSPACES - {widget_part(module)} if widget_part(module) in WORKSPACES else ()
        return widget_level(name) > widget_level(module) or widget_part(name) in others

    ours = {module: [name for name in imported(module) if name in WIDGETS] for module in WIDGETS}
    wrong = {module: [name for name in names if is_wrong(module, name)] for module, names in ours.items()}
    assert not {module: names for module, names in wrong.items() if names}


def test_there_is_no_cycle():
    parts = SOURCES.keys()
    waiting = {module: {name for name in imported(module) if name in parts} - {module} for module in parts}
    while waiting:
        ready = [module for module, needs in waiting.items() if not needs & waiting.keys()]
        assert ready, f"these modules import one another: {sorted(waiting)}"
        for module in ready:
            del waiting[module]


def test_nothing_names_qt_and_only_the_door_names_the_window():
    named = {module: [name for name in imported(module) if name.startswith(QT)] for module in WITHOUT_A_SCREEN}
    assert {module: names for module, names in named.items() if names} == {
        "underfoot.__main__": ["underfoot.widgets.application"]
    }


def test_importing_the_package_loads_nothing_of_it():
    done = python(
        "import sys; before = set(sys.modules); import underfoot\n"
        "print(sorted({name.partition('.')[0] for name in set(sys.modules) - before}))"
    )
    assert done.returncode == 0, done.stderr
    heavy = {"numpy", "numba", "scipy", "msgspec", "PySide6"}
    assert "'underfoot'" in done.stdout
    assert not [name for name in heavy if f"'{name}'" in done.stdout]


def test_the_command_line_needs_neither_numba_nor_qt_to_say_what_it_can():
    done = python(
        f"{blocked((*QT, 'numba', 'scipy'))}\n"
        "import underfoot.__main__ as door\nsys.argv = ['underfoot', 'render', '--help']\ndoor.main()"
    )
    assert done.returncode == 0, done.stderr
    assert "--force" in done.stdout


def test_the_engine_plays_a_patch_without_scipy():
    done = python(
        f"{blocked(NOT_IN_THE_ENGINE)}\n"
        "import underfoot.engine.process\n"
        "from underfoot.devices.simulated_floor import SimulatedFloor\n"
        "from underfoot.engine.loop import Loop, LoopOptions\n"
        "from underfoot.floor.layout import default_floor\n"
        "from underfoot.nodes import REGISTRY\n"
        "from underfoot.patch import preset_files\n"
        "from underfoot.patch.patch import Patch\n"
        "patch = Patch.load(preset_files.patches()['gravel'], REGISTRY)\n"
        "loop = Loop(patch, REGISTRY, SimulatedFloor(default_floor(1, 1)), LoopOptions(block=64))\n"
        "loop.run(64)\n"
    )
    assert done.returncode == 0, done.stderr


def test_the_emulator_sends_without_scipy():
    """Only a file of acceleration needs it; it took half a second of the processor at each start."""
    done = python(
        f"{blocked(('scipy',))}\n"
        "import underfoot.__main__ as door\n"
        "sys.argv = ['underfoot', 'emulate', '--udp', '9', '--seconds', '0.01']\n"
        "door.main()"
    )
    assert done.returncode == 0, done.stderr


def test_workspaces_open_without_what_only_computes():
    """They are made while the window is already in use."""
    every = sorted(module for module in SOURCES if re.fullmatch(r"underfoot\.widgets\.\w+\.workspace", module))
    done = python(f"{blocked(('numba', 'scipy'))}\nimport importlib\nfor m in {every!r}: importlib.import_module(m)")
    assert done.returncode == 0, done.stderr
    assert len(every) >= 6


def test_without_qt_the_window_says_so_in_a_line():
    done = python(
        f"{blocked(('PySide6',))}\nimport sys\nsys.argv = ['underfoot']\nfrom underfoot.__main__ import main\nmain()"
    )
    assert done.returncode == 1
    assert done.stderr.startswith("underfoot: the window cannot be opened: ")
    assert done.stderr.count("\n") == 1


@pytest.mark.parametrize(
    ("platform", "reason"),
    [
        ("none", "Could not find the Qt platform plugin"),
        pytest.param(
            "linuxfb:fb=/dev/none", "Failed to open framebuffer /dev/none",
            marks=pytest.mark.skipif(sys.platform != "linux", reason="a platform of Linux"),
        ),
    ],
)  # fmt: skip
def test_without_a_display_the_window_says_so_in_a_line_where_qt_would_abort(tmp_path, platform, reason):
    done = python(
        f"import os, tempfile\nos.environ['QT_QPA_PLATFORM'], tempfile.tempdir = {platform!r}, {str(tmp_path)!r}\n"
        "from underfoot.widgets.application import run\nrun(screenshot_dir='pictures')"
    )
    assert not [*tmp_path.iterdir()]
    assert done.returncode == 1
    assert done.stderr.startswith(f"underfoot: the window cannot be opened: {reason}")
    assert done.stderr.count("\n") == 1


def test_before_a_window_opens_neither_metadata_nor_sources_are_read():
    """Qt's hook on imports would read the source of every module that is imported from then on."""
    done = python(
        "import builtins, platformdirs, sys\n"
        "imports, platformdirs.user_data_dir = builtins.__import__, lambda *_: sys.exit(0)  # all is imported by then\n"
        "import underfoot.__main__ as door\n"
        "sys.argv = ['underfoot']\n"
        "try:\n"
        "    door.main()\n"
        "finally:\n"
        "    loaded = [m in sys.modules for m in ('underfoot.widgets.window', 'importlib.metadata')]\n"
        "    print(builtins.__import__ is imports, *loaded)\n"
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.split() == ["True", "True", "False"]


def test_everything_imports_where_the_system_is_not_posix_and_all_but_the_window_without_qt():
    """As on Windows: what other libraries need of the system is loaded before it is taken away."""
    without, window = sorted(WITHOUT_A_SCREEN), sorted(WIDGETS)
    done = python(
        "import os, pathlib, signal, sys, importlib\n"
        "import numpy, scipy.signal, scipy.optimize, numba, click, msgspec, platformdirs, soundfile, sounddevice\n"
        "import multiprocessing.shared_memory, concurrent.futures.process, serial, serial.tools.list_ports\n"
        "import PySide6.QtWidgets\n"
        "qt = {name: sys.modules.pop(name) for name in [*sys.modules] if name.startswith(('PySide6', 'shiboken6'))}\n"
        f"{blocked(QT)}"
        "sys.modules.update(dict.fromkeys(('fcntl', 'pty', 'termios', 'tty', 'resource', 'pwd', 'grp')))\n"
        "for name in ('pthread_sigmask', 'SIG_BLOCK', 'SIGKILL', 'SIGHUP', 'SIGUSR1', 'SIGALRM'):\n"
        "    delattr(signal, name)\n"
        "for name in ('fork', 'openpty', 'killpg', 'getloadavg', 'sched_getaffinity'):\n"
        "    delattr(os, name)\n"
        "os.name, sys.modules[pathlib.Path.__module__].WindowsPath = 'nt', pathlib.PosixPath\n"
        f"for module in {without!r}: importlib.import_module(module)\n"
        "del sys.meta_path[0]\n"
        "sys.modules.update(qt)\n"
        f"for module in {window!r}: importlib.import_module(module)\n"
    )
    assert done.returncode == 0, done.stderr


def test_no_interval_is_told_by_a_clock_that_can_be_stepped_or_is_coarse():
    """Somebody sets the clock, or a server does: `time.perf_counter` does not mind. Nor does `time.monotonic`, which on
    Windows has steps of 15.6 ms until Python 3.13; and a time of the one is none of the other there.
    """
    told = {"underfoot.network.server", "underfoot.widgets.design.blind_test"}  # a time of day for others, and a seed
    told.add("underfoot.widgets.recordings.recording_list")  # the age of an empty file, which no other clock tells
    assert {module for module, path in SOURCES.items() if "time.time" in path.read_text()} <= told
    assert not [module for module, path in SOURCES.items() if "time.monotonic" in path.read_text()]


def test_an_sdist_has_what_its_tests_read_beside_the_packages():
    texts = [path.read_text() for path in (ROOT / "tests").rglob("*.py")]
    read = {name.partition("/")[0] for text in texts for name in re.findall(r'\bROOT / "([\w./-]+)"', text)}
    lines = [line.split() for line in (ROOT / "MANIFEST.in").read_text().splitlines()]
    sent = {name for line in lines if line and line[0] in ("include", "graft") for name in line[1:]}
    assert ".dockerignore" in read
    assert read <= sent | {"README.md", "pyproject.toml", "MANIFEST.in", "workbench", "widgets"}


def test_no_file_has_over_500_lines_and_no_function_over_60():
    files = [*SOURCES.values(), *sorted((ROOT / "tests").rglob("*.py"))]
    assert [path for path in files if path.read_text().count("\n") > 500] == []
    functions = {(path, *name): lines for path in files for name, lines in parsed(path)[1].items()}
    assert len(functions) > 1000
    assert [name for name, lines in functions.items() if lines > 60] == []
