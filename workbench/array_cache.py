"""Cache of expensive arrays, in memory and on disk."""

from collections import OrderedDict
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from underfoot.errors import BadFile
from underfoot.files import cache_folder, make_folder, replaced


class ArrayCache:
    """Float64 arrays by name: the latest `in_memory` of them, and files in a folder beside the compiled kernels.

    Beyond `on_disk` files the oldest are deleted. If the folder cannot be written to, arrays are kept in memory only.
    """

    def __init__(self, folder: str, in_memory: int = 64, on_disk: int = 100) -> None:
        self._folder, self._in_memory, self._on_disk = folder, in_memory, on_disk
        self._latest: OrderedDict[str, NDArray[np.float64]] = OrderedDict()

    def get(self, name: str, make: Callable[[], NDArray[np.float64]]) -> NDArray[np.float64]:
        """Return the array of this name; made if there is none yet, or if its file is truncated."""
        found = self.kept(name)
        if found is None:
            found = make()
            with suppress(OSError, BadFile):
                self._write(self._path(name), found)
            self._keep(name, found)
        return found

    def kept(self, name: str) -> NDArray[np.float64] | None:
        """Return the array of this name, or None if it has to be made."""
        found = self._latest.get(name)
        if found is None:
            with suppress(OSError, ValueError, EOFError):
                found = np.asarray(np.load(self._path(name)))
        if found is not None:
            self._keep(name, found)
        return found

    def _keep(self, name: str, array: NDArray[np.float64]) -> None:
        self._latest[name] = array
        self._latest.move_to_end(name)
        while len(self._latest) > self._in_memory:
            self._latest.popitem(last=False)

    def _path(self, name: str) -> Path:
        return cache_folder() / self._folder / f"{name}.npy"

    def _write(self, path: Path, array: NDArray[np.float64]) -> None:
        make_folder(path.parent)
        for old in sorted(path.parent.glob("*.npy"), key=lambda file: file.stat().st_mtime)[: 1 - self._on_disk]:
            old.unlink(missing_ok=True)
        with replaced(path) as part, part.open("wb") as file:
            np.save(file, array)
