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
        if name not in self._latest:
            self._latest[name] = self._from_disk(name, make)
        self._latest.move_to_end(name)
        while len(self._latest) > self._in_memory:
            self._latest.popitem(last=False)
        return self._latest[name]

    def _from_disk(self, name: str, make: Callable[[], NDArray[np.float64]]) -> NDArray[np.float64]:
        path = cache_folder() / self._folder / f"{name}.npy"
        with suppress(OSError, ValueError, EOFError):
            return np.asarray(np.load(path))
        made = make()
        with suppress(OSError, BadFile):
            self._write(path, made)
        return made

    def _write(self, path: Path, array: NDArray[np.float64]) -> None:
        make_folder(path.parent)
        for old in sorted(path.parent.glob("*.npy"), key=lambda file: file.stat().st_mtime)[: 1 - self._on_disk]:
            old.unlink(missing_ok=True)
        with replaced(path) as part, part.open("wb") as file:
            np.save(file, array)
