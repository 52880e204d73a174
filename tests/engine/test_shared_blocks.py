"""Shared memory that killed programs left behind."""

import os
import subprocess
import sys
from multiprocessing.shared_memory import SharedMemory
from pathlib import Path

import pytest

from underfoot.engine.session_memory import SessionMemory
from underfoot.engine.shared_blocks import new_block, remove_orphans
from underfoot.errors import DeviceError

BLOCKS = Path("/dev/shm")
pytestmark = pytest.mark.skipif(not BLOCKS.is_dir(), reason="shared memory is no files here")


def test_blocks_of_the_killed_are_removed_and_those_of_the_living_are_not():
    """A process and its resource tracker are killed as a group, which leaves the block."""
    script = (
        "import os, signal; from underfoot.engine.shared_blocks import new_block; "
        "print(new_block(64).name, flush=True); os.killpg(0, signal.SIGKILL)"
    )
    killed = subprocess.run(
        [sys.executable, "-c", script], stdout=subprocess.PIPE, text=True, check=False, start_new_session=True
    )
    left = BLOCKS / killed.stdout.strip()
    assert left.exists()
    mine = new_block(64)
    try:
        remove_orphans()
        assert not left.exists()
        other = SharedMemory(mine.name)
        assert bytes(other.buf[:64]) == bytes(64)
        other.close()
    finally:
        mine.close()
        mine.unlink()


def test_files_of_others_are_left_alone(tmp_path, monkeypatch):
    for name in ("underfoot_notes", "psm_1234", f"underfoot_{os.getpid()}_00ff"):
        (tmp_path / name).touch()
    (tmp_path / "underfoot_4194999_00ff").touch()  # beyond the largest number of a process
    monkeypatch.setattr("underfoot.engine.shared_blocks._BLOCKS", tmp_path)
    remove_orphans()
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted(
        ["underfoot_notes", "psm_1234", f"underfoot_{os.getpid()}_00ff"]
    )


def test_memory_that_cannot_be_made_is_refused_in_one_line(monkeypatch):
    """As in a sandbox: it was said that what is printed cannot be written."""
    monkeypatch.setattr("underfoot.engine.shared_blocks.SharedMemory", lambda *given, **named: os.mkdir(BLOCKS))
    with pytest.raises(DeviceError, match=r"no shared memory in /dev/shm: file exists; .* \(end other programs, "):
        new_block(64)
    monkeypatch.setattr("underfoot.engine.shared_blocks._BLOCKS", Path("/sys/kernel"))  # where nobody may write
    with pytest.raises(DeviceError, match=r"\(it must be writable; give a container one of its own, as --tmpfs"):
        new_block(64)


@pytest.mark.skipif(not hasattr(os, "posix_fallocate"), reason="nothing can be reserved here")
def test_memory_without_room_is_refused_in_one_line_and_leaves_nothing():
    """A container has 64 MB: the first write beyond them ended the program with a bus error."""
    with pytest.raises(DeviceError, match=r"no shared memory in /dev/shm: .*; the session needs [\d.]+ MB more"):
        SessionMemory.create(1 << 20, 48_000.0, 1000.0)
    assert not list(BLOCKS.glob(f"underfoot_{os.getpid()}_*"))


@pytest.mark.skipif(not hasattr(os, "posix_fallocate"), reason="nothing can be reserved here")
def test_memory_beyond_the_largest_file_writes_no_traceback():
    """Python's process that removes shared memory was told of a block that it did not know (`ulimit -f`)."""
    script = """if True:
        import resource
        from underfoot.engine.shared_blocks import new_block
        from underfoot.errors import DeviceError
        resource.setrlimit(resource.RLIMIT_FSIZE, (1 << 20, 1 << 20))
        try:
            new_block(1 << 21)
        except DeviceError as error:
            print(error)
    """
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=False)
    assert done.stdout.startswith("no shared memory in /dev/shm: file too large; the session needs 2.1 MB more")
    assert done.stderr == ""
