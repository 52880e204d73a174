"""The desktop's files: written where a desktop looks for them, and valid by its own tools where those are there."""

import re
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path
from xml.etree import ElementTree

import pytest
from click.testing import CliRunner

from underfoot import __version__
from underfoot.commands.desktop import PLACES, desktop

ROOT = Path(__file__).resolve().parents[1]
pytestmark = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="menus of Linux desktops")


@pytest.fixture
def written(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path))
    result = CliRunner().invoke(desktop)
    assert result.exit_code == 0
    yield tmp_path
    for said in ("removed", "there is no"):
        removed = CliRunner().invoke(desktop, ["--remove"])
        assert (removed.exit_code, removed.output.count(said)) == (0, len(PLACES))
        assert not [path for path in tmp_path.rglob("underfoot.*") if path.is_file()]


def arguments(entry):
    """The command line of an entry, unescaped and split as the Desktop Entry Specification says."""
    value = next(line for line in entry.splitlines() if line.startswith("Exec=")).removeprefix("Exec=")
    value = value.replace("\\\\", "\\")
    found = re.findall(r'"((?:\\.|[^"\\])*)"|(\S+)', value)
    return [re.sub(r"\\(.)", r"\1", quoted) if quoted else plain.replace("%%", "%") for quoted, plain in found]


def test_the_menu_starts_this_installation_with_the_file_that_was_clicked(written):
    path = written / "applications/underfoot.desktop"
    *command, file = arguments(path.read_text())
    assert file == "%f"
    said = subprocess.run([*command, "--version"], capture_output=True, text=True, check=True, env={})
    assert said.stdout.strip().endswith(__version__)
    if shutil.which("desktop-file-validate"):
        checked = subprocess.run(["desktop-file-validate", path], capture_output=True, text=True, check=False)
        assert checked.stdout == ""


@pytest.mark.parametrize("folder", ["plain", "two words", """it's "$HOME" (100%) \\ `x`; #1"""])
def test_the_menu_starts_a_python_in_any_folder_without_the_script_beside_it(tmp_path, monkeypatch, folder):
    python = tmp_path / folder / "python"
    python.parent.mkdir()
    monkeypatch.setattr(sys, "executable", str(python))
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path))
    assert CliRunner().invoke(desktop).exit_code == 0
    entry = (tmp_path / "applications/underfoot.desktop").read_text()
    assert [one.replace("%%", "%") for one in arguments(entry)] == [str(python), "-m", "underfoot", "%f"]


def test_recordings_and_patches_are_kinds_of_files(written):
    root = ElementTree.parse(written / "mime/packages/underfoot.xml").getroot()
    space = "{http://www.freedesktop.org/standards/shared-mime-info}"
    kinds = {kind.get("type") for kind in root.iter(f"{space}mime-type")}
    entry = (written / "applications/underfoot.desktop").read_text()
    offered = next(line for line in entry.splitlines() if line.startswith("MimeType=")).removeprefix("MimeType=")
    assert kinds == set(offered.strip(";").split(";"))


def test_an_image_is_built_of_what_the_wheel_needs_and_its_user_may_write_into_ones_folder():
    told = (ROOT / "assets/desktop/Containerfile").read_text()
    page = (ROOT / "docs/install.md").read_text()
    line = re.search(r"podman run .*", told)[0]
    assert f"    {line}\n" in page
    user = re.search(r"useradd .*--uid (\d+) (\w+)", told)
    assert f"--userns keep-id:uid={user[1]},gid={user[1]} " in line
    assert f"USER {user[2]}\n" in told
    assert all('--user "$(id -u):$(id -g)"' in text for text in (told, page))
    sent = {name.removeprefix("!") for name in (ROOT / ".dockerignore").read_text().splitlines() if name[0] == "!"}
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())
    needed = {*project["tool"]["setuptools"]["package-dir"].values(), *project["project"]["license-files"]}
    assert sent == {*needed, project["project"]["readme"], "pyproject.toml", "assets", "presets"}


def test_the_icon_is_a_picture(written, qtbot):
    from PySide6.QtGui import QIcon

    icon = QIcon(str(written / "icons/hicolor/scalable/apps/underfoot.svg"))
    assert not icon.pixmap(64, 64).isNull()
