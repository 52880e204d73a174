"""Unusual environments: no home, no cache, several programs at once, another locale, special characters in names."""

import hashlib
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

from underfoot.bench.stress.outcome import Effort, Outcome, Progress
from underfoot.bench.stress.valid_files import tone
from underfoot.files import cache_folder

_NAMES = ("two words", "Füße", "снег и лёд", "雪と氷", "ثلج", "a'b\"c", "-o", "🦶")
_LONGEST_S = 900.0


def run(effort: Effort, progress: Progress) -> Iterator[Outcome]:
    """Yield a result for each environment; each renders the same tone, whose bytes must be identical."""
    with tempfile.TemporaryDirectory() as made:
        folder = Path(made)
        tone().save(folder / "tone.json")
        nowhere = folder / "file"
        nowhere.write_bytes(b"")
        wanted, said = _rendered(folder, {})
        yield Outcome("as usual", 1, said or "renders", bool(wanted))
        homes = {name: str(nowhere / "home") for name in ("HOME", "XDG_CONFIG_HOME", "XDG_CACHE_HOME", "XDG_DATA_HOME")}
        progress("stress: no home")
        yield _same("a home that cannot be", _rendered(folder, homes), wanted)
        german = _german(folder / "locales")
        how = "a locale with decimal commas" if "LOCPATH" in german else "the name of a locale that is not installed"
        yield _same(how, _rendered(folder, german), wanted)
        yield _same("a locale without UTF-8", _rendered(folder, {"LC_ALL": "C", "PYTHONUTF8": "0"}), wanted)
        for name in _NAMES:
            below = folder / name
            below.mkdir()
            tone().save(below / f"{name}.json")
            yield _same(f"the name {name!a}", _rendered(below, {}, f"{name}.json"), wanted)
        progress("stress: two programs at once")
        yield _at_once(folder, wanted)
        progress("stress: no cache; this compiles all kernels anew")
        yield _same("a cache that cannot be", _rendered(folder, {"UNDERFOOT_CACHE": str(nowhere)}), wanted)


def _german(folder: Path) -> dict[str, str]:
    """Return a German environment, with the compiled locale if the system can generate it."""
    named = {"LC_ALL": "de_DE.UTF-8", "LANG": "de_DE.UTF-8"}
    folder.mkdir()
    try:
        made = ["localedef", "-f", "UTF-8", "-i", "de_DE", str(folder / "de_DE.UTF-8")]
        done = subprocess.run(made, capture_output=True).returncode == 0
    except OSError:
        done = False
    return named | {"LOCPATH": str(folder)} if done else named


def _command(patch: str, out: str) -> list[str]:
    return [sys.executable, "-m", "underfoot", "render", f"./{patch}", "--seconds", "0.2", "-o", f"./{out}"]


def _environment(changes: dict[str, str]) -> dict[str, str]:
    return {**os.environ, "UNDERFOOT_CACHE": str(cache_folder().parent), **changes}


def _rendered(folder: Path, changes: dict[str, str], patch: str = "tone.json") -> tuple[str, str]:
    """Return the hash of a render in a folder with a changed environment, and ""; on failure "" and the reason."""
    try:
        done = subprocess.run(
            _command(patch, "out.wav"), cwd=folder, env=_environment(changes), capture_output=True, timeout=_LONGEST_S
        )
    except subprocess.TimeoutExpired:
        return "", f"not done after {_LONGEST_S:.0f} s"
    lines = done.stderr.decode(errors="replace").strip().splitlines()
    if done.returncode:
        return "", lines[-1] if lines else f"exit status {done.returncode}"
    return hashlib.sha256((folder / "out.wav").read_bytes()).hexdigest(), ""


def _same(what: str, found: tuple[str, str], wanted: str) -> Outcome:
    digest, said = found
    return Outcome(what, 1, said or ("the same bytes" if digest == wanted else "OTHER BYTES"), digest == wanted != "")


def _at_once(folder: Path, wanted: str) -> Outcome:
    """Test four programs that write the same file at once: it must be one complete version, with no other files."""
    before = {path.name for path in folder.iterdir()}
    programs = [
        subprocess.Popen(
            _command("tone.json", "together.wav"),
            cwd=folder,
            env=_environment({}),
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        for _ in range(4)
    ]
    statuses = [program.wait(_LONGEST_S) for program in programs]
    digest = hashlib.sha256((folder / "together.wav").read_bytes()).hexdigest()
    beside = {path.name for path in folder.iterdir()} - before - {"together.wav"}
    good = digest == wanted and not any(statuses) and not beside
    return Outcome("four programs that write one file", 4, "whole, nothing beside it" if good else str(statuses), good)
