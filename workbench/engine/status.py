"""How the engine is, in shared memory: written at each block, read by anyone at any time; and the panic byte."""

from multiprocessing.shared_memory import SharedMemory

import numpy as np

from underfoot.engine.messages import Health

_FIELDS = (
    "running",
    "load",
    "worst",
    "xruns",
    "lost",
    "latency_s",
    "stream_latency_s",
    "frame",
    "peak",
    "awake",
)
_COUNT = len(_FIELDS) + 1
_PANIC = 8 * _COUNT


class Status:
    """The numbers of `Health`, the frame before which every command was reported, and one byte for panic."""

    def __init__(self, memory: SharedMemory, owned: bool) -> None:
        self._memory, self._owned = memory, owned
        self._numbers = np.ndarray((_COUNT,), np.float64, memory.buf)
        self._panic = np.ndarray((1,), np.uint8, memory.buf, offset=_PANIC)

    @staticmethod
    def create() -> "Status":
        memory = SharedMemory(create=True, size=_PANIC + 8)
        np.ndarray((memory.size,), np.uint8, memory.buf)[:] = 0
        return Status(memory, owned=True)

    @staticmethod
    def open(name: str) -> "Status":
        return Status(SharedMemory(name), owned=False)

    @property
    def name(self) -> str:
        return self._memory.name

    @property
    def panic(self) -> bool:
        """Whether somebody asked for silence at once."""
        return bool(self._panic[0])

    @panic.setter
    def panic(self, on: bool) -> None:
        self._panic[0] = on

    def put(self, field: int, value: float) -> None:
        """Write one number; `field` is one of the constants below."""
        self._numbers[field] = value

    def get(self, field: int) -> float:
        """Read one number."""
        return float(self._numbers[field])

    def stopped(self) -> None:
        """Note that the engine is gone, whatever it wrote last."""
        self._numbers[[RUNNING, LOAD, PEAK, AWAKE]] = 0.0

    def health(self) -> Health:
        """All numbers."""
        whole = {"running": bool, "xruns": int, "lost": int, "frame": int, "awake": int}
        return Health(
            **{name: whole.get(name, float)(v) for name, v in zip(_FIELDS, self._numbers[:-1].tolist(), strict=True)}
        )

    def close(self) -> None:
        """Let go of the memory; the one who created it removes it."""
        del self._numbers, self._panic
        self._memory.close()
        if self._owned:
            self._memory.unlink()


RUNNING, LOAD, WORST, XRUNS, LOST, LATENCY, STREAM_LATENCY, FRAME, PEAK, AWAKE, TOLD = range(_COUNT)
