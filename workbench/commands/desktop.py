"""`underfoot desktop`: the program in the menu of a Linux desktop, and its files under their own icon."""

import os
import shutil
import subprocess
import sys
from importlib.resources import as_file, files
from pathlib import Path

import click

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
        if remove:
            path.unlink(missing_ok=True)
        else:
            _write(name, path)
        print(f"{'removed' if remove else 'wrote'} {path}")
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
    if name.endswith(".desktop"):  # a menu knows no virtual environment
        command = shutil.which("underfoot") or f"{sys.executable} -m underfoot"
        data = data.replace(b"Exec=underfoot ", f"Exec={_quoted(command)} ".encode())
    make_folder(path.parent)
    write_file(path, data)


def _quoted(command: str) -> str:
    """Return a path for a desktop entry, quoted if it has spaces."""
    return command if " " not in command or command.startswith('"') else f'"{command}"'
