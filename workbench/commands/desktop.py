"""`underfoot desktop`: the program in the menu of a Linux desktop, and its files under their own icon."""

import os
import re
import shutil
import subprocess
import sys
from importlib.resources import as_file, files
from pathlib import Path

import click

_RESERVED = re.compile(r"""[\s"'\\<>~|&;$*?#()`]""")
"""Characters for which an argument of `Exec` must be quoted (Desktop Entry Specification, the Exec key)."""

PLACES = {
    "underfoot.desktop": "applications/underfoot.desktop",
    "underfoot.xml": "mime/packages/underfoot.xml",
    "underfoot.svg": "icons/hicolor/scalable/apps/underfoot.svg",
}
"""Where each file goes below the person's data folder (freedesktop.org's base directories)."""


@click.command()
@click.option("--remove", is_flag=True, help="Remove it from the menu.")
def desktop(remove: bool) -> None:
    """Add Underfoot to the desktop menu, and register its file types (Linux)."""
    from underfoot.errors import UnderfootError

    if not sys.platform.startswith("linux"):
        raise UnderfootError("a menu entry is made on Linux only; elsewhere an installer makes it (docs/install.md)")
    root = Path(os.environ.get("XDG_DATA_HOME") or Path.home() / ".local" / "share")
    for name, place in PLACES.items():
        path = root / place
        if not remove:
            _write(name, path)
            print(f"wrote {path}")
        elif path.is_file():
            path.unlink()
            print(f"removed {path}")
        else:
            print(f"there is no {path}")
    for program, folder in (
        ("update-mime-database", root / "mime"),
        ("update-desktop-database", root / "applications"),
    ):
        if shutil.which(program) is not None and folder.is_dir():
            subprocess.run([program, str(folder)], check=False, capture_output=True)


def _write(name: str, path: Path) -> None:
    from underfoot.files import make_folder, write_file

    with as_file(files("underfoot.assets") / "desktop" / name) as source:
        data = source.read_bytes()
    if name.endswith(".desktop"):
        data = data.replace(b"Exec=underfoot ", f"Exec={' '.join(map(_argument, _program()))} ".encode())
    make_folder(path.parent)
    write_file(path, data)


def _program() -> list[str]:
    """Return the arguments that start this installation: a menu knows no virtual environment, nor its `PATH`."""
    script = shutil.which("underfoot", path=os.path.dirname(sys.executable))
    return [script] if script is not None else [sys.executable, "-m", "underfoot"]


def _argument(text: str) -> str:
    """Return an argument as the `Exec` of a desktop entry has it.

    >>> print(_argument("/opt/underfoot"), _argument("/home/me/my tiles/underfoot"), _argument("$5"))
    /opt/underfoot "/home/me/my tiles/underfoot" "\\\\$5"
    """
    text = text.replace("%", "%%")
    if not _RESERVED.search(text):
        return text
    quoted = re.sub(r'(["`$\\])', r"\\\1", text)
    return f'"{quoted}"'.replace("\\", "\\\\")  # the entry is a string, which has escapes of its own
