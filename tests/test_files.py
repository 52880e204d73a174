"""Whole files: what is written replaces the old file at once, or leaves it as it was."""

import os
from contextlib import nullcontext
from pathlib import Path

import pytest

from underfoot.commands.files import require_folders_writable, require_outputs_writable
from underfoot.errors import BadFile
from underfoot.files import head_of, make_folder, read_file, replaced, write_file
from underfoot.records.c3d_files import C3DFile


def test_the_old_file_stays_until_the_new_one_is_whole(tmp_path):
    path = tmp_path / "a.txt"
    write_file(path, b"old")
    with replaced(path) as part:
        part.write_bytes(b"new")
        assert path.read_bytes() == b"old"
        assert part.parent == tmp_path
    assert read_file(path) == b"new"
    assert [file.name for file in tmp_path.iterdir()] == ["a.txt"]
    if os.name == "posix":
        assert path.stat().st_mode & 0o777 == 0o644


@pytest.mark.parametrize("times", [2, 99])
def test_a_file_that_another_program_has_open_is_replaced_once_it_is_closed(tmp_path, monkeypatch, times):
    """On Windows, where a scan for viruses or a program that keeps folders alike reads what was just written."""
    path, replace, refusals = tmp_path / "a.txt", os.replace, []
    write_file(path, b"old")

    def refused(part, target):
        refusals.append(target)
        if len(refusals) <= times:
            raise PermissionError(13, "Access is denied")
        replace(part, target)

    monkeypatch.setattr(os, "replace", refused)
    with nullcontext() if times < 9 else pytest.raises(BadFile, match=r"a\.txt cannot be written: access is denied"):
        write_file(path, b"new")
    assert path.read_bytes() == (b"new" if times < 9 else b"old")
    assert [file.name for file in tmp_path.iterdir()] == ["a.txt"]


@pytest.mark.parametrize("error", [RuntimeError, KeyboardInterrupt, FileNotFoundError])
def test_a_block_that_raises_leaves_everything_as_it_was(tmp_path, error):
    path = tmp_path / "a.txt"
    write_file(path, b"old")

    def stopped():
        with replaced(path) as part:
            part.write_bytes(b"half")
            raise error

    with pytest.raises(error):
        stopped()
    assert path.read_bytes() == b"old"
    assert [file.name for file in tmp_path.iterdir()] == ["a.txt"]


def test_what_a_killed_process_left_of_a_file_is_gone_with_the_next_that_is_written(tmp_path):
    """Nothing removed the hidden parts: a machine that is switched off every night collected them."""
    left, present, other = (tmp_path / name for name in (".a.txt.0123abcd", ".a.txt.89abcdef", ".b.txt.0123abcd"))
    for path in (left, present, other):
        path.write_bytes(b"half")
    for path in (left, other):
        os.utime(path, (path.stat().st_mtime - 7200.0,) * 2)
    write_file(tmp_path / "a.txt", b"whole")
    assert {path.name for path in tmp_path.iterdir()} == {"a.txt", present.name, other.name}


def test_what_cannot_be_is_a_bad_file_that_leaves_nothing(tmp_path):
    (tmp_path / "folder").mkdir()
    with pytest.raises(BadFile, match=r"no.a\.txt cannot be written: no such folder"):
        write_file(tmp_path / "no" / "a.txt", b"")
    with pytest.raises(BadFile, match="folder cannot be written: it is a folder"):
        write_file(tmp_path / "folder", b"")
    with pytest.raises(BadFile, match="folder cannot be read: it is a folder"):
        read_file(tmp_path / "folder")
    write_file(tmp_path / "file", b"")
    with pytest.raises(BadFile, match="inside cannot be written"):
        make_folder(tmp_path / "file" / "inside")
    assert sorted(file.name for file in tmp_path.iterdir()) == ["file", "folder"]


def test_a_document_of_gigabytes_is_not_read(tmp_path):
    with (tmp_path / "a.json").open("wb") as file:
        file.truncate(1 << 40)
    with pytest.raises(BadFile, match=r"a\.json has 1099511627776 bytes; allowed: at most 67108864"):
        read_file(tmp_path / "a.json")


@pytest.mark.skipif(os.name != "posix", reason="only POSIX has permissions, links and devices of this kind")
def test_permissions_links_and_devices_stay_what_they_are(tmp_path):
    before = os.umask(0o077)
    try:
        write_file(tmp_path / "mine.csv", b"answers of people")
    finally:
        os.umask(before)
    assert (tmp_path / "mine.csv").stat().st_mode & 0o777 == 0o600
    write_file(tmp_path / "mine.csv", b"more")
    assert (tmp_path / "mine.csv").stat().st_mode & 0o777 == 0o600
    (tmp_path / "disk").mkdir()
    (tmp_path / "a.wav").symlink_to(tmp_path / "disk" / "a.wav")
    write_file(tmp_path / "a.wav", b"there")
    assert (tmp_path / "a.wav").is_symlink()
    assert (tmp_path / "disk" / "a.wav").read_bytes() == b"there"
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(BadFile, match="pipe cannot be written: it is a device, and no file"):
        write_file(tmp_path / "pipe", b"")
    for device in (Path("/dev/null"), tmp_path / "pipe"):  # without the check, the second waits for a writer
        with pytest.raises(BadFile, match="cannot be read: it is a device, and no file"):
            read_file(device)
        with pytest.raises(BadFile, match="cannot be read: it is a device, and no file"):
            C3DFile(device)
        assert head_of(device, 1) is None


@pytest.mark.skipif(os.name != "posix", reason="only POSIX has permissions of this kind")
def test_what_is_protected_is_refused_before_the_work(tmp_path, monkeypatch):
    path = tmp_path / "old.csv"
    write_file(path, b"old")
    path.chmod(0o444)
    tmp_path.chmod(0o555)
    monkeypatch.setattr(os, "access", lambda path, mode: bool(os.stat(path).st_mode & 0o200))  # also for root
    try:
        with pytest.raises(BadFile, match=r"old\.csv cannot be written: permission denied"):
            write_file(path, b"new")
        for check in (require_outputs_writable, require_folders_writable):
            with pytest.raises(BadFile, match="new cannot be written: permission denied"):
                check(tmp_path / "new")
        with pytest.raises(BadFile, match="new/report cannot be written: permission denied"):
            require_folders_writable(tmp_path / "new" / "report")
    finally:
        tmp_path.chmod(0o755)
    assert path.read_bytes() == b"old"
