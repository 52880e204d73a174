"""What was computed once is kept: in memory, and on disk for the next process."""

import numpy as np
import pytest

from underfoot.array_cache import ArrayCache


@pytest.fixture(autouse=True)
def _own_folder(tmp_path, monkeypatch):
    monkeypatch.setenv("UNDERFOOT_CACHE", str(tmp_path))


def made():
    return np.arange(1000.0)


def never():
    raise AssertionError("made again")


def test_an_array_is_made_once_and_found_by_the_next_process():
    cache = ArrayCache("arrays")
    first = cache.get("a", made)
    assert cache.get("a", never) is first
    assert np.array_equal(ArrayCache("arrays").get("a", never), first)


def test_a_file_that_was_cut_short_is_made_anew(tmp_path):
    ArrayCache("arrays").get("a", made)
    (file,) = tmp_path.rglob("*.npy")
    whole = file.read_bytes()
    file.write_bytes(whole[:200])
    assert np.array_equal(ArrayCache("arrays").get("a", made), made())
    assert file.read_bytes() == whole


def test_only_so_many_are_kept(tmp_path):
    cache = ArrayCache("arrays", in_memory=1, on_disk=2)
    for name in "abcd":
        cache.get(name, made)
    assert sorted(file.stem for file in tmp_path.rglob("*.npy")) == ["c", "d"]
    assert np.array_equal(cache.get("a", lambda: made() + 1.0), made() + 1.0)  # no longer in memory either


def test_a_place_that_cannot_be_written_is_done_without(tmp_path, monkeypatch):
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("UNDERFOOT_CACHE", str(tmp_path / "file"))
    cache = ArrayCache("arrays")
    assert cache.get("a", made) is cache.get("a", never)
