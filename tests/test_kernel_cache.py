"""What throws a compiled kernel away, and what does not."""

import importlib
import os
import pickle
import subprocess
import sys
from collections import Counter

import numba
import numpy as np
import pytest

from underfoot.files import cache_folder
from underfoot.kernel_cache import digest

CALLED = '''
"""A module that a kernel calls into."""
from underfoot.kernels import kernel
FACTOR = 2.0
UNUSED = 1

@kernel
def scaled(x):
    """Doubled."""
    return FACTOR * x
'''
CALLER = """
from underfoot.kernels import kernel
import called

@kernel
def one_more(x):
    return called.scaled(x) + 1.0
"""


@pytest.fixture
def kernels(tmp_path, monkeypatch):
    """`kernels(called, caller)`: the kernel of `caller` as it is when the two modules have these texts."""
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(sys, "dont_write_bytecode", True)

    def load(called=CALLED, caller=CALLER):
        (tmp_path / "called.py").write_text(called)
        (tmp_path / "caller.py").write_text(caller)
        for name in ("called", "caller"):
            sys.modules.pop(name, None)
        importlib.invalidate_caches()
        return importlib.import_module("caller").one_more

    yield load
    for name in ("called", "caller"):
        sys.modules.pop(name, None)


def mark(kernel):
    return digest(kernel.py_func)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ('"""Doubled."""', '"""Twice as much."""'),
        ("UNUSED = 1", "UNUSED = 2"),
        ("    return FACTOR", "    # it is two\n\n    return FACTOR"),
        ("@kernel", "\n\n\n@kernel"),
        ('"""A module that a kernel calls into."""', ""),
    ],
)
def test_words_and_places_do_not_count(kernels, old, new):
    before = mark(kernels())
    assert old in CALLED
    assert mark(kernels(called=CALLED.replace(old, new))) == before


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("FACTOR * x", "FACTOR + x"),
        ("FACTOR = 2.0", "FACTOR = 3.0"),
        ("FACTOR * x", "3.0 * x"),
        ("import kernel", "import modal_kernel as kernel"),
    ],
)
def test_what_a_called_function_does_counts(kernels, old, new):
    before = mark(kernels())
    assert old in CALLED
    assert mark(kernels(called=CALLED.replace(old, new))) != before


BORROWED = """
from typing import Annotated, NamedTuple
import numpy as np
from underfoot.array_tables import arrays_at
from underfoot.kernels import kernel

class Table(NamedTuple):
    rows: Annotated[np.ndarray, np.dtype([("force_n", np.float64), ("x_m", np.float64)], align=True), 1]

table_at = arrays_at(Table)

@kernel
def one_more(where):
    return table_at(where).rows[0].x_m + 1.0
"""


def test_the_data_types_of_arrays_that_are_passed_by_address_count(kernels):
    before = mark(kernels(caller=BORROWED))
    moved = BORROWED.replace('("x_m", np.float64)', '("y_m", np.float64), ("x_m", np.float64)')
    assert mark(kernels(caller=moved)) != before


def test_a_kernel_is_loaded_until_what_it_calls_has_changed(kernels, tmp_path, monkeypatch):
    monkeypatch.setenv("UNDERFOOT_CACHE", str(tmp_path / "cache"))
    assert kernels()(2.0) == 5.0
    again = kernels(called=CALLED.replace("Doubled", "Twice"))
    assert again(2.0) == 5.0
    assert sum(again.compiled.stats.cache_hits.values()) == 1
    other = kernels(called=CALLED.replace("2.0", "10.0"))
    assert other(2.0) == 21.0
    assert sum(other.compiled.stats.cache_misses.values()) == 1


def test_the_oldest_forms_of_a_kernel_go(kernels, tmp_path, monkeypatch):
    monkeypatch.setenv("UNDERFOOT_CACHE", str(tmp_path / "cache"))
    for k in range(7):
        kernels(called=CALLED.replace("2.0", f"{k}.5"))(1.0)
    kept = Counter(path.suffix for path in cache_folder().rglob("caller.one_more-*"))
    assert kept[".nbc"] == kept[".nbi"] == 4
    assert kept[".lock"] in (0, 4)  # older versions of filelock delete them


def test_of_processes_that_need_a_kernel_at_once_one_compiles_it(kernels, tmp_path):
    kernels()
    code = "import caller; caller.one_more(1.0); print(sum(caller.one_more.compiled.stats.cache_hits.values()))"
    environment = {**os.environ, "UNDERFOOT_CACHE": str(tmp_path / "cache"), "PYTHONPATH": str(tmp_path)}
    both = [
        subprocess.Popen([sys.executable, "-c", code], env=environment, stdout=subprocess.PIPE, text=True)
        for _ in range(2)
    ]
    assert sorted(process.communicate()[0] for process in both) == ["0\n", "1\n"]


def test_without_a_writable_folder_kernels_are_compiled_all_the_same(kernels, tmp_path, monkeypatch):
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("UNDERFOOT_CACHE", str(tmp_path / "file"))
    assert kernels()(2.0) == 5.0


@pytest.mark.skipif(os.name != "posix", reason="the modes of folders")
def test_kernels_of_a_folder_that_is_only_read_are_loaded_also_by_one_that_is_compiled(kernels, tmp_path, monkeypatch):
    monkeypatch.setenv("UNDERFOOT_CACHE", str(tmp_path / "cache"))
    kernels()
    sys.modules["called"].scaled(1.0)
    kernels(caller=CALLER.replace("1.0", "7.0"))  # called.scaled is there, caller.one_more is not
    folder = cache_folder() / "kernels"
    there = sorted(folder.iterdir())
    code = """
import called, caller
print(called.scaled(1.0), caller.one_more(1.0))
print(*(sum(one.compiled.stats.cache_hits.values()) for one in (called.scaled, caller.one_more)))
open(caller.one_more.compiled._cache.cache_path + "/written", "w")
"""
    as_root = ["setpriv", "--bounding-set=-dac_override"]  # root writes whatever a folder's mode is
    command = [*(as_root if os.geteuid() == 0 else []), sys.executable, "-c", code]
    folder.chmod(0o555)
    try:
        done = subprocess.run(command, capture_output=True, text=True, env={**os.environ, "PYTHONPATH": str(tmp_path)})
    finally:
        folder.chmod(0o755)
    assert done.stdout.split() == ["2.0", "9.0", "1", "0"], done.stderr
    assert "Permission denied" in done.stderr  # so the folder was not writable
    assert sorted(folder.iterdir()) == there


_ON_A_FULL_DISK = """
import resource, sys
sys.path.insert(0, {folder!r})
from caller import one_more
resource.setrlimit(resource.RLIMIT_FSIZE, (1, resource.RLIM_INFINITY))
assert one_more(3.0) == 7.0
"""


@pytest.mark.skipif(os.name != "posix", reason="files have no limit to their size elsewhere")
def test_on_a_full_disk_kernels_are_compiled_all_the_same(kernels, tmp_path):
    kernels()
    cache = tmp_path / "cache"
    script = _ON_A_FULL_DISK.format(folder=str(tmp_path))
    subprocess.run([sys.executable, "-c", script], check=True, env=os.environ | {"UNDERFOOT_CACHE": str(cache)})
    assert not [path for path in cache.rglob("*") if path.is_file() and path.stat().st_size]


def test_digests_are_the_same_in_every_process_whatever_else_it_has_imported():
    """And Numba's own cache is left alone."""
    code = """
import gc, os, numba, underfoot.engine.loop
from underfoot.kernel_cache import digest
from underfoot.kernels import Kernel
print(repr(numba.config.CACHE_DIR), "NUMBA_CACHE_DIR" in os.environ)
for one in gc.get_objects():
    if isinstance(one, Kernel):
        print(f"{one.__module__}.{one.__qualname__}", digest(one.py_func))
"""
    environment = {name: value for name, value in os.environ.items() if name != "NUMBA_CACHE_DIR"}
    command = [sys.executable, "-c", code]
    done = subprocess.run(
        command, capture_output=True, check=True, text=True, env=environment | {"PYTHONHASHSEED": "1"}
    )
    own_cache, *said = done.stdout.splitlines()
    assert own_cache == "'' False"
    import sqlite3  # noqa: F401 - modules that the other process has not

    import underfoot.records.recording  # noqa: F401

    for line in said:
        name, there = line.split()
        module, _, path = name.rpartition(".")
        assert mark(getattr(importlib.import_module(module), path)) == there, name
    assert any(line.startswith("underfoot.patch.driver.run_block ") for line in said)
    assert np.unique(said).size == len(said)


@pytest.mark.parametrize("rest", [b"", b"cunderfoot\nNotHere\n."], ids=["cut short", "with a type that is not here"])
def test_an_index_that_cannot_be_read_is_begun_anew(kernels, tmp_path, monkeypatch, rest):
    monkeypatch.setenv("UNDERFOOT_CACHE", str(tmp_path / "kept"))
    assert kernels()(1.0) == 3.0
    (index,) = cache_folder().glob("kernels/caller.one_more-*.nbi")
    whole = index.read_bytes()
    index.write_bytes(pickle.dumps(numba.__version__) + rest)
    again = kernels()
    assert again(1.0) == 3.0
    assert index.read_bytes() == whole
    assert sum(again.compiled.stats.cache_hits.values()) == 0
    third = kernels()
    assert (third(1.0), sum(third.compiled.stats.cache_hits.values())) == (3.0, 1)


def test_machine_code_that_is_damaged_is_not_run(kernels, tmp_path, monkeypatch):
    monkeypatch.setenv("UNDERFOOT_CACHE", str(tmp_path / "kept"))
    factor, damaged = np.float64(1.2345).tobytes(), np.float64(6.789).tobytes()
    called = CALLED.replace("2.0", "1.2345")
    assert kernels(called)(2.0) == 3.469
    (code,) = cache_folder().glob("kernels/caller.one_more-*.nbc")
    whole = code.read_bytes()
    assert factor in whole
    code.write_bytes(whole.replace(factor, damaged))
    assert kernels(called)(2.0) == 3.469
    third = kernels(called)
    assert (third(2.0), sum(third.compiled.stats.cache_hits.values())) == (3.469, 1)
