"""Whole files: what is written replaces the old file at once, or leaves it as it was."""

import os

import pytest

from underfoot.errors import BadFile
from underfoot.files import make_folder, read_file, replaced, write_file


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


def test_what_cannot_be_is_a_bad_file_that_leaves_nothing(tmp_path):
    (tmp_path / "folder").mkdir()
    with pytest.raises(BadFile, match=r"no.a\.txt cannot be written: no such file"):
        write_file(tmp_path / "no" / "a.txt", b"")
    with pytest.raises(BadFile, match="folder cannot be written: is a directory"):
        write_file(tmp_path / "folder", b"")
    with pytest.raises(BadFile, match="folder cannot be read: is a directory"):
        read_file(tmp_path / "folder")
    write_file(tmp_path / "file", b"")
    with pytest.raises(BadFile, match="inside cannot be written"):
        make_folder(tmp_path / "file" / "inside")
    assert sorted(file.name for file in tmp_path.iterdir()) == ["file", "folder"]
