"""What a command says where a kernel is compiled for the first time."""

import numpy as np

from underfoot import __version__
from underfoot.commands.compiling import report_compiling
from underfoot.kernels import kernel


def _kernel():
    """A kernel that no other test has called in this process."""

    @kernel
    def double(numbers):
        for i in range(len(numbers)):
            numbers[i] *= 2.0

    return double


def test_what_is_compiled_is_told_and_what_is_loaded_is_not(monkeypatch, tmp_path, capfd):
    monkeypatch.setenv("UNDERFOOT_CACHE", str(tmp_path))
    said = []
    for _ in range(2):
        with report_compiling():
            numbers = np.ones(3)
            _kernel()(numbers)
        assert list(numbers) == [2.0, 2.0, 2.0]
        said.append(capfd.readouterr().err)
    first, *_, last = said[0].splitlines()  # on a busy machine it also says how long it is taking
    assert first == "underfoot: first use: compiling kernels, which takes up to a minute"
    assert last.startswith("underfoot: 1 kernel compiled in ")
    assert said[1] == ""


def test_what_is_compiled_is_told_once_and_not_for_as_long_as_a_session_lasts(monkeypatch, tmp_path, capfd, until):
    """A floor that was served wrote that line every five seconds, for weeks."""
    monkeypatch.setenv("UNDERFOOT_CACHE", str(tmp_path))
    monkeypatch.setattr("underfoot.commands.compiling._EVERY_S", 0.01)
    said = []
    with report_compiling():
        _kernel()(np.ones(3))
        until(lambda: said.extend(capfd.readouterr().err.splitlines()) or "underfoot: 1 kernel" in str(said[-1:]))
    assert capfd.readouterr().err == ""


def test_a_cache_that_cannot_be_written_is_told(monkeypatch, tmp_path, capfd):
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("UNDERFOOT_CACHE", str(tmp_path / "file"))
    with report_compiling():
        _kernel()(np.ones(3))
    *_, last = capfd.readouterr().err.splitlines()
    kept = f"underfoot: kernels cannot be kept in {tmp_path / 'file' / __version__}, so each time they are compiled"
    assert last == f"{kept}; name another folder in UNDERFOOT_CACHE"
