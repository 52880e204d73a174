"""Underfoot: a workbench for vibrotactile floors. Nothing here imports Qt, but for `underfoot.widgets`."""

import hashlib
import os
from pathlib import Path

import platformdirs

__version__ = "0.1.0"


def kernel_cache() -> Path:
    """The folder of compiled kernels: one for each version and each state of the kernels' sources.

    Numba's own cache does not see a change in a function that a kernel calls from another file, and an
    installed package may have no writable place beside its source.

    >>> kernel_cache().parent.name == __version__
    True
    """
    sources = hashlib.sha256()
    for path in sorted(Path(__file__).parent.rglob("*.py")):
        text = path.read_bytes()
        if b"kernel" in text:
            sources.update(text)
    cache = os.environ.get("UNDERFOOT_CACHE") or platformdirs.user_cache_dir("underfoot")
    return Path(cache) / "kernels" / __version__ / sources.hexdigest()[:16]


os.environ.setdefault("NUMBA_CACHE_DIR", str(kernel_cache()))
