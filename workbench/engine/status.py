"""The engine's status in shared memory, written every block and readable at any time; and the panic byte."""

from enum import IntEnum, auto
from multiprocessing.shared_memory import SharedMemory
from struct import Struct

from msgspec.structs import fields

from underfoot.engine.reports import Health
from underfoot.engine.shared_blocks import new_block


class Field(IntEnum):
    """The numbers in shared memory: those of `Health`, the frame before which every command was reported, what an
    engine begins with: the output level, and whether it plays; and whether a sound card is missing."""

    RUNNING = 0
    LOAD = auto()
    WORST = auto()
    FRAME = auto()
    PEAK = auto()
    XRUNS = auto()
    LOST = auto()
    LATENCY_S = auto()
    HOLD_S = auto()
    STREAM_LATENCY_S = auto()
    ROUND_TRIP_S = auto()
    AWAKE = auto()
    CARDS_DELAY_S = auto()
    CARDS_OFFSET_S = auto()
    CARDS_DRIFT_PPM = auto()
    JUMPS = auto()
    CLOCK_TRIP_S = auto()
    REPORTED = auto()
    LEVEL_DB = auto()
    PLAYING = auto()
    MISSING = auto()


_OF_HEALTH = [(one.name, Field[one.name.upper()], one.type) for one in fields(Health)]
"""Name, number in memory and type of each field of `Health`."""
_PANIC = 8 * len(Field)  # offset of the byte
_BLOCK = Struct("4d")
"""The numbers from `LOAD` to `PEAK`, which every block writes."""


class Status:
    """A number for each `Field`, and one byte for panic."""

    def __init__(self, memory: SharedMemory, owned: bool) -> None:
        self._memory, self._owned = memory, owned
        assert memory.buf is not None
        self._numbers = memory.buf[:_PANIC].cast("d")
        self._block = memory.buf[8 * Field.LOAD : 8 * Field.LOAD + _BLOCK.size]
        self._panic = memory.buf[_PANIC : _PANIC + 1]

    @staticmethod
    def create() -> "Status":
        """Create memory, all zero."""
        memory = new_block(_PANIC + 8)
        return Status(memory, owned=True)

    @staticmethod
    def open(name: str) -> "Status":
        """Open the memory that another process created."""
        return Status(SharedMemory(name), owned=False)

    @property
    def name(self) -> str:
        """Name by which another process opens it."""
        return self._memory.name

    @property
    def panic(self) -> bool:
        """Whether immediate silence has been requested."""
        return bool(self._panic[0])

    @panic.setter
    def panic(self, on: bool) -> None:
        self._panic[0] = on

    def put_block(self, load: float, worst: float, frame: float, peak: float) -> None:
        """Write what changes with every block, in half of the time of a number after the other."""
        _BLOCK.pack_into(self._block, 0, load, worst, frame, peak)

    def put(self, field: Field, value: float) -> None:
        """Write one number."""
        self._numbers[field] = value

    def get(self, field: Field) -> float:
        """Read one number."""
        return self._numbers[field]

    def stopped(self) -> None:
        """Record that the engine has ended, whatever it wrote last."""
        for field in (Field.RUNNING, Field.LOAD, Field.PEAK, Field.AWAKE, Field.MISSING):
            self.put(field, 0.0)

    def health(self) -> Health:
        """Return the numbers that are of interest outside."""
        return Health(**{name: type(self.get(field)) for name, field, type in _OF_HEALTH})

    def close(self) -> None:
        """Release the memory; its creator also removes it."""
        self._numbers.release()
        self._block.release()
        self._panic.release()
        self._memory.close()
        if self._owned:
            self._memory.unlink()
